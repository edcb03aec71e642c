"""pygame with OpenGL: the effect runs on what the display shows, before its buffers are swapped."""

from __future__ import annotations

from typing import Any

from passgraph.backends.gl.host import Isolation
from passgraph.engines.attachment import Attachment, Effect
from passgraph.engines.hooks import check_has, hook


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
        For what has no ``flip``, and for values that the effect does not take.

    >>> attached = attach(pygame.display, gaussian_blur, radius_px=4)    # doctest: +SKIP
    """
    check_has(display, "pygame", "the module pygame.display", "flip", "quit", "set_mode")
    made = Attachment(
        "pygame", effect, values, frame=lambda host: host.framebuffer(0, srgb=False), camera=camera, isolation=isolation
    )
    made.on_close(hook(display, "flip", before=made.draw))
    made.on_close(hook(display, "quit", before=made.close))
    return made
