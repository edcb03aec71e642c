"""The camera of effects on a picture and its depth."""

from __future__ import annotations

import passgraph as pg


def camera_of(camera: pg.Camera | pg.Value | None, vertical_fov_rad: float) -> pg.Camera | pg.Value:
    """Return the given camera, or one at the origin with this angle of view.

    >>> camera_of(None, 0.5).vertical_fov_rad
    0.5
    """
    return camera or pg.Camera((0.0, 0.0, 0.0), (0.0, 0.0, -1.0), vertical_fov_rad=vertical_fov_rad)
