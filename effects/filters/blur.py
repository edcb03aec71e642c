"""Blurs in two passes, horizontally and vertically."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from functools import lru_cache
from math import ceil, exp
from typing import Annotated, Any

import passgraph as pg
from passgraph.effects.channels import between, result_like
from passgraph.effects.checked import effect
from passgraph.formats import FORMATS
from passgraph.language import Const, Image, vec4

#: A Gaussian has 0.3 % of its weight beyond three standard deviations.
SIGMAS = 3.0
#: Most taps to each side: for wider kernels, blurring a smaller picture and scaling it up is cheaper.
MAX_RADIUS_PX = 300


def gaussian_weights(sigma_px: float, radius_px: int) -> tuple[float, ...]:
    """Return the weights of the center and of each distance up to ``radius_px``; with both sides they add up to 1.

    >>> gaussian_weights(2.0, 0)
    (1.0,)
    """
    if radius_px == 0 or sigma_px == 0.0:
        return (1.0, *(0.0,) * radius_px)
    raw = [exp(-0.5 * (i / sigma_px) ** 2) for i in range(radius_px + 1)]
    total = raw[0] + 2.0 * sum(raw[1:])
    return tuple(weight / total for weight in raw)


@lru_cache(maxsize=64)
def _symmetric(weights: tuple[float, ...]) -> Any:
    """Return a kernel with these weights built in, for one direction per pass."""
    count = len(weights)

    @pg.kernel(alike=True)
    def blur(color: Image, dx: Const[int], dy: Const[int]) -> vec4:
        total = color[0, 0] * weights[0]
        for i in range(1, count):
            total += (color[i * dx, i * dy] + color[-i * dx, -i * dy]) * weights[i]
        return total

    return blur


@effect("gaussian-blur", alpha="premultiplied", alike=True)
def gaussian_blur(
    color: pg.Target,
    sigma_px: Annotated[float, pg.Range(0, 100, "px")] = 3.0,
    radius_px: Annotated[int, pg.Range(0, MAX_RADIUS_PX, "px")] | None = None,
    into: pg.TargetSpec | None = None,
    name: str = "gaussian_blur",
) -> pg.Target:
    """Blur with a Gaussian of normalized weights; a constant picture is unchanged.

    Parameters
    ----------
    color : any picture, linear light; outside of it, reads follow the rule of ``color.border(...)``
    sigma_px : standard deviation; 0 returns ``color`` itself
    radius_px : taps to each side (7 makes 15 taps); default: three sigma; 0 returns ``color`` itself
    into : destination target; default: float32 named ``name``
    name : name of the passes and targets

    Source: the separable sampled Gaussian, weights summed in float64 on the host.

    Examples
    --------
    >>> import numpy as np
    >>> soft = gaussian_blur(pg.Input("frame"), sigma_px=2.0, radius_px=7)
    >>> with pg.compile(soft, backend="reference") as program:
    ...     picture = program(frame=np.ones((4, 4, 4), np.float32))["gaussian_blur"]
    >>> bool(abs(picture - 1.0).max() < 1e-6)
    True
    """
    radius = ceil(SIGMAS * sigma_px) if radius_px is None else radius_px
    if radius == 0 or sigma_px == 0.0:
        return color
    blur = _symmetric(gaussian_weights(sigma_px, radius))
    result = result_like(color, into, name)
    across = blur(color, 1, 0, into=pg.target(f"{name}_x", _between(result)))
    return blur(across.border(color.border_rule), 0, 1, into=result, name=f"{name}_y")


def _between(spec: pg.TargetSpec) -> str:
    """Return a float format with the result's channels and precision."""
    letters = "rgba"[: spec.format.channels]
    return letters + ("16f" if spec.format.unit >= FORMATS["rgba16f"].unit else "32f")


@lru_cache(maxsize=64)
def _edge_aware(radius: int) -> Any:
    """Return a kernel of this radius that skips taps off the surface at the center."""

    @pg.kernel(alike=True)
    def blur(mask: Image, depth: Image, tolerance: float, dx: Const[int], dy: Const[int]) -> vec4:
        # 1 / depth is linear over the picture on any plane
        here = 1.0 / max(depth[0, 0].r, 1e-30)
        ahead = 1.0 / max(depth[dx, dy].r, 1e-30) - here
        behind = here - 1.0 / max(depth[-dx, -dy].r, 1e-30)
        slope = ahead if abs(ahead) < abs(behind) else behind
        total = mask[0, 0]
        weight = 1.0
        scale = 1.0 / max(tolerance * here, 1e-30)
        for i in range(1, radius + 1):
            t = float(i) / float(radius + 1)
            window = (1.0 - t * t) * (1.0 - t * t)
            for side in range(2):
                s = i - 2 * i * side
                off = abs(1.0 / max(depth[s * dx, s * dy].r, 1e-30) - here - slope * float(s)) * scale
                w = window * max(1.0 - off, 0.0)
                total += mask[s * dx, s * dy] * w
                weight += w
        return total / weight

    return blur


@effect("depth-aware-blur", "picture+depth", alpha="premultiplied", alike=True)
def depth_aware_blur(
    mask: pg.Target,
    depth: pg.Target,
    radius_px: Annotated[int, pg.Range(0, 63, "px")] = 7,
    tolerance: Annotated[float, pg.Range(0, None, "relative", above=True)] = 0.05,
    into: pg.TargetSpec | None = None,
    name: str = "depth_aware_blur",
) -> pg.Target:
    """Blur along the surfaces of a depth picture, and not across their edges.

    Parameters
    ----------
    mask : the picture to blur, any range
    depth : red is the distance along the view axis in scene units, above 0; of the size of ``mask``
    radius_px : taps to each side; 0 returns ``mask`` itself
    tolerance : largest distance of a tap from the plane through the center, as a fraction of the center's distance
    into : destination target; default: float32 named ``name``
    name : name of the passes and targets

    The weight of a tap is (1 - t²)² for the distance t (1 = radius + 1), times how well its depth fits the plane
    through the center, so that slanted floors are blurred like upright walls. The center always counts, so the sum of
    weights is at least 1.

    Source: C. Tomasi, R. Manduchi, "Bilateral Filtering for Gray and Color Images", 1998, with a plane instead of a
    constant.

    Examples
    --------
    >>> import numpy as np
    >>> soft = depth_aware_blur(pg.Input("mask"), pg.Input("depth"), radius_px=3)
    >>> step = np.where(np.arange(8) < 4, 1.0, 0.0).astype(np.float32)
    >>> mask, depth = np.tile(step, (8, 1)), np.tile(1 + 9 * step, (8, 1))
    >>> with pg.compile(soft, backend="reference") as program:
    ...     picture = program(mask=mask, depth=depth)["depth_aware_blur"]
    >>> bool(abs(picture[:, :, 0] - mask).max() < 1e-6)
    True
    """
    if radius_px == 0:
        return mask
    blur = _edge_aware(radius_px)
    result = result_like(mask, into, name)
    across = blur(mask, depth, tolerance, 1, 0, into=pg.target(f"{name}_x", between(mask, result)))
    return blur(across, depth, tolerance, 0, 1, into=result, name=f"{name}_y")
