"""Run effects in pyglet and arcade, on the window's frame before its buffers are swapped."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.engines.attachment import Attachment, Effect, Seen, View
from passgraph.engines.hooks import check_has, hook
from passgraph.hosts.gl import Isolation


def attach(
    window: Any, effect: Effect, *, camera: object = None, isolation: Isolation = "auto", **values: object
) -> Attachment:
    """Run an effect on all that a window draws, `pyglet.window.Window` or `arcade.Window`, with a screen or headless.

    Parameters
    ----------
    window : a window of pyglet or arcade; its ``flip`` is hooked, which the event loop or your own loop calls
    effect, isolation, values : see `passgraph.engines.attachment.Attachment`
    camera
        What the frame was seen by: a `passgraph.Camera`, (view, projection), or a function that returns either.
        By default the window's ``view`` and ``projection`` at the end of the frame.

    Raises
    ------
    InputError
        For what is no window, and for values that the effect does not take.

    >>> attached = attach(window, gaussian_blur, radius_px=4)    # doctest: +SKIP
    >>> attached.enabled = False                                 # doctest: +SKIP
    """
    check_has(window, "pyglet", "a pyglet.window.Window or an arcade.Window", "flip", "switch_to", "projection")
    seen = Seen()

    def matrices() -> View:
        return seen.by(_rows(window.view), _rows(window.projection))

    attachment = Attachment(
        "pyglet", effect, values, frame=lambda host: host.framebuffer(0, srgb=False), camera=camera,
        engine_camera=matrices, isolation=isolation,
    )  # fmt: skip

    def draw() -> None:
        window.switch_to()  # as its event loop does; passes need a current context, and flip does not
        attachment.draw()

    attachment.on_close(hook(window, "flip", before=draw))
    attachment.on_close(hook(window, "close", before=attachment.close))
    return attachment


def _rows(matrix: Any) -> NDArray[np.float64]:
    """Convert a matrix of pyglet, which is stored by columns."""
    return np.array(tuple(matrix), np.float64).reshape(4, 4).T
