"""Work beside an engine in OpenGL: guard its context's state, or share objects with a context of our own."""

from __future__ import annotations

import ctypes
import weakref
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

from passgraph.backends.gl import gl_functions as g
from passgraph.backends.gl import state as fixed
from passgraph.backends.gl.context import (
    Canary,
    Context,
    Current,
    OtherContextError,
    destroy_later,
    destroy_left,
    destroy_now,
)
from passgraph.backends.gl.gl_functions import Functions
from passgraph.backends.gl.windowing import State
from passgraph.backends.turn import Turn, open_driver
from passgraph.errors import BackendError
from passgraph.hosts.gl_pictures import texture_targets

NO_CONTEXT = (
    "no OpenGL context is current in this thread; ask for the host where the engine draws: in its draw callback, or "
    "after it has made its context current"
)
NO_SYSTEM = (
    "an engine's OpenGL context is found through EGL or GLX, and this system has no EGL; install it (libegl1 on "
    "Debian), or pass pictures through arrays: pg.compile(…, backend='gl')"
)
OTHER_CONTEXT = (
    "gl: another OpenGL context is current in this thread than the one that this host was made in; make that current, "
    "or, where the engine has made a new one (a window moved or went fullscreen), close this host and ask for "
    "Host.current() anew"
)


def current_state(current: Current) -> State:
    """Return the current state of this thread.

    Raises
    ------
    BackendError
        If no context is current, or if EGL is missing.
    """
    if current.egl is None:
        raise BackendError(f"gl: {NO_SYSTEM}")
    state = current.state()
    if state is None:
        raise BackendError(f"gl: {NO_CONTEXT}")
    return state


class HostContext(Context):
    """Base of contexts that are entered while the host's context is current.

    Attributes
    ----------
    current : reads and changes the current context
    host : the host's context when this was created
    canary : detects another context at the same address
    """

    canary: Canary

    def __init__(self, turn: Turn | None = None) -> None:
        open_driver("gl")
        destroy_left()
        super().__init__(turn)
        self.current = Current()
        self.host = current_state(self.current)

    def check_current(self) -> None:
        super().check_current()
        self.found()

    def found(self) -> State:
        """Return the host's context, which must be current, with the surfaces that it draws to.

        Raises
        ------
        BackendError
            If no context is current, or another one.
        """
        now = current_state(self.current)
        if (now.context, now.display) != (self.host.context, self.host.display):
            raise OtherContextError(OTHER_CONTEXT)
        self.canary.look()
        return now

    def at_release(self, delete: Callable[[], None]) -> None:
        """Register a function that deletes our shared objects, called in the context at its release."""
        raise NotImplementedError


_PASS_SWITCHES = (fixed.CULL_FACE, fixed.DEPTH_TEST, fixed.STENCIL_TEST, fixed.POLYGON_OFFSET_FILL)
#: Texture targets that queries may bind, with the parameters that report their bindings.
_TEXTURE_TARGETS = {g.TEXTURE_2D: 0x8069, **g.OTHER_TEXTURES}
_PIXEL_STORE = (0xCF2, 0xCF3, 0xCF4, 0xCF5, 0xD02, 0xD03, 0xD04, 0xD05)
_VIEWPORT, _VIEWPORTS, _COLOUR_MASK, _DEPTH_RANGE = 0xBA2, 16, 0xC23, 0xB70
_STENCIL = {
    g.FRONT: (0xB92, 0xB97, 0xB93, 0xB94, 0xB95, 0xB96, 0xB98),
    g.BACK: (0x8800, 0x8CA3, 0x8CA4, 0x8801, 0x8802, 0x8803, 0x8CA5),
}
_BLEND_TERMS = (0x80C9, 0x80C8, 0x80CB, 0x80CA, 0x8009, 0x883D)
_FEEDBACK_ACTIVE, _FEEDBACK_PAUSED = 0x8E24, 0x8E23
_CLIP_ORIGIN, _LOWER_LEFT, _MINUS_ONE_TO_ONE = 0x935C, 0x8CA1, 0x935E
_STORAGE, _STORAGE_START, _STORAGE_SIZE = 0x90D3, 0x90D4, 0x90D5
_CLAMPS, _FALSE = (0x891A, 0x891B, 0x891C), 0
_ALL_STENCIL = 0xFFFFFFFF

Restore = Callable[[], object]


class Guard:
    """Save and restore the state of a context."""

    def __init__(self, gl: Functions, units: int) -> None:
        self.gl, self.units = gl, units
        self.buffers = gl.integer(g.MAX_DRAW_BUFFERS)
        all_switches = (*gl.has.off, *_PASS_SWITCHES, *gl.has.never_ours)
        self.switches = [switch for switch in all_switches if switch != fixed.SCISSOR_TEST]
        self.pixel_store = _PIXEL_STORE if gl.has.is_es else (*_PIXEL_STORE, *fixed.SWAPPED_BYTES)
        self.bindings = {target: _TEXTURE_TARGETS[target] for target in texture_targets(gl.has)}
        clamps = _CLAMPS if gl.has.is_compatible else _CLAMPS[2:]
        self.clamps = () if gl.ClampColor is None else clamps
        self.has_viewports = gl.ViewportIndexedf is not None
        self.has_clip_control = gl.ClipControl is not None

    def save(self) -> list[Restore]:
        """Save the state: return the functions that restore it, to be called in reverse. Afterwards the state is
        neutral.

        Raises
        ------
        BackendError
            In the middle of the host's transform feedback, in which nothing else can be drawn.
        """
        gl = self.gl
        if gl.integer(_FEEDBACK_ACTIVE) and not gl.integer(_FEEDBACK_PAUSED):
            raise BackendError(
                "gl: the host's transform feedback is active, in which no pass can run; run the program before it "
                "begins or after it ends"
            )
        saved: list[Restore] = []
        for part in (
            self._bindings,
            self._buffers,
            self._textures,
            self._switches,
            self._colours,
            self._geometry,
            self._stencil,
        ):
            saved += part()
        self._neutralise()
        return saved

    def _bindings(self) -> Iterable[Restore]:
        gl, ask = self.gl, self.gl.integer
        for what, target in ((0x8CA6, g.DRAW_FRAMEBUFFER), (0x8CAA, g.READ_FRAMEBUFFER)):
            yield _later(gl.BindFramebuffer, target, ask(what))
        for what, target in (
            (0x8894, g.ARRAY_BUFFER),
            (0x88ED, g.PIXEL_PACK_BUFFER),
            (0x88EF, g.PIXEL_UNPACK_BUFFER),
        ):
            yield _later(gl.BindBuffer, target, ask(what))
        yield _later(gl.UseProgram, ask(0x8B8D))
        yield _later(gl.BindVertexArray, ask(0x85B5))
        yield _later(gl.BindRenderbuffer, g.RENDERBUFFER, ask(0x8CA7))
        for what in self.pixel_store:
            yield _later(gl.PixelStorei, what, ask(what))

    def _buffers(self) -> Iterable[Restore]:
        """Save the bindings of shader storage buffers; an indexed binding also changes the generic one."""
        gl, number, wide = self.gl, ctypes.c_int(0), ctypes.c_int64(0)
        if not gl.has.has_buffers:
            return
        yield _later(gl.BindBuffer, g.SHADER_STORAGE_BUFFER, gl.integer(_STORAGE))
        gl.GetIntegeri_v(_STORAGE, 0, ctypes.byref(number))
        part = []
        for what in (_STORAGE_START, _STORAGE_SIZE):
            gl.GetInteger64i_v(what, 0, ctypes.byref(wide))
            part.append(wide.value)
        if part[1]:
            yield _later(gl.BindBufferRange, g.SHADER_STORAGE_BUFFER, 0, number.value, *part)
        else:
            yield _later(gl.BindBufferBase, g.SHADER_STORAGE_BUFFER, 0, number.value)

    def _textures(self) -> Iterable[Restore]:
        gl = self.gl
        yield _later(gl.ActiveTexture, gl.integer(0x84E0))
        for unit in range(self.units):
            gl.ActiveTexture(g.TEXTURE0 + unit)
            yield _later(gl.BindSampler, unit, gl.integer(0x8919))
            # Queries bind textures of other targets on unit 0 only.
            for target, binding in self.bindings.items() if unit == 0 else [(g.TEXTURE_2D, 0x8069)]:
                yield _later(gl.BindTexture, target, gl.integer(binding))
            yield _later(gl.ActiveTexture, g.TEXTURE0 + unit)

    def _switches(self) -> Iterable[Restore]:
        gl = self.gl
        for switch in self.switches:
            yield _later(gl.Enable if gl.IsEnabled(switch) else gl.Disable, switch)
        for viewport in range(_VIEWPORTS if self.has_viewports else 1):
            on = gl.IsEnabledi(fixed.SCISSOR_TEST, viewport) if self.has_viewports else gl.IsEnabled(fixed.SCISSOR_TEST)
            change = (gl.Enablei if on else gl.Disablei) if self.has_viewports else (gl.Enable if on else gl.Disable)
            yield _later(change, fixed.SCISSOR_TEST, *([viewport] if self.has_viewports else []))

    def _colours(self) -> Iterable[Restore]:
        gl, apart = self.gl, self.gl.BlendFuncSeparatei is not None
        mask, number = (ctypes.c_int * 4)(), ctypes.c_int(0)
        if gl.ColorMaski is None:
            gl.GetIntegerv(_COLOUR_MASK, mask)
            yield _later(gl.ColorMask, *mask)
            yield _later(gl.Enable if gl.IsEnabled(fixed.BLEND) else gl.Disable, fixed.BLEND)
        for buffer in range(self.buffers):
            if gl.ColorMaski is not None:
                gl.GetIntegeri_v(_COLOUR_MASK, buffer, mask)
                yield _later(gl.ColorMaski, buffer, *mask)
                yield _later(gl.Enablei if gl.IsEnabledi(fixed.BLEND, buffer) else gl.Disablei, fixed.BLEND, buffer)
            if not apart and buffer:
                continue
            terms = []
            for what in _BLEND_TERMS:
                if apart:
                    gl.GetIntegeri_v(what, buffer, ctypes.byref(number))
                terms.append(number.value if apart else gl.integer(what))
            yield _later(*((gl.BlendFuncSeparatei, buffer) if apart else (gl.BlendFuncSeparate,)), *terms[:4])
            yield _later(*((gl.BlendEquationSeparatei, buffer) if apart else (gl.BlendEquationSeparate,)), *terms[4:])
        for what in self.clamps:
            yield _later(gl.ClampColor, what, gl.integer(what))

    def _geometry(self) -> Iterable[Restore]:
        gl, four = self.gl, (ctypes.c_float * 4)()
        if self.has_viewports:
            for viewport in range(_VIEWPORTS):
                gl.GetFloati_v(_VIEWPORT, viewport, four)
                yield _later(gl.ViewportIndexedf, viewport, *four)
        else:
            gl.GetFloatv(_VIEWPORT, four)
            yield _later(gl.Viewport, *(int(side) for side in four))
        gl.GetFloatv(_DEPTH_RANGE, four)
        yield _later(gl.depth_range, four[0], four[1])
        yield from self._polygon_modes()
        yield _later(gl.CullFace, gl.integer(0xB45))
        yield _later(gl.FrontFace, gl.integer(0xB46))
        yield _later(gl.DepthFunc, gl.integer(0xB74))
        yield _later(gl.DepthMask, gl.integer(0xB72))
        offset = (ctypes.c_float * 2)()
        for k, what in enumerate((0x8038, 0x2A00)):
            gl.GetFloatv(what, ctypes.byref(offset, 4 * k))
        yield _later(gl.PolygonOffset, *offset)
        if self.has_clip_control:
            yield _later(gl.ClipControl, gl.integer(_CLIP_ORIGIN), gl.integer(g.CLIP_DEPTH_MODE))

    def _polygon_modes(self) -> Iterable[Restore]:
        gl, modes = self.gl, (ctypes.c_int * 2)()
        if gl.PolygonMode is None:
            return
        gl.GetIntegerv(0xB40, modes)
        # Compatibility contexts have a polygon mode for each face.
        faces = (g.FRONT, g.BACK) if gl.has.is_compatible else (g.FRONT_AND_BACK,)
        for face, mode in zip(faces, modes, strict=False):
            yield _later(gl.PolygonMode, face, mode)

    def _stencil(self) -> Iterable[Restore]:
        gl, wide = self.gl, ctypes.c_int64(0)
        for face, parameters in _STENCIL.items():
            numbers = []
            for what in parameters:
                # GetInteger64v, since GetIntegerv limits masks to 31 bits.
                gl.GetInteger64v(what, ctypes.byref(wide))
                numbers.append(wide.value & _ALL_STENCIL)
            function, reference, mask, fail, depth_fail, success, write = numbers
            yield _later(gl.StencilFuncSeparate, face, function, reference, mask)
            yield _later(gl.StencilOpSeparate, face, fail, depth_fail, success)
            yield _later(gl.StencilMaskSeparate, face, write)

    def _neutralise(self) -> None:
        """Reset the state that passes do not set themselves."""
        gl = self.gl
        for switch in gl.has.never_ours:
            gl.Disable(switch)
        for what in self.clamps:
            gl.ClampColor(what, _FALSE)
        # Uploads, also of textures without content, would read from a bound buffer.
        gl.BindBuffer(g.PIXEL_PACK_BUFFER, 0)
        gl.BindBuffer(g.PIXEL_UNPACK_BUFFER, 0)
        gl.depth_range(0.0, 1.0)
        if self.has_clip_control:
            gl.ClipControl(_LOWER_LEFT, _MINUS_ONE_TO_ONE)


def _later(call: Any, *arguments: Any) -> Restore:
    return lambda: call(*arguments)


class GuardedContext(HostContext):
    """The host's own context; its state is saved when this is entered, and restored at the end."""

    about = "the host's context, whose state is read before and set again behind"

    def __init__(self, turn: Turn | None = None) -> None:
        super().__init__(turn)
        self.gl = Functions(self.current.system(self.host).address)
        self._saved: list[Restore] = []
        #: Errors of the host that it has not queried yet.
        self._errors: list[int] = []
        self._guard = Guard(self.gl, 8)
        self.canary = Canary(self.gl)
        self._delete: Callable[[], None] = lambda: None

    def need_units(self, count: int) -> None:
        self._guard.units = max(self._guard.units, count)

    def _make_current(self) -> None:
        self.found()
        self._errors = self.gl.drain()
        self._saved = self._guard.save()

    def _put_back(self) -> None:
        self.gl.drain()
        self.gl.fail_again(self._errors, self.canary.name)  # while the host's debug callback is off
        saved, self._saved = self._saved, []
        for restore in reversed(saved):
            restore()

    def at_release(self, delete: Callable[[], None]) -> None:
        self._delete = delete

    def release(self) -> None:
        """Delete our objects if the host's context is current; else they are deleted with that context."""
        self.closed = True
        with suppress(BackendError):
            self.found()
            self._delete()
            self.canary.release()


_COMMANDS_COMPLETE, _NO_TIMEOUT = 0x9117, 0xFFFFFFFFFFFFFFFF


class _Shared:
    """A native context that shares objects with another one, and our objects among them."""

    def __init__(self, current: Current, host: State) -> None:
        self.current, self.host = current, host
        self.handle = current.system(host).share(host)
        self._display_lives = current.system(host).lives(host)
        self.delete: Callable[[], None] = lambda: None

    def state(self, host: State) -> State:
        """Return this context with the host's current surfaces, so that framebuffer 0 is the host's."""
        return State(host.system, host.display, host.draw, host.read, self.handle)

    def release(self) -> None:
        """Delete our shared objects, which would outlive this context, and then the context.

        They are deleted in this context, since the host's may be destroyed, or current in another thread. If the host's
        display is closed, all of them are gone already.
        """
        if not self._display_lives():
            return
        before = self.current.state()
        with suppress(BackendError):
            self.current.change(before, State(self.host.system, self.host.display, None, None, self.handle))
            try:
                self.delete()
            finally:
                self.current.put_back(self.current.state(), before)
        self.current.system(self.host).destroy(self.host, self.handle)


class SiblingContext(HostContext):
    """A context of ours that shares the host's objects; the host's context is current again at the end."""

    def __init__(self, turn: Turn | None = None) -> None:
        super().__init__(turn)
        self._before: State | None = None
        #: True if each context waits for the commands of the other.
        self._waits = True
        self._shared = _Shared(self.current, self.host)
        self._finalizer = weakref.finalize(self, destroy_later, self._shared)
        self._finalizer.atexit = False
        try:
            self.current.change(self.host, self._shared.state(self.host))
            try:
                self.gl = Functions(self.current.system(self.host).address)
                self.canary = Canary(self.gl)
                self._shared.delete = self.canary.release
            finally:
                self.current.put_back(self.current.state(), self.host)
        except BaseException:
            self.release()
            raise
        system = self.host.system.upper()
        self.about = f"a context beside the host's that shares its objects and has its own state ({system})"

    @contextmanager
    def looking(self) -> Iterator[Functions]:
        waits, self._waits = self._waits, False
        try:
            with self as gl:
                yield gl
        finally:
            self._waits = waits

    def _make_current(self) -> None:
        now = self.found()
        fence = self._fence()
        self.current.change(now, self._shared.state(now))
        self._before = now
        self._wait(fence)

    def _put_back(self) -> None:
        fence = self._fence()
        before, self._before = self._before, None
        self.current.put_back(self.current.state(), before)
        self._wait(fence)

    def _fence(self) -> Any:
        """Create a fence behind this context's commands; the other context waits for it on the device."""
        return self.gl.FenceSync(_COMMANDS_COMPLETE, 0) if self._waits else None

    def _wait(self, fence: Any) -> None:
        if fence:
            self.gl.WaitSync(fence, 0, _NO_TIMEOUT)
            self.gl.DeleteSync(fence)

    def at_release(self, delete: Callable[[], None]) -> None:
        canary = self.canary  # the finalizer must not refer to this object, which would never be collected

        def both() -> None:
            delete()
            canary.release()

        self._shared.delete = both

    def release(self) -> None:
        self.closed = True
        if self._finalizer.detach() is not None:
            destroy_now(self._shared)
