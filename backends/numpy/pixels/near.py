"""Which images a pixel pass reads in a window around each pixel, and which texel by texel from the whole picture.

A window is a table of rows and copies of their ends (code.py), as large as the footprint.  Text may ask for any
footprint; one that is larger than :data:`MAX_WINDOW`, or that differs between pixels, needs no memory this way.
"""

from __future__ import annotations

from collections.abc import Sequence

from passgraph.language import scalar as s
from passgraph.plan.footprint import Halo

#: Texels of the windows of a pass, their rows times their columns: 256 x 256, or a row of 65,536.
MAX_WINDOW = 1 << 16
#: Rows of them: each is an address that is found anew for each row of pixels.
MAX_WINDOW_ROWS = 1024


def reach(uses: Sequence[s.ImageUse]) -> Halo:
    """How far relative reads go."""
    found = Halo()
    for use in uses:
        if use.relative:
            found = found.over(Halo(-use.x[0], use.x[1], -use.y[0], use.y[1]))
    return found


def near_images(program: s.ScalarProgram) -> tuple[s.ImageUse, ...]:
    """The images whose relative reads go through windows."""
    apart = _apart(program)
    around, found = Halo(), []
    for use in program.images:
        wider = around.over(reach([use]))
        rows = wider.up + wider.down + 1
        small = rows <= MAX_WINDOW_ROWS and rows * (wider.left + wider.right + 1) <= MAX_WINDOW
        if use.relative and small and use.name not in apart:
            around = wider
            found.append(use)
    return tuple(found)


def _apart(program: s.ScalarProgram) -> set[str]:
    """Images read at offsets that differ between pixels: choices by what a pixel holds."""
    alike: set[int] = set()
    apart: set[str] = set()
    for i in s.walk(program.body):
        same = all(isinstance(operand, s.Lit) or operand.id in alike for operand in s.operands_of(i))
        if isinstance(i, s.For):
            alike.add(i.index.id)
        elif isinstance(i, s.LoadTexel):
            if i.relative and not same:
                apart.add(i.image)
        elif same and isinstance(i, (s.Op, s.Choose, s.LoadUniform, s.LoadTable)):
            alike.update(value.id for value in s.results_of(i))
    return apart
