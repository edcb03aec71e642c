"""Count bins of rows (`passgraph.plan.data.CountStep`): each texel increments its bin in a table of its row.

On GPUs a work-group processes a row with one table in local memory and atomic additions.  On CPUs atomics take twenty
times as long as plain additions; there one work-item processes a row.
"""

from __future__ import annotations

from passgraph.backends.opencl.opencl_c import join, package_text, prologue
from passgraph.backends.opencl.pixel import GROUP_GPU, Launch, PixelPassRunner, parameters
from passgraph.backends.opencl.storage import ImageLayout
from passgraph.backends.printing import Listing


class CountsRunner(PixelPassRunner):
    """The counting pass, compiled."""

    def _compile(self, layouts: tuple[ImageLayout, ...], image_count: int) -> list[Launch]:
        (image, counts), items = layouts, 1 if self.backend.is_cpu else GROUP_GPU
        built = self.backend.programs.build(
            counts_source(image, counts, items, self.uniforms.fits_constant()), self.what
        )
        return [self.launch(built, "pg_counts", (items * counts.size[1], 1), (items, 1))]


def counts_source(image: ImageLayout, counts: ImageLayout, items: int, constant: bool) -> Listing:
    """Return the kernel ``pg_counts``, with the arguments of a pixel pass."""
    columns = counts.size[0]
    stored = " ".join(f"out0[o + {counts.places[c]}] = SUM({c + 1} + 4 * (x));" for c in range(4))
    defined = {
        "ARGUMENTS": parameters([image], [counts]),
        "NUMBER(x, y)": f"image0[{image.place('(x)', '(y)')} + {image.places[0]}]",
        "BINS": 4 * columns,
        "WIDTH": image.size[0],
        "HEIGHT": image.size[1],
        "COLUMNS": columns,
        "ITEMS": items,
        "STORE(x, y)": f"{{ {counts.index_type} o = {counts.place('(x)', '(y)')}; {stored} }}",
    }
    lines = "".join(f"#define {name} {text}\n" for name, text in defined.items())
    return join(prologue(constant), lines, package_text("counts.cl"))
