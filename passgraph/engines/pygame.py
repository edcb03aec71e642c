"""Run effects in pygame with OpenGL, on the window's frame before its buffers are swapped."""

from __future__ import annotations

from typing import Any

from passgraph.engines.attachment import Attachment, Effect
from passgraph.engines.hooks import check_has, hook
from passgraph.errors import InputError
from passgraph.hosts.gl import Host, HostFramebuffer, Isolation

#: ``pygame.OPENGL``, ``pygame.SCALED``, and ``pygame.PREALLOC``: SDL draws its own surface to the window.
_OPENGL, _SCALED, _PREALLOC = 0x2, 0x200, 0x01000000


def attach(
    window: Any, effect: Effect, *, camera: object = None, isolation: Isolation = "auto", **values: object
) -> Attachment:
    """Run an effect on all that is drawn into pygame's window.

    Parameters
    ----------
    window
        The module ``pygame.display``; its ``flip`` is hooked. Call it as ``pygame.display.flip``: a ``flip`` imported
        before does not run the effect. Or a window of pygame-ce with ``opengl=True``, of a subclass, ``class
        Window(pygame.Window): pass``, since the ``flip`` of ``pygame.Window`` itself cannot be hooked.
    effect, isolation, values : see `passgraph.engines.attachment.Attachment`
    camera
        What the frame was seen by: a `passgraph.Camera`, (view, projection), or a function that returns either; pygame
        knows none.

    Raises
    ------
    InputError
        For what has no ``flip``, a window without OpenGL, and for values that the effect does not take.

    >>> attached = attach(pygame.display, gaussian_blur, radius_px=4)    # doctest: +SKIP
    """
    if hasattr(window, "opengl") and hasattr(window, "destroy"):
        _check_takes_hooks(window)
        attachment = Attachment("pygame", effect, values, frame=_screen, camera=camera, isolation=isolation)
        attachment.on_close(hook(window, "flip", before=attachment.draw))
        attachment.on_close(hook(window, "destroy", before=attachment.close))
        return attachment
    check_has(window, "pygame", "the module pygame.display", "flip", "quit", "set_mode", "get_surface")
    display = _Display(window)
    display.check_has_opengl()

    def frame(host: Host) -> HostFramebuffer:
        display.check_has_opengl()
        return _screen(host)

    attachment = Attachment("pygame", effect, values, frame=frame, camera=camera, isolation=isolation)
    attachment.on_close(hook(window, "flip", before=attachment.draw))
    attachment.on_close(hook(window, "quit", before=attachment.close))
    attachment.on_close(hook(window, "set_mode", before=lambda: None, when=display.remember_mode))
    return attachment


def _screen(host: Host) -> HostFramebuffer:
    return host.framebuffer(0, srgb=False)


def _check_takes_hooks(window: Any) -> None:
    if not window.opengl:
        raise InputError("pygame: the window has no OpenGL; make it with opengl=True, and draw with OpenGL")
    if not hasattr(window, "__dict__"):
        raise InputError(
            f"pygame: the flip of a {type(window).__name__} cannot be hooked; derive a class, "
            "class Window(pygame.Window): pass, and make the window of it"
        )


class _Display:
    """Tracks if pygame's display is an OpenGL one; SDL does not report it, since it also shows surfaces with OpenGL."""

    def __init__(self, module: Any) -> None:
        self.module = module
        surface = module.get_surface()
        self._is_scaled = surface is not None and _is_enlarged(surface.get_size(), module.get_window_size())

    def remember_mode(self, size: object = None, flags: int = 0, *_: object, **__: object) -> bool:
        """Remember the mode of a ``set_mode`` call. The surface of an OpenGL display does not follow later sizes."""
        self._is_scaled = bool(flags & _SCALED)
        return False

    def check_has_opengl(self) -> None:
        """Raise InputError for a display of surfaces: they reach the window inside ``flip``, after the effect."""
        surface = self.module.get_surface()
        if surface is None:
            return
        flags = surface.get_flags()
        if not flags & _OPENGL or flags & _PREALLOC or self._is_scaled:
            raise InputError(
                "pygame: the display has no OpenGL; call pygame.display.set_mode(size, pygame.OPENGL | "
                "pygame.DOUBLEBUF), and draw with OpenGL. Where surfaces are drawn, run a program on them: "
                "program(frame=pygame.surfarray.array3d(surface).swapaxes(0, 1))"
            )


def _is_enlarged(size: tuple[int, int], window: tuple[int, int]) -> bool:
    """Return True if a window is an integer multiple of its surface, as with ``pygame.SCALED``."""
    times = window[0] // size[0]
    return times > 1 and tuple(window) == (times * size[0], times * size[1])
