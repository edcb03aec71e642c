"""Pixel passes: one work-item per pixel, or on CPUs per run of pixels.

A pass that reads neighbors runs as two kernels.  The inner one covers the block of pixels whose reads are all inside
the picture, so its loads vectorize without border code.  The other one covers the surrounding pixels, row by row in
groups of one size: PoCL compiles a kernel again for each group size and for global offsets other than 0, which takes a
fifth of the first run.

On CPUs the inner kernel loops over a run of pixels.  PoCL optimizes a kernel before it adds the loop over a group's
work-items: LLVM then packs the channels of one pixel into short vectors (its SLP vectorizer), after which the loop over
pixels "cannot be vectorized".  A loop inside the kernel is vectorized first.  The sRGB curve on three channels takes a
sixteenth of the time.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias
from weakref import ReferenceType, ref

import numpy as np

from passgraph.backends.base import Block
from passgraph.backends.opencl.opencl_c import OpenCLPrinter, element, join, prologue
from passgraph.backends.opencl.programs import MOST_LAYOUTS
from passgraph.backends.opencl.storage import INT_LIMIT, ImageLayout, Storage
from passgraph.backends.printing import Listing, kept
from passgraph.cached import Recent
from passgraph.language.builtin_name import OUTPUT_SIZE, PIXEL
from passgraph.language.scalar import ScalarProgram, count
from passgraph.plan.data import PixelStep

if TYPE_CHECKING:
    from passgraph.backends.opencl.backend import OpenCLBackend


#: Most pending writes; then the host waits for the oldest: some seconds of frames.
MOST_WRITING = 256


class Uniforms:
    """The parameters of one stage on the device, written only when they change."""

    def __init__(self, backend: OpenCLBackend, floats: int, ints: int, what: str) -> None:
        self.backend = backend
        self.sizes = max(1, floats), max(1, ints)
        self.buffers = tuple(backend.allocate(4 * n, f"the parameters of {what}") for n in self.sizes)
        for buffer in self.buffers:
            backend.free_with(self, buffer)
        self.held: list[bytes] = [b"", b""]
        #: Writes that may be pending: dropping one waits for it.
        self.writing: deque[Any] = deque()

    def update(self, block: Block) -> None:
        for i, array in enumerate((block.floats, block.ints)):
            raw = array.tobytes()
            if raw != self.held[i]:
                self._forget_finished()
                self.writing.append(self.backend.write(self.buffers[i], np.frombuffer(raw, np.uint8)))
                self.held[i] = raw

    def _forget_finished(self) -> None:
        complete = self.backend.cl.command_execution_status.COMPLETE
        while self.writing and (
            len(self.writing) >= MOST_WRITING or self.writing[0].command_execution_status <= complete
        ):
            self.writing.popleft()

    def fits_constant(self) -> bool:
        """Return True if every block fits into the device's constant memory."""
        return 4 * max(self.sizes) <= int(self.backend.device.max_constant_buffer_size)


#: Most pixels of a run, or of a group along x, on CPUs: from 64 on, a pass that only copies runs at memory speed.
GROUP = 128
#: Floats of the longest vectors of CPUs.
VECTOR = 16
#: Rows of a group on CPUs, the first number that divides the height: a group writes whole contiguous rows, and there
#: are few groups to schedule.  A copying pass takes 5 % less than with a group per run.
ROWS = (4, 3, 2, 1)
#: The same on GPUs: a few warps.
GROUP_GPU = 64
#: Pixels of a group around an inner block.
GROUP_AROUND = 64
#: Instructions from which on a group has one run: without a loop over long code, compilers save up to a fifth of their
#: time.
LONG = 100
#: (x, y, width, height) of an inner block.
Inner: TypeAlias = tuple[int, int, int, int]


def pixel_source(
    program: ScalarProgram,
    images: Sequence[tuple[str, ImageLayout]],
    outputs: Sequence[ImageLayout],
    constant: bool,
    run: int,
    block: Inner,
) -> Listing:
    """Return the source of ``pg_pixel`` (with borders) and ``pg_inner`` (without; ``run`` pixels per work-item);
    kernels without pixels are left out."""
    names = kernels_of(outputs[0].size, block)
    return join(prologue(constant), *(_kernel(name, program, images, outputs, run, block) for name in names))


def readable_source(step: PixelStep, sizes: Mapping[int, tuple[int, int]]) -> str:
    """Return the kernel with borders alone, one pixel per work-item; ``sizes`` by resource."""
    formats = zip(step.images, step.image_formats, strict=True)
    images = [(name, ImageLayout.tight(format_, sizes[resource])) for (name, resource), format_ in formats]
    outputs = [ImageLayout.tight(format_, step.size) for format_ in step.output_formats]
    return _kernel("pg_pixel", step.program, images, outputs, 1, (0, 0, 0, 0)).text


def kernels_of(size: tuple[int, int], block: Inner) -> tuple[str, ...]:
    """Return the kernels that a pass runs."""
    if not block[2]:
        return ("pg_pixel",)
    return ("pg_inner",) if block[2:] == size else ("pg_inner", "pg_pixel")


def _kernel(
    name: str,
    program: ScalarProgram,
    images: Sequence[tuple[str, ImageLayout]],
    outputs: Sequence[ImageLayout],
    run: int,
    block: Inner,
) -> Listing:
    inner, on_cpu = name == "pg_inner", run > 1
    width, height = outputs[0].size
    builtins = dict(zip((*PIXEL, *OUTPUT_SIZE), ("x", "y", str(width), str(height)), strict=True))
    named = {image: (f"image{i}", layout) for i, (image, layout) in enumerate(images)}
    printer = OpenCLPrinter(program, builtins, named, inner=inner, outputs=outputs, prefix=f"{name}_")
    printer.open(f"__kernel void {name}({parameters([layout for _, layout in images], outputs)})")
    if inner:
        printer.line(_inner_place(run))
    else:
        printer.line(_around_place(block, outputs[0].size) if block[2] else WHOLE)
    if inner and on_cpu:
        printer.line(f"for (int x = start; x < start + {run}; ++x)\n{{")
    printer.variables()
    printer.block(printer.program.body)
    if inner and on_cpu:
        printer.line("}")
    return printer.close()


#: The pixel of a work-item in a picture without inner block.
WHOLE = "int x = (int)get_global_id(0);\nint y = (int)get_global_id(1);"


def _inner_place(run: int) -> str:
    """Return the pixel of a work-item in the inner block. The block begins at column ``cut.x`` and row ``cut.z``; its
    last run begins at column ``cut.y``. The last run, or the last pixel until its group is full, is computed twice:
    that costs less than another kernel."""
    row = "int y = (int)get_global_id(1) + cut.z;"
    if run > 1:
        return f"{row}\nint start = min(cut.x + (int)get_global_id(0) * {run}, cut.y);"
    return f"{row}\nint x = min(cut.x + (int)get_global_id(0), cut.y);"


def cut_of(block: Inner, run: int) -> tuple[int, int, int, int]:
    """Return ``cut`` for `_inner_place`. It is an argument: LLVM treats a known positive number as unsigned, and then
    does not see that texels to the left are adjacent (four times slower)."""
    x, y, width, _ = block
    return x, x + width - run, y, 0


def _around_place(block: Inner, size: tuple[int, int]) -> str:
    """Return the pixel of a work-item around the inner block. Work-items are counted row by row: first the rows above
    and below, then the columns left and right. The last pixel is repeated until its group is full."""
    x, y, width, height = block
    rows, columns = size[1] - height, size[0] - width
    lines = [f"int i = min((int)get_global_id(0), {pixels_around(block, size) - 1});"]
    if rows:
        lines += [f"int x = i % {size[0]};", f"int y = i / {size[0]};", f"y = y < {y} ? y : y + {height};"]
    else:
        lines += ["int x = 0;", "int y = 0;"]
    if columns:
        lines += [
            f"int j = i - {rows * size[0]};",
            f"x = j < 0 ? x : j % {columns} < {x} ? j % {columns} : j % {columns} + {width};",
            f"y = j < 0 ? y : j / {columns} + {y};",
        ]
    return "\n".join(lines)


def pixels_around(block: Inner, size: tuple[int, int]) -> int:
    """Return the number of pixels outside an inner block."""
    return size[0] * size[1] - block[2] * block[3]


def parameters(images: Sequence[ImageLayout], outputs: Sequence[ImageLayout]) -> str:
    """Return the parameter list of a pixel pass: ``out0`` …, its inputs, and ``cut``."""
    outputs_ = [f"__global {element(layout.format)}* restrict out{i}" for i, layout in enumerate(outputs)]
    return ", ".join([*outputs_, *inputs(images), "int4 cut"])


def inputs(images: Sequence[ImageLayout]) -> list[str]:
    """Return the input parameters of a pixel pass: ``image0`` …, then its uniforms."""
    pointers = [f"__global const {element(layout.format)}* restrict image{i}" for i, layout in enumerate(images)]
    return [*pointers, "PG_UNIFORMS float* restrict floats", "PG_UNIFORMS int* restrict ints"]


def inner_block(program: ScalarProgram, size: tuple[int, int], group: int) -> Inner:
    """Return (x, y, width, height) of the pixels whose reads are all inside; empty if narrower than a group, or too
    large for int to count the pixels around it."""
    uses = [use for use in program.images if use.relative]
    left, top = (max([0, *(-getattr(use, axis)[0] for use in uses)]) for axis in "xy")
    right, bottom = (max([0, *(getattr(use, axis)[1] for use in uses)]) for axis in "xy")
    width, height = size[0] - left - right, size[1] - top - bottom
    block = (left, top, width, height)
    fits = width >= group and height > 0 and pixels_around(block, size) < INT_LIMIT - GROUP_AROUND
    return block if fits else (0, 0, 0, 0)


def run_of(width: int) -> int:
    """Return the pixels of a run on CPUs for a row's width: whole vectors, and few enough to divide the row evenly,
    since the last run overlaps the one before.

    >>> run_of(1280), run_of(160), run_of(0)
    (128, 80, 128)
    """
    runs = max(1, -(-width // GROUP))
    vectors = -(-width // (runs * VECTOR))
    return vectors * VECTOR or GROUP


@dataclass(eq=False)
class Launch:
    """A kernel with its arguments, over a range of pixels."""

    kernel: Any
    items: tuple[int, int]
    group: tuple[int, int] | None
    cut: Any

    def bind(self, buffers: Sequence[Any]) -> None:
        self.kernel.set_args(*buffers, self.cut)


class PixelPassRunner:
    """A pixel pass, compiled at first use for each combination of storage formats and sizes."""

    def __init__(self, backend: OpenCLBackend, step: PixelStep) -> None:
        self.backend = backend
        self.step = step
        self.what = f"pass {step.name!r}"
        self.uniforms = Uniforms(backend, step.program.float_count, step.program.int_count, self.what)
        self.compiled: dict[tuple[ImageLayout, ...], list[Launch]] = Recent(MOST_LAYOUTS)
        #: Weak references to the storages of the last call, and its launches.
        self.storages: list[ReferenceType[Storage]] = []
        self.launches: list[Launch] = []

    def __call__(self, outputs: Sequence[Storage], images: Sequence[Storage], block: Block) -> None:
        backend = self.backend
        backend.check_open()
        try:
            storages = [*images, *outputs]
            if [storage() for storage in self.storages] != storages:
                self._bind(storages, len(images))
            self.uniforms.update(block)
            enqueue, queue = backend.cl.enqueue_nd_range_kernel, backend.queue
            for launch in self.launches:
                enqueue(queue, launch.kernel, launch.items, launch.group)
        except backend.cl.Error:
            with backend.reported(f"running {self.what}"):
                raise

    def _bind(self, storages: list[Storage], image_count: int) -> None:
        """Prepare kernels for these storages, with their buffers as arguments."""
        layouts = tuple([storage.layout for storage in storages])
        if layouts not in self.compiled:
            self.compiled[layouts] = self._compile(layouts, image_count)
        self.launches = self.compiled[layouts]
        self.storages = []  # nothing counts as bound if an argument is rejected
        written, read = storages[image_count:], storages[:image_count]
        buffers = [*(storage.buffer for storage in [*written, *read]), *self.uniforms.buffers]
        for launch in self.launches:
            launch.bind(buffers)
        self.storages = [ref(storage) for storage in storages]

    def _compile(self, layouts: tuple[ImageLayout, ...], image_count: int) -> list[Launch]:
        names = [name for name, _ in self.step.images]
        images = list(zip(names, layouts[:image_count], strict=True))
        constant = self.uniforms.fits_constant()
        group = GROUP if self.backend.is_cpu else GROUP_GPU
        size = layouts[-1].size
        block = inner_block(self.step.program, size, group)
        run = run_of(block[2]) if self.backend.is_cpu else 1
        given = images, layouts[image_count:], constant, run, block
        source = kept(lambda: pixel_source(self.step.program, *given), "opencl", self.step.program.key, *given)
        items = {name: self._items(name, size, block, run) for name in kernels_of(size, block)}
        grouped = any(group != (1, 1) for _, group in items.values())
        built = self.backend.programs.build(source, self.what, grouped)
        cut = cut_of(block, run)
        return [self.launch(built, name, *one, cut) for name, one in items.items()]

    def launch(
        self, program: Any, name: str, items: tuple[int, int], group: tuple[int, int] | None,
        cut: tuple[int, int, int, int] = (0, 0, 0, 0),
    ) -> Launch:  # fmt: skip
        """Return a kernel of a built program over some pixels."""
        cl = self.backend.cl
        with self.backend.reported(f"making the kernels of {self.what}"):
            return Launch(cl.Kernel(program, name), items, group, cl.cltypes.make_int4(*cut))

    def _items(
        self, name: str, size: tuple[int, int], block: Inner, run: int
    ) -> tuple[tuple[int, int], tuple[int, int] | None]:
        """Return the work-items of a kernel, and of its groups."""
        _, _, width, height = block
        if name == "pg_inner" and self.backend.is_cpu:
            items = (-(-width // run), height)
            return items, self._group(items)
        if name == "pg_inner":
            return (-(-width // GROUP_GPU) * GROUP_GPU, height), (GROUP_GPU, 1)
        if not width:
            return size, (1, 1) if self._is_ungrouped() else None
        device = self.backend.device
        across = (
            1 if self._is_ungrouped() else min(GROUP_AROUND, device.max_work_group_size, device.max_work_item_sizes[0])
        )
        return (-(-pixels_around(block, size) // across) * across, 1), (across, 1)

    def _is_ungrouped(self) -> bool:
        """Return True if each work-item is a group: PoCL keeps the arrays of a whole group on the stack."""
        return self.backend.is_cpu and bool(self.step.program.arrays)

    def _group(self, items: tuple[int, int]) -> tuple[int, int]:
        """Return a group of whole rows of runs, within the limits of the device."""
        if self._is_ungrouped() or count(self.step.program.body) >= LONG:
            return 1, 1
        across, down = self.backend.device.max_work_item_sizes[:2]
        most = self.backend.device.max_work_group_size
        fit = (n for n in ROWS if items[1] % n == 0 and n <= down and items[0] <= across and items[0] * n <= most)
        rows = next(fit, 0)
        return (items[0], rows) if rows else (1, 1)
