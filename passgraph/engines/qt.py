"""Run effects in Qt through PySide6 or PyQt, after a widget or window has painted with OpenGL."""

from __future__ import annotations

from typing import Any

from passgraph.engines.attachment import Attachment, Effect
from passgraph.engines.hooks import check_has, hook
from passgraph.hosts.gl import Isolation


def attach(
    widget: Any, effect: Effect, *, camera: object = None, isolation: Isolation = "auto", **values: object
) -> Attachment:
    """Run an effect on all that a widget paints, before Qt composes it with the others.

    Parameters
    ----------
    widget : `QOpenGLWidget` or `QOpenGLWindow`; its ``paintGL`` is hooked.  Widgets above it are not affected.
    effect, isolation, values : see `passgraph.engines.attachment.Attachment`
    camera
        What the frame was seen by: a `passgraph.Camera`, (view, projection), or a function that returns either; Qt
        knows none.

    Raises
    ------
    InputError
        For what is no such widget, and for values that the effect does not take.

    >>> attached = attach(widget, gaussian_blur, radius_px=4)    # doctest: +SKIP
    """
    check_has(widget, "qt", "a QOpenGLWidget or QOpenGLWindow", "paintGL", "defaultFramebufferObject", "context")
    attachment = Attachment(
        "qt", effect, values, frame=lambda host: host.framebuffer(widget.defaultFramebufferObject(), srgb=False),
        camera=camera, isolation=isolation,
    )  # fmt: skip
    attachment.on_close(hook(widget, "paintGL", after=attachment.draw))
    if hasattr(widget, "destroyed"):
        widget.destroyed.connect(attachment.close)
        attachment.on_close(lambda: _disconnect(widget, attachment.close))
    return attachment


def _disconnect(widget: Any, slot: Any) -> None:
    try:
        widget.destroyed.disconnect(slot)
    except RuntimeError:
        return  # the widget is gone, and its signals with it
