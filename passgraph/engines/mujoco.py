"""Run effects in MuJoCo, after ``mjr_render`` has drawn a scene and before its pixels are read."""

from __future__ import annotations

import gc
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.arguments import shown
from passgraph.engines.attachment import Attachment, Effect, Seen, View, imported
from passgraph.engines.hooks import check_has, hook
from passgraph.errors import InputError
from passgraph.hosts.gl import Host, HostFramebuffer, Isolation
from passgraph.scene.matrices import look_rotation, translation


def attach(
    scene: Any, effect: Effect, *, camera: object = None, isolation: Isolation = "auto", **values: object
) -> Attachment:
    """Run an effect on every picture of a scene.

    Parameters
    ----------
    scene : a ``mujoco.Renderer``, or the ``MjvScene`` that your own loop passes to ``mujoco.mjr_render``, called by
        this name
    effect, camera, isolation, values : see `passgraph.engines.attachment.Attachment`; the default camera is the
        scene's

    Segmentation and depth pictures of ``Renderer`` are unchanged.

    Raises
    ------
    InputError
        For the passive viewer (``mujoco.viewer.launch_passive``), which draws in a thread of its own.
    InputError, GraphError, KernelError
        Raised by the effect when its graph is built.

    >>> renderer = mujoco.Renderer(model)                                    # doctest: +SKIP
    >>> attached = passgraph.engines.mujoco.attach(renderer, black_and_white)    # doctest: +SKIP
    """
    core = imported("mujoco", "mujoco")
    drawn = getattr(scene, "scene", scene)
    _check_is_drawn_here(scene)
    check_has(drawn, "mujoco", "a mujoco.Renderer or an MjvScene", "camera", "flags")
    seen, viewport = Seen(zero_to_one=True), [0, 0, 1, 1]
    plain = [int(core.mjtRndFlag.mjRND_SEGMENT), int(core.mjtRndFlag.mjRND_IDCOLOR)]

    def is_ours(rect: Any, context: Any, *_: object, **__: object) -> bool:
        viewport[:] = rect.left, rect.bottom, rect.width, rect.height
        return context is drawn and not any(drawn.flags[flag] for flag in plain)

    def frame(host: Host) -> HostFramebuffer:
        x, y, width, height = viewport
        return host.framebuffer(region=(x, y, width, height), srgb=False)

    def view() -> View:
        one = core.mjv_averageCamera(*drawn.camera)
        return seen.by(*matrices(one, viewport[2] / viewport[3]))

    attachment = Attachment(
        "mujoco", effect, values, frame=frame, camera=camera, engine_camera=view, isolation=isolation
    )
    attachment.on_close(hook(core, "mjr_render", after=attachment.draw, when=is_ours))
    return attachment


def _check_is_drawn_here(scene: Any) -> None:
    """Raise InputError for the viewer of ``mujoco.viewer.launch_passive``, and for its ``user_scn``: a thread of C++
    draws these, without ``mujoco.mjr_render``."""
    viewer = sys.modules.get("mujoco.viewer")
    if viewer is None:
        return
    handles = [each for each in gc.get_objects() if type(each) is viewer.Handle]
    if any(scene is handle or scene is handle.user_scn for handle in handles):
        raise InputError(
            f"mujoco: the passive viewer draws in a thread that Python cannot reach, so that no effect would run; got "
            f"{shown(scene)}, expected a mujoco.Renderer or an MjvScene. Draw in a loop of your own, with "
            "mujoco.mjr_render in a window (glfw), or show the pictures of a mujoco.Renderer"
        )


def matrices(camera: Any, aspect: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return view and projection of an ``MjvGLCamera``, with reversed depth (1 near, 0 far), as MuJoCo draws."""
    forward, up = np.float64(camera.forward), np.float64(camera.up)
    view = look_rotation(forward / np.linalg.norm(forward), up) @ translation(-np.float64(camera.pos))
    bottom, top = float(camera.frustum_bottom), float(camera.frustum_top)
    near, far = float(camera.frustum_near), float(camera.frustum_far)
    half, middle = float(camera.frustum_width) or 0.5 * aspect * (top - bottom), float(camera.frustum_center)
    across, above = 1.0 / half, 2.0 / (top - bottom)
    lift, depth = (top + bottom) / (top - bottom), 1.0 / (far - near)
    if camera.orthographic:
        rows = [[across, 0, 0, -middle / half], [0, above, 0, -lift], [0, 0, depth, far * depth], [0, 0, 0, 1]]
    else:
        rows = [
            [near * across, 0, middle / half, 0],
            [0, near * above, lift, 0],
            [0, 0, near * depth, near * far * depth],
            [0, 0, -1, 0],
        ]
    return view, np.array(rows, np.float64)
