"""Count bins of rows (:class:`passgraph.plan.known.Counting`): each texel increments its bin in a table of its row.

On GPUs a work-group processes a row with one table in local memory and atomic additions.  On CPUs atomics take twenty
times as long as plain additions; there one work-item processes a row.
"""

from __future__ import annotations

from collections.abc import Sequence

from passgraph.backends.opencl.opencl_c import OpenCLPrinter, join, package_text, prologue
from passgraph.backends.opencl.pixel import GROUP_GPU, Launch, PixelPassRunner, inputs, parameters
from passgraph.backends.opencl.storage import ImageLayout
from passgraph.backends.printing import Listing
from passgraph.plan.known import Counting, numbers_program


class CountsRunner(PixelPassRunner):
    """The counting pass, compiled."""

    def _compile(self, layouts: tuple[ImageLayout, ...], image_count: int) -> list[Launch]:
        (image,), outputs, items = layouts[:image_count], layouts[image_count:], 1 if self.backend.is_cpu else GROUP_GPU
        assert self.step.known is not None
        source = counts_source(self.step.known, image, outputs, items, self.uniforms.fits_constant())
        built = self.backend.programs.build(source, self.what)
        return [self.launch(built, "pg_counts", (items * outputs[0].size[1], 1), (items, 1))]


def counts_source(
    counting: Counting, image: ImageLayout, outputs: Sequence[ImageLayout], items: int, constant: bool
) -> Listing:
    """Return the kernel ``pg_counts``, with the arguments of a pixel pass."""
    defined = {
        "ARGUMENTS": parameters([image], outputs),
        "NUMBER(x, y)": "pg_number(x, y, image0, floats, ints)",
        "BINS": counting.bins,
        "WIDTH": image.size[0],
        "HEIGHT": image.size[1],
        "COLUMNS": outputs[0].size[0],
        "ITEMS": items,
        "STORE(x, y)": _store(outputs, counting.quarter),
    }
    lines = "".join(f"#define {name} {text}\n" for name, text in defined.items())
    return join(prologue(constant), _number(image), lines, package_text("counts.cl"))


def _number(image: ImageLayout) -> Listing:
    """Return a function of column and row that gives the number of a pixel."""
    program = numbers_program()
    width, height = image.size
    builtins = {"pixel.0": "x", "pixel.1": "y", "output_size.0": str(width), "output_size.1": str(height)}
    printer = OpenCLPrinter(program, builtins, {program.images[0].name: ("image0", image)})
    printer.open(f"float pg_number(int x, int y, {', '.join(inputs([image]))})")
    printer.variables()
    printer.block(printer.program.body)
    printer.line(f"return {printer.operand(program.outputs[0].values[0])};")
    return printer.close()


def _store(outputs: Sequence[ImageLayout], quarter: int) -> str:
    """Return the statements that write the pixels of a column and a row in all outputs."""
    parts = []
    for k, layout in enumerate(outputs):
        parts.append(f"{layout.index_type} o{k} = {layout.place('(x)', '(y)')};")
        for channel in range(layout.channels):
            parts.append(f"out{k}[o{k} + {layout.channel(channel)}] = SUM({k * quarter + channel + 1} + 4 * (x));")
    return f"{{ {' '.join(parts)} }}"
