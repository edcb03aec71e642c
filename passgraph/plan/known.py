"""Recognize steps by their program that a device may implement in its own way.

A pixel pass gathers.  Scattering in this form reads every texel many times: each pixel of a histogram tests thousands
of texels.  The program defines the result on every device and for the oracle; a backend with a faster way to the same
bits uses it (`Backend.own_way`).  Programs are recognized by their cache keys, so this works for deserialized graphs;
changed kernels run as written.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

from passgraph.formats import FORMATS
from passgraph.language.scalar import ScalarProgram, nameless

if TYPE_CHECKING:
    from passgraph.plan.data import PixelStep

#: Formats of the counted picture, and of the four outputs.
COUNTED, COUNTS = FORMATS["r32f"], FORMATS["rgba32f"]


@dataclass(frozen=True, slots=True)
class Counting:
    """Count integers in the rows of a single-channel picture.

    Each row of the picture gives a row of each output.  A channel of a pixel there counts the texels of the row that
    equal the number of its bin; other numbers and NaN are not counted.  Rows of the outputs below the picture are 0.
    The picture may hold any values.

    Attributes
    ----------
    quarter : bins in a row of each of the four outputs, a multiple of 4: in output k, channel c of the pixel in column
        x is the bin of the number ``k * quarter + 4 * x + c + 1``
    """

    quarter: int

    @property
    def bins(self) -> int:
        return 4 * self.quarter


def known_work(step: PixelStep) -> Counting | None:
    """Recognize the work of a step; None for most steps."""
    if (step.image_formats, step.output_formats) != ((COUNTED,), (COUNTS,) * 4):
        return None
    # Few plans count, and importing these kernels takes a while.
    from passgraph.graph.reductions import MOST_BINS

    if 16 * step.size[0] > MOST_BINS or nameless(step.program).key != _counting_key():
        return None
    return Counting(4 * step.size[0])


@cache
def _counting_key() -> str:
    """Return the key of the counting kernel's program."""
    from passgraph.graph.reductions import count_bins
    from passgraph.language.facts import Facts, ImageFacts
    from passgraph.language.lower_cache import lower_once

    (name,) = count_bins.program.images
    images = {name: ImageFacts(COUNTED.channels, "zero", COUNTED.decode)}
    return nameless(lower_once(count_bins.program, Facts({}, images, (COUNTS.store,) * 4))).key


@cache
def numbers_program() -> ScalarProgram:
    """Return a program that gives a texel's number as stored, for backends that print it."""
    from passgraph.graph.reductions import reduced_one
    from passgraph.language.facts import Facts, ImageFacts
    from passgraph.language.lower import lower

    (name,) = reduced_one.program.images
    images = {name: ImageFacts(COUNTED.channels, decode=COUNTED.decode)}
    return lower(reduced_one.program, Facts(images=images, stores=(COUNTED.store,)))
