"""Median filter: remove specks and keep edges."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Annotated, Any

import passgraph as pg
from passgraph.effects.channels import result_like
from passgraph.effects.checked import effect
from passgraph.language import Const, Image, vec4


def _pairs(text: str) -> Any:
    return tuple(tuple(map(int, pair.split("-"))) for pair in text.split())


#: Exchanges (the smaller number to the first place, the larger to the second) that move the median of 9 numbers to
#: place 4, and that of 25 to place 12.
NINE = _pairs("1-2 4-5 7-8 0-1 3-4 6-7 1-2 4-5 7-8 0-3 5-8 4-7 3-6 1-4 2-5 4-7 4-2 6-4 4-2")
TWENTY_FIVE = _pairs(
    "0-1 3-4 2-4 2-3 6-7 5-7 5-6 9-10 8-10 8-9 12-13 11-13 11-12 15-16 14-16 14-15 18-19 17-19 17-18 21-22 20-22 20-21 "
    "23-24 2-5 3-6 0-6 0-3 4-7 1-7 1-4 11-14 8-14 8-11 12-15 9-15 9-12 13-16 10-16 10-13 20-23 17-23 17-20 21-24 18-24 "
    "18-21 19-22 8-17 9-18 0-18 0-9 10-19 1-19 1-10 11-20 2-20 2-11 12-21 3-21 3-12 13-22 4-22 4-13 14-23 5-23 5-14 "
    "15-24 6-24 6-15 7-16 7-19 13-21 15-23 7-13 7-15 1-9 3-11 5-17 11-17 9-17 4-10 6-12 7-14 4-6 4-7 12-14 10-14 6-7 "
    "10-12 6-10 6-17 12-17 7-17 7-10 12-18 7-12 10-18 12-20 10-20 10-12"
)
#: All exchanges, and the first and the end of each loop over them: one loop for 9 numbers, two for 25, as loops of more
#: than 64 iterations are not unrolled.
EXCHANGES = NINE + TWENTY_FIVE
LOOPS = _pairs("0-19 19-69 69-118")


@pg.function
def middle_within(color: Image, channel: int, reach: int) -> float:
    """Return the median of one channel of texels 1 or 2 away; arrays of scalars are short enough to be values."""
    side = 2 * reach + 1
    sorted_values = [0.0] * 25
    for i in range(side * side):
        sorted_values[i] = color[i % side - reach, i // side - reach][channel]
    for loop in range(reach - 1, 2 * reach - 1):
        first, end = LOOPS[loop].x, LOOPS[loop].y
        for i in range(first, min(end, first + 64)):  # the limit is known even without simplification
            a, b = sorted_values[EXCHANGES[i].x], sorted_values[EXCHANGES[i].y]
            sorted_values[EXCHANGES[i].x] = min(a, b)
            sorted_values[EXCHANGES[i].y] = max(a, b)
    return sorted_values[side * side // 2]


@pg.function
def middle(color: Image, channel: int, wide: bool) -> float:
    if wide:
        return middle_within(color, channel, 2)
    return middle_within(color, channel, 1)


@pg.kernel(alike=True)
def middles(color: Image, wide: Const[bool]) -> vec4:
    return vec4(middle(color, 0, wide), middle(color, 1, wide), middle(color, 2, wide), middle(color, 3, wide))


@effect("median", alpha="premultiplied", alike=True)
def median(
    color: pg.Target,
    size_px: Annotated[int, pg.Range(3, 5, "px", odd=True)] = 3,
    into: pg.TargetSpec | None = None,
    name: str = "median",
) -> pg.Target:
    """Remove specks by the median around each pixel; edges stay in place.

    Parameters
    ----------
    color : any picture without NaN, any range; outside of it, reads follow the handle's border rule
    size_px : side of the square around a pixel
    into : destination target, which gets the first channels; default: float32 named ``name``.  With the picture's own
        format, such as r8 for an r8, nothing is converted, which is fastest
    name : name of the pass

    Filters every channel separately, alpha too; results are exact.
    Source: N. Devillard, "Fast median search: an ANSI C implementation", 1998: the exchanges for 9 and 25 numbers.

    Examples
    --------
    >>> import numpy as np
    >>> speck = np.zeros((5, 5, 4), np.float32)
    >>> speck[2, 2] = 1.0
    >>> with pg.compile(median(pg.Input("frame")), backend="reference") as program:
    ...     float(program(frame=speck)["median"].max())
    0.0
    """
    return middles(color, size_px == 5, into=result_like(color, into, name), name=name)
