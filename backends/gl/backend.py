"""The backend: storages, transfers and passes on one OpenGL context."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import SNAP_PX, Block, DeviceInfo, FloatBlock, PixelRunner, SentPass, device_number
from passgraph.backends.driver import DriverBackend, chosen_device, stored_clear
from passgraph.backends.gl import gl_functions as g
from passgraph.backends.gl import state as fixed
from passgraph.backends.gl import transfers
from passgraph.backends.gl.capabilities import count_group, loop_trips
from passgraph.backends.gl.context import Context, OwnContext, device_names, device_texts
from passgraph.backends.gl.counts import CountRun, counts
from passgraph.backends.gl.glsl import GLSL
from passgraph.backends.gl.measured import measure_offset_unit
from passgraph.backends.gl.passes import DrawRun, Mesh, PixelRun
from passgraph.backends.gl.programs import Programs
from passgraph.backends.gl.textures import (
    ALL_PLAIN,
    WRAP_MODES,
    GLFormat,
    Objects,
    Texture,
    gl_format_of,
    placements_of,
)
from passgraph.errors import BackendError
from passgraph.formats import Format, padded
from passgraph.graph.draw_state import Geometry
from passgraph.language.native import GLSL as GLSL_ACCURACY
from passgraph.language.scalar import filtered_images
from passgraph.plan.data import CountStep, DrawStep, PixelStep
from passgraph.plan.limits import Limits

#: Texture parameters: nearest for both filters, clamp to edge, one mip level, no depth comparison.
_PARAMETERS = {0x2801: g.NEAREST, 0x2800: g.NEAREST, 0x2802: 0x812F, 0x2803: 0x812F, 0x813D: 0, 0x884C: 0}
#: Vector uniforms of a stage besides the kernel's parameters: the output's size and the guard band's factor.
OTHER_NUMBERS = 8


class GLBackend(DriverBackend):
    """OpenGL 3.3 off screen.  Every call and every run makes the context current, in any thread, and then restores the
    previous one."""

    name: ClassVar[str] = "gl"
    #: How contexts are made.
    contexts: ClassVar[type[OwnContext]] = OwnContext

    def __init__(self, device: str | None = None) -> None:
        self._open(self.contexts(device_index(device, self.contexts), self.turn))

    def _open(self, context: Context) -> None:
        self.in_run = False
        self.context = context
        with self.context as gl:
            self.objects = Objects(gl)
            self.programs = Programs(self.objects)
            self.corner_px = max(SNAP_PX, 2.0 ** -gl.integer(g.SUBPIXEL_BITS))
            self.max_size = gl.integer(g.MAX_TEXTURE_SIZE)
            self.max_viewport = gl.integer(g.MAX_VIEWPORT)
            self.limits = Limits(
                f"{self.name} ({gl.text(g.RENDERER)})",
                side=min(self.max_size, self.max_viewport),
                images=gl.integer(g.MAX_TEXTURE_UNITS),
                targets=min(gl.integer(g.MAX_DRAW_BUFFERS), gl.integer(g.MAX_COLOUR_ATTACHMENTS)),
                vertex_numbers=gl.integer(g.MAX_VERTEX_UNIFORMS) - OTHER_NUMBERS,
                numbers=gl.integer(g.MAX_FRAGMENT_UNIFORMS) - OTHER_NUMBERS,
                rounding=4,
                varyings=gl.integer(g.MAX_VARYINGS),
                filters=gl.has.filtered(WRAP_MODES),
                native=GLSL_ACCURACY,
                contracts=True,
                trips=loop_trips(gl.text(g.RENDERER)),
                not_kept=gl.has.not_kept(),
                not_written=gl.has.not_drawn(),
            )
            #: Invocations that count a row together; 0 without compute shaders.
            self.count_group = count_group(gl)
            self.no_vertices = self.objects.new("VertexArray")
        self._offset_unit: float | None = None
        self.values: Texture | None = None  # staging texture for float32 values; the last one is kept
        self._gl_formats: dict[Format, GLFormat] = {}

    @classmethod
    def devices(cls) -> list[DeviceInfo]:
        try:
            return [DeviceInfo(*names) for names in device_names(cls.contexts)]
        except BackendError as error:
            return [DeviceInfo("none", cls.contexts.api, "", missing=str(error))]

    def device_info(self) -> DeviceInfo:
        with self.context as gl:
            return DeviceInfo(*device_texts(gl))

    # Storages

    def make(self, format: Format, size: tuple[int, int]) -> Texture:
        with self.context as gl:
            gl.drain()
            texture = self.new_texture(format, size)
            self._zero(texture)
            gl.check(f"making a {format.name} target of {size[0]} x {size[1]}")
        return texture

    def new_texture(self, format_: Format, size: tuple[int, int], gl_format: GLFormat | None = None) -> Texture:
        gl_format = gl_format or self._gl_format(format_)
        gl, (width, height) = self.context.gl, size
        what = f"a {format_.name} target of {width} x {height} ({gl_format_bytes(gl_format, size) / 2**20:.0f} MiB)"
        if max(size) > self.max_size:
            raise BackendError(
                f"{self.name}: {what} is too large: this device takes {self.max_size} pixels a side; "
                "use a smaller size, or the numpy backend"
            )
        arguments = (gl_format.internal, width, height, 0, gl_format.external, gl_format.type, None)
        if not gl.has.is_es:
            self._check_fits(what, width, arguments)
        name = self.objects.new("Texture")
        with fixed.transfer(gl, fixed.Rows()):
            gl.BindTexture(g.TEXTURE_2D, name)
            for parameter, value in _PARAMETERS.items():
                gl.TexParameteri(g.TEXTURE_2D, parameter, value)
            gl.TexImage2D(g.TEXTURE_2D, 0, *arguments)
        texture = Texture(name, format_, size, gl_format)
        try:
            gl.check(f"making {what}")
        except BackendError:
            self.objects.forget(texture)
            raise
        return texture

    def _check_fits(self, what: str, width: int, arguments: tuple[Any, ...]) -> None:
        """Raise BackendError if the driver rejects the size; a proxy texture of size 0 says so."""
        gl, accepted = self.context.gl, ctypes.c_int(0)
        gl.TexImage2D(g.PROXY_TEXTURE_2D, 0, *arguments)
        gl.GetTexLevelParameteriv(g.PROXY_TEXTURE_2D, 0, g.TEXTURE_WIDTH, ctypes.byref(accepted))
        if accepted.value != width:
            raise BackendError(
                f"{self.name}: this device has not enough memory for {what}; use a smaller size or format"
            )

    def _gl_format(self, format_: Format) -> GLFormat:
        """Return the GL format; three channels stay three if the driver can draw into them, which is optional."""
        if format_ not in self._gl_formats:
            gl_format = gl_format_of(format_)
            if format_.channels == 3:
                probe = self.new_texture(format_, (1, 1), gl_format)
                try:
                    self.objects.framebuffer((probe,), None)
                except BackendError:
                    gl_format = gl_format_of(padded(format_))
                self.objects.forget(probe)
            self._gl_formats[format_] = gl_format
        return self._gl_formats[format_]

    def draws(self, format_: Format) -> bool:
        """Return True if passes can write pictures of this format here."""
        return format_.is_depth or format_.number not in self.limits.not_written

    def _zero(self, texture: Texture) -> None:
        gl = self.context.gl
        if not self.draws(texture.format):
            width, height = texture.size
            transfers.send(self, texture, np.zeros((height, width, texture.format.channels), texture.format.number))
            return
        is_depth = texture.format.is_depth
        framebuffer = self.objects.framebuffer(() if is_depth else (texture,), texture if is_depth else None)
        fixed.set_common(gl, self.context.bound, framebuffer)
        zero = stored_clear((0.0,) * texture.format.channels, texture.format)
        stencil = 0 if texture.format.stencil else None
        colours = [] if is_depth else [(0, zero)]
        fixed.clear_targets(gl, self.context.bound, colours, 0.0 if is_depth else None, stencil)
        self.unbind()

    def release(self, storage: Any) -> None:
        if self.closed:
            return
        with self.context:
            self.objects.forget(storage)

    def release_geometry(self, geometry: Mesh) -> None:
        if not self.closed:
            with self.context:
                geometry.release()

    # Transfers

    def upload(self, storage: Texture, picture: FloatBlock) -> None:
        """Upload a picture; the stencil of a depth-stencil storage becomes 0."""
        with self._transferring("uploading", storage):
            transfers.send_values(self, storage, picture)

    def upload_stored(self, storage: Texture, numbers: NDArray[Any], format: Format) -> None:
        with self._transferring("uploading", storage):
            transfers.send(self, storage, numbers)

    def download_into(self, storage: Texture, into: NDArray[Any], format: Format) -> None:
        with self._transferring("downloading", storage):
            transfers.receive(self, storage, into)

    @contextmanager
    def _transferring(self, doing: str, storage: Texture) -> Iterator[None]:
        (width, height), name = storage.size, storage.format.name
        with self.context as gl:
            gl.drain()
            yield
            gl.check(f"{doing} a {name} picture of {width} x {height}")

    def copy(self, source: Texture, destination: Texture) -> None:
        self.check_copy(source, destination)
        (width, height), bits = source.size, g.COLOR_BUFFER_BIT
        if source.format.is_depth:
            bits = g.DEPTH_BUFFER_BIT | (g.STENCIL_BUFFER_BIT if source.format.stencil else 0)
        with self.context as gl:
            gl.drain()
            names = [
                self.objects.framebuffer((), t) if t.format.is_depth else self.objects.framebuffer((t,), None)
                for t in (source, destination)
            ]
            fixed.set_common(gl, self.context.bound, names[1])
            gl.BindFramebuffer(g.READ_FRAMEBUFFER, names[0])
            gl.BlitFramebuffer(0, 0, width, height, 0, 0, width, height, bits, g.NEAREST)
            self.unbind()
            gl.check(f"copying a {source.format.name} target")

    # Passes

    @contextmanager
    def running(self) -> Iterator[None]:
        """Make the context current once for all passes inside, which then set only the state that changes."""
        with self.context as gl:
            gl.drain()
            self.in_run = True
            try:
                yield
            finally:
                self.in_run = False
                self.unbind()

    def offset_unit(self) -> float:
        """Return the depth that the driver adds per unit of polygon offset (rule 5: 1); the context must be current."""
        if self._offset_unit is None:
            self._offset_unit = measure_offset_unit(self)
        return self._offset_unit

    def geometry(self, mesh: Geometry) -> Mesh:
        with self.context as gl:
            gl.drain()
            return Mesh(self.objects, mesh)

    def pixel_pass(self, step: PixelStep) -> PixelRunner:
        with self.context as gl:
            gl.drain()
            return PixelRun(self, step)

    def count_pass(self, step: CountStep) -> PixelRunner:
        return CountRun(self, step) if counts(self, step) else self.pixel_pass(step)

    def own_way(self, step: CountStep) -> str | None:
        return "each texel adds to its bin in a table of its row, in a compute shader" if counts(self, step) else None

    def code(self, step: PixelStep | DrawStep, sizes: Mapping[int, tuple[int, int]]) -> str:
        programs = [step.program] if isinstance(step, PixelStep) else [step.vertex, step.fragment]
        varyings = step.varyings if isinstance(step, DrawStep) else ()
        shaders = [GLSL(p, varyings, ALL_PLAIN, self.programs.dialect).shader() for p in programs if p is not None]
        return "\n".join(shader.text for shader in shaders)

    def sent(
        self, step: PixelStep, outputs: Sequence[Texture], images: Sequence[Texture], block: Block
    ) -> SentPass | None:
        textures = [*outputs, *images]
        if (
            placements_of(outputs, images) is not ALL_PLAIN
            or filtered_images(step.program)
            or self.context.gl.has.is_es
        ):
            return None  # pictures of a host, samplers with border rules, or an API that moderngl lacks
        if any(texture.format.is_depth for texture in textures):
            return None
        dialect = self.programs.dialect
        sources = {"pass.vert": dialect.fullscreen, "pass.frag": self.code(step, {})}
        stored = [texture.gl_format for texture in textures]
        described = [(one.internal, one.stored.channels, str(one.dtype)) for one in stored]
        calls = {"outputs": described[: len(outputs)], "images": described[len(outputs) :]}
        buffers = {"floats.bin": block.floats.tobytes(), "ints.bin": block.ints.tobytes()}
        return SentPass("moderngl", sources, buffers, calls, tuple([type_ for *_, type_ in calls["images"]]))

    def sent_draw(
        self, step: DrawStep, outputs: Sequence[Texture], depth: Texture | None, images: Sequence[Texture],
        geometry: Mesh, vertex: Block, fragment: Block,
    ) -> SentPass | None:  # fmt: skip
        from passgraph.backends.gl.sent import sent_draw

        with self.context:
            gl, dialect, run = self.context.gl, self.programs.dialect, DrawRun(self, step)
            return sent_draw(gl, dialect, run, outputs, depth, images, geometry.mesh, vertex, fragment)

    def draw_pass(self, step: DrawStep) -> DrawRun:
        with self.context as gl:
            gl.drain()
            return DrawRun(self, step)

    def unbind(self) -> None:
        """Unbind all of our objects, so that deletes and reads elsewhere are safe."""
        gl = self.context.gl
        self.context.bound.forget()
        gl.BindVertexArray(0)
        gl.UseProgram(0)
        gl.BindFramebuffer(g.FRAMEBUFFER, 0)

    def finish(self) -> None:
        if not self.closed:
            with self.context as gl:
                gl.Finish()

    def _close(self) -> None:
        self.closed = True
        # If the context cannot be made current, its objects are destroyed with it.
        with suppress(BackendError), self.context:
            self.objects.delete_all()
        self.objects.alive.clear()
        self.context.release()


def gl_format_bytes(gl_format: GLFormat, size: tuple[int, int]) -> int:
    return int(gl_format.dtype.itemsize * gl_format.stored.channels * size[0] * size[1])


def device_index(device: str | None, kind: type[OwnContext]) -> int:
    """Return a device's number; names are looked up only for a part of one."""
    number = 0 if device is None else device_number(device)
    return chosen_device(device, [name for name, *_ in device_names(kind)], kind.api) if number is None else number
