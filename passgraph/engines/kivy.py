"""Run effects in Kivy, on the window's frame before its buffers are swapped."""

from __future__ import annotations

from typing import Any

from passgraph.engines.attachment import Attachment, Effect
from passgraph.engines.hooks import check_has
from passgraph.hosts.gl import Isolation


def attach(
    window: Any, effect: Effect, *, camera: object = None, isolation: Isolation = "auto", **values: object
) -> Attachment:
    """Run an effect on all that a Kivy window draws.

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
    # Handlers run before the event's default one, which swaps. bind would keep only a weak reference to the method.
    window.fbind("on_flip", attachment.draw)
    attachment.on_close(lambda: window.funbind("on_flip", attachment.draw))
    return attachment
