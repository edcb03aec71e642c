"""Pixel passes: one work-item a pixel, or on CPUs one a run of pixels.

A pass that reads neighbours runs as two kernels.  The inner one covers the block of pixels whose reads all
lie inside, so that no border code keeps its loads from vectorising; the other one the strips around.

On CPUs the inner kernel goes through a run of pixels in a loop of its own.  PoCL optimises a kernel before it makes
the loop over a group's work-items: LLVM then packs the channels of one pixel into short vectors (its SLP vectoriser),
after which the loop over pixels "cannot be vectorized".  A loop that is in the kernel from the start is vectorised
first.  The sRGB curve on three channels takes a sixteenth of the time.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias
from weakref import ReferenceType, ref

from passgraph.backends.base import Block
from passgraph.backends.opencl.opencl_c import OpenCLPrinter, element, join, prologue
from passgraph.backends.opencl.programs import MOST_LAYOUTS, Recent
from passgraph.backends.opencl.storage import ImageLayout, Storage
from passgraph.backends.opencl.uniforms import Uniforms
from passgraph.backends.printing import Listing
from passgraph.language.scalar import ScalarProgram
from passgraph.plan.data import PixelStep

if TYPE_CHECKING:
    from passgraph.backends.opencl.backend import OpenCLBackend

#: Pixels of a run at most, or of a group along x, on CPUs: from 64 on, a pass that only copies runs at the speed of
#: memory.
GROUP = 128
#: Floats of the longest vectors that CPUs have.
VECTOR = 16
#: Rows of a group on CPUs, the first that divides the height: a group writes whole rows, one behind the other in
#: memory, and there are few groups to hand out.  A pass that only copies takes 5 % less than with a group for each run.
ROWS = (4, 3, 2, 1)
#: The same on graphics processors: a few warps.
GROUP_GPU = 64
#: Pixels of a strip, up to which its work-items go one by one on CPUs where there are two strips: PoCL compiles a
#: kernel for each size of group, which takes a fifth of the first run, and so few groups take microseconds.
FEW = 512


def pixel_source(
    program: ScalarProgram,
    images: Sequence[tuple[str, ImageLayout]],
    outputs: Sequence[ImageLayout],
    constant: bool,
    run: int,
    kernels: Collection[str],
) -> Listing:
    """Kernels ``pg_pixel`` (with borders) and ``pg_inner`` (without; ``run`` pixels a work-item), those of both that
    are asked for."""
    return join(prologue(constant), *(_kernel(name, program, images, outputs, run) for name in sorted(kernels)))


def _kernel(
    name: str,
    program: ScalarProgram,
    images: Sequence[tuple[str, ImageLayout]],
    outputs: Sequence[ImageLayout],
    run: int,
) -> Listing:
    inner, on_cpu = name == "pg_inner", run > 1
    width, height = outputs[0].size
    builtins = {"pixel.0": "x", "pixel.1": "y", "output_size.0": str(width), "output_size.1": str(height)}
    named = {image: (f"image{i}", layout) for i, (image, layout) in enumerate(images)}
    printer = OpenCLPrinter(program, builtins, named, inner=inner, prefix=f"{name}_")
    if on_cpu:
        printer.functions()
    printer.open(f"__kernel void {name}({parameters([layout for _, layout in images], outputs)})")
    if inner and on_cpu:
        # cut: columns of the first and the last run, which overlaps: some pixels twice cost less than one more kernel.
        printer.line("int y = (int)get_global_id(1) + first.y;")
        printer.line(f"int start = min(cut.x + (int)get_global_id(0) * {run}, cut.y);")
        printer.line(f"for (int x = start; x < start + {run}; ++x)\n{{")
    elif inner:
        printer.line("int x = (int)get_global_id(0) + first.x;\nint y = (int)get_global_id(1) + first.y;")
    else:
        # cut: first column and row of the block that the inner kernel covers, and its width and height.
        printer.line("int x = (int)get_global_id(0) + first.x;\nx = x < cut.x ? x : x + cut.z;")
        printer.line("int y = (int)get_global_id(1) + first.y;\ny = y < cut.y ? y : y + cut.w;")
    printer.variables()
    printer.block(program.body)
    for i, (output, layout) in enumerate(zip(program.outputs, outputs, strict=True)):
        printer.line(f"{layout.index_type} o{i} = {layout.place('x', 'y')};")
        for channel, value in enumerate(output.values):
            printer.line(f"out{i}[o{i} + {layout.channel(channel)}] = {printer.stored(layout.format, value)};")
    if inner and on_cpu:
        printer.line("}")
    return printer.close()


def parameters(images: Sequence[ImageLayout], outputs: Sequence[ImageLayout], *own: str) -> str:
    """What kernels of a pixel pass take: ``out0`` …, what it reads, buffers of its own, ``cut`` and ``first``."""
    found = [f"__global {element(layout.format)}* restrict out{i}" for i, layout in enumerate(outputs)]
    return ", ".join([*found, *inputs(images), *own, "int4 cut", "int2 first"])


def inputs(images: Sequence[ImageLayout]) -> list[str]:
    """What a pixel pass reads: ``image0`` and so on, and its parameters."""
    found = [f"__global const {element(layout.format)}* restrict image{i}" for i, layout in enumerate(images)]
    return [*found, "PG_UNIFORMS float* restrict floats", "PG_UNIFORMS int* restrict ints"]


def inner_block(program: ScalarProgram, size: tuple[int, int], group: int) -> tuple[int, int, int, int]:
    """(x, y, width, height) of the pixels whose reads all lie inside; empty below one group's width."""
    uses = [use for use in program.images if use.relative]
    left, top = (max([0, *(-getattr(use, axis)[0] for use in uses)]) for axis in "xy")
    right, bottom = (max([0, *(getattr(use, axis)[1] for use in uses)]) for axis in "xy")
    width, height = size[0] - left - right, size[1] - top - bottom
    return (left, top, width, height) if width >= group and height > 0 else (0, 0, 0, 0)


def run_of(width: int) -> int:
    """Pixels of a run on CPUs, in a row of so many: whole vectors, and so few as divide the row evenly, since the last
    run overlaps the one before.

    >>> run_of(1280), run_of(160), run_of(0)
    (128, 80, 128)
    """
    runs = max(1, -(-width // GROUP))
    vectors = -(-width // (runs * VECTOR))
    return vectors * VECTOR or GROUP


#: A kernel, its work-items, their groups, the first of them, and ``cut``.
Launched: TypeAlias = tuple[str, tuple[int, int], tuple[int, int] | None, tuple[int, int], tuple[int, int, int, int]]


@dataclass(eq=False)
class Launch:
    """One kernel with its arguments, over a range of pixels.

    Where the range begins is an argument too: PoCL compiles a kernel again for work-items that are counted from
    elsewhere than 0.
    """

    kernel: Any
    items: tuple[int, int]
    group: tuple[int, int] | None
    cut: Any
    first: Any
    #: A buffer of its own, where it takes one.
    own: Any = None

    def bind(self, buffers: Sequence[Any]) -> None:
        self.kernel.set_args(*buffers, *([] if self.own is None else [self.own]), self.cut, self.first)


class PixelPassRunner:
    """One pixel pass, compiled when it first meets storages of some formats and sizes."""

    def __init__(self, backend: OpenCLBackend, step: PixelStep) -> None:
        self.backend = backend
        self.step = step
        self.what = f"pass {step.name!r}"
        self.uniforms = Uniforms(backend, step.program.float_count, step.program.int_count, self.what)
        self.compiled: dict[tuple[ImageLayout, ...], list[Launch]] = Recent(MOST_LAYOUTS)
        #: What the last call was for, which nothing here keeps alive, and what it runs.
        self.storages: list[ReferenceType[Storage]] = []
        self.launches: list[Launch] = []

    def __call__(self, outputs: Sequence[Storage], images: Sequence[Storage], block: Block) -> None:
        backend = self.backend
        backend.check_open()
        try:
            storages = [*images, *outputs]
            if [held() for held in self.storages] != storages:
                self._bind(storages, len(images))
            self.uniforms.update(block)
            enqueue, queue = backend.cl.enqueue_nd_range_kernel, backend.queue
            for launch in self.launches:
                enqueue(queue, launch.kernel, launch.items, launch.group)
        except backend.cl.Error:
            with backend.reported(f"running {self.what}"):
                raise

    def _bind(self, storages: list[Storage], image_count: int) -> None:
        """Kernels for these storages, with their buffers as arguments."""
        layouts = tuple([storage.layout for storage in storages])
        if layouts not in self.compiled:
            self.compiled[layouts] = self._compile(layouts, image_count)
        self.launches = self.compiled[layouts]
        self.storages = []  # nothing counts as bound where an argument is refused
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
        block = inner_block(self.step.program, layouts[-1].size, group)
        run = run_of(block[2]) if self.backend.is_cpu else 1
        ranges = self._ranges(layouts[-1].size, block, group, run)
        kernels = {name for name, *_ in ranges}
        source = pixel_source(self.step.program, images, layouts[image_count:], constant, run, kernels)
        built = self.backend.programs.build(source, self.what)
        return [self.launch(built, *one) for one in ranges]

    def launch(
        self, program: Any, name: str, items: tuple[int, int], group: tuple[int, int] | None,
        first: tuple[int, int] = (0, 0), cut: tuple[int, int, int, int] = (0, 0, 0, 0), own: Any = None,
    ) -> Launch:  # fmt: skip
        """A kernel of a built program over some pixels, with a buffer of its own where it takes one."""
        cl = self.backend.cl
        with self.backend.reported(f"making the kernels of {self.what}"):
            kernel = cl.Kernel(program, name)
        return Launch(kernel, items, group, cl.cltypes.make_int4(*cut), cl.cltypes.make_int2(*first), own)

    def _ranges(self, size: tuple[int, int], block: tuple[int, int, int, int], group: int, run: int) -> list[Launched]:
        """Which kernel runs where."""
        x, y, width, height = block
        ranges: list[Launched] = []
        if width and run > 1:
            items = (-(-width // run), height)
            ranges.append(("pg_inner", items, self._group(items), (0, y), (x, x + width - run, 0, 0)))
        elif width:
            whole = width // group * group
            # The last group overlaps: some pixels twice are cheaper than a group of another size.
            spans = [(x, whole), *([(x + width - group, group)] if whole < width else [])]
            for start, count in spans:
                ranges.append(("pg_inner", (count, height), (group, 1), (start, y), (0, 0, 0, 0)))
        around = strips(size, (x, y, width, height))
        few = self.backend.is_cpu and len(around) > 1 and all(across * down <= FEW for (across, down), _, _ in around)
        for strip, cut, first in around:
            ranges.append(("pg_pixel", strip, (1, 1) if few or self._alone() else None, first, cut))
        return ranges

    def _alone(self) -> bool:
        """Whether work-items go one by one: PoCL holds the arrays of a whole group on the stack, for each its own."""
        return self.backend.is_cpu and bool(self.step.program.arrays)

    def _group(self, items: tuple[int, int]) -> tuple[int, int]:
        """Whole rows of runs, as far as the device takes them."""
        if self._alone():
            return 1, 1
        across, down = self.backend.device.max_work_item_sizes[:2]
        most = self.backend.device.max_work_group_size
        fit = (n for n in ROWS if items[1] % n == 0 and n <= down and items[0] <= across and items[0] * n <= most)
        rows = next(fit, 0)
        return (items[0], rows) if rows else (1, 1)


def strips(
    size: tuple[int, int], block: tuple[int, int, int, int]
) -> list[tuple[tuple[int, int], tuple[int, int, int, int], tuple[int, int]]]:
    """What a block leaves of a picture: rows above and below together, columns left and right together.

    Returns
    -------
    list
        (work-items along x and y, cut, first work-item) for each; coordinates from ``cut`` on skip the block.
    """
    x, y, width, height = block
    found = []
    if height < size[1]:
        found.append(((size[0], size[1] - height), (size[0], y, 0, height), (0, 0)))
    if height and width < size[0]:
        found.append(((size[0] - width, height), (x, size[1], width, 0), (0, y)))
    return found
