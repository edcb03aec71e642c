"""Dither: simulate many levels with few, by rounding neighbors up and down in turn."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Annotated, Literal

import numpy as np

import passgraph as pg
from passgraph import Const, Image, clamp, dot, floor, fract, pixel, vec2, vec3, vec4
from passgraph.effects.checked import effect


def bayer(side: int) -> list[list[int]]:
    """Return the order in which the pixels of a square become bright, each far from earlier ones; ``side`` is a power
    of 2.

    >>> bayer(2)
    [[0, 2], [3, 1]]
    """
    order = np.zeros((1, 1), np.int64)
    while len(order) < side:
        order = np.block([[4 * order, 4 * order + 2], [4 * order + 3, 4 * order + 1]])
    found: list[list[int]] = order.tolist()
    return found


Pattern = Literal["bayer", "gradient-noise"]
SIDE = 8
#: Thresholds strictly between 0 and 1.
THRESHOLDS = tuple(tuple((rank + 0.5) / SIDE**2 for rank in row) for row in bayer(SIDE))


@pg.kernel
def rounded(color: Image, levels: int, noise: Const[bool]) -> vec4:
    """Round to the level below or above, by this pixel's threshold."""
    p, c = pixel(), color[0, 0]
    threshold = 0.0
    if noise:
        # J. Jimenez, "Next Generation Post Processing in Call of Duty: Advanced Warfare", 2014
        threshold = fract(52.9829189 * fract(dot(vec2(p % 1024), vec2(0.06711056, 0.00583715))))
    else:
        threshold = THRESHOLDS[p.y % SIDE][p.x % SIDE]
    steps = float(levels - 1)
    return vec4(min(floor(clamp(c.rgb, 0.0, 1.0) * steps + threshold) / steps, vec3(1.0)), c.a)


@effect("dither")
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
        has no grid
    into : destination target; default: float32 named ``name``
    name : name of the pass

    Source: B. E. Bayer, "An Optimum Method for Two-Level Rendition of Continuous-Tone Pictures", 1973.

    Examples
    --------
    >>> with pg.compile(dither(pg.Input("frame"), 2), backend="reference") as program:
    ...     shown = program(frame=np.full((8, 8, 4), 0.25, np.float32))["dither"][..., 0]
    >>> np.unique(shown).tolist(), float(shown.mean())
    ([0.0, 1.0], 0.25)
    """
    return rounded(color, levels, pattern != "bayer", into=into or pg.target(name, "rgba32f"), name=name)
