"""Normals from depth alone: exact on planes up to their edges, whatever the camera."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.effects import scene_surfaces, soft_shadow
from passgraph.effects.surfaces.depth_normals import depth_normals
from passgraph.scene.matrices import rotation_y, translation
from passgraph.truth import first_surfaces
from tests.agreement import assert_within_bounds
from tests.effects.scenes import cube, floor, render

Float64 = NDArray[np.float64]
SIZE = (97, 65)
CAMERA = pg.Camera((1.4, 1.1, 1.9), (0, 0.35, 0), vertical_fov_rad=0.8, near=0.1, far=50.0)
CAMERAS = [CAMERA, replace(CAMERA, orthographic_height=1.8), replace(CAMERA, shift=(0.4, -0.3))]


def unpacked(packed: NDArray[np.float32]) -> Float64:
    """The unit vectors of an octahedron's unfolded square."""
    x, y = packed[..., 0].astype(np.float64), packed[..., 1].astype(np.float64)
    z = 1.0 - abs(x) - abs(y)
    t = np.maximum(-z, 0.0)
    made = np.stack([x - np.sign(x) * t, y - np.sign(y) * t, z], axis=-1)
    return np.asarray(made / np.linalg.norm(made, axis=-1, keepdims=True))


def normals_of(depth: NDArray[np.floating], camera: pg.Camera, backend: str = "numpy") -> Float64:
    made = depth_normals(pg.Input("depth"), pg.Value("camera", pg.Camera, default=camera), "normals")
    return unpacked(render(made, size=None, backend=backend, depth=depth.astype(np.float32))["normals"])


def turned_cube() -> pg.Scene:
    node = cube()
    node = pg.Node(node.mesh, node.material, translation((0.1, 0, 0.2)) @ rotation_y(0.5), "cube")
    return pg.Scene((floor(3.0), node), CAMERA, ())


@pytest.mark.parametrize("camera", CAMERAS, ids=["perspective", "parallel", "off-centre"])
def test_no_edge_and_no_crease_bends_a_normal(camera: pg.Camera) -> None:
    """A cube on a floor before the sky, by rays: each pixel whose plane goes on for two pixels to some side of it."""
    seen = first_surfaces(turned_cube(), SIZE, camera)
    got = normals_of(seen.depth, camera)
    truth = seen.normals @ camera.view_rotation()[:3, :3].T
    same = _goes_on(seen.normals, seen.positions)
    assert same.sum() > 0.97 * (seen.depth > 0).sum()
    off = np.degrees(np.arccos(np.clip((got * truth).sum(axis=-1), -1.0, 1.0)))
    # float16 packs to a twentieth of a degree; depth in float32, over a pixel's step, adds as much
    assert off[same].max() < 0.15
    # of what is left, thinner than three pixels, little is seen
    assert (off[seen.depth > 0] > 1.0).mean() < 0.01


def _goes_on(normals: Float64, positions: Float64) -> NDArray[np.bool_]:
    """Whether two neighbours to one side show the same plane, along x and along y."""

    def alike(axis: int, way: int) -> NDArray[np.bool_]:
        made = np.ones(normals.shape[:2], np.bool_)
        for step in (way, 2 * way):
            height = ((np.roll(positions, -step, axis) - positions) * normals).sum(axis=-1)
            made &= ((np.roll(normals, -step, axis) * normals).sum(axis=-1) > 0.9999) & (abs(height) < 1e-6)
            edge = np.arange(made.shape[axis]) + step
            inside = (edge >= 0) & (edge < made.shape[axis])
            made &= inside[:, None] if axis == 0 else inside[None, :]
        return made

    # where nothing is seen, positions are NaN and heights below no number
    return (alike(0, 1) | alike(0, -1)) & (alike(1, 1) | alike(1, -1))


def test_where_nothing_is_seen_there_is_no_normal() -> None:
    depth = np.zeros((3, 4))
    made = depth_normals(pg.Input("depth"), pg.Value("camera", pg.Camera, default=CAMERA), "normals")
    assert not render(made, size=None, backend="numpy", depth=depth.astype(np.float32))["normals"].any()


@pytest.mark.parametrize("shape", [(1, 1), (1, 5), (2, 1)])
def test_a_surface_without_neighbours_faces_the_eye(shape: tuple[int, int]) -> None:
    depth = np.zeros(shape)
    depth[0, 0] = 2.0
    parallel = replace(CAMERA, orthographic_height=1.0)
    assert normals_of(depth, parallel)[0, 0].tolist() == [0.0, 0.0, 1.0]


def test_devices_agree_on_normals() -> None:
    depth = first_surfaces(turned_cube(), (21, 13)).depth[..., None]
    made = depth_normals(pg.Input("depth"), pg.Value("camera", pg.Camera, default=CAMERA))
    assert_within_bounds(made, depth=depth.astype(np.float32))


@pytest.mark.parametrize("space", ["view", "world"])
def test_surfaces_of_a_scene_are_those_of_its_geometry(space: Literal["view", "world"], backend_name: str) -> None:
    """A floor from the side and above: rays through pixels meet y = 0 where arithmetic says, and face up."""
    seen = scene_surfaces(pg.Scene((floor(3.0),), CAMERA, ()), space)
    targets = {"depth": seen.depth, "normals": seen.normals}
    with pg.compile(targets, backend=backend_name, size=SIZE) as program:
        made = program()
    back = np.subtract(CAMERA.eye, CAMERA.target) / np.linalg.norm(np.subtract(CAMERA.eye, CAMERA.target))
    right = np.cross((0, 1, 0), back) / np.linalg.norm(np.cross((0, 1, 0), back))
    up = np.cross(back, right)
    half = np.tan(0.5 * CAMERA.vertical_fov_rad)
    x = ((np.arange(SIZE[0]) + 0.5) / SIZE[0] * 2 - 1) * half * SIZE[0] / SIZE[1]
    y = (1 - (np.arange(SIZE[1]) + 0.5) / SIZE[1] * 2) * half
    rays = x[None, :, None] * right + y[:, None, None] * up - back
    distance = np.where(rays[..., 1] < 0, -CAMERA.eye[1] / np.minimum(rays[..., 1], -1e-9), 0.0)
    places = np.add(CAMERA.eye, rays * distance[..., None])
    hit = (distance > 0) & (abs(places[..., 0]) < 3.0) & (abs(places[..., 2]) < 3.0)
    assert 0.3 < hit.mean() < 0.95
    # pixels at the floor's edge may lie on either side of it by rounding
    assert ((made["depth"][..., 0] > 0) != hit).mean() < 0.001
    both = (made["depth"][..., 0] > 0) & hit
    np.testing.assert_allclose(made["depth"][both][:, 0], distance[both], rtol=1e-5)
    normal = np.array([0.0, 1.0, 0.0]) if space == "world" else np.array([right[1], up[1], back[1]])
    # half floats, packed
    np.testing.assert_allclose(made["normals"][both], np.broadcast_to([*normal, 1.0], (both.sum(), 4)), atol=2e-3)
    assert not made["normals"][~both & (made["depth"][..., 0] == 0)].any()


def test_surfaces_and_soft_shadows_of_one_scene_go_into_one_graph() -> None:
    """Both read the scene's textures; each picture is that of its graph alone."""
    scene = pg.Scene.shipped()
    outputs = {"picture": soft_shadow(scene, map_size=64), "color": scene_surfaces(scene).base_color}

    def pictures(targets: dict[str, pg.Target]) -> dict[str, np.ndarray]:
        with pg.compile(targets, backend="numpy", size=(48, 27)) as program:
            return dict(program())

    together = pictures(outputs)
    for name, target in outputs.items():
        np.testing.assert_array_equal(together[name], pictures({name: target})[name])


def test_textures_of_one_name_stay_apart() -> None:
    """Each floor has a texture of its own, both called the same, and seen in both effects."""

    def floors(names: tuple[str, str]) -> dict[str, np.ndarray]:
        nodes = []
        for name, x, color in zip(names, (-1.6, 1.6), ((255, 0, 0, 255), (0, 0, 255, 255)), strict=True):
            texture = pg.Texture.make(np.full((4, 4, 4), color, np.uint8), "srgb", name)
            mesh = pg.Mesh.make(
                [(x - 1.5, 0, -1.5), (x + 1.5, 0, -1.5), (x + 1.5, 0, 1.5), (x - 1.5, 0, 1.5)], [(0, 2, 1), (0, 3, 2)],
                uvs=[(0, 0), (1, 0), (1, 1), (0, 1)],
            )  # fmt: skip
            nodes.append(pg.Node(mesh, pg.Material(base_color_texture=texture)))
        scene = pg.Scene(tuple(nodes), CAMERA, pg.Scene.shipped().lights)
        targets = {"picture": soft_shadow(scene, map_size=64), "color": scene_surfaces(scene).base_color}
        with pg.compile(targets, backend="numpy", size=(48, 27)) as program:
            return dict(program())

    same, apart = floors(("paint", "paint")), floors(("red", "blue"))
    red, _, blue = np.moveaxis(apart["color"][..., :3], 2, 0)
    assert ((red > 0.5) & (blue == 0)).any() and ((blue > 0.5) & (red == 0)).any()
    for name, picture in apart.items():
        np.testing.assert_array_equal(same[name], picture)
