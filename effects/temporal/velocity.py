"""Velocity: the motion of each pixel's surface since the last picture, from depth and two cameras."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Any

import numpy as np

import passgraph as pg
from passgraph.effects.checked import checked
from passgraph.effects.quantities import combined
from passgraph.effects.surfaces.geometry import ViewFrame, line_of_sight, picture_place, view_position
from passgraph.effects.surfaces.views import View
from passgraph.language import Image, mat4, output_size, uv, vec2, vec3, vec4

#: Third channel if the previous camera did not see the position: it was behind the eye.
UNSEEN = -1.0


@pg.kernel
def moved(depth: Image, frame: ViewFrame, before: ViewFrame, before_from_now: mat4) -> vec3:
    """Return the motion of each pixel in pixels, and the previous distance; the sky rotates, and does not come
    nearer."""
    z = depth[0, 0].r
    drawn = z > 0.0
    now = view_position(frame, uv(), z) if drawn else line_of_sight(frame, uv())
    then = (before_from_now * vec4(now, 1.0 if drawn else 0.0)).xyz
    if -then.z <= 0.0:
        return vec3(0.0, 0.0, UNSEEN)
    way = picture_place(frame, now) - picture_place(before, then)
    if not drawn and not frame.perspective:
        way = vec2(0.0)
    return vec3(way * vec2(output_size()), -then.z if drawn else 0.0)


def before_from_now(camera: pg.Camera, previous_camera: pg.Camera) -> Any:
    """Return the matrix between two cameras' frames, (4, 4); large world coordinates cancel in float64."""
    turn, before = camera.view_rotation(), previous_camera.view_rotation()
    matrix = before @ turn.T
    matrix[:3, 3] = before[:3, :3] @ np.subtract(camera.eye, previous_camera.eye)
    return matrix


@checked
def camera_velocity(
    depth: pg.Target,
    camera: pg.Camera | pg.Value,
    previous_camera: pg.Camera | pg.Value,
    into: pg.TargetSpec | None = None,
    name: str = "velocity",
) -> pg.Target:
    """Return the motion of each pixel's surface since the last frame, if only the camera moves.

    Parameters
    ----------
    depth : red is the distance along the view axis in scene units, 0 where there is no surface
    camera : the camera of the depth, without jitter
    previous_camera : the camera of the frame before, without jitter
    into : destination target; default: "rgb32f" of the size of ``depth`` named ``name``
    name : name of the pass and target

    Returns
    -------
    Red and green: the motion since the last picture, pixels, to the right and down. Blue: its previous distance along
    the view axis, scene units; 0 for the sky, and -1 if it was behind the eye, with a motion of 0.

    Examples
    --------
    One unit to the right, at a distance at which the picture is 4 units wide:

    >>> import numpy as np
    >>> before = pg.Camera((0, 0, 0), (0, 0, -1), vertical_fov_rad=2 * np.arctan(0.5), near=0.1)
    >>> now = pg.Camera((1, 0, 0), (1, 0, -1), vertical_fov_rad=2 * np.arctan(0.5), near=0.1)
    >>> with pg.compile(camera_velocity(pg.Input("depth"), now, before), backend="reference") as program:
    ...     program(depth=np.full((8, 8, 1), 4.0))["velocity"][3, 3].tolist()
    [-2.0, 0.0, 4.0]
    """
    into = into or pg.target(name, "rgb32f", like=depth)
    matrix = combined(before_from_now, camera, previous_camera)
    velocity: pg.Target = moved(
        depth, View(camera).frame(), View(previous_camera).frame(), matrix, into=into, name=name
    )
    return velocity
