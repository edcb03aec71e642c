"""Pixel passes: one work-item a pixel.

A pass that reads neighbours runs as two kernels.  The inner one covers the block of pixels whose reads all lie
inside, so that no border code keeps its loads from vectorising; the other one the strips around.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from passgraph.backends.base import Block
from passgraph.backends.opencl.opencl_c import ELEMENTS, OpenCLPrinter, join, prologue, store_expression
from passgraph.backends.opencl.storage import ImageLayout, Storage
from passgraph.backends.printing import Listing
from passgraph.language.scalar import ScalarProgram
from passgraph.plan.data import PixelStep

if TYPE_CHECKING:
    from passgraph.backends.opencl.backend import OpenCLBackend

#: Work-items of a group along x.  Measured on PoCL: 64 costs 5 % more on a copy, 1024 gains nothing.
GROUP = 128
#: The same on graphics processors: a few warps.
GROUP_GPU = 64


def pixel_source(
    program: ScalarProgram, images: Sequence[tuple[str, ImageLayout]], outputs: Sequence[ImageLayout], constant: bool
) -> Listing:
    """Kernels ``pg_pixel`` (with borders) and ``pg_inner`` (without)."""
    return join(
        prologue(constant),
        _kernel("pg_pixel", program, images, outputs, inner=False),
        _kernel("pg_inner", program, images, outputs, inner=True),
    )


def _kernel(
    name: str,
    program: ScalarProgram,
    images: Sequence[tuple[str, ImageLayout]],
    outputs: Sequence[ImageLayout],
    *,
    inner: bool,
) -> Listing:
    width, height = outputs[0].size
    builtins = {"pixel.0": "x", "pixel.1": "y", "output_size.0": str(width), "output_size.1": str(height)}
    named = {image: (f"image{i}", layout) for i, (image, layout) in enumerate(images)}
    printer = OpenCLPrinter(program, builtins, named, inner=inner, prefix=f"{name}_")
    parameters = [f"__global const {ELEMENTS[layout.kind]}* restrict {n}" for n, layout in named.values()]
    parameters += [f"__global {ELEMENTS[o.kind]}* restrict out{i}" for i, o in enumerate(outputs)]
    parameters += ["PG_UNIFORMS float* restrict floats", "PG_UNIFORMS int* restrict ints", "int4 cut"]
    printer.open(f"__kernel void {name}({', '.join(parameters)})")
    if inner:
        printer.line("int x = (int)get_global_id(0);\nint y = (int)get_global_id(1);")
    else:
        # cut: first column and row of the block that the inner kernel covers, and its width and height.
        printer.line("int x = (int)get_global_id(0);\nx = x < cut.x ? x : x + cut.z;")
        printer.line("int y = (int)get_global_id(1);\ny = y < cut.y ? y : y + cut.w;")
    printer.variables()
    printer.block(program.body)
    for i, (output, layout) in enumerate(zip(program.outputs, outputs, strict=True)):
        type_ = "int" if width * height * layout.channels < 1 << 31 else "long"
        printer.line(f"{type_} o{i} = (({type_})y * {width} + x) * {layout.channels};")
        for channel, value in enumerate(output.values):
            printer.line(f"out{i}[o{i} + {channel}] = {store_expression(layout.kind, printer.operand(value))};")
    return printer.close()


def inner_block(program: ScalarProgram, size: tuple[int, int], group: int) -> tuple[int, int, int, int]:
    """(x, y, width, height) of the pixels whose relative reads all lie inside; the width whole groups."""
    uses = [use for use in program.images if use.relative]
    left, top = (max([0, *(-getattr(use, axis)[0] for use in uses)]) for axis in "xy")
    right, bottom = (max([0, *(getattr(use, axis)[1] for use in uses)]) for axis in "xy")
    width = max(0, size[0] - left - right) // group * group
    height = max(0, size[1] - top - bottom)
    return (left, top, width, height) if width and height else (0, 0, 0, 0)


class PixelPassRunner:
    """One pixel pass.  It is compiled for the formats of the first storages that it meets, and for others then."""

    def __init__(self, backend: OpenCLBackend, step: PixelStep) -> None:
        from passgraph.backends.opencl.backend import Uniforms

        self.backend = backend
        self.step = step
        self.what = f"pass {step.name!r}"
        self.uniforms = Uniforms(backend, step.program.float_count, step.program.int_count, self.what)
        self.kernels: dict[tuple[ImageLayout, ...], tuple[Any, Any]] = {}

    def __call__(self, outputs: Sequence[Storage], images: Sequence[Storage], block: Block) -> None:
        backend = self.backend
        backend.check_open()
        layouts = tuple(storage.layout for storage in (*images, *outputs))
        if layouts not in self.kernels:
            self.kernels[layouts] = self._compile(layouts, len(images))
        self.uniforms.update(block)
        arguments = [storage.buffer for storage in (*images, *outputs)]
        arguments += self.uniforms.buffers
        with backend.reported(f"running {self.what}"):
            self._run(*self.kernels[layouts], arguments, outputs[0].size)

    def _compile(self, layouts: tuple[ImageLayout, ...], image_count: int) -> tuple[Any, Any]:
        names = [name for name, _ in self.step.images]
        images = list(zip(names, layouts[:image_count], strict=True))
        constant = self.uniforms.fits_constant()
        source = pixel_source(self.step.program, images, layouts[image_count:], constant)
        built = self.backend.programs.build(source, self.what)
        cl = self.backend.cl
        return cl.Kernel(built, "pg_pixel"), cl.Kernel(built, "pg_inner")

    def _run(self, bordered: Any, inner: Any, arguments: list[Any], size: tuple[int, int]) -> None:
        cl, queue = self.backend.cl, self.backend.queue
        group = GROUP if self.backend.is_cpu else GROUP_GPU
        x, y, width, height = inner_block(self.step.program, size, group)
        if width:
            inner.set_args(*arguments, cl.cltypes.make_int4(0, 0, 0, 0))
            cl.enqueue_nd_range_kernel(queue, inner, (width, height), (group, 1), (x, y))
        for strip, cut, offset in strips(size, (x, y, width, height)):
            bordered.set_args(*arguments, cl.cltypes.make_int4(*cut))
            cl.enqueue_nd_range_kernel(queue, bordered, strip, None, offset)


def strips(
    size: tuple[int, int], block: tuple[int, int, int, int]
) -> list[tuple[tuple[int, int], tuple[int, int, int, int], tuple[int, int]]]:
    """What a block leaves of a picture: rows above and below together, columns left and right together.

    Returns
    -------
    list
        (work-items along x and y, cut, first work-item) for each; a coordinate from ``cut`` on skips the block.
    """
    x, y, width, height = block
    found = []
    if height < size[1]:
        found.append(((size[0], size[1] - height), (size[0], y, 0, height), (0, 0)))
    if height and width < size[0]:
        found.append(((size[0] - width, height), (x, size[1], width, 0), (0, y)))
    return found
