"""Run effects in moderngl-window, with any of its windowing libraries or headless, before buffers are swapped."""

from __future__ import annotations

from typing import Any

from passgraph.engines.attachment import Attachment, Effect
from passgraph.engines.hooks import check_has, hook
from passgraph.hosts.gl import Isolation


def attach(
    window: Any, effect: Effect, *, camera: object = None, isolation: Isolation = "auto", **values: object
) -> Attachment:
    """Run an effect on all that a moderngl-window window draws.

    Parameters
    ----------
    window : `moderngl_window.BaseWindow`, such as ``self.wnd`` of a WindowConfig; its ``swap_buffers`` is hooked
    effect, isolation, values : see `passgraph.engines.attachment.Attachment`
    camera
        What the frame was seen by: a `passgraph.Camera`, (view, projection), or a function that returns either;
        moderngl-window knows none.

    Raises
    ------
    InputError
        For what is no window, and for values that the effect does not take.

    >>> attached = attach(self.wnd, gaussian_blur, radius_px=4)    # doctest: +SKIP
    """
    check_has(window, "moderngl-window", "a window of moderngl_window's", "swap_buffers", "fbo", "destroy")
    # A headless window creates a new framebuffer at each change of size.
    attachment = Attachment(
        "moderngl-window", effect, values, frame=lambda host: host.framebuffer(window.fbo.glo, srgb=False),
        camera=camera, isolation=isolation,
    )  # fmt: skip
    attachment.on_close(hook(window, "swap_buffers", before=attachment.draw))
    attachment.on_close(hook(window, "destroy", before=attachment.close))
    return attachment
