"""What devices that count bins in ways of their own have in common: which numbers are counted, and in what strips."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

from passgraph.graph.targets import MAX_SIDE
from passgraph.language.scalar import ScalarProgram
from passgraph.plan.data import PixelStep
from passgraph.plan.known import COUNTED, Counting, counting_of

#: Strips that the cores of a device share at least, where there are as many rows.
LEAST_STRIPS = 8


@dataclass(frozen=True)
class Work:
    """What is counted.

    Attributes
    ----------
    program : gives a pixel's number, by the images, the parameters and the size of the first step
    size : (width, height) of what is counted; None where a picture that the program reads tells it
    counting : the bins, and the rows that are counted together
    rows : of the outputs
    """

    program: ScalarProgram
    size: tuple[int, int] | None
    counting: Counting
    rows: int


def work_of(steps: Sequence[PixelStep]) -> Work | None:
    """That of steps which count together, or of one, whose numbers are in a picture; None for others."""
    if len(steps) == 1:
        known = steps[0].known
        return None if known is None else Work(in_picture(), None, known, steps[0].size[1])
    counting = counting_of(steps)
    return None if counting is None else Work(steps[0].program, steps[0].size, counting, steps[-1].size[1])


@cache
def in_picture() -> ScalarProgram:
    """Numbers as a picture holds them."""
    from passgraph.graph.reductions import reduced_one
    from passgraph.language.facts import Facts, ImageFacts
    from passgraph.language.lower import lower

    (name,) = reduced_one.program.images
    images = {name: ImageFacts(COUNTED.channels, decode=COUNTED.decode)}
    return lower(reduced_one.program, Facts(images=images, stores=(COUNTED.store,)))


@dataclass(frozen=True)
class Strips:
    """How a picture is cut: what one group counts lies in one row of the outputs.

    Attributes
    ----------
    width, height : of what is counted
    rows : of a strip, but for the last ones
    each : rows that a row of the outputs counts
    together : strips in these
    """

    width: int
    height: int
    rows: int
    each: int
    together: int

    @property
    def count(self) -> int:
        return self.together * -(-self.height // self.each)


def strips_of(work: Work, size: tuple[int, int], texels: int, most_rows: int = MAX_SIDE) -> Strips:
    """Strips of about so many texels.

    >>> work = Work(in_picture(), None, Counting(16, 64), 3)
    >>> strips_of(work, (640, 130), 1 << 15), strips_of(work, (640, 130), 1 << 13).count
    (Strips(width=640, height=130, rows=17, each=64, together=4), 18)
    """
    each = work.counting.each
    height = min(size[1], work.rows * each)
    rows = max(1, min(texels // size[0], most_rows, each, -(-height // LEAST_STRIPS)))
    return Strips(size[0], height, rows, each, -(-min(each, height) // rows))
