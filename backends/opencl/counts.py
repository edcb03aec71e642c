"""Bins counted (:class:`passgraph.plan.known.Counting`): each texel adds to its bin in a table of a strip of rows.

On graphics processors a group of work-items goes through a strip and adds to one table in the group's memory, each
texel by an atomic addition.  On CPUs these take twenty times as long as others; there one work-item goes through a
strip.  Numbers of bins are computed on the way, as the pass that writes them would.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from passgraph.backends.base import Block
from passgraph.backends.counting import Strips, Work, strips_of
from passgraph.backends.opencl.opencl_c import OpenCLPrinter, join, package_text, prologue
from passgraph.backends.opencl.pixel import GROUP_GPU, Launch, PixelPassRunner, inputs, parameters
from passgraph.backends.opencl.storage import ImageLayout, Storage
from passgraph.backends.printing import Listing
from passgraph.plan.data import PixelStep

if TYPE_CHECKING:
    from passgraph.backends.opencl.backend import OpenCLBackend

#: Texels of a strip, on CPUs and on graphics processors: enough that emptying tables is little, few enough that there
#: are strips for many cores.
STRIP_CPU, STRIP_GPU = 1 << 15, 1 << 13


class CountsRunner(PixelPassRunner):
    """The steps at work; their parameters are those of the first."""

    def __init__(self, backend: OpenCLBackend, steps: Sequence[PixelStep], work: Work) -> None:
        super().__init__(backend, steps[0])
        self.what, self.work = f"pass {steps[-1].name!r}", work

    def chain(self, outputs: Sequence[Storage], images: Sequence[Sequence[Storage]], blocks: Sequence[Block]) -> None:
        """As the steps together."""
        self(outputs, images[0], blocks[0])

    def _compile(self, layouts: tuple[ImageLayout, ...], image_count: int) -> list[Launch]:
        backend, work = self.backend, self.work
        images, outputs, items = layouts[:image_count], layouts[image_count:], items_of(backend)
        size = work.size or images[0].size
        strips = strips_of(work, size, STRIP_CPU if backend.is_cpu else STRIP_GPU)
        source = counts_source(work, images, outputs, strips, items, self.uniforms.fits_constant())
        built = backend.programs.build(source, self.what)
        tables = backend.allocate(4 * strips.count * work.counting.bins, f"the tables of {self.what}")
        launches = [
            self.launch(built, "pg_counts", (items * strips.count, 1), (items, 1), own=tables),
            self.launch(built, "pg_sums", outputs[0].size, None, own=tables),
        ]
        backend.free_with(launches[0], tables)
        return launches


def items_of(backend: OpenCLBackend) -> int:
    """Work-items that go through a strip together."""
    return 1 if backend.is_cpu else GROUP_GPU


def counts_source(
    work: Work, images: Sequence[ImageLayout], outputs: Sequence[ImageLayout], strips: Strips, items: int,
    constant: bool,
) -> Listing:  # fmt: skip
    """The kernels ``pg_counts`` and ``pg_sums``, with the arguments of a pixel pass and tables."""
    names = [*(f"image{k}" for k in range(len(images))), "floats", "ints"]
    defined = {
        "ARGUMENTS": parameters(images, outputs, "__global uint* restrict counts"),
        "NUMBER(x, y)": f"pg_number(x, y, {', '.join(names)})",
        "BINS": work.counting.bins,
        "WIDTH": strips.width,
        "HEIGHT": strips.height,
        "ROWS": strips.rows,
        "EACH": strips.each,
        "TOGETHER": strips.together,
        "ITEMS": items,
    }
    lines = "".join(f"#define {name} {text}\n" for name, text in defined.items())
    numbers = _number(work, images, strips, on_cpu=items == 1)
    return join(prologue(constant), numbers, lines, package_text("counts.cl"), _sums(outputs, work.counting.quarter))


def _number(work: Work, images: Sequence[ImageLayout], strips: Strips, on_cpu: bool) -> Listing:
    """The program as a function of a pixel's column and row."""
    width, height = work.size or images[0].size
    builtins = {"pixel.0": "x", "pixel.1": "y", "output_size.0": str(width), "output_size.1": str(height)}
    named = {use.name: (f"image{k}", images[k]) for k, use in enumerate(work.program.images)}
    printer = OpenCLPrinter(work.program, builtins, named)
    if on_cpu:
        printer.functions()
    printer.open(f"float pg_number(int x, int y, {', '.join(inputs(images))})")
    printer.variables()
    printer.block(work.program.body)
    (output,) = work.program.outputs
    printer.line(f"return {printer.operand(output.values[0])};")
    return printer.close()


def _sums(outputs: Sequence[ImageLayout], quarter: int) -> str:
    """What writes the pixels of a column and a row in all outputs."""
    lines = ["__kernel void pg_sums(ARGUMENTS)\n{\nint x = (int)get_global_id(0), y = (int)get_global_id(1);"]
    for k, layout in enumerate(outputs):
        lines.append(f"{layout.index_type} o{k} = {layout.place('x', 'y')};")
        for channel in range(layout.channels):
            found = f"pg_sum(counts, y, {k * quarter + channel} + 4 * x)"
            lines.append(f"out{k}[o{k} + {layout.channel(channel)}] = {found};")
    return "\n".join([*lines, "}\n"])
