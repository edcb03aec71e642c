"""Steps whose work is known by their program, so that a device may do it in a way of its own.

A pixel pass gathers.  What would be scattered is then asked for many times over: a histogram's pixel asks of thousands
of texels whether they are its own.  The program stays what such a step means, on every device and for the oracle; a
backend that has a shorter way to the same bits takes it (`Backend.own_way`).  Programs are told by their keys, so that
graphs that have traveled are known too, and whatever is written anew is run as it is written.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

from passgraph.formats import FORMATS
from passgraph.language.scalar import ScalarProgram, nameless

if TYPE_CHECKING:
    from passgraph.plan.data import PixelStep

#: Of the picture that is counted, and of the four that are written.
COUNTED, COUNTS = FORMATS["r32f"], FORMATS["rgba32f"]


@dataclass(frozen=True, slots=True)
class Counting:
    """Count integers in the rows of a single-channel picture.

    Each row of the picture gives a row of each output.  There a channel of a pixel holds how many texels of the row are
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
    """Recognize the work of a step; None for nearly every one."""
    if (step.image_formats, step.output_formats) != ((COUNTED,), (COUNTS,) * 4):
        return None
    # Few plans count, and these kernels take a while to read.
    from passgraph.graph.reductions import MOST_BINS

    if 16 * step.size[0] > MOST_BINS or nameless(step.program).key != _counting_key():
        return None
    return Counting(4 * step.size[0])


@cache
def _counting_key() -> str:
    """The key of the counting kernel's program."""
    from passgraph.graph.reductions import count_bins
    from passgraph.language.facts import Facts, ImageFacts
    from passgraph.language.lower_cache import lower_once

    (name,) = count_bins.program.images
    images = {name: ImageFacts(COUNTED.channels, "zero", COUNTED.decode)}
    return nameless(lower_once(count_bins.program, Facts({}, images, (COUNTS.store,) * 4))).key


@cache
def numbers_program() -> ScalarProgram:
    """A program that gives a texel's number as the picture holds it, for backends that print it."""
    from passgraph.graph.reductions import reduced_one
    from passgraph.language.facts import Facts, ImageFacts
    from passgraph.language.lower import lower

    (name,) = reduced_one.program.images
    images = {name: ImageFacts(COUNTED.channels, decode=COUNTED.decode)}
    return lower(reduced_one.program, Facts(images=images, stores=(COUNTED.store,)))
