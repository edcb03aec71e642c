"""Bins of rows, counted (:class:`passgraph.plan.known.Counting`): each texel adds to its bin in a table.

On graphics processors a group of work-items goes through a row and adds to one table in the group's memory, each texel
by an atomic addition.  On CPUs these take twenty times as long as others; there one work-item goes through a row.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from passgraph.backends.opencl.opencl_c import join, load_expression, package_text, prologue
from passgraph.backends.opencl.pixel import GROUP_GPU, Launch, PixelPassRunner, parameters
from passgraph.backends.opencl.storage import ImageLayout
from passgraph.backends.printing import Listing
from passgraph.plan.known import Counting

if TYPE_CHECKING:
    from passgraph.backends.opencl.backend import OpenCLBackend


class CountsRunner(PixelPassRunner):
    """The pass at work.  Pictures in a caller's layout are counted by the step's program."""

    def _compile(self, layouts: tuple[ImageLayout, ...], image_count: int) -> list[Launch]:
        if any(layout.placement is not None for layout in layouts):
            return super()._compile(layouts, image_count)
        known, rows = self.step.known, self.step.size[1]
        assert known is not None
        items = items_of(self.backend)
        built = self.backend.programs.build(counts_source(known, layouts[0], layouts[1:], items), self.what)
        return [self.launch(built, "pg_counts", (items * rows, 1), (items, 1))]


def items_of(backend: OpenCLBackend) -> int:
    """Work-items that go through a row together."""
    return 1 if backend.is_cpu else GROUP_GPU


def counts_source(known: Counting, image: ImageLayout, outputs: tuple[ImageLayout, ...], items: int) -> Listing:
    """The kernel ``pg_counts``, with the arguments of a pixel pass."""
    # Bins lie side by side in a row of an output, as the channels of its pixels do.
    defined = {
        "ARGUMENTS": parameters([image], outputs),
        "WIDTH": image.size[0],
        "HEIGHT": image.size[1],
        "NUMBER(x, y)": load_expression(image.format, "image0", image.place("(x)", "(y)")),
        "QUARTER": known.quarter,
        "COUNT(k, x, y)": f"(({outputs[0].index_type})(y) * {known.quarter} + (x))",
        "ITEMS": items,
    }
    lines = "".join(f"#define {name} {text}\n" for name, text in defined.items())
    return join(prologue(False), lines, package_text("counts.cl"))
