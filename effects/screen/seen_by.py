"""The camera of effects that take a picture and its depth."""

from __future__ import annotations

import passgraph as pg


def camera_of(camera: pg.Camera | pg.Value | None, vertical_fov_rad: float) -> pg.Camera | pg.Value:
    """The camera given, or one at the origin that only knows its angle.

    >>> camera_of(None, 0.5).vertical_fov_rad
    0.5
    """
    return camera or pg.Camera((0.0, 0.0, 0.0), (0.0, 0.0, -1.0), vertical_fov_rad=vertical_fov_rad)
