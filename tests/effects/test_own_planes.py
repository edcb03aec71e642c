"""The plane of each pixel's own triangle."""

from __future__ import annotations

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects.surfaces.g_buffer import g_buffer
from passgraph.effects.surfaces.views import View
from passgraph.truth import first_surfaces

SIZE = (97, 63)


def rounded() -> pg.Mesh:
    """A cube whose eight corners have smooth normals: those of its faces lie up to 55 degrees off."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float64)
    sides = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    triangles = [triangle for a, b, c, d in sides for triangle in ((a, b, c), (a, c, d))]
    return pg.Mesh.make(corners * 0.5, triangles, corners / np.sqrt(3.0), name="rounded")


@pytest.mark.parametrize("orthographic", [False, True])
def test_a_triangles_plane_is_known_where_its_normals_are_smooth(orthographic: bool, backend_name: str) -> None:
    camera = pg.Camera(
        (1.5, 1.8, 2.2), (0, 0, 0), vertical_fov_rad=0.6, orthographic_height=2.5 if orthographic else None
    )
    scene = pg.Scene((pg.Node(rounded()),), camera, ())
    seen = g_buffer(scene, View(pg.Value("camera", pg.Camera, default=camera)), (0.0, 0.0, 0.0))
    assert seen.rises is not None
    with pg.compile([seen.rises, seen.depth], backend=backend_name, size=SIZE) as program:
        made = program()
    rises, depth = made["rises"].astype(np.float64), made["depth"][..., 0].astype(np.float64)
    inside = depth > 0.0
    half = np.array(camera.window(SIZE[0] / SIZE[1]).half)
    x = (2.0 * (np.arange(SIZE[0]) + 0.5) / SIZE[0] - 1.0) * half[0]
    y = (1.0 - 2.0 * (np.arange(SIZE[1])[:, None] + 0.5) / SIZE[1]) * half[1]
    slope = rises / (2.0 * half / SIZE)
    if orthographic:
        normals = np.stack([slope[..., 0], slope[..., 1], np.ones_like(depth)], axis=-1)
    else:
        steep = 1.0 / np.where(inside, depth, 1.0) - slope[..., 0] * x - slope[..., 1] * y
        normals = np.stack([-slope[..., 0], -slope[..., 1], steep], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    truth = first_surfaces(scene, SIZE)
    counts = inside & (np.abs(depth - truth.depth) < 1e-3)
    assert counts.sum() > 1000
    off = np.linalg.norm(normals - truth.normals @ camera.view_rotation()[:3, :3].T, axis=-1)
    # a pixel on the edge of two faces may take either
    assert np.quantile(off[counts], 0.98) < 2e-3
