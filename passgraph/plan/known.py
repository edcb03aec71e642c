"""Steps whose work is known by their program, so that a device may do it in a way of its own.

A pixel pass gathers.  What would be scattered is then asked for many times over: a histogram's pixel asks of thousands
of texels whether they are its own.  The program stays what such a step means, on every device and for the oracle; a
backend that has a shorter way to the same bits takes it (`Backend.own_way`).  Programs are told by their keys, so that
graphs that have travelled are known too, and whatever is written anew is run as it is written.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

from passgraph.formats import FORMATS
from passgraph.language.nameless import nameless

if TYPE_CHECKING:
    from passgraph.plan.data import PixelStep

#: Of the picture that is counted, and of the four that are written.
COUNTED, COUNTS = FORMATS["r32f"], FORMATS["rgba32f"]


@dataclass(frozen=True, slots=True)
class Counting:
    """How often whole numbers stand in each row of a picture of one channel.

    A row of the picture gives a row of each output.  There a channel of a pixel holds how many texels of the row are
    exactly the number of its bin; numbers between, beyond and NaN are in none.  Rows of the outputs below the picture
    are 0.  Whoever wrote the picture, it may hold anything.

    Attributes
    ----------
    quarter : bins in a row of each of the four outputs, a multiple of 4: of output k, the channel c of the pixel in
        column x is the bin of the number ``k * quarter + 4 * x + c + 1``
    """

    quarter: int

    @property
    def bins(self) -> int:
        return 4 * self.quarter


def known_work(step: PixelStep) -> Counting | None:
    """What a step is known to do; None for nearly every one."""
    from passgraph.graph.reductions import MOST_BINS

    if (*step.image_formats, *step.output_formats) != (COUNTED, *[COUNTS] * 4) or 16 * step.size[0] > MOST_BINS:
        return None
    return Counting(4 * step.size[0]) if nameless(step.program).key == _counting() else None


@lru_cache(maxsize=1)
def _counting() -> str:
    """The key of what counts bins."""
    from passgraph.graph.reduction_kernels import count_bins
    from passgraph.language.facts import Facts, ImageFacts
    from passgraph.language.lower_cache import lower_once

    facts = Facts({}, {"numbers": ImageFacts(COUNTED.channels, "zero", COUNTED.decode)}, (COUNTS.store,) * 4)
    return nameless(lower_once(count_bins.program, facts)).key
