"""Runtime of the ``numpy`` backend: storages, compiled passes, threads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import (
    READ,
    Backend,
    ChainRunner,
    DeviceInfo,
    DrawRunner,
    FloatBlock,
    PixelRunner,
    Use,
    device_number,
)
from passgraph.backends.numpy.machine.workers import Workers, thread_count
from passgraph.backends.numpy.storage import MAX_PIXELS, Storage, adopted, new_storage
from passgraph.cached import cached_property
from passgraph.errors import BackendError
from passgraph.formats import Format, float_format
from passgraph.graph.draw_state import Geometry
from passgraph.plan.data import CountStep, DrawStep, PixelStep
from passgraph.plan.limits import Limits
from passgraph.quantise import transfer_format

if TYPE_CHECKING:
    from passgraph.backends.numpy.pixels.moves import Moves


class NumpyBackend(Backend):
    """See :class:`passgraph.backends.base.Backend`."""

    name: ClassVar[str] = "numpy"
    limits = Limits("numpy", pixels=MAX_PIXELS - 1, contracts=True)

    def __init__(self, device: str | None = None) -> None:
        count = None if device is None else device_number(device)
        if device is not None and count is None:
            raise BackendError(f"backend numpy takes a number of threads as its device (numpy:2), got {device!r}")
        self.workers = Workers(count)

    @classmethod
    def devices(cls) -> list[DeviceInfo]:
        import platform
        from importlib.metadata import version

        from llvmlite.binding import llvm_version_info

        llvm = ".".join(map(str, llvm_version_info))
        return [
            DeviceInfo(
                f"{platform.machine()}, {thread_count()} threads", "llvmlite", f"{version('llvmlite')} (LLVM {llvm})"
            )
        ]

    def make(self, format: Format, size: tuple[int, int]) -> Storage:
        if size[0] * size[1] >= MAX_PIXELS:
            raise BackendError(
                f"a {size[0]}x{size[1]} target has more pixels than backend numpy counts, {MAX_PIXELS - 1}"
            )
        return new_storage(format, size)

    def adopt(self, external: NDArray[Any], format: Format, use: Use = READ) -> Storage | None:
        return adopted(external, format)

    @cached_property
    def moves(self) -> Moves:
        from passgraph.backends.numpy.pixels.moves import Moves

        return Moves(self.workers)

    # Compiled code converts pictures between float32 and storage formats, and between layouts.

    def upload(self, storage: Storage, picture: FloatBlock) -> None:
        values = picture.reshape(storage.numbers.shape)
        self.moves(values, float_format(storage.format.channels), storage.numbers, storage.format)

    def upload_stored(self, storage: Storage, numbers: NDArray[Any], format: Format) -> None:
        self.moves(numbers, format, storage.numbers, format)

    def download(self, storage: Storage) -> FloatBlock:
        values = np.empty(storage.numbers.shape, np.float32)
        self.moves(storage.numbers, storage.format, values, float_format(storage.format.channels))
        return values

    def download_into(self, storage: Storage, into: NDArray[Any], format: Format) -> None:
        self.moves(storage.numbers, format, into, transfer_format(into, format))

    def copy(self, source: Storage, destination: Storage) -> None:
        self.moves(source.numbers, source.format, destination.numbers, destination.format)
        if source.stencil is not None and destination.stencil is not None:
            np.copyto(destination.stencil, source.stencil)

    def geometry(self, mesh: Geometry) -> Geometry:
        return mesh

    def compiling(self) -> AbstractContextManager[None]:
        from passgraph.backends.numpy.machine.machine_code import side_by_side

        return side_by_side(self.workers.count)

    def pixel_pass(self, step: PixelStep) -> PixelRunner:
        from passgraph.backends.numpy.pixels.chains import single_stage
        from passgraph.backends.numpy.pixels.runner import PixelRun

        run = PixelRun.compile(single_stage(step), self.workers)
        assert run is not None
        return lambda outputs, images, block: run(outputs, (images,), (block,))

    def count_pass(self, step: CountStep) -> PixelRunner:
        from passgraph.backends.numpy.pixels.counts import Counts

        return Counts(step, self.workers)

    def own_way(self, step: CountStep) -> str | None:
        return "each texel adds to its bin in a table of its row"

    def code(self, step: PixelStep | DrawStep, sizes: Mapping[int, tuple[int, int]]) -> str:
        from passgraph.backends.numpy.machine.machine_code import lanes
        from passgraph.backends.numpy.pixels.body import body_text
        from passgraph.backends.numpy.pixels.buffer_layout import Layout
        from passgraph.backends.numpy.pixels.chains import single_stage

        if not isinstance(step, PixelStep):
            return ""
        return body_text(Layout.for_chain(single_stage(step), lanes()).stages[0], "body")

    def pixel_chain(self, steps: Sequence[PixelStep]) -> ChainRunner | None:
        from passgraph.backends.numpy.pixels.chains import stages
        from passgraph.backends.numpy.pixels.runner import PixelRun

        chain = stages(steps)
        return None if chain is None else PixelRun.compile(chain, self.workers)

    def draw_pass(self, step: DrawStep) -> DrawRunner:
        from passgraph.backends.numpy.raster.draw import Raster

        return Raster(step, self.workers)

    def release(self, storage: Storage) -> None:
        storage.numbers = np.empty((0, 0, 0), storage.numbers.dtype)
        storage.stencil = None

    def after_fork(self) -> bool:
        self.workers.after_fork()
        return True

    def close(self) -> None:
        if not self.turn.lost:
            with self.turn:
                self.workers.close()
