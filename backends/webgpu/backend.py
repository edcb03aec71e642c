"""The webgpu backend: one device, its queue, and its objects."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, ClassVar

from numpy.typing import NDArray

from passgraph.backends.base import SNAP_PX, Block, DeviceInfo, DrawRunner, FloatBlock, PixelRunner, SentPass
from passgraph.backends.driver import DriverBackend
from passgraph.backends.turn import check_driver, open_driver
from passgraph.backends.webgpu import devices, transfers
from passgraph.backends.webgpu.counts import CountRun, counts
from passgraph.backends.webgpu.passes import DrawRun, Mesh, PixelRun
from passgraph.backends.webgpu.programs import Programs
from passgraph.backends.webgpu.textures import Stored, Texture, stored_as
from passgraph.backends.webgpu.wgsl import WGSL
from passgraph.errors import BackendError, PassgraphError, UnsupportedError
from passgraph.formats import Format, float_format
from passgraph.graph.draw_state import Geometry
from passgraph.plan.data import CountStep, DrawStep, PixelStep
from passgraph.quantise import numbers_of


class WebGPUBackend(DriverBackend):
    """Runs passes on a WebGPU device.

    ``device`` is a number, or a part of a device's or driver's name, or "chromium" for a device of headless Chromium.
    """

    name: ClassVar[str] = "webgpu"
    corner_px = SNAP_PX

    def __init__(self, device: str | None = None) -> None:
        super().__init__(device)
        check_driver(self.name)
        if device == "chromium":
            from passgraph.backends.webgpu import chromium

            page = chromium.Device(devices.FEATURES)
            self._open(page, page.name)
            self.corner_px = page.corner_px
            return
        adapter = devices.choose(device)
        open_driver(self.name)
        self._open(devices.open_device(adapter), devices.name_of(adapter))

    def _open(self, device: Any, name: str) -> None:
        import wgpu

        self.wgpu = wgpu
        self.device: Any = device
        self.device_name = name
        self.limits = devices.limits_of(device, name)
        self.programs: Any = Programs(device)
        self.draws_norm16 = devices.draws_norm16(device)
        self.alive: dict[int, Any] = {}  # textures and buffers not yet released, by id
        self.in_run = False
        self._encoder: Any = None
        self._staging: Any = None

    @classmethod
    def devices(cls) -> list[DeviceInfo]:
        return devices.device_infos()

    def device_info(self) -> DeviceInfo:
        self.check_open()
        own: DeviceInfo | None = getattr(self.device, "info", None)  # a page of Chromium
        return own or devices.info_of(self.device.adapter)

    # Commands

    def encoder(self) -> Any:
        """Return the encoder of the commands that the next :meth:`flush` submits."""
        self.check_open()
        if self._encoder is None:
            self._encoder = self.device.create_command_encoder()
        return self._encoder

    def draw_triangle(self, pipeline: Any, group: Any, outputs: Sequence[Texture]) -> None:
        """Encode one triangle over whole targets."""
        colors = [{"view": output.view, "load_op": "load", "store_op": "store"} for output in outputs]
        encoded = self.encoder().begin_render_pass(color_attachments=colors)
        encoded.set_pipeline(pipeline)
        encoded.set_bind_group(0, group)
        encoded.draw(3)
        encoded.end()

    def encoded(self) -> None:
        """Submit an encoded pass immediately if no run is in progress."""
        if not self.in_run:
            self.flush()

    def flush(self) -> None:
        """Submit the encoded commands."""
        encoder, self._encoder = self._encoder, None
        if encoder is not None:
            self.device.queue.submit([encoder.finish()])

    @contextmanager
    def running(self) -> Iterator[None]:
        """Submit the passes of a run together."""
        if self.in_run:
            yield
            return
        self.in_run = True
        try:
            yield
            with self.reported("running passes"):
                self.flush()
        finally:
            self.in_run = False
            self._encoder = None

    @contextmanager
    def reported(self, doing: str) -> Iterator[None]:
        """Convert wgpu's errors to BackendError with the failed operation."""
        try:
            yield
        except PassgraphError:
            raise
        except Exception as error:
            self._encoder = None
            lines = [line.strip() for line in str(error).splitlines() if line.strip()]
            raise BackendError(f"webgpu: {self.device_name} failed while {doing}: {'; '.join(lines[:4])}") from None

    # Memory

    def buffer(self, size: int, usage: str, what: str) -> Any:
        """Return a buffer of a number of bytes that copies may write; registered until :meth:`free`."""
        self.check_open()
        flags = self.wgpu.BufferUsage
        with self.reported(f"making {what} of {size:,} bytes"):
            buffer = self.device.create_buffer(size=-(-size // 4) * 4, usage=flags[usage] | flags.COPY_DST)
        self.alive[id(buffer)] = buffer
        return buffer

    def write(self, buffer: Any, data: bytes) -> None:
        """Write a buffer, before the commands that are encoded next."""
        self.device.queue.write_buffer(buffer, 0, data)

    def free(self, resource: Any) -> None:
        if resource is not None and not self.turn.lost and self.alive.pop(id(resource), None) is not None:
            resource.destroy()

    def staging(self, size: int) -> Any:
        """Return the buffer for readback."""
        if self._staging is None or self._staging.size < size:
            self.free(self._staging)
            self._staging = None
            self._staging = self.buffer(size, "MAP_READ", "a buffer for results")
        return self._staging

    def stored(self, format_: Format) -> Stored:
        return stored_as(format_, self.draws_norm16)

    def steps(self, step: PixelStep | DrawStep) -> tuple[int, ...]:
        """Return, for each image of a step, the number by which the device divides its stored numbers, or 0."""
        return tuple([self.stored(format_).format.steps for format_ in step.image_formats])

    def make(self, format: Format, size: tuple[int, int]) -> Texture:
        self.check_open()
        texture = self._texture(format, size)
        if texture.padded:
            with self.reported("clearing a target"):
                color = {"view": texture.view, "load_op": "clear", "store_op": "store", "clear_value": (0, 0, 0, 1)}
                self.encoder().begin_render_pass(color_attachments=[color]).end()
                self.encoded()
        return texture

    def _texture(self, format_: Format, size: tuple[int, int]) -> Texture:
        stored, usage = self.stored(format_), self.wgpu.TextureUsage
        uses = usage.TEXTURE_BINDING | usage.COPY_SRC | usage.COPY_DST | usage.RENDER_ATTACHMENT
        what = f"a {format_.name} target of {size[0]} x {size[1]}"
        if format_.stencil and devices.STENCIL not in self.device.features:
            raise UnsupportedError(
                f"webgpu: {what} takes the feature {devices.STENCIL}, and {self.device_name} lacks it"
            )
        with self.reported(f"making {what}"):
            texture = self.device.create_texture(size=(*size, 1), format=stored.name, usage=uses)
            view = texture.create_view()
            read = texture.create_view(aspect="depth-only", format="depth32float") if format_.is_depth else view
        self.alive[id(texture)] = texture
        return Texture(format_, size, stored, texture, view, read)

    def release(self, storage: Texture) -> None:
        if self.closed:
            return
        self.flush()
        self.free(storage.texture)
        if storage.values is not None:
            self.free(storage.values.texture)

    def release_geometry(self, geometry: Mesh) -> None:
        if not self.closed:
            self.flush()
            geometry.release()

    # Transfers

    def upload(self, storage: Texture, picture: FloatBlock) -> None:
        self.upload_stored(storage, numbers_of(picture, storage.format), storage.format)

    def upload_stored(self, storage: Texture, numbers: NDArray[Any], format: Format) -> None:
        self.check_open()
        with self.reported("uploading a picture"):
            if storage.format.is_depth:
                self._values_of(storage)
                storage.is_uploaded = True
            transfers.send(self, storage.readable, numbers)

    def download_into(self, storage: Texture, into: NDArray[Any], format: Format) -> None:
        self.check_open()
        with self.reported("downloading a picture"):
            found = storage.readable
            if found.format.stencil:  # a command would copy both parts
                found = self._values_of(storage)
                transfers.move_depth(self, storage, found)
            transfers.receive(self, found, into)

    def _values_of(self, storage: Texture) -> Texture:
        """Return the float32 texture that accompanies a depth texture."""
        if storage.values is None:
            storage.values = self._texture(float_format(1), storage.size)
        return storage.values

    def copy(self, source: Texture, destination: Texture) -> None:
        self.check_copy(source, destination)
        with self.reported("copying a picture"):
            if source.format.is_depth:
                self.as_depth(source)
            places = {"texture": source.texture}, {"texture": destination.texture}
            self.encoder().copy_texture_to_texture(*places, (*source.size, 1))
            destination.is_uploaded = False
            self.encoded()

    def as_depth(self, storage: Texture) -> None:
        """Move uploaded values into the depth texture itself; a stencil becomes 0."""
        if not storage.is_uploaded or storage.values is None:
            return
        transfers.move_depth(self, storage.values, storage)
        storage.is_uploaded = False

    # Passes

    def geometry(self, mesh: Geometry) -> Mesh:
        self.check_open()
        return Mesh(self, mesh)

    def pixel_pass(self, step: PixelStep) -> PixelRunner:
        self.check_open()
        return PixelRun(self, step)

    def count_pass(self, step: CountStep) -> PixelRunner:
        return CountRun(self, step) if counts(self, step) else self.pixel_pass(step)

    def own_way(self, step: CountStep) -> str | None:
        return "each texel adds to its bin in a table of its row, in a compute shader" if counts(self, step) else None

    def sent(
        self, step: PixelStep, outputs: Sequence[Texture], images: Sequence[Texture], block: Block
    ) -> SentPass | None:
        from passgraph.backends.webgpu.sent import sent_pass

        return sent_pass(self.code(step, {}), self.device.features, step, outputs, images, block)

    def draw_pass(self, step: DrawStep) -> DrawRunner:
        self.check_open()
        return DrawRun(self, step)

    def check_draw(self, step: DrawStep) -> None:
        """Check that this device can blend the targets of a draw, and offset its depth.

        Raises
        ------
        UnsupportedError
            With the draw, and the feature that the device lacks.
        """
        units = step.state.polygon_offset[1]
        if units != int(units) or abs(units) >= 1 << 31:
            raise UnsupportedError(
                f"webgpu: draw {step.name!r} has a polygon offset of {units:g} units; WebGPU takes whole numbers of 32 "
                "bits; round it"
            )
        for blend, format_ in zip(step.state.blend, step.output_formats, strict=False):
            name = self.stored(format_).name
            if blend is None or not name.endswith("32float"):
                continue
            needed = "texture-formats-tier1" if format_.steps else devices.BLENDS
            if needed not in self.device.features:
                raise UnsupportedError(
                    f"webgpu: draw {step.name!r} blends into {format_.name}, which takes the feature {needed}, and "
                    f"{self.device_name} lacks it; give the target a format of 8 bits, or one such as rgba16f"
                )

    def code(self, step: PixelStep | DrawStep, sizes: Mapping[int, tuple[int, int]]) -> str:
        steps = self.steps(step)
        if isinstance(step, PixelStep):
            return WGSL(step.program, (), steps).shader().text
        count = len(step.vertex.images)
        stages = (step.vertex, steps[:count]), (step.fragment, steps[count:])
        return "\n".join(WGSL(p, step.varyings, read).shader().text for p, read in stages if p is not None)

    def finish(self) -> None:
        if not self.closed:
            with self.reported("finishing"):
                # A buffer can be mapped once the last command that writes it has completed.
                buffer = self.staging(4)
                self.encoder().clear_buffer(buffer, 0, 4)
                self.flush()
                buffer.map_sync("READ", 0, 4)
                buffer.unmap()

    def after_fork(self) -> bool:
        """Keep a child process from releasing the device at exit: that would wait for threads of the parent."""
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(self.device))
        return False

    def _close(self) -> None:
        self.finish()
        self.closed = True
        for resource in list(self.alive.values()):
            self.free(resource)
        self._close_device()
        # wgpu releases a device with its last Python object: drop them all.
        self.programs = self.device = self._staging = None

    def _close_device(self) -> None:
        self.device.destroy()
