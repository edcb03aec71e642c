"""Small scenes whose shadows can be computed by hand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import cos, radians, sin, tan
from typing import Any

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.scene.matrices import translation
from passgraph.scene.shipped_scene import box

Picture = NDArray[np.float32]
Float64 = NDArray[np.float64]
SIZE = (96, 64)


def floor(half: float = 4.0, **options: Any) -> pg.Node:
    """A white floor at y = 0."""
    corners = np.array([[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1.0]]) * half
    mesh = pg.Mesh.make(corners, [[0, 1, 2], [0, 2, 3]], np.tile([0.0, 1.0, 0.0], (4, 1)))
    return pg.Node(mesh, pg.Material("white", (1, 1, 1, 1)), name="floor", **options)


def scaling(factors: Sequence[float]) -> Float64:
    """The matrix that scales by three factors."""
    return np.diag((*factors, 1.0))


def cube(at: Sequence[float] = (0.0, 0.0, 0.0), size: float = 1.0, **options: Any) -> pg.Node:
    """A cube that stands with its middle at ``at``."""
    return pg.Node(box(size), pg.Material("grey", (0.5, 0.5, 0.5, 1)), translation(at), name="cube", **options)


def from_above(height: float = 8.0, x: float = 0.5) -> pg.Camera:
    """Looks straight down; right in the picture is +x, down is +z."""
    return pg.Camera((x, height, 0), (x, 0, 0), up=(0, 0, -1), vertical_fov_rad=0.6, near=0.5, far=400.0)


def sun(elevation_deg: float = 45.0, azimuth_deg: float = 0.0, **options: Any) -> pg.Light:
    """A directional light that shines toward +x (azimuth 0), from this high above the horizon."""
    elevation, azimuth = radians(elevation_deg), radians(azimuth_deg)
    flat = cos(elevation)
    direction = (flat * cos(azimuth), -sin(elevation), flat * sin(azimuth))
    return pg.Light.directional(direction, **{"radius": 0.0, **options})


def floor_places(camera: pg.Camera, size: tuple[int, int] = SIZE) -> tuple[Float64, Float64]:
    """World x and z of each pixel's centre on the floor, for a camera from above."""
    width, height = size
    half = tan(0.5 * camera.vertical_fov_rad) * camera.eye[1]
    x = camera.eye[0] + (2 * (np.arange(width) + 0.5) / width - 1) * half * width / height
    z = camera.eye[2] + (2 * (np.arange(height) + 0.5) / height - 1) * half
    return np.meshgrid(x, z)


def moved(scene: pg.Scene, offset: Sequence[float]) -> pg.Scene:
    """The same scene elsewhere in the world."""
    by = np.asarray(offset, np.float64)
    camera, light = scene.camera, scene.lights[0]
    nodes = [pg.Node(n.mesh, n.material, translation(by) @ n.transform, n.name) for n in scene.nodes]
    camera = replace(camera, eye=tuple(by + camera.eye), target=tuple(by + camera.target))
    light = pg.Light(
        light.kind, tuple(by + light.position), light.direction, light.color, light.intensity, light.radius
    )
    return pg.Scene(tuple(nodes), camera, (light,), scene.name)


def render(
    *targets: pg.Target, size: tuple[int, int] | None = SIZE, backend: str = "reference", **values: Any
) -> dict[str, Picture]:
    """One run; pictures by target name."""
    with pg.compile(targets, backend=backend, size=size) as program:
        return dict(program(**values))
