"""The opencl backend: one device, its queue, and its objects."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import (
    READ,
    Block,
    DeviceInfo,
    DrawRunner,
    FloatBlock,
    PixelRunner,
    SentPass,
    Use,
)
from passgraph.backends.driver import DriverBackend, chosen_device
from passgraph.backends.opencl import transfers
from passgraph.backends.opencl.programs import MOST_LAYOUTS, Programs
from passgraph.backends.opencl.storage import ImageLayout, Storage
from passgraph.backends.turn import check_driver, open_driver
from passgraph.cached import Recent
from passgraph.errors import BackendError, DeviceMissingError
from passgraph.formats import Format
from passgraph.graph.draw_state import Geometry
from passgraph.language.native import OPENCL
from passgraph.plan.data import CountStep, DrawStep, PixelStep
from passgraph.plan.limits import Limits

INSTALL_MODULE = "pip install 'passgraph[opencl]'"
INSTALL_DRIVER = "apt-get install pocl-opencl-icd ocl-icd-libopencl1"


def all_devices() -> list[Any]:
    """Return every device of every platform, in the order of their numbers.

    Raises
    ------
    DeviceMissingError
        Without pyopencl, a driver or a device, with the command that installs it.
    """
    try:
        import pyopencl as cl
    except ImportError as error:
        raise DeviceMissingError(f"the opencl backend needs pyopencl ({error}); install it: {INSTALL_MODULE}") from None
    try:
        devices = [
            device
            for platform in cl.get_platforms()
            for device in platform.get_devices()
            if device.available and device.compiler_available
        ]
    except cl.Error as error:
        raise DeviceMissingError(
            f"OpenCL found no driver ({error}); install one, on CPUs PoCL: {INSTALL_DRIVER}"
        ) from None
    if not devices:
        raise DeviceMissingError(
            f"OpenCL found drivers but no usable device; install one, on CPUs PoCL: {INSTALL_DRIVER}"
        )
    return devices


def choose(device: str | None) -> Any:
    """Return the device with this number or with this text in its name; the first one for None."""
    devices = all_devices()
    names = [f"{one.name.strip()} ({one.platform.name})" for one in devices]
    return devices[chosen_device(device, names, "OpenCL")]


def device_infos() -> list[DeviceInfo]:
    """Return all devices for a listing, or one entry that names what is missing."""
    try:
        check_driver("opencl")
        return [_info_of(one) for one in all_devices()]
    except BackendError as error:
        return [DeviceInfo("OpenCL", "", "", str(error))]
    except Exception as error:
        return [DeviceInfo("OpenCL", "", "", f"the OpenCL driver failed: {error}")]


def _info_of(device: Any) -> DeviceInfo:
    return DeviceInfo(device.name.strip(), _driver_text(device), device.version.strip())


def _driver_text(device: Any) -> str:
    """Return the driver's name and version; PoCL's platform version names its LLVM, too."""
    llvm = re.search(r"LLVM [\d.]+", device.platform.version)
    return f"{device.platform.name} {device.driver_version}" + (f" ({llvm[0]})" if llvm else "")


#: Other 8-byte arguments of kernels, in addition to images and targets: parameters, lists of triangles, depth, sizes.
OTHER_ARGUMENTS = 20


class OpenCLBackend(DriverBackend):
    """Runs passes on an OpenCL 1.2 device.

    ``device`` is a number counted over all platforms, or a part of a device's or platform's name.
    """

    name: ClassVar[str] = "opencl"

    def __init__(self, device: str | None = None) -> None:
        super().__init__(device)
        check_driver(self.name)
        chosen = choose(device)
        import pyopencl as cl

        context = cl.Context([chosen])
        self._open(chosen, context, cl.CommandQueue(context, chosen))

    def _open(self, device: Any, context: Any, queue: Any) -> None:
        import pyopencl as cl

        open_driver(self.name)
        self.cl, self.device = cl, device
        self.context: Any = context
        self.queue: Any = queue
        self.programs = Programs(self.context, self.device)
        self.alive: dict[int, Any] = {}  # every live buffer, by its id
        self.scratch: dict[str, Any] = {}  # buffers shared by draws, by purpose; they only grow
        #: Storages in memory of the caller, by address and length, during a run.
        self.borrowed_arrays: dict[tuple[int, int], Storage] | None = None
        self.moves: dict[tuple[ImageLayout, ImageLayout], Any] = Recent(MOST_LAYOUTS)  # kernels by layouts
        #: Alignment in bytes of a sub-buffer's start.
        self.alignment = max(1, int(self.device.mem_base_addr_align) // 8)
        self.is_cpu = bool(self.device.type & cl.device_type.CPU)
        self.max_bytes = int(self.device.max_mem_alloc_size)
        self.limits = Limits(
            f"opencl ({self.device.name.strip()})",
            picture_bytes=self.max_bytes,
            bindings=int(self.device.max_parameter_size) // 8 - OTHER_ARGUMENTS,
            vertex_numbers=self.max_bytes // 4,
            numbers=self.max_bytes // 4,
            # PoCL's functions take 22 times as long on a CPU as ours (eight of them a pixel: 776 ms and 34 ms).
            native={} if self.is_cpu else OPENCL,
            contracts=True,
        )

    @classmethod
    def devices(cls) -> list[DeviceInfo]:
        return device_infos()

    def device_info(self) -> DeviceInfo:
        self.check_open()
        return _info_of(self.device)

    # Buffers

    def allocate(self, size: int, what: str) -> Any:
        """Return a buffer of a number of bytes, registered until :meth:`free`.

        Raises
        ------
        BackendError
            If the device lacks memory, with the requested and the available bytes.
        """
        self.check_open()
        size = max(int(size), 4)
        if size > self.max_bytes:
            raise BackendError(
                f"{what} needs {size:,} bytes; {self.device.name.strip()} gives at most {self.max_bytes:,} "
                f"at once (of {self.device.global_mem_size:,}); use a smaller size or format"
            )
        # On CPUs its memory is the host's, touched now: PoCL ends the process if it runs out later.
        at_once = self.cl.mem_flags.ALLOC_HOST_PTR if self.is_cpu else 0
        with self.reported(f"making {what} of {size:,} bytes"):
            buffer = self.cl.Buffer(self.context, self.cl.mem_flags.READ_WRITE | at_once, size)
        self.alive[buffer.int_ptr] = buffer
        return buffer

    def free(self, resource: Any) -> None:
        if resource is not None and not self.turn.lost and self.alive.pop(resource.int_ptr, None) is not None:
            resource.release()

    def scratch_buffer(self, purpose: str, size: int) -> Any:
        """Return a buffer that every draw may use while its commands are queued."""
        buffer = self.scratch.get(purpose)
        if buffer is None or buffer.size < size:
            self.free(buffer)
            self.scratch.pop(purpose, None)
            # Half as much again, so that slowly growing needs do not allocate each time.
            roomy = min(size + size // 2, self.max_bytes) if buffer is not None else size
            self.scratch[purpose] = self.allocate(max(size, roomy), f"scratch memory ({purpose})")
        return self.scratch[purpose]

    def fill(self, buffer: Any, size: int) -> None:
        # Some drivers allocate only when a buffer is first used.
        with self.reported(f"clearing {size:,} bytes"):
            self.cl.enqueue_fill_buffer(self.queue, buffer, np.zeros(1, np.uint8), 0, size)

    def write(self, buffer: Any, array: NDArray[Any]) -> Any:
        """Write a host array, which must not change, to a buffer.  Dropping the returned event waits for it."""
        return self.cl.enqueue_copy(self.queue, buffer, array, is_blocking=False)

    def read(self, buffer: Any, array: NDArray[Any]) -> None:
        self.cl.enqueue_copy(self.queue, array, buffer, is_blocking=True)

    @contextmanager
    def reported(self, doing: str) -> Iterator[None]:
        """Convert driver errors to BackendError with the failed operation."""
        try:
            yield
        except self.cl.Error as error:
            codes = self.cl.status_code
            if error.code in (codes.MEM_OBJECT_ALLOCATION_FAILURE, codes.OUT_OF_RESOURCES, codes.OUT_OF_HOST_MEMORY):
                raise BackendError(
                    f"{self.device.name.strip()} is out of memory while {doing} "
                    f"({self.device.global_mem_size:,} bytes in all): {error}"
                ) from None
            raise BackendError(f"the OpenCL driver failed while {doing}: {error}") from None

    # Pictures

    def make(self, format: Format, size: tuple[int, int]) -> Storage:
        pixels = size[0] * size[1]
        layout = ImageLayout.tight(format, size)
        what = f"a target of {size[0]}x{size[1]} pixels {format.name}"
        storage = Storage(layout, self.allocate(layout.bytes, what))
        self.fill(storage.buffer, layout.bytes)
        if format.stencil:
            storage.stencil = self.allocate(pixels, f"the stencil of {what}")
            self.fill(storage.stencil, pixels)
        return storage

    def adopt(self, external: Any, format: Format, use: Use = READ) -> Storage | None:
        """Adopt a contiguous array on CPUs, in place until the run ends."""
        return transfers.adopted(self, external, format)

    def running(self) -> AbstractContextManager[None]:
        return transfers.Running(self)

    def upload(self, storage: Storage, picture: FloatBlock) -> None:
        self.check_open()
        with self.reported("uploading a picture"):
            transfers.send_values(self, storage, picture)

    def upload_stored(self, storage: Storage, numbers: NDArray[Any], format: Format) -> None:
        self.check_open()
        with self.reported("uploading a picture"):
            transfers.send(self, storage, numbers)

    def download_into(self, storage: Storage, into: NDArray[Any], format: Format) -> None:
        self.check_open()
        with self.reported("downloading a picture"):
            transfers.receive(self, storage, into)

    def copy(self, source: Storage, destination: Storage) -> None:
        if source.layout != destination.layout:
            raise BackendError(f"cannot copy {source.layout} into {destination.layout}")
        with self.reported("copying a picture"):
            self.cl.enqueue_copy(self.queue, destination.buffer, source.buffer, byte_count=source.layout.bytes)
            if source.stencil is not None and destination.stencil is not None:
                pixels = source.size[0] * source.size[1]
                self.cl.enqueue_copy(self.queue, destination.stencil, source.stencil, byte_count=pixels)

    def release(self, storage: Storage) -> None:
        if not storage.released:
            storage.released = True
            self.free(storage.buffer)
            self.free(storage.stencil)

    # Passes

    def geometry(self, mesh: Geometry) -> Any:
        from passgraph.backends.opencl.raster import DeviceMesh

        self.check_open()
        return DeviceMesh(self, mesh)

    def pixel_pass(self, step: PixelStep) -> PixelRunner:
        from passgraph.backends.opencl.pixel import PixelPassRunner

        self.check_open()
        return PixelPassRunner(self, step)

    def count_pass(self, step: CountStep) -> PixelRunner:
        from passgraph.backends.opencl.counts import CountsRunner

        self.check_open()
        return CountsRunner(self, step)

    def own_way(self, step: CountStep) -> str | None:
        if self.is_cpu:
            return "each texel adds to its bin in a table of its row"
        return "each texel adds atomically to its bin in a table of its row, in the memory of a work-group"

    def code(self, step: PixelStep | DrawStep, sizes: Mapping[int, tuple[int, int]]) -> str:
        from passgraph.backends.opencl.pixel import readable_source

        return readable_source(step, sizes) if isinstance(step, PixelStep) else ""

    def sent(
        self, step: PixelStep, outputs: Sequence[Storage], images: Sequence[Storage], block: Block
    ) -> SentPass | None:
        from passgraph.backends.opencl.pixel import PixelPassRunner
        from passgraph.backends.opencl.sent import sent_pass

        runner = PixelPassRunner(self, step)
        runner(outputs, images, block)
        return sent_pass(self.programs, runner, outputs, images, block)

    def draw_pass(self, step: DrawStep) -> DrawRunner:
        from passgraph.backends.opencl.raster import DrawPassRunner

        self.check_open()
        return DrawPassRunner(self, step)

    def finish(self) -> None:
        if not self.closed:
            with self.reported("finishing"):
                self.queue.finish()

    def _close(self) -> None:
        self.finish()
        self.closed = True
        for buffer in list(self.alive.values()):
            self.free(buffer)
        self.scratch.clear()
        self.moves.clear()
        self.programs.close()
        # pyopencl releases a context with its last Python object: drop them all.
        self.queue = None
        self.context = None
        self.programs.context = None
