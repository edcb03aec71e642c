"""Tilt-shift: keep a band of the picture sharp and blur its sides, as in photographs of models."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from math import ceil
from typing import Annotated

import passgraph as pg
from passgraph.effects.channels import between, result_like
from passgraph.effects.checked import effect
from passgraph.effects.filters.blur import SIGMAS
from passgraph.effects.pictures.decoded import decoded
from passgraph.effects.quantities import Place, Share, axis_of, mapped
from passgraph.language import Const, Image, dot, exp, output_size, pixel, vec2, vec4

#: Blurs of less than this many pixels are skipped.
LEAST_PX = 0.1


@pg.function
def sigma_here(across: vec2, y: float, half: float, most: float) -> float:
    """Return the standard deviation at this pixel, px: it grows with the distance from the band, to its maximum at half
    a picture's height."""
    size = vec2(output_size())
    away = abs(dot(vec2(pixel()) + 0.5 - size * vec2(0.5, y), across)) / size.y
    return most * min(max(away - half, 0.0) / 0.5, 1.0)


@pg.kernel(alike=True)
def blurred(
    color: Image, across: vec2, y: float, half: float, most: float, reach: Const[int], vertical: Const[bool]
) -> vec4:
    """A Gaussian of this pixel's width along rows, or along columns."""
    sigma = sigma_here(across, y, half, most)
    total, weight = color[0, 0], 1.0
    if sigma < LEAST_PX:
        return total
    # each weight from the one before, by a ratio that falls by the same factor from tap to tap
    ratio = exp(-0.5 / (sigma * sigma))
    w, factor = 1.0, ratio * ratio
    for i in range(1, min(int(SIGMAS * sigma) + 1, reach) + 1):
        w *= ratio
        ratio *= factor
        total += ((color[0, -i] + color[0, i]) if vertical else (color[-i, 0] + color[i, 0])) * w
        weight += 2.0 * w
    return total / weight


@effect("tilt-shift", linear=True, alpha="premultiplied", alike=True)
def tilt_shift(
    color: pg.Target,
    y: Place | pg.Value | pg.Derived = 0.5,
    angle_rad: Annotated[float, pg.Range(-7, 7, "radians")] | pg.Value | pg.Derived = 0.0,
    band: Share | pg.Value | pg.Derived = 0.1,
    sigma_px: Annotated[float, pg.Range(0, 32, "px")] = 8.0,
    into: pg.TargetSpec | None = None,
    name: str = "tilt_shift",
) -> pg.Target:
    """Blur both sides of a band, like a tilted lens: scenes look like models.

    Parameters
    ----------
    color : any picture, linear light; outside of it, reads follow the rule of ``color.border(...)``
    y : where the middle of the band crosses the middle of the picture, as a fraction of the height from the upper edge
    angle_rad : angle of the band, counterclockwise from horizontal
    band : width of the sharp band, as a fraction of the height
    sigma_px : standard deviation of the blur at half the picture's height from the band, and farther; 0 returns
        ``color`` itself
    into : destination target; default: float32 named ``name``
    name : name of the passes and targets

    The blur grows linearly from the band, as it does where a tilted plane of focus meets an upright wall. Each pixel is
    a Gaussian mean of its own width, along rows and then along columns.
    Source: H. M. Merklinger, "Focusing the View Camera", 1993 (the blur of a tilted plane of focus); K. Turkowski,
    "Incremental Computation of the Gaussian", GPU Gems 3, chapter 40, 2007.

    Examples
    --------
    >>> import numpy as np
    >>> lines = np.float32(np.arange(32) % 2)[None, :, None] * np.ones((32, 1, 4), np.float32)
    >>> with pg.compile(tilt_shift(pg.Input("frame"), band=0.25, sigma_px=3.0), backend="reference") as program:
    ...     shown = program(frame=lines)["tilt_shift"][..., 0]
    >>> bool((shown[13:19] == lines[13:19, :, 0]).all()), bool(shown[0, 12:20].std() < 0.01)
    (True, True)
    """
    if sigma_px == 0.0:
        return color
    light = decoded(color, f"{name}_light", "rgba32f")
    # the normal of a line that rises to the right, in a picture whose rows go down
    normal = mapped(angle_rad, lambda angle: axis_of(angle)[::-1])
    half = mapped(band, lambda share: 0.5 * share)
    into = result_like(light, into, name)
    reach, rows = ceil(SIGMAS * sigma_px), pg.target(f"{name}_x", between(light, into), like=light)
    across = blurred(light, normal, y, half, sigma_px, reach, False, into=rows, name=rows.name)
    return blurred(across.border(color.border_rule), normal, y, half, sigma_px, reach, True, into=into, name=name)
