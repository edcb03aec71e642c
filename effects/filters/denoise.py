"""Non-local means: remove noise by averaging pixels with similar neighborhoods."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from functools import lru_cache
from math import exp as _exp
from typing import Annotated, Any

import passgraph as pg
from passgraph.effects.checked import effect
from passgraph.effects.pictures.decoded import decoded
from passgraph.effects.quantities import NotNegative
from passgraph.language import Const, Image, dot, exp, pixel, vec3, vec4


def patch_weights(radius_px: int) -> tuple[float, ...]:
    """Return weights of a patch's pixels, row by row: a Gaussian whose deviation is half its radius; they add up to 1.

    >>> [round(weight, 3) for weight in patch_weights(1)[:5]]
    [0.011, 0.084, 0.011, 0.084, 0.619]
    """
    side = range(-radius_px, radius_px + 1)
    raw = [_exp(-2.0 * (x * x + y * y) / radius_px**2) for y in side for x in side]
    return tuple(weight / sum(raw) for weight in raw)


@lru_cache(maxsize=16)
def filter_by_patches(radius: int) -> Any:
    """Return a kernel that compares patches of this radius."""
    weights, side = patch_weights(radius), 2 * radius + 1

    @pg.kernel
    def mean_of_alike(color: Image, search: Const[int], strength: float, noise: float) -> vec4:
        center = color[0, 0]
        own = [vec3(0.0)] * len(weights)
        for k in range(len(weights)):
            own[k] = color[k % side - radius, k // side - radius].rgb
        total, weight = center, 1.0
        scale, expected = 1.0 / (strength * strength), 2.0 * noise * noise
        for y in range(-search, search + 1):
            for x in range(-search, search + 1):
                at = pixel()
                inside = at.x + x >= 0 and at.y + y >= 0 and at.x + x < color.size.x and at.y + y < color.size.y
                if inside and (x != 0 or y != 0):
                    apart = 0.0
                    for k in range(len(weights)):
                        d = color[x + k % side - radius, y + k // side - radius].rgb - own[k]
                        apart += dot(d, d) * weights[k]
                    w = exp(-max(apart / 3.0 - expected, 0.0) * scale)
                    if w > 0.0:
                        total += color[x, y] * w
                        weight += w
        return total / weight

    return mean_of_alike


@effect("denoise", alpha="premultiplied")
def denoise(
    color: pg.Target,
    strength: Annotated[float, pg.Range(0.001, 100)] | pg.Value | pg.Derived = 0.08,
    noise: NotNegative | pg.Value | pg.Derived = 0.0,
    patch_radius_px: Annotated[int, pg.Range(1, 5, "px")] = 1,
    search_radius_px: Annotated[int, pg.Range(1, 15, "px")] = 5,
    into: pg.TargetSpec | None = None,
    name: str = "denoise",
) -> pg.Target:
    """Remove noise and keep edges and textures, by non-local means.

    Parameters
    ----------
    color : any picture; with encoded values one ``strength`` suits dark and bright areas
    strength : root mean square difference of two patches, in the picture's values, at which the weight is 1/e; about
        0.8 times the noise if ``noise`` is given, and more if it is not
    noise : known standard deviation of the picture's noise; it is subtracted from differences
    patch_radius_px : radius of the compared square around each pixel; 1 is 3 by 3 pixels
    search_radius_px : radius of the square of averaged pixels. The work grows with the square of both radii
    into : destination target; default: float32 named ``name``
    name : name of the pass

    The weight of a pixel is ``exp(-max(d² - 2 noise², 0) / strength²)``. d² is the mean square difference of two
    patches over red, green and blue, weighted by a Gaussian whose deviation is half the patch's radius. Patches that
    extend beyond the picture follow the rule of ``color.border(...)``; only pixels inside are averaged.  Patches with
    NaN or infinity match no other, so pixels around these stay unchanged.
    Source: A. Buades, B. Coll, J.-M. Morel, "A Non-Local Algorithm for Image Denoising", 2005; the correction by the
    noise from their "Non-Local Means Denoising", IPOL 2011. ``strength`` is their h.

    Examples
    --------
    >>> import numpy as np
    >>> clean = np.where(np.arange(16) // 4 % 2, 0.8, 0.2).astype(np.float32)[None, :, None] * np.ones((16, 1, 4))
    >>> frame = np.float32(clean + np.random.default_rng(1).normal(0.0, 0.03, (16, 16, 1)))
    >>> with pg.compile(denoise(pg.Input("frame")), backend="reference") as program:
    ...     shown = program(frame=frame)["denoise"]
    >>> bool((shown - clean).std() < 0.5 * (frame - clean).std())
    True
    """
    light, into = decoded(color, f"{name}_light"), into or pg.target(name, "rgba32f")
    return filter_by_patches(patch_radius_px)(light, search_radius_px, strength, noise, into=into, name=name)
