"""Runtime of the ``numpy`` backend: storages, compiled passes, threads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import Backend, Block, DeviceInfo, DrawRunner, FloatBlock, PixelRunner
from passgraph.backends.numpy.workers import Workers, thread_count
from passgraph.errors import BackendError
from passgraph.formats import Format
from passgraph.graph import Geometry
from passgraph.plan.data import DrawStep, PixelStep

#: Rows in one piece of work: small enough to balance, large enough that handing out costs nothing.
MIN_PIXELS_A_PIECE = 16_384


@dataclass(eq=False)
class Storage:
    """A picture as flat float32, channels interleaved; values are already quantised to the format."""

    format: Format
    size: tuple[int, int]
    values: FloatBlock
    stencil: NDArray[np.uint8] | None = None


class NumpyBackend(Backend):
    """See :class:`passgraph.backends.base.Backend`."""

    name: ClassVar[str] = "numpy"

    def __init__(self, device: str | None = None) -> None:
        if device is not None and not device.isdigit():
            raise BackendError(f"backend numpy takes a number of threads as its device (numpy:2), got {device!r}")
        self.workers = Workers(int(device) if device else None)

    @classmethod
    def devices(cls) -> list[DeviceInfo]:
        import platform
        from importlib.metadata import version

        return [DeviceInfo(f"{platform.machine()}, {thread_count()} threads", "numba", version("numba"))]

    def make(self, format: Format, size: tuple[int, int]) -> Storage:
        count = size[0] * size[1]
        try:
            values = np.zeros(count * format.channels, np.float32)
            stencil = np.zeros(count, np.uint8) if format.stencil else None
        except MemoryError:
            needed = count * format.channels * 4 / 2**30
            raise BackendError(
                f"a {size[0]}x{size[1]} {format.name} target needs {needed:.1f} GiB, which is not there"
            ) from None
        return Storage(format, size, values, stencil)

    def upload(self, storage: Storage, picture: FloatBlock) -> None:
        width, height = storage.size
        given = np.ascontiguousarray(picture, np.float32).reshape(height * width * storage.format.channels)
        np.copyto(storage.values, quantized(given, storage.format))

    def download(self, storage: Storage) -> FloatBlock:
        width, height = storage.size
        return storage.values.reshape(height, width, storage.format.channels).copy()

    def download_stencil(self, storage: Storage) -> NDArray[np.uint8]:
        """The stencil of a depth-stencil storage, (height, width)."""
        assert storage.stencil is not None
        return storage.stencil.reshape(storage.size[1], storage.size[0]).copy()

    def copy(self, source: Storage, destination: Storage) -> None:
        np.copyto(destination.values, source.values)
        if source.stencil is not None and destination.stencil is not None:
            np.copyto(destination.stencil, source.stencil)

    def geometry(self, mesh: Geometry) -> Geometry:
        return mesh

    def pixel_pass(self, step: PixelStep) -> PixelRunner:
        from passgraph.backends.numpy.jit import load_module
        from passgraph.backends.numpy.pixel_code import pixel_module

        channels = tuple(len(output.values) for output in step.program.outputs)
        module = load_module(*pixel_module(step, channels), step.name)
        width, height = step.size
        order = _image_order(step.program.images, step.images)
        rows = max(1, min(height, MIN_PIXELS_A_PIECE // width))
        pieces = -(-height // rows)
        workers = self.workers

        def run(outputs: Sequence[Storage], images: Sequence[Storage], block: Block) -> None:
            arguments = _image_arguments(images, order)
            stores = [output.values for output in outputs]

            def piece(number: int) -> None:
                first = number * rows
                module.rows(
                    first,
                    min(height, first + rows),
                    width,
                    height,
                    *arguments,
                    *stores,
                    block.floats,
                    block.ints,
                )

            workers.each(piece, pieces)

        warm_up(
            lambda: module.rows(0, 0, width, height, *_dummies(len(order)), *_blanks(len(channels)), *_no_uniforms())
        )
        return run

    def draw_pass(self, step: DrawStep) -> DrawRunner:
        from passgraph.backends.numpy.raster import Raster

        return Raster(step, self.workers)

    def release(self, storage: Storage) -> None:
        storage.values = np.empty(0, np.float32)
        storage.stencil = None

    def close(self) -> None:
        self.workers.close()


def quantized(values: FloatBlock, format_: Format) -> FloatBlock:
    """Nearest values that the format stores."""
    if format_.kind == "half":
        with np.errstate(over="ignore"):
            return values.astype(np.float16).astype(np.float32)
    if format_.kind.startswith("unorm"):
        steps = np.float32(255 if format_.kind == "unorm8" else 65535)
        clean = np.clip(np.nan_to_num(values, nan=0.0), 0, 1)
        return np.asarray(np.rint(clean * steps) / steps, np.float32)
    return values


def _image_order(uses: Any, images: tuple[tuple[str, int], ...]) -> list[int]:
    """For each image of the program, its place among the step's images."""
    names = [name for name, _ in images]
    return [names.index(use.name) for use in uses]


def _image_arguments(images: Sequence[Storage], order: list[int]) -> list[Any]:
    arguments: list[Any] = []
    for place in order:
        arguments += [images[place].values, images[place].size[0], images[place].size[1]]
    return arguments


def _dummies(count: int) -> list[Any]:
    return [part for _ in range(count) for part in (np.zeros(4, np.float32), 1, 1)]


def _blanks(count: int) -> list[FloatBlock]:
    return [np.zeros(4, np.float32) for _ in range(count)]


def _no_uniforms() -> tuple[FloatBlock, NDArray[np.int32]]:
    return np.zeros(1, np.float32), np.zeros(1, np.int32)


def warm_up(call: Any) -> None:
    """Run on nothing, so that compiling belongs to making the program and not to its first frame."""
    call()
