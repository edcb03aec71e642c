"""Bake light maps into the vertex colors of static 3-D geometry, once, when it is loaded."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.effects.light2d.world import Float64, Window
from passgraph.language import Vertex, mat4, vec3, vec4
from passgraph.scene import Mesh


@pg.struct
class Baked:
    """Varyings of the vertex kernel."""

    position: vec4
    color: vec4


@pg.vertex
def placed(vertex: Vertex, view_projection: mat4) -> Baked:
    """Vertex colors hold the light."""
    return Baked(view_projection * vec4(vertex.position, 1.0), vertex.color)


@pg.fragment
def lit_surface(baked: Baked, albedo: vec3) -> vec4:
    """Return the surface's color in the baked light."""
    return vec4(albedo * baked.color.rgb, 1.0)


def light_at(light: NDArray[np.float32], window: Window, places: Float64) -> NDArray[np.float32]:
    """Sample a light map bilinearly at places of the world (n, 2): (n, 4), clamped to the map's edge.

    >>> ramp = np.repeat(np.arange(4, dtype=np.float32), 4).reshape(1, 4, 4)
    >>> light_at(ramp, Window(0, 0, 4, 1), np.array([[1.0, 0.5], [9.0, 0.5]]))[:, 0].tolist()
    [0.5, 3.0]
    """
    height, width = light.shape[:2]
    x, y = window.pixels((places[:, 0], places[:, 1]), (width, height))  # type: ignore[arg-type]
    x, y = np.clip(x - 0.5, 0.0, width - 1.0), np.clip(y - 0.5, 0.0, height - 1.0)
    left, top = np.floor(x).astype(int), np.floor(y).astype(int)
    right, bottom = np.minimum(left + 1, width - 1), np.minimum(top + 1, height - 1)
    across, along = (x - left)[:, None], (y - top)[:, None]
    upper = light[top, left] * (1.0 - across) + light[top, right] * across
    lower = light[bottom, left] * (1.0 - across) + light[bottom, right] * across
    return np.asarray(upper * (1.0 - along) + lower * along, np.float32)


def baked(mesh: Mesh, light: NDArray[np.float32], window: Window) -> Mesh:
    """Return a mesh whose vertex colors are its old ones times the light at the vertices.

    Parameters
    ----------
    mesh : y up; the flat world's x and y are its x and -z, as seen from above
    light : a light map that was read back, (height, width, 4), linear
    window : the window of the light map

    Light between vertices is interpolated: triangles should be as small as the shadow details.
    """
    places = np.column_stack([mesh.positions[:, 0], -mesh.positions[:, 2]]).astype(np.float64)
    return replace(mesh, colors=light_at(light, window, places) * mesh.colors, has_colors=True)
