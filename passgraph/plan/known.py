"""Steps whose work is known by their program, so that a device may do it in a way of its own.

A pixel pass gathers.  What would be scattered is then asked for many times over: a histogram's pixel asks of thousands
of texels whether they are its own.  The program stays what such a step means, on every device and for the oracle; a
backend that has a shorter way to the same bits takes it (`Backend.own_way`).  Programs are told by their keys, so that
graphs that have travelled are known too, and whatever is written anew is run as it is written.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from passgraph.formats import FORMATS, Format
from passgraph.language.scalar import nameless

if TYPE_CHECKING:
    from passgraph.graph.calls import PixelKernel
    from passgraph.plan.data import PixelStep

#: Of the picture that is counted, and of the four that are written.
COUNTED, COUNTS = FORMATS["r32f"], FORMATS["rgba32f"]
#: Up to here float32 holds every whole number, so that sums are the same in any order.
EXACT = 1 << 24


@dataclass(frozen=True, slots=True)
class Counting:
    """How often whole numbers stand in rows of a picture of one channel.

    So many rows of the picture give a row of each output.  There a channel of a pixel holds how many texels of these
    rows are exactly the number of its bin; numbers between, beyond and NaN are in none.  Rows of the outputs below the
    picture are 0.  Whoever wrote the picture, it may hold anything.

    Attributes
    ----------
    quarter : bins in a row of each of the four outputs, a multiple of 4: of output k, the channel c of the pixel in
        column x is the bin of the number ``k * quarter + 4 * x + c + 1``
    each : rows that are counted together
    """

    quarter: int
    each: int = 1

    @property
    def bins(self) -> int:
        return 4 * self.quarter


def known_work(step: PixelStep) -> Counting | None:
    """What a step is known to do; None for nearly every one."""
    if not _is_of(step, (COUNTED,)):
        return None
    # Few plans count, and these kernels take a while to read.
    from passgraph.graph.reductions import MOST_BINS, count_bins

    if 16 * step.size[0] > MOST_BINS or not _runs(step, count_bins, (COUNTED,), "zero"):
        return None
    return Counting(4 * step.size[0])


def counting_of(steps: Sequence[PixelStep]) -> Counting | None:
    """What consecutive steps are known to do together, from numbers of bins to sums of many rows; None for others.

    The first computes the picture that the second counts; it may be any.  Those behind add rows up, as many as no
    count can leave the whole numbers that float32 holds: then whoever counts them in another order, or as ints, has
    the same bits.
    """
    if len(steps) < 2:
        return None
    numbers, counts, *levels = steps
    known, (width, height) = counts.known, numbers.size
    if known is None or counts.reads != numbers.outputs or counts.size[1] != height:
        return None
    from passgraph.graph.reductions import SIDE, sum_counts

    each, below = 1, counts
    for level in levels:
        each *= SIDE * SIDE
        across, down = below.size
        if level.reads != below.outputs or level.size != (across, -(-down // (SIDE * SIDE))):
            return None
        if min(each, height) * width > EXACT or not _is_of(level, (COUNTS,) * 4):
            return None
        if not _runs(level, sum_counts, (COUNTS,) * 4, "clamp"):
            return None
        below = level
    return Counting(known.quarter, each)


def _is_of(step: PixelStep, formats: tuple[Format, ...]) -> bool:
    """Whether a step reads pictures of such formats and writes four of counts."""
    return (step.image_formats, step.output_formats) == (formats, (COUNTS,) * 4)


def _runs(step: PixelStep, kernel: PixelKernel[Any], formats: tuple[Format, ...], border: str) -> bool:
    """Whether it runs a kernel of ours."""
    return nameless(step.program).key == _key(kernel, formats, border)


@lru_cache
def _key(kernel: PixelKernel[Any], formats: tuple[Format, ...], border: str) -> str:
    """The key of the program that it becomes."""
    from passgraph.language.facts import Facts, ImageFacts
    from passgraph.language.lower_cache import lower_once

    named = zip(kernel.program.images, formats, strict=True)
    images = {name: ImageFacts(format_.channels, border, format_.decode) for name, format_ in named}
    return nameless(lower_once(kernel.program, Facts({}, images, (COUNTS.store,) * 4))).key
