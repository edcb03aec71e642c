"""Copies of a host's pictures for passes that cannot use them as they are, and what is written back."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

from passgraph.backends.gl import gl_functions as g
from passgraph.backends.gl import state as fixed
from passgraph.backends.gl.backend import GLBackend
from passgraph.backends.gl.capabilities import FRAMEBUFFER_SRGB
from passgraph.backends.gl.gl_functions import Functions
from passgraph.backends.gl.textures import (
    PLAIN,
    Placement,
    Surface,
    Texture,
    bind_surface,
    gl_format_of,
    in_words,
    unbind_surface,
)
from passgraph.backends.gl.transfers import store
from passgraph.errors import BackendError, InputError
from passgraph.formats import Format, curved, float_format
from passgraph.hosts.gl_host_pictures import HostPicture, Region
from passgraph.hosts.gl_pictures import Facts, told_now
from passgraph.hosts.gl_samples import FEWEST_FITTED, Samples

#: Sampler parameters: nearest, clamped to the edge, no comparison of depth.
_NEAREST = {0x2801: g.NEAREST, 0x2800: g.NEAREST, 0x2802: 0x812F, 0x2803: 0x812F, 0x884C: 0}
#: Depth's internal formats → format and type for creating an empty texture.
_DEPTHS = {
    **dict.fromkeys((0x81A5, 0x81A6, 0x81A7, 0x8CAC, 0x1902), (0x1902, 0x1406)),
    0x88F0: (0x84F9, 0x84FA),
    0x84F9: (0x84F9, 0x84FA),
    0x8CAD: (0x84F9, 0x8DAD),
}
_STENCILS = (0x88F0, 0x84F9, 0x8CAD)
_READ_BUFFER = 0xC02


#: A texture for copies is deleted after this many uses of others.
KEPT_FOR = 64


@dataclass
class _Room:
    """A texture for copies."""

    name: int
    kind: object
    size: tuple[int, int]
    free: bool = True
    taken: int = 0


class Copies:
    """Copies of a host's pictures; their textures are reused in later runs."""

    def __init__(self, host: GLBackend) -> None:
        self.host = host
        self.objects = host.objects
        gl = self.objects.gl
        #: Replaces the sampling parameters of the host's textures, which must not change.
        self.sampler = self.objects.new("Sampler")
        for parameter, value in _NEAREST.items():
            gl.SamplerParameteri(self.sampler, parameter, value)
        if gl.has.skips_decoding:
            gl.SamplerParameteri(self.sampler, g.SRGB_DECODE, g.SKIP_DECODE)
        self.samples = Samples(host)
        self._rooms: list[_Room] = []
        self._of_run: dict[tuple[Surface, Region, float], Texture] = {}
        self._takes = 0
        self._framebuffers = [self.objects.new("Framebuffer"), self.objects.new("Framebuffer")]

    def can_sample(self, picture: HostPicture) -> bool:
        """Return True if a pass can sample the host's picture itself."""
        return self._is_plain(picture) and not self._is_decoded(picture)

    @staticmethod
    def _is_plain(picture: HostPicture) -> bool:
        facts = picture.facts
        surface = facts.surface
        plain = surface.kind == "texture" and surface.target == g.TEXTURE_2D and surface.layer <= 0
        return plain and not facts.samples and surface.level == facts.base and not facts.is_changed

    def _is_decoded(self, picture: HostPicture) -> bool:
        """Return True if sampling always decodes the picture from sRGB."""
        return picture.facts.stores_srgb and not self.objects.gl.has.skips_decoding

    def sampled(self, picture: HostPicture, format_: Format, copied: bool = False) -> Texture:
        """Return a texture with the picture's current content; with ``copied``, never the host's texture.

        Raises
        ------
        BackendError, InputError
            If the picture was deleted, or its size or format has changed.
        """
        with self.host.context:
            self.check_same(picture)
            decoded = self._is_decoded(picture)
            in_place = self._is_plain(picture) and (decoded or not copied)
            texture = self.itself(picture, format_) if in_place else self._copied(picture, format_)
            return self._encoded(picture, texture) if decoded else texture

    def itself(self, picture: HostPicture, format_: Format) -> Texture:
        """Return the host's own picture, for sampling or writing with numbers of a format."""
        surface = picture.facts.surface
        return Texture(
            surface.name if surface.kind == "texture" else 0, format_, picture.size,
            gl_format_of(picture.format), picture.placement, picture.region[:2], surface, self.sampler,
        )  # fmt: skip

    def _encoded(self, picture: HostPicture, decoded: Texture) -> Texture:
        """Return the encoded numbers of an sRGB picture from its decoded values; exact for 8 bits."""
        size, format_ = picture.size, picture.format
        encoded = curved(format_, True)
        assert encoded is not None  # OpenGL has such a format
        name = self._taken(format_, size, lambda: self.host.new_texture(format_, size).name)
        own = Texture(name, encoded, size, gl_format_of(format_))
        self.move(replace(decoded, format=float_format(format_.channels)), own)
        return replace(own, format=decoded.format)

    def check_same(self, picture: HostPicture) -> None:
        """Raise an error if the picture was deleted, or its size or format has changed."""
        facts = picture.facts
        surface = facts.surface
        if surface.kind == "window":
            return
        # OpenGL gives the name of a deleted texture to a new one, Mesa 25 at once: it may be one of ours.
        is_ours = (surface.kind.capitalize(), surface.name) in self.objects.alive
        with self.host.context as gl:
            now = None if is_ours else told_now(gl, facts)
            gl.drain()
        if now == facts.reported:
            return
        had = f"{facts.size[0]}x{facts.size[1]}"
        if now is None:
            what = f"is gone, and had {had}"
        elif now[:2] != facts.size:
            what = f"has {now[0]}x{now[1]} pixels now, and had {had}"
        else:
            what = "has another format or number of samples now than"
        raise InputError(
            f"{in_words(surface)} {what} when it was asked for; ask the host anew in each frame: it is cheap"
        )

    def write_changes(self, result: Texture, picture: HostPicture) -> None:
        """Write a result to the pixels of a multisampled picture that it changes."""
        with self.host.context as gl:
            gl.drain()
            self.check_same(picture)
            before = self._copied(picture, picture.format)
            self.samples.write_changes(result, before, picture, self.itself(picture, picture.format))
            self._of_run.clear()

    def _copied(self, picture: HostPicture, format_: Format) -> Texture:
        """Copy the picture on the device, with rows in the same order; samples are resolved."""
        facts = picture.facts
        key = (facts.surface, picture.region, picture.sample_gamma)
        if facts.samples and key in self._of_run:  # unchanged since, as it is written only at the end of a run
            return replace(self._of_run[key], format=format_)
        by_us = facts.samples >= FEWEST_FITTED if facts.is_depth else picture.sample_gamma != 1.0
        # OpenGL ES cannot copy samples, and OpenGL resolves sRGB formats in linear light already.
        if facts.samples and by_us and not facts.stores_srgb and self.objects.gl.TexImage2DMultisample is not None:
            copy = self._resolved(picture, format_)
        else:
            copy = self._blitted(picture, format_)
        self._of_run[key] = copy
        return copy

    def _resolved(self, picture: HostPicture, format_: Format) -> Texture:
        """Resolve all samples by a pass."""
        gl, facts = self.host.context.gl, picture.facts
        copied, copy_texture = self._samples_of(picture), self._room_for(picture, format_, False, not facts.is_depth)
        places = None
        if facts.is_depth:
            bind_surface(gl, g.DRAW_FRAMEBUFFER, self._framebuffers[0], facts.surface, points := (_point(facts),))
            places = self.samples.places(facts.samples)
            unbind_surface(gl, g.DRAW_FRAMEBUFFER, facts.surface, points)
        surface, points = Surface("texture", copy_texture.name), (g.COLOR_ATTACHMENT0,)
        bind_surface(gl, g.FRAMEBUFFER, self._framebuffers[0], surface, points)
        self.host.context.bound.forget()
        self.samples.resolve(picture, copied, self._framebuffers[0], places)
        gl.BindFramebuffer(g.FRAMEBUFFER, self._framebuffers[0])
        unbind_surface(gl, g.FRAMEBUFFER, surface, points)
        return copy_texture

    def _samples_of(self, picture: HostPicture) -> int:
        """Return a texture with the samples of the whole surface: the host's, or a copy."""
        facts, gl = picture.facts, self.host.context.gl
        plain = facts.surface.kind == "texture" and facts.surface.target == g.TEXTURE_2D_MULTISAMPLE
        if plain and facts.surface.layer <= 0 and not facts.is_changed:
            return facts.surface.name
        kind = (facts.internal, facts.samples)
        name = self._taken(kind, facts.size, lambda: self._new_samples(facts))
        surface = Surface("texture", name, g.TEXTURE_2D_MULTISAMPLE)
        self._blit(facts, surface, picture.region, picture.region[:2])
        gl.check(f"copying the samples of {picture}")
        return name

    def _new_samples(self, facts: Facts) -> int:
        gl, name = self.host.context.gl, self.objects.new("Texture")
        gl.ActiveTexture(g.TEXTURE0)
        gl.BindTexture(g.TEXTURE_2D_MULTISAMPLE, name)
        gl.TexImage2DMultisample(g.TEXTURE_2D_MULTISAMPLE, facts.samples, facts.internal, *facts.size, 1)
        gl.BindTexture(g.TEXTURE_2D_MULTISAMPLE, 0)
        gl.check(f"making room for a copy of {facts.samples} samples")
        return name

    def _blitted(self, picture: HostPicture, format_: Format) -> Texture:
        """Copy by one OpenGL blit."""
        gl, facts = self.host.context.gl, picture.facts
        # OpenGL ES resolves only to the same position.
        in_place = gl.has.is_es and facts.samples > 0
        texture = self._room_for(picture, format_, in_place)
        self._blit(facts, Surface("texture", texture.name), picture.region, texture.origin)
        gl.check(f"copying {picture}")
        return texture

    def _blit(self, facts: Facts, into: Surface, region: Region, place: tuple[int, int]) -> None:
        """Blit a part of the host's surface to a position in a texture of ours."""
        host, gl = self.host, self.host.context.gl
        x, y, width, height = region
        fixed.set_common(gl, host.context.bound, 0)
        host.context.bound.forget()
        point = (_point(facts),)
        ends = ((g.DRAW_FRAMEBUFFER, into), (g.READ_FRAMEBUFFER, facts.surface))
        for (target, surface), framebuffer in zip(ends, self._framebuffers, strict=True):
            bind_surface(gl, target, framebuffer, surface, point)
        before = gl.integer(_READ_BUFFER)
        if facts.surface.kind == "window" and not facts.is_depth:
            gl.ReadBuffer(facts.surface.buffer)
        bits = g.DEPTH_BUFFER_BIT if facts.is_depth else g.COLOR_BUFFER_BIT
        left, low = place
        with self._numbers_kept(gl, facts):
            gl.BlitFramebuffer(x, y, x + width, y + height, left, low, left + width, low + height, bits, g.NEAREST)
        if facts.surface.kind == "window" and not facts.is_depth:
            gl.ReadBuffer(before)
        for target, surface in ends:
            unbind_surface(gl, target, surface, point)

    @staticmethod
    @contextmanager
    def _numbers_kept(gl: Functions, facts: Facts) -> Iterator[None]:
        """Keep the numbers of a blit unchanged: OpenGL ES decodes sRGB sources, and encodes only if that is enabled."""
        switches = gl.has.is_es and facts.stores_srgb and not gl.has.always_encodes
        if switches:
            gl.Enable(FRAMEBUFFER_SRGB)
        try:
            yield
        finally:
            if switches:
                gl.Disable(FRAMEBUFFER_SRGB)

    def _room_for(self, picture: HostPicture, format_: Format, in_place: bool, alike: bool = True) -> Texture:
        """Return a texture for a copy of the picture, until the run ends.

        ``in_place``: the texture is as large as the surface, with the copy at the picture's position. ``alike``: it has
        the picture's internal format, else that of ``format_``.
        """
        facts = picture.facts
        size, origin = (facts.size, picture.region[:2]) if in_place else (picture.size, (0, 0))
        placement = Placement(picture.origin == "bottom", size != picture.size)
        internal = facts.internal if alike else gl_format_of(picture.format).internal
        name = self._taken(internal, size, lambda: self._new_texture(internal, size))
        return Texture(
            name, format_, picture.size, gl_format_of(picture.format),
            PLAIN if placement == PLAIN else placement, origin, Surface("texture", name), self.sampler,
        )  # fmt: skip

    def _new_texture(self, internal: int, size: tuple[int, int]) -> int:
        gl, name = self.host.context.gl, self.objects.new("Texture")
        external, type_ = _DEPTHS.get(internal, (0x1908, 0x1406))
        with fixed.transfer(gl, fixed.Rows()):
            gl.BindTexture(g.TEXTURE_2D, name)
            gl.TexParameteri(g.TEXTURE_2D, 0x813D, 0)
            if gl.TexStorage2D is not None:
                gl.TexStorage2D(g.TEXTURE_2D, 1, internal, *size)
            else:
                gl.TexImage2D(g.TEXTURE_2D, 0, internal, *size, 0, external, type_, None)
        gl.check(f"making room for a copy of {size[0]} x {size[1]} pixels")
        return name

    def _taken(self, kind: object, size: tuple[int, int], make: Callable[[], int]) -> int:
        """Return a free texture of a kind, created if there is none; delete those that were unused for long."""
        self._takes += 1
        texture = next((r for r in self._rooms if r.free and (r.kind, r.size) == (kind, size)), None)
        if texture is None:
            texture = _Room(make(), kind, size)
            self._rooms.append(texture)
        texture.free, texture.taken = False, self._takes
        for old in [r for r in self._rooms if r.free and self._takes - r.taken > KEPT_FOR]:
            self._rooms.remove(old)
            self.objects.delete("Texture", old.name)
        return texture.name

    def end_run(self) -> None:
        """Release the copies of this run."""
        for texture in self._rooms:
            texture.free = True
        self._of_run.clear()

    def move(self, source: Texture, destination: Texture) -> None:
        """Copy values from one texture to another, by a pass."""
        host = self.host
        if source.size != destination.size:
            raise BackendError(f"gl: cannot move {source.size} pixels into {destination.size}")
        with host.context as gl:
            gl.drain()
            store(host, source, destination, source.format)
            gl.check(f"moving a {source.format.name} picture")

    @contextmanager
    def plain(self, texture: Texture) -> Iterator[Texture]:
        """Yield a texture of ours with the same picture, valid until the context manager ends."""
        if texture.surface is None:
            yield texture
            return
        own = self.host.make(texture.format, texture.size)
        try:
            self.move(texture, own)
            yield own
        finally:
            self.host.release(own)


def _point(facts: Facts) -> int:
    """Return the attachment point for both ends of a copy."""
    if not facts.is_depth:
        return g.COLOR_ATTACHMENT0
    return g.DEPTH_STENCIL_ATTACHMENT if facts.internal in _STENCILS else g.DEPTH_ATTACHMENT
