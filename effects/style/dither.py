"""Dither: simulate many levels with few, by rounding neighbors up and down in turn."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Annotated, Literal

import numpy as np

import passgraph as pg
from passgraph.effects.channels import result_like
from passgraph.effects.checked import effect
from passgraph.effects.style import blue_noise
from passgraph.language import Const, Image, clamp, dot, floor, fract, ivec2, pixel, vec2, vec3, vec4


def bayer(side: int) -> list[list[int]]:
    """Return the order in which pixels of a square become bright, each far from earlier ones.

    ``side`` is a power of 2.

    >>> bayer(2)
    [[0, 2], [3, 1]]
    """
    order = np.zeros((1, 1), np.int64)
    while len(order) < side:
        order = np.block([[4 * order, 4 * order + 2], [4 * order + 3, 4 * order + 1]])
    found: list[list[int]] = order.tolist()
    return found


Pattern = Literal["bayer", "gradient-noise", "blue-noise"]
SIDE = 8
#: Thresholds strictly between 0 and 1.
THRESHOLDS = tuple(tuple((rank + 0.5) / SIDE**2 for rank in row) for row in bayer(SIDE))


@pg.function
def at_threshold(color: vec4, levels: int, threshold: float) -> vec4:
    """Round to the level below or above; alpha stays."""
    steps = float(levels - 1)
    return vec4(min(floor(clamp(color.rgb, 0.0, 1.0) * steps + threshold) / steps, vec3(1.0)), color.a)


@pg.kernel(alike=True)
def rounded(color: Image, levels: int, noise: Const[bool]) -> vec4:
    """Round by thresholds computed from the pixel's position."""
    p = pixel()
    if noise:
        # J. Jimenez, "Next Generation Post Processing in Call of Duty: Advanced Warfare", 2014
        threshold = fract(52.9829189 * fract(dot(vec2(p % 1024), vec2(0.06711056, 0.00583715))))
    else:
        threshold = THRESHOLDS[p.y % SIDE][p.x % SIDE]
    return at_threshold(color[0, 0], levels, threshold)


@pg.kernel(alike=True)
def rounded_by(color: Image, thresholds: Image, levels: int) -> vec4:
    """Round by the thresholds in a repeating picture."""
    p, size = pixel(), thresholds.size
    return at_threshold(color[0, 0], levels, thresholds.texel(ivec2(p.x % size.x, p.y % size.y)).r)


@effect("dither", alike=True)
def dither(
    color: pg.Target,
    levels: Annotated[int, pg.Range(2, 256)] | pg.Value | pg.Derived = 4,
    pattern: Pattern = "bayer",
    into: pg.TargetSpec | None = None,
    name: str = "dither",
) -> pg.Target:
    """Round colors to few levels by a pattern of thresholds; the mean of neighbors stays.

    Parameters
    ----------
    color : encoded for display, 0 to 1, and clamped to that; alpha stays
    levels : levels of each channel, including black and white; 256 removes the banding of gradients stored in 8 bits
    pattern : "bayer" is an ordered grid of 8 x 8 thresholds, whose mean is exact to 1/128 of a level; "gradient-noise"
        has no grid; "blue-noise" has neither grid nor clumps: 64 x 64 thresholds without low frequencies
    into : destination target; default: float32 named ``name``
    name : name of the pass

    Source: B. E. Bayer, "An Optimum Method for Two-Level Rendition of Continuous-Tone Pictures", 1973;
    R. Ulichney, "The void-and-cluster method for dither array generation", 1993.

    Examples
    --------
    >>> with pg.compile(dither(pg.Input("frame"), 2), backend="reference") as program:
    ...     shown = program(frame=np.full((8, 8, 4), 0.25, np.float32))["dither"][..., 0]
    >>> np.unique(shown).tolist(), float(shown.mean())
    ([0.0, 1.0], 0.25)
    """
    into = result_like(color, into, name)
    if pattern == "blue-noise":
        size = (blue_noise.SIDE, blue_noise.SIDE)
        noise = pg.Input(f"{name}_thresholds", "r32f", size, static=True, default=blue_noise.thresholds())
        return rounded_by(color, noise, levels, into=into, name=name)
    return rounded(color, levels, pattern != "bayer", into=into, name=name)
