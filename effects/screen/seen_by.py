"""The camera of effects that take a picture and its depth."""

from __future__ import annotations

import passgraph as pg


def camera_of(camera: pg.Camera | pg.Value | None, vertical_fov_rad: float) -> pg.Value:
    """A run value "camera": the one given, or one that only knows its angle.

    >>> camera_of(None, 0.5).default.vertical_fov_rad
    0.5
    """
    if isinstance(camera, pg.Value):
        return camera
    seen_by = camera or pg.Camera((0.0, 0.0, 0.0), (0.0, 0.0, -1.0), vertical_fov_rad=vertical_fov_rad)
    return pg.Value("camera", pg.Camera, default=seen_by)
