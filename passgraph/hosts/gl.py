"""OpenGL in a host program's context: an engine's pictures are read and written in place.

The engine's state is unchanged. Passes run in a context of ours that shares its objects; where none can be created, the
engine's state is saved before and restored afterwards.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from passgraph import arguments
from passgraph.backends.base import READ, DevicePicture, Use
from passgraph.backends.gl import gl_functions as g
from passgraph.backends.gl.backend import GLBackend
from passgraph.backends.gl.context import Current
from passgraph.backends.gl.textures import Surface, Texture, in_words
from passgraph.errors import BackendError, InputError
from passgraph.formats import Format, colour_format, curved, float_format
from passgraph.graph.targets import checked_size
from passgraph.hosts.gl_copies import Copies
from passgraph.hosts.gl_host_pictures import HostFramebuffer, HostPicture, Origin, Region
from passgraph.hosts.gl_isolation import GuardedContext, HostContext, SiblingContext, current_state
from passgraph.hosts.gl_pictures import RegionError, attached, facts_of

Isolation = Literal["auto", "sibling", "guard"]


class Host(GLBackend):
    """A backend in a host program's context of OpenGL (3.3 or newer) or OpenGL ES (3.0 or newer).

    Use it in the thread and with the context in which it was created; a run elsewhere raises BackendError. Between runs
    no object or state of ours is current, bound or set. `close` deletes our objects; with contexts of EGL and GLX it
    may be called anywhere. A guarded host deletes them only if its context is current; else they are deleted with that
    context.

    >>> host = pg.gl.Host.current()                                          # doctest: +SKIP
    >>> program = pg.compile(black_and_white(pg.Input("frame")), backend=host)    # doctest: +SKIP
    >>> program.run(frame=host.framebuffer(), into={"black_and_white": host.framebuffer()})   # doctest: +SKIP
    """

    @classmethod
    def current(cls, isolation: Isolation = "auto") -> Host:
        """Return the host whose context is current in this thread.

        Parameters
        ----------
        isolation
            ``"sibling"``: passes run in a context of ours that shares its objects. ``"guard"``: they run in the host's
            context, whose state is restored. ``"auto"``: a sibling if the system can create one, else a guard.

        Raises
        ------
        BackendError
            If no context is current, no sibling can be created, or the context is older than OpenGL 3.3 and OpenGL ES
            3.0.
        """
        return cls(isolation)

    def __init__(self, isolation: Isolation = "auto") -> None:
        arguments.one_of(isolation, "isolation", get_args(Isolation))
        self.isolation: str = "guard"
        context: HostContext | None = None
        if isolation != "guard":
            try:
                context = SiblingContext(self.turn)
                self.isolation = "sibling"
            except BackendError:
                current_state(Current())  # raises if no context is current
                if isolation == "sibling":
                    raise
        self._open(context or GuardedContext(self.turn))
        self._of_host.at_release(self.objects.delete_all)
        self.about = self.context.about

    def _open(self, context: Any) -> None:
        super()._open(context)
        with self.context as gl:
            self._scratch = self.objects.new("Framebuffer")
            self.copies = Copies(self)
            gl.BindFramebuffer(g.FRAMEBUFFER, 0)

    # What the host has

    def framebuffer(
        self,
        name: int | None = None,
        *,
        region: Region | None = None,
        size: tuple[int, int] | None = None,
        origin: Origin = "bottom",
        srgb: bool | None = None,
        sample_gamma: float = 1.0,
    ) -> HostFramebuffer:
        """Return a framebuffer of the host, as it is now.

        Parameters
        ----------
        name
            OpenGL's name; None takes the framebuffer bound for drawing.
        region
            (x, y, width, height) from the bottom left pixel, such as the viewport of one of several views.
        size
            (width, height), where OpenGL cannot report it: framebuffer 0, and textures in OpenGL ES 3.0.
        origin
            ``"bottom"`` if the first row in memory is the picture's bottom row, as nearly everywhere.
        srgb
            True if colors are sRGB-encoded; None takes what OpenGL reports. Many engines store encoded colors in linear
            formats.
        sample_gamma
            Samples of a pixel are averaged as colors to this power. Use the engine's own value, so that the effect sees
            edges as the engine shows them.

        Raises
        ------
        BackendError
            If the framebuffer does not exist, has no attachment, or has no pixels.
        """
        check_asked(name, region, size, origin, srgb)
        sample_gamma = arguments.real(sample_gamma, "sample_gamma", 0.1, 10.0, InputError)
        self.context.check_current()
        gl = self.context.gl
        if name and not gl.IsFramebuffer(name):
            raise BackendError(f"gl: there is no framebuffer {name} in the host's context, or it was never bound")
        if name is None:
            colour, depth = attached(gl, depth=False), attached(gl, depth=True)
        else:
            bound = gl.integer(0x8CA6)
            gl.BindFramebuffer(g.DRAW_FRAMEBUFFER, name)
            try:
                colour, depth = attached(gl, depth=False), attached(gl, depth=True)
            finally:
                gl.BindFramebuffer(g.DRAW_FRAMEBUFFER, bound)
        if colour is None and depth is None:
            raise BackendError("gl: the framebuffer has nothing attached that a pass could read or write")
        if size is None and (colour or depth).kind == "window":  # type: ignore[union-attr]
            size = self._window_size()
        with self.context.looking():
            return HostFramebuffer(
                None
                if colour is None
                else replace(self._picture(colour, size, region, origin, srgb), sample_gamma=sample_gamma),
                None if depth is None else self._picture(depth, size, region, origin, None),
            )

    def texture(
        self,
        name: int,
        *,
        region: Region | None = None,
        size: tuple[int, int] | None = None,
        origin: Origin = "bottom",
        srgb: bool | None = None,
    ) -> HostPicture:
        """Return a texture of the host by OpenGL's name, as it is now; parameters as in :meth:`framebuffer`.

        ``region`` is for textures that are larger than their picture, such as those padded to powers of two.
        """
        check_asked(name, region, size, origin, srgb)
        if name is None:
            raise InputError("texture: give the name that OpenGL has for it, a whole number")
        return self._picture(Surface("texture", int(name), target=0), size, region, origin, srgb)

    @property
    def zero_to_one(self) -> bool | None:
        """Return True if ``glClipControl`` sets a clip space with depth from 0 to 1 now; else None."""
        return (
            self.context.gl.ClipControl is not None and self.context.gl.integer(g.CLIP_DEPTH_MODE) == g.ZERO_TO_ONE
        ) or None

    def _window_size(self) -> tuple[int, int] | None:
        current = self._of_host.current
        state = current_state(current)
        return current.system(state).surface_size(state)

    @property
    def _of_host(self) -> HostContext:
        assert isinstance(self.context, HostContext)
        return self.context

    def _picture(
        self, surface: Surface, size: tuple[int, int] | None, region: Region | None, origin: Origin,
        srgb: bool | None,
    ) -> HostPicture:  # fmt: skip
        with self.context.looking() as gl:
            facts = facts_of(gl, surface, self._scratch, size)
            gl.drain()
        x, y, width, height = region = region or (0, 0, *facts.size)
        if min(x, y) < 0 or min(width, height) < 1 or x + width > facts.size[0] or y + height > facts.size[1]:
            raise RegionError(
                f"region {region} is not inside of {in_words(facts.surface)}, which has {facts.size[0]}x"
                f"{facts.size[1]} pixels; give (x, y, width, height) from its lowest left pixel"
            )
        format_ = facts.format if srgb is None or facts.is_depth else _encoded(facts.format, srgb)
        return HostPicture(format_, (width, height), region, origin, facts, self)

    # The contract

    def picture_of(self, candidate: object) -> DevicePicture | None:
        if isinstance(candidate, HostFramebuffer):
            if candidate.color is None:
                raise InputError("the framebuffer draws no colour; give its .depth, or another one")
            candidate = candidate.color
        if not isinstance(candidate, HostPicture):
            return None
        if candidate.host is not self:
            raise InputError(f"{candidate} is of another host; ask this program's backend for it")
        return candidate

    def adopt(self, external: Any, format: Format, use: Use = READ) -> Texture | None:
        if not isinstance(external, HostPicture):
            return super().adopt(external, format, use)
        return self._room(external, format, use) if use.is_written else self._read(external, format, use)

    def _read(self, picture: HostPicture, format_: Format, use: Use) -> Texture | None:
        """Return a texture to sample: the host's own, or a copy on the device if it cannot be sampled or is
        overwritten."""
        readable = picture.format == format_ or (
            (format_.number, format_.channels) == ("f4", picture.format.channels) and not picture.format.srgb
        )
        return self.copies.sampled(picture, format_, use.is_overwritten) if readable else None

    def _room(self, picture: HostPicture, format_: Format, use: Use) -> Texture | None:
        check_room(picture, format_)
        self.copies.check_same(picture)
        if use.is_drawn or use.beside_others or picture.samples or self._is_encoded(picture):
            return None
        if use.is_read and (picture.format != format_ or not self.copies.can_sample(picture)):
            return None
        return self.copies.itself(picture, format_)

    def _is_encoded(self, picture: HostPicture) -> bool:
        """Return True if the device encodes to sRGB what passes write to the picture."""
        return picture.facts.stores_srgb and self.context.gl.has.always_encodes

    def upload_stored(self, storage: Texture, numbers: NDArray[Any] | HostPicture, format: Format) -> None:
        if not isinstance(numbers, HostPicture):
            super().upload_stored(storage, numbers, format)
            return
        source = self.copies.sampled(numbers, numbers.format)
        self.copies.move(source, storage)

    def download_into(self, storage: Texture, into: NDArray[Any] | HostPicture, format: Format) -> None:
        if isinstance(into, HostPicture):
            check_room(into, format)
            written = _as_wide(format, into.format)
            if into.samples and not self._is_encoded(into):
                self.copies.write_changes(storage, into)
                return
            if self._is_encoded(into):  # the device gets linear values, which it encodes to the same numbers
                storage = replace(storage, format=_encoded(storage.format, True))
                written = float_format(into.format.channels)
            self.copies.move(storage, self.copies.itself(into, written))
        else:
            with self.copies.plain(storage) as own:
                super().download_into(own, into, format)

    def copy(self, source: Texture, destination: Texture) -> None:
        if source.surface is None and destination.surface is None:
            super().copy(source, destination)
        else:
            self.copies.move(source, destination)

    def release(self, storage: Any) -> None:
        self._give_back(lambda: super(Host, self).release(storage))

    def release_geometry(self, geometry: Any) -> None:
        self._give_back(lambda: super(Host, self).release_geometry(geometry))

    def _give_back(self, give_back: Callable[[], None]) -> None:
        """Release in the host's context: now if it is current, else when it next is, or when this host closes."""
        try:
            give_back()
        except BackendError:
            self.turn.later(give_back)

    def pixel_pass(self, step: Any) -> Any:
        self._need_units(step.images)
        return super().pixel_pass(step)

    def draw_pass(self, step: Any) -> Any:
        self._need_units(step.images)
        return super().draw_pass(step)

    def _need_units(self, images: Sequence[Any]) -> None:
        if isinstance(self.context, GuardedContext):
            self.context.need_units(len(images))

    @contextmanager
    def running(self) -> Iterator[None]:
        try:
            with super().running():
                yield
        finally:
            self.copies.end_run()

    def unbind(self) -> None:
        super().unbind()
        gl = self.context.gl
        if self.objects.attached:
            gl.BindFramebuffer(g.FRAMEBUFFER, self.objects.for_foreign)
            self.objects.detach()
            gl.BindFramebuffer(g.FRAMEBUFFER, 0)


def check_asked(name: object, region: object, size: object, origin: object, srgb: object) -> None:
    """Check the arguments of a picture before any OpenGL call."""
    if name is not None:
        if isinstance(getattr(name, "glo", None), int):
            raise InputError("the name of OpenGL's object is a whole number; moderngl's objects have it as .glo")
        arguments.whole_number(name, "the name of OpenGL's object", 0, (1 << 32) - 1, InputError)
    if size is not None:
        checked_size(size, "a picture of the host's")
    if region is not None:
        for number in arguments.several(region, (int, np.integer), "region", "(x, y, width, height)", InputError):
            arguments.whole_number(number, "a number of region", 0, (1 << 31) - 1, InputError)
        if len(tuple(region)) != 4:  # type: ignore[arg-type]
            raise InputError(f"region must be (x, y, width, height), got {arguments.shown(region)}")
    arguments.one_of(origin, "origin", get_args(Origin), InputError)
    if srgb is not None:
        arguments.flag(srgb, "srgb", InputError)


def check_room(picture: HostPicture, format_: Format) -> None:
    """Raise InputError if a target of a format cannot be written to the picture."""
    if picture.facts.is_depth:
        raise InputError(f"{picture} is depth, which no pass writes; give a colour picture in into=")
    own = f"rgba8{'_srgb' if picture.format.srgb else ''}"
    picture.check_room(format_, f"give the target format {own}, or ask for the picture with srgb={format_.srgb}")


def _encoded(format_: Format, srgb: bool) -> Format:
    """Return the sRGB-encoded, or linear, format of the same numbers."""
    result = curved(format_, srgb)
    if result is None:
        raise InputError(
            f"srgb={srgb}: there is no format {format_.name}_srgb; colours of {format_.name} are not encoded"
        )
    return result


def _as_wide(format_: Format, picture: Format) -> Format:
    """Return a target's format with as many channels as its destination picture."""
    wide = colour_format(format_.number, picture.channels)
    result = None if wide is None else curved(wide, format_.srgb)
    assert result is not None  # every channel type has formats of three and of four channels
    return result


__all__ = ["Host", "HostFramebuffer", "HostPicture", "Isolation", "Origin", "Region"]
