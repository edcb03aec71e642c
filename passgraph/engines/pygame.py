"""pygame with OpenGL: the effect runs on what the display shows, before its buffers are swapped."""

from __future__ import annotations

from typing import Any

from passgraph.engines.attachment import Attachment, Effect
from passgraph.engines.hooks import check_has, hook
from passgraph.errors import InputError
from passgraph.hosts.gl import Host, HostFramebuffer, Isolation

#: ``pygame.OPENGL``, and ``pygame.PREALLOC``: that SDL sends a surface of its own to the window.
_OPENGL, _PREALLOC = 0x2, 0x01000000


def attach(
    display: Any, effect: Effect, *, camera: object = None, isolation: Isolation = "auto", **values: object
) -> Attachment:
    """Run an effect on all that is drawn into pygame's window.

    Parameters
    ----------
    display
        The module ``pygame.display``; its ``flip`` is hooked.  Call it by this name: what ``from pygame.display import
        flip`` took before stays without the effect.
    effect, isolation, values : see `passgraph.engines.attachment.Attachment`
    camera
        What the frame was seen by: a `passgraph.Camera`, (view, projection), or a function that returns either; pygame
        knows none.

    Raises
    ------
    InputError
        For what has no ``flip``, a display without ``pygame.OPENGL``, and for values that the effect does not take.

    >>> attached = attach(pygame.display, gaussian_blur, radius_px=4)    # doctest: +SKIP
    """
    check_has(display, "pygame", "the module pygame.display", "flip", "quit", "set_mode", "get_surface")
    _check_has_opengl(display)

    def frame(host: Host) -> HostFramebuffer:
        _check_has_opengl(display)
        return host.framebuffer(0, srgb=False)

    made = Attachment("pygame", effect, values, frame=frame, camera=camera, isolation=isolation)
    made.on_close(hook(display, "flip", before=made.draw))
    made.on_close(hook(display, "quit", before=made.close))
    return made


def _check_has_opengl(display: Any) -> None:
    """Frames that pygame makes of surfaces are sent to the window behind ``flip``, where no effect sees them."""
    surface = display.get_surface()
    if surface is None:
        return
    # SDL from 2.32 on sends surfaces through OpenGL, and sets its flag for all windows.
    flags = surface.get_flags()
    is_scaled = tuple(surface.get_size()) != tuple(display.get_window_size())
    if not flags & _OPENGL or flags & _PREALLOC or is_scaled:
        raise InputError(
            "pygame: the display has no OpenGL; call pygame.display.set_mode(size, pygame.OPENGL | pygame.DOUBLEBUF), "
            "and draw with OpenGL. Where surfaces are drawn, run a program on them: "
            "program(frame=pygame.surfarray.array3d(surface).swapaxes(0, 1))"
        )
