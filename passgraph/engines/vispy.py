"""Run effects in vispy, on a canvas's scene when it is drawn on screen or by ``render``."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.engines.attachment import Attachment, Effect, Seen, View
from passgraph.engines.hooks import check_has, hook
from passgraph.hosts.gl import Host, HostFramebuffer, Isolation


def attach(
    canvas: Any, effect: Effect, *, view: Any = None, camera: object = None, isolation: Isolation = "auto",
    **values: object,
) -> Attachment:  # fmt: skip
    """Run an effect on all that a canvas shows, and on the picture of its ``render``, but not on picking.

    Parameters
    ----------
    canvas : `vispy.scene.SceneCanvas`
    view : the `vispy.scene.ViewBox` whose camera the effect gets; needed if the effect takes ``camera`` or ``depth``
    effect, camera, isolation, values : see `passgraph.engines.attachment.Attachment`

    vispy's own depth buffers have 16 bits, and its cameras have a far plane at a million times the near distance. For
    effects that take depth, set a smaller ``depth_value`` of the camera, such as 100.

    Raises
    ------
    InputError
        For what is no canvas with a scene, and for values that the effect does not take.

    >>> attached = attach(canvas, ambient_occlusion, view=view)    # doctest: +SKIP
    """
    # The method that draws the scene for both screen and render() is private; the draw event is for the screen only.
    check_has(canvas, "vispy", "a vispy.scene.SceneCanvas", "_draw_scene", "scene")
    if view is not None:
        check_has(view, "vispy", "a vispy.scene.ViewBox as view=", "camera", "scene")
    seen = Seen()

    def frame(host: Host) -> HostFramebuffer:
        return host.framebuffer(srgb=False)

    def matrices() -> View | None:
        return None if view is None else seen.by(*camera_matrices(view))

    attachment = Attachment(
        "vispy", effect, values, frame=frame, camera=camera, engine_camera=matrices, isolation=isolation
    )

    def draw() -> None:
        if not canvas.scene.picking:
            canvas.context.flush_commands()  # vispy queues its commands
            attachment.draw()

    attachment.on_close(hook(canvas, "_draw_scene", after=draw))
    attachment.on_close(hook(canvas, "close", before=attachment.close))
    return attachment


def camera_matrices(view: Any) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return view and projection of a view box's camera, (4, 4) with ``M @ v``."""
    to_camera = _matrix(view.scene.node_transform(view.camera))
    width, height = view.size
    to_box = np.array([[width / 2, 0, 0, width / 2], [0, -height / 2, 0, height / 2], [0, 0, 1, 0], [0, 0, 0, 1]])
    # vispy has one transform of the scene, to pixels of the box with y down.
    projection = np.linalg.inv(to_box) @ _matrix(view.scene.transform) @ np.linalg.inv(to_camera)
    projection[np.abs(projection) < 1e-6 * np.abs(projection).max()] = 0.0
    return to_camera, projection


def _matrix(transform: Any) -> NDArray[np.float64]:
    return np.array(transform.map(np.eye(4)), np.float64).T
