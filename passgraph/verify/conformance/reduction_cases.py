"""Reductions: trees of passes whose sizes depend on the picture's, and passes that read the result.

Numbers are small and whole, so sums are exact in any order; of equal values the first texel's position counts.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.verify.conformance.case import Case, whole_numbers

GROUP = "plans"
#: Two levels of blocks across, with partial blocks at the edges.
SIZE = (67, 11)
#: A power of two texels.
EVEN = (64, 8)
#: Bins, four for each pixel of counts without padding.
BINS = 48
#: Size of counts by row: two more rows than the picture has.
ROWS = (BINS // 4, SIZE[1] + 2)
#: A size with rows that are counted 64 at a time, and a partial last group.
HIGH = (7, 150)


def cases() -> Iterator[Case]:
    """Yield each case with NumPy's result."""
    picture = whole_numbers(SIZE, 7)
    frames = ({"frame": picture},)
    sums = {"all": picture.sum((0, 1), keepdims=True), "rows": picture.sum(1, keepdims=True)}
    yield Case(GROUP, "sums", summed, SIZE, frames, exact=sums)
    ends = {"least": picture.min(0, keepdims=True), "largest": picture.max((0, 1), keepdims=True)}
    yield Case(GROUP, "the least and the largest", ends_of, SIZE, frames, exact=ends, quick=False)
    green = picture[..., 1]
    place = divmod(int(green.argmax()), SIZE[0])[::-1]
    yield Case(GROUP, "the first place of many", placed, SIZE, frames, exact={"place": np.array([[place]], np.float64)})
    counts = np.histogram(picture[..., 2], BINS, (0.05, 6))[0]
    yield Case(GROUP, "a histogram", counted, SIZE, frames, exact={"counts": counts[None, :, None]})
    numbers = wild_numbers()
    exact = {"counts": counts_of(numbers)}
    yield Case(GROUP, "counts of wild numbers", counted_rows, ROWS, ({"numbers": numbers},), exact=exact, quick=False)
    high = np.random.default_rng(12).integers(1, BINS + 1, (HIGH[1], HIGH[0], 1))
    blocks = np.array([np.bincount(high[y : y + 64].ravel() - 1, minlength=BINS) for y in range(0, HIGH[1], 64)])
    exact = {"counts": blocks.reshape(-1, ROWS[0], 4)}
    together = ({"numbers": high.astype(np.float32)},)
    yield Case(
        GROUP, "counts of 64 rows each", counted_together, (ROWS[0], len(blocks)), together, exact=exact, quick=False
    )
    last, now = whole_numbers(EVEN, 8), whole_numbers(EVEN, 9)
    above = now - last.mean((0, 1), np.float64)
    yield Case(GROUP, "less last frame's mean", levelled, EVEN, ({"frame": last}, {"frame": now}), exact={"out": above})


def summed() -> Mapping[str, pg.Target]:
    frame = pg.Input("frame", "rgba32f")
    return {"all": pg.reduce(frame, "sum"), "rows": pg.reduce(frame, "sum", axis="x", name="rows")}


def ends_of() -> Mapping[str, pg.Target]:
    frame = pg.Input("frame", "rgba32f")
    return {"least": pg.reduce(frame, "min", axis="y"), "largest": pg.reduce(frame, "max")}


def placed() -> Mapping[str, pg.Target]:
    frame = pg.Input("frame", "rgba32f")
    return {"place": pg.reduce(frame, "arg_max", channel=1)}


def counted() -> Mapping[str, pg.Target]:
    """Numbers below and above the range are not counted."""
    return {"counts": pg.histogram(pg.Input("frame", "rgba32f"), BINS, channel=2, low=0.05, high=6.0)}


def wild_numbers() -> NDArray[np.float32]:
    """Return bin numbers, some repeated many times, and uncounted ones: below, above, and fractions."""
    random = np.random.default_rng(11)
    numbers = random.integers(-2, BINS + 3, (SIZE[1], SIZE[0], 1)).astype(np.float32)
    numbers[::3, ::2] = BINS
    numbers[1::3, 5:] = 1
    numbers[:, 3::7] += np.float32(0.5)
    return numbers


def counts_of(numbers: NDArray[np.float32]) -> NDArray[np.float64]:
    """Count each bin's numbers in each row, four bins per pixel; rows below the picture count 0."""
    counts = np.zeros((ROWS[1], BINS))
    counts[: SIZE[1]] = (numbers == np.arange(1, BINS + 1)).sum(1)
    return counts.reshape(-1, ROWS[0], 4)


def counted_rows() -> Mapping[str, pg.Target]:
    """Count the numbers of a picture that is not from a histogram."""
    from passgraph.graph.reductions import count_rows

    return {"counts": count_rows(pg.Input("numbers", "r32f", SIZE), pg.target("counts", "rgba32f", ROWS), "counts")}


def counted_together() -> Mapping[str, pg.Target]:
    """Sum the counts of all rows; nothing else reads them."""
    from passgraph.graph.reductions import COLUMNS, SUM, count_rows, reduce_level

    same = pg.kernel(source="def same(a: Image) -> float: return a[0, 0].r")
    numbered: pg.Target = same(pg.Input("numbers", "r32f", HIGH), into=pg.target("same", "r32f"))
    rows = count_rows(numbered, pg.target("rows", "rgba32f", (ROWS[0], HIGH[1])), "rows")
    into = pg.target("counts", "rgba32f", (ROWS[0], -(-HIGH[1] // 64)))
    return {"counts": reduce_level(rows, SUM, COLUMNS, into=into)}


def levelled() -> Mapping[str, pg.Target]:
    """Subtract the mean of last frame's picture; its number of texels is a power of two."""
    keep = pg.kernel(source="def keep(a: Image) -> vec4: return a[0, 0]")
    less = pg.kernel(source="def less(a: Image, mean: Image) -> vec4: return a[0, 0] - mean.texel(ivec2(0, 0))")
    frame = pg.Input("frame", "rgba32f")
    kept = keep(frame, into=pg.target("kept", "rgba32f"))
    mean = pg.reduce(pg.previous(kept), "mean", name="mean")
    return {"out": less(frame, mean, into=pg.target("out", "rgba32f")), "kept": kept}
