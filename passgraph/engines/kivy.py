"""Kivy: the effect runs on what the window shows, before its buffers are swapped."""

from __future__ import annotations

from typing import Any

from passgraph.engines.attachment import Attachment, Effect
from passgraph.engines.hooks import check_has
from passgraph.hosts.gl import Isolation


def attach(
    window: Any, effect: Effect, *, camera: object = None, isolation: Isolation = "auto", **values: object
) -> Attachment:
    """Run an effect on all that a window of Kivy's draws.

    Kivy draws when something changes, so an effect whose values change needs ``window.canvas.ask_update()``.

    Parameters
    ----------
    window : `kivy.core.window.Window`; the effect is called by its event ``on_flip``
    effect, isolation, values : see `passgraph.engines.attachment.Attachment`
    camera
        What the frame was seen by: a `passgraph.Camera`, (view, projection), or a function that returns either; Kivy
        knows none.

    Raises
    ------
    InputError
        For what is no window, and for values that the effect does not take.

    >>> attached = attach(Window, gaussian_blur, radius_px=4)    # doctest: +SKIP
    """
    check_has(window, "kivy", "kivy.core.window.Window", "fbind", "funbind", "on_flip", "canvas")
    attachment = Attachment(
        "kivy", effect, values, frame=lambda host: host.framebuffer(0, srgb=False), camera=camera, isolation=isolation
    )
    # Handlers go before the event's own, which swaps; bind would forget a method whose object nobody else keeps.
    window.fbind("on_flip", attachment.draw)
    attachment.on_close(lambda: window.funbind("on_flip", attachment.draw))
    return attachment
