"""WebGPU on a host program's wgpu device: its textures are read and written in place."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from numpy.typing import NDArray

from passgraph import arguments
from passgraph.backends.base import READ, DevicePicture, Use
from passgraph.backends.turn import open_driver
from passgraph.backends.webgpu import devices
from passgraph.backends.webgpu.backend import WebGPUBackend
from passgraph.backends.webgpu.textures import Stored, Texture, stored_as
from passgraph.backends.webgpu.transfers import copy_pass, move_depth
from passgraph.errors import BackendError, DeviceMissingError, InputError
from passgraph.formats import FORMATS, Format, curved

#: WebGPU's format → ours with the same numbers.
_KNOWN = {
    stored_as(format_, has_norm16=True).name: format_
    for name, format_ in FORMATS.items()
    if format_.channels != 3 and not format_.srgb and not format_.is_depth
}
_KNOWN["bgra8unorm"] = FORMATS["rgba8"]
_DEPTHS = ("depth32float", "depth24plus", "depth16unorm", "depth24plus-stencil8", "depth32float-stencil8")
_KNOWN |= dict.fromkeys(_DEPTHS, FORMATS["depth32f"])


@dataclass(frozen=True, eq=False)
class HostPicture(DevicePicture):
    """A texture of a host: give it for an input, or in ``into=``.

    Attributes
    ----------
    texture : the ``wgpu.GPUTexture``
    stored : how passes see it
    coded : whether the device decodes and encodes sRGB at each access, so that it is copied on the device
    """

    texture: Any = field(repr=False)
    stored: Stored = field(repr=False)
    coded: bool
    host: Host = field(repr=False)

    def can(self, usage: str) -> bool:
        """Return True if the texture was created with a usage flag."""
        return bool(self.texture.usage & self.host.wgpu.TextureUsage[usage])

    def overlaps(self, other: DevicePicture) -> bool:
        return isinstance(other, HostPicture) and self.texture is other.texture

    def is_in(self, storage: Any) -> bool:
        return isinstance(storage, Texture) and storage.texture is self.texture

    def __str__(self) -> str:
        return f"{self.texture.format} texture of {self.size[0]}x{self.size[1]} pixels"


@dataclass(frozen=True, eq=False)
class HostFramebuffer:
    """A frame that an engine has drawn: its color, and its depth or None."""

    color: HostPicture
    depth: HostPicture | None


class Host(WebGPUBackend):
    """A backend on a host program's wgpu device.

    Runs are submitted to the device's queue, after what the host has submitted; inside of :meth:`recording` they are
    added to a command encoder of the host's.  `close` gives back what is ours; device and textures stay the host's.

    Parameters
    ----------
    device : a ``wgpu.GPUDevice``

    Raises
    ------
    BackendError
        For anything else.

    >>> host = pg.webgpu.Host(device)                                        # doctest: +SKIP
    >>> program = pg.compile(black_and_white(pg.Input("frame")), backend=host)    # doctest: +SKIP
    >>> program.run(frame=texture, into={"black_and_white": other})          # doctest: +SKIP
    """

    #: No state of the host's is touched: WebGPU's commands have none that outlives a pass.
    isolation = "encoder"
    #: Clip space reaches from 0 to 1 in depth.
    zero_to_one = True

    def __init__(self, device: Any) -> None:
        try:
            import wgpu
        except ImportError as error:
            raise DeviceMissingError(f"a host needs wgpu ({error}); install it: {devices.INSTALL_MODULE}") from None
        if not isinstance(device, wgpu.GPUDevice):
            raise BackendError(f"webgpu.Host: takes a wgpu.GPUDevice, got {arguments.shown(device)}")
        open_driver(self.name)
        self._recorded: Any = None
        self._open(device, devices.name_of(device.adapter))
        self.about = f"the caller's WebGPU device, on {self.device_name}"

    @contextmanager
    def recording(self, encoder: Any) -> Iterator[None]:
        """Add the passes of runs to a ``wgpu.GPUCommandEncoder`` of the host's, which submits them.

        Arrays of NumPy are uploaded at once, before all that is recorded, and no results can be read back inside.
        """
        if not isinstance(encoder, self.wgpu.GPUCommandEncoder):
            raise BackendError(f"recording: takes a wgpu.GPUCommandEncoder, got {arguments.shown(encoder)}")
        self.flush()
        before, self._recorded = self._recorded, encoder
        try:
            yield
        finally:
            self._recorded = before

    def texture(self, texture: Any, *, srgb: bool | None = None) -> HostPicture:
        """Return a texture of the host, or of a view, as a picture that programs read and write in place.

        Parameters
        ----------
        texture : a ``wgpu.GPUTexture`` or ``wgpu.GPUTextureView``, two-dimensional, with one sample a pixel
        srgb : True if kernels get 8-bit colors decoded from sRGB; None follows the texture's format

        Raises
        ------
        InputError
            For textures of another device, dimension or sample count, and formats that kernels do not read.
        """
        target = texture.texture if isinstance(texture, self.wgpu.GPUTextureView) else texture
        if not isinstance(target, self.wgpu.GPUTexture):
            raise InputError(f"webgpu.Host.texture: takes a wgpu.GPUTexture or a view, got {arguments.shown(texture)}")
        width, height, layers = target.size
        what = f"webgpu.Host.texture: a {target.format} texture of {width}x{height} pixels"
        if getattr(target, "_device", self.device) is not self.device:
            raise InputError(f"{what} is of another device; give the host the device that made it")
        if target.dimension != "2d" or layers != 1 or target.sample_count != 1:
            raise InputError(
                f"{what} has dimension {target.dimension}, {layers} layer(s) and {target.sample_count} sample(s); "
                "expected 2d, 1 and 1. Resolve or copy it first"
            )
        name = target.format.removesuffix("-srgb")
        if name not in _KNOWN:
            raise InputError(f"{what} cannot be read by kernels; expected one of {', '.join(_KNOWN)}")
        format_, stored = _KNOWN[name], Stored(name, _KNOWN[name])
        is_coded = name != target.format
        if is_coded if srgb is None else arguments.flag(srgb, "webgpu.Host.texture: srgb", InputError):
            encoded = curved(format_, True)
            if encoded is None:
                raise InputError(f"{what} with srgb=True: there is no format {format_.name}_srgb")
            format_ = encoded
        return HostPicture(format_, (width, height), target, stored, is_coded, self)

    # The contract

    def picture_of(self, candidate: object) -> DevicePicture | None:
        if isinstance(candidate, (self.wgpu.GPUTexture, self.wgpu.GPUTextureView)):
            return self.texture(candidate)
        if not isinstance(candidate, HostPicture):
            return None
        if candidate.host is not self:
            raise InputError(f"{candidate} is of another host; ask this program's backend for it")
        return candidate

    def adopt(self, external: Any, format: Format, use: Use = READ) -> Texture | None:
        if not isinstance(external, HostPicture):
            return super().adopt(external, format, use)
        own = external.format
        if use.is_written:
            _check_destination(external, format)
            is_apart = use.is_drawn or (use.is_read and not external.can("TEXTURE_BINDING"))
            if external.coded or is_apart or format.number not in (own.number, "f2", "f4"):
                return None
            return None if use.is_read and format != own else self._storage(external, format)
        _check_source(external, format)
        if external.coded or use.is_overwritten or (format != own and not (own.is_depth and format.number == "f4")):
            return None
        return self._storage(external, format)

    def _storage(self, picture: HostPicture, format_: Format, linear: bool = False) -> Texture:
        """Return a storage in a host's texture; ``linear``: the device decodes and encodes sRGB."""
        texture, stored = picture.texture, picture.stored
        if linear:
            stored = Stored(texture.format, stored.format)
        with self.reported(f"taking a {picture}"):
            aspect = "depth-only" if picture.format.is_depth and "stencil" in stored.name else "all"
            name = None if aspect == "depth-only" else stored.name
            view = texture.create_view(format=name, aspect=aspect, mip_level_count=1)
        return Texture(format_, picture.size, stored, texture, view, view)

    def upload_stored(self, storage: Texture, numbers: NDArray[Any] | HostPicture, format: Format) -> None:
        if not isinstance(numbers, HostPicture):
            super().upload_stored(storage, numbers, format)
            return
        _check_source(numbers, format)
        with self.reported(f"copying a {numbers}"):
            source = self._storage(numbers, numbers.format, numbers.coded)
            if storage.format.is_depth:
                move_depth(self, source, storage)
                storage.is_uploaded = False
            else:
                self._move(source, storage, "encoded" if numbers.coded else "")
            self.encoded()

    def download_into(self, storage: Texture, into: NDArray[Any] | HostPicture, format: Format) -> None:
        if not isinstance(into, HostPicture):
            super().download_into(storage, into, format)
            return
        _check_destination(into, format)
        with self.reported(f"copying a result to a {into}"):
            self._move(storage.readable, self._storage(into, into.format, into.coded), "decoded" if into.coded else "")
            self.encoded()

    def _move(self, source: Texture, destination: Texture, coding: str) -> None:
        """Copy pixels on the device; ``coding`` undoes what the device does to sRGB."""
        name, value = destination.stored.name, "textureLoad(source, vec2<i32>(place.xy), 0)"
        code = _MOVE.replace("VALUE", f"{coding}({value})")
        pipeline, group = copy_pass(self, source, ("move", coding, name), code, [{"format": name}])
        self.draw_triangle(pipeline, group, [destination])

    # What is the host's stays so

    def encoder(self) -> Any:
        self.check_open()
        return super().encoder() if self._recorded is None else self._recorded

    def flush(self) -> None:
        if self._recorded is None:
            super().flush()

    def write(self, buffer: Any, data: bytes) -> None:
        if self._recorded is None:
            super().write(buffer, data)
            return
        source = self.device.create_buffer_with_data(data=data, usage=self.wgpu.BufferUsage.COPY_SRC)
        self._recorded.copy_buffer_to_buffer(source, 0, buffer, 0, len(data))

    def staging(self, size: int) -> Any:
        if self._recorded is not None:
            raise BackendError("webgpu.Host: results cannot be read back inside of recording(); read them behind it")
        return super().staging(size)

    def finish(self) -> None:
        if self._recorded is None:
            super().finish()

    def free(self, resource: Any) -> None:
        """Drop the reference: commands that the host has recorded may still use it, and wgpu frees it after them."""
        self.alive.pop(id(resource), None)

    def _close_device(self) -> None:
        """Do nothing: the device is the host's."""


def _check_source(picture: HostPicture, format_: Format) -> None:
    if not picture.can("TEXTURE_BINDING"):
        raise InputError(f"a {picture} cannot be read: its usage lacks TEXTURE_BINDING; create it with that flag")
    if picture.format.srgb != format_.srgb:
        raise InputError(
            f"a {picture} is read as {picture.format.name} and the input is {format_.name}: only one is sRGB-encoded; "
            f"ask for host.texture(texture, srgb={format_.srgb})"
        )


def _check_destination(picture: HostPicture, format_: Format) -> None:
    if picture.format.is_depth:
        raise InputError(f"into= gives a {picture}, which no pass writes; give a color texture")
    if not picture.can("RENDER_ATTACHMENT"):
        raise InputError(f"into= gives a {picture}: its usage lacks RENDER_ATTACHMENT; create it with that flag")
    picture.check_room(format_, f"ask for host.texture(texture, srgb={format_.srgb})")


_MOVE = """@group(0) @binding(0) var source: texture_2d<f32>;
fn encoded(c: vec4<f32>) -> vec4<f32> {
    let curve = 1.055 * pow(max(c.rgb, vec3<f32>(0.0)), vec3<f32>(1.0 / 2.4)) - 0.055;
    return vec4<f32>(select(curve, c.rgb * 12.92, c.rgb <= vec3<f32>(0.0031308)), c.a);
}
fn decoded(c: vec4<f32>) -> vec4<f32> {
    // Whole numbers of 8 bits: drivers may encode those between by up to 0.6 of a step beside.
    let v = round(clamp(c.rgb, vec3<f32>(0.0), vec3<f32>(1.0)) * 255.0) / 255.0;
    let curve = pow((v + 0.055) / 1.055, vec3<f32>(2.4));
    return vec4<f32>(select(curve, v / 12.92, v <= vec3<f32>(0.04045)), c.a);
}
@fragment
fn main(@builtin(position) place: vec4<f32>) -> @location(0) vec4<f32> {
    return VALUE;
}
"""
