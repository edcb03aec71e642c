"""Screen-space reflections against rays: a floor that mirrors what the picture shows of a room."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.effects import ssr
from passgraph.truth import Tracer
from passgraph.truth.rays import strata
from passgraph.truth.surfaces import seen_triangles
from tests.agreement import assert_within_bounds
from tests.conftest import DEVICES
from tests.effects.engine import EngineView
from tests.effects.scenes import Float64, Picture, cube, floor

SIZE = (160, 100)
CAMERA = pg.Camera((0.3, 1.3, 3.4), (0.0, 0.35, 0.0), vertical_fov_rad=0.6, near=0.1, far=50.0)
CAMERAS = [CAMERA, replace(CAMERA, orthographic_height=2.2), replace(CAMERA, shift=(0.15, 0.1))]
Mask = NDArray[np.bool_]


def room(camera: pg.Camera = CAMERA) -> pg.Scene:
    """A floor, two cubes on it, and a wall behind them."""
    wall = replace(
        cube((0.0, 0.0, 0.0)), transform=np.array([[4, 0, 0, 0], [0, 1.6, 0, 0.5], [0, 0, 0.2, -1.3], [0, 0, 0, 1.0]])
    )
    return pg.Scene((floor(2.0), cube((-0.5, 0.3, 0.0), 0.5), cube((0.6, 0.15, 0.3), 0.3), wall), camera, ())


def paint(positions: Float64) -> Float64:
    """Bright waves over the world, a color for each place."""
    return np.asarray(2.0 + np.sin(positions @ np.array([[5.0, 1.0, 0.5], [0.5, 4.0, 1.0], [1.0, 0.5, 3.0]])))


def dot(a: Float64, b: Float64) -> Float64:
    return np.asarray(np.einsum("...i,...i->...", a, b))


@dataclass(frozen=True, eq=False)
class Reflection:
    """What each pixel of the floor mirrors, by rays: its light, whether there is something, and whether that lies in
    the picture, and is to be seen there."""

    light: Float64
    hit: Mask
    inside: Mask
    in_picture: Mask

    @classmethod
    def of(cls, view: EngineView, scene: pg.Scene) -> Reflection:
        seen, camera = view.surfaces, view.camera
        triangles = seen_triangles(scene, seen.origin).corners
        eye = np.subtract(camera.eye, seen.origin)
        along = np.broadcast_to(camera.forward, seen.positions.shape) if camera.orthographic else seen.positions - eye
        along = along / np.linalg.norm(along, axis=-1, keepdims=True)
        ray = along - 2.0 * dot(along, seen.normals)[..., None] * seen.normals
        start = np.nan_to_num(seen.positions + 1e-4 * seen.normals)
        number = (
            Tracer(triangles).closest(start.reshape(-1, 3), np.nan_to_num(ray).reshape(-1, 3)).reshape(ray.shape[:2])
        )
        a, b, c = triangles[number].transpose(2, 0, 1, 3)
        normal = np.cross(b - a, c - a)
        with np.errstate(divide="ignore", invalid="ignore"):
            place = start + (dot(normal, a - start) / dot(normal, ray))[..., None] * ray
            # where it lies in the picture, and whether that pixel shows it, from its front
            turned = (place - eye) @ camera.view_rotation()[:3, :3].T
            half, middle = camera.window(SIZE[0] / SIZE[1])
            spread = 1.0 if camera.orthographic else -turned[..., 2]
            x = ((turned[..., 0] / spread - middle[0]) / half[0] + 1.0) * 0.5 * SIZE[0]
            y = (1.0 - (turned[..., 1] / spread - middle[1]) / half[1]) * 0.5 * SIZE[1]
        column, row = (np.nan_to_num(np.clip(np.floor(n), -1, 9999)).astype(int) for n in (x, y))
        inside = (
            (number >= 0) & (column >= 0) & (row >= 0) & (column < SIZE[0]) & (row < SIZE[1]) & (turned[..., 2] < 0)
        )
        row, column = np.where(inside, row, 0), np.where(inside, column, 0)
        same = np.linalg.norm(np.nan_to_num(seen.positions[row, column], nan=1e9) - place, axis=-1) < 0.05
        return cls(paint(place), number >= 0, inside, inside & same & (dot(seen.normals[row, column], ray) < 0.0))


def shown(view: EngineView, backend: str = "numpy", base: float = -1.0, **options: Any) -> tuple[Float64, Picture]:
    """Its mirror alone, with a mask of the floor, whose own light is ``base``, and what was there before."""
    frame = np.ones((SIZE[1], SIZE[0], 4), np.float32)
    frame[..., :3] = np.where(view.shown[..., None], paint(np.nan_to_num(view.surfaces.positions)), 0.0)
    frame[view.surfaces.node == 0, :3] = base
    given = {"reflectance": 1.0, "fade": 0.0, "reach": 1e3, "thickness": 0.1, "steps": 256, **options}
    mask = (view.surfaces.node == 0).astype(np.float32)[..., None]
    made = ssr(pg.Input("frame"), view.distance(), mask=pg.Input("mask"), camera=view.camera, **given)
    with pg.compile(made, backend) as program:
        picture = program(frame=frame, depth=view.depth, mask=mask)["ssr"]
    return picture[..., :3].astype(np.float64), frame


@pytest.mark.parametrize("camera", CAMERAS, ids=["perspective", "parallel", "off-centre"])
@pytest.mark.parametrize("backend_name", DEVICES, indirect=True)
def test_a_floor_mirrors_what_the_picture_has(camera: pg.Camera, backend_name: str) -> None:
    """As rays find it, within what the paint changes by over a pixel, but for few pixels beside edges."""
    scene = room(camera)
    view = EngineView.of(scene, SIZE)
    truth, on_floor = Reflection.of(view, scene), view.surfaces.node == 0
    made, frame = shown(view, backend_name)
    mirrors = on_floor & truth.in_picture
    assert mirrors.sum() > 1000
    off = np.abs(made - truth.light).max(axis=-1)[mirrors]
    assert np.median(off) < 0.04
    assert (off < 0.15).mean() > 0.98
    # what meets nothing, or leaves the picture, stays
    stays = on_floor & ~truth.hit
    assert (np.abs(made - frame[..., :3]).max(axis=-1)[stays] == 0.0).mean() > 0.97
    np.testing.assert_array_equal(made[~on_floor], frame[~on_floor][:, :3])


def test_what_the_picture_does_not_have_is_not_invented() -> None:
    """What lies outside of it. What is hidden in it has no rule: a way may pass behind a thing, and meet another."""
    view = EngineView.of(room(), SIZE)
    truth, on_floor = Reflection.of(view, room()), view.surfaces.node == 0
    made, _ = shown(view)
    missing = on_floor & truth.hit & ~truth.inside
    assert missing.sum() > 500
    assert (made[missing] == -1.0).mean() > 0.97


def test_reach_fade_and_reflectance() -> None:
    view = EngineView.of(room(), SIZE)
    full, frame = shown(view)
    near, _ = shown(view, reach=0.3)
    mirrors = (full != frame[..., :3]).any(axis=-1)
    assert 0 < (near != frame[..., :3]).any(axis=-1).sum() < 0.6 * mirrors.sum()
    faded, _ = shown(view, fade=0.3)
    assert np.abs(faded - full)[mirrors].max() > 0.5
    # Schlick's share, of what is mirrored in full
    some, _ = shown(view, reflectance=0.1)
    mirrors &= full[..., 0] > 0.0
    share = ((some - frame[..., :3])[mirrors] / (full - frame[..., :3])[mirrors])[:, 0]
    eye = np.subtract(view.camera.eye, view.surfaces.origin)
    along = (eye - view.surfaces.positions)[mirrors]
    cosine = along[:, 1] / np.linalg.norm(along, axis=-1)
    np.testing.assert_allclose(share, 0.1 + 0.9 * (1.0 - cosine) ** 5, atol=2e-3)


# Rough surfaces


def test_a_rough_mirror_blurs_an_edge_as_its_facets_spread() -> None:
    """The edge of a wall's two halves, seen in a rough floor by parallel rays.

    The slopes s of GGX facets across the line of sight have the density 1 / (2 (1 + s²)^1.5) for alpha 1.  A slope
    moves the ray's hit on a wall at distance d by 2 s alpha d tan(elevation).  So the edge is the integral of the
    density: its width grows with the distance and with the square of the roughness.
    """
    elevation = np.radians(40.0)
    view, _ = beside_wall(elevation)
    places = view.surfaces.positions + view.surfaces.origin
    for roughness in (0.3, 0.4):
        # some rays leave the picture: compare with a wall that is white all over
        white, edge = (rough_floor(view, wall, roughness) for wall in (1.0, np.float32(places[..., 0] > 0.0)))
        away = places[..., 2] + 1.0
        for near, far in ((0.4, 0.5), (0.6, 0.7)):
            chosen = (view.surfaces.node == 0) & (away > near) & (away < far)
            u = places[..., 0][chosen] / (2.0 * np.tan(elevation) * roughness**2 * away[chosen])
            off = edge[chosen] / white[chosen] - (0.5 + 0.5 * u / np.hypot(1.0, u))
            assert np.abs(u).min() < 0.2
            # the mean over 4 by 4 pixels, and 1024 rays
            assert np.sqrt(np.mean(off[np.abs(u) < 3.0] ** 2)) < 0.025, (roughness, near)


@pytest.mark.slow
def test_facets_hide_light_from_one_another() -> None:
    """A white wall in a floor so rough that half of the light is lost, as rays to what the picture shows of it say."""
    view, scene = beside_wall(np.radians(15.0))
    to_origin = np.subtract(view.surfaces.origin, view.camera.eye)
    half, _ = view.camera.window(view.depth.shape[1] / view.depth.shape[0])

    def in_picture(places: Float64) -> Float64:
        turned = (places + to_origin) @ view.camera.view_rotation()[:3, :3].T
        return np.float64(np.abs(turned[..., :2] / half).max(axis=-1, keepdims=True) < 1.0)

    away = (view.surfaces.positions + view.surfaces.origin)[..., 2] + 1.0
    chosen = (view.surfaces.node == 0) & (away > 0.4) & (away < 0.8)
    truth = facets_seen(view, scene, 0.8, in_picture)[chosen].mean()
    # without the factor a third more than the truth
    assert rough_floor(view, 1.0, 0.8)[chosen].mean() == pytest.approx(truth, rel=0.06)


def beside_wall(elevation: float) -> tuple[EngineView, pg.Scene]:
    """A floor from this far above it, in parallel rays, up to a wall at z = -1 across the picture."""
    eye = (0.0, 5.0 * np.sin(elevation), 5.0 * np.cos(elevation))
    camera = pg.Camera(eye, (0, 0, 0), near=0.1, far=50.0, orthographic_height=3.0)
    sides = np.array([[30, 0, 0, 0], [0, 30, 0, 0], [0, 0, 0.2, -1.1], [0, 0, 0, 1.0]])
    scene = pg.Scene((floor(20.0), replace(cube((0.0, 0.0, 0.0)), transform=sides)), camera, ())
    return EngineView.of(scene, (240, 120)), scene


def rough_floor(view: EngineView, wall: float | Picture, roughness: float) -> Float64:
    """(h, w) what the floor reflects of a wall of this light."""
    mask = np.float32(view.surfaces.node == 0)
    made = ssr(
        pg.Input("frame"), view.distance(), mask=pg.Input("mask"), camera=view.camera, reflectance=1.0, fade=0.0,
        reach=1e3, thickness=0.1, steps=256, roughness=roughness, rays=64,
    )  # fmt: skip
    frame = np.repeat(((1.0 - mask) * wall)[..., None], 4, axis=2).astype(np.float32)
    with pg.compile(made, "numpy") as program:
        picture = program(frame=frame, depth=view.depth, mask=mask[..., None])["ssr"]
    return picture[..., 0].astype(np.float64)


def facets_seen(
    view: EngineView, scene: pg.Scene, roughness: float, light: Callable[[Float64], Float64] = paint, side: int = 16
) -> Float64:
    """What a rough floor reflects of all that rays find, black where they find nothing.

    Facets are drawn from their own density, visible or not, and weighted by what is visible and lit: B. Walter et al.,
    "Microfacet Models for Refraction through Rough Surfaces", EGSR 2007, equations 20 and 35.
    """
    seen, on_floor, alpha = view.surfaces, view.surfaces.node == 0, roughness**2
    triangles = seen_triangles(scene, seen.origin).corners
    start = seen.positions[on_floor][:, None] + np.array([0.0, 1e-4, 0.0])
    toward_eye = np.subtract(view.camera.eye, seen.origin) - start
    toward_eye /= np.linalg.norm(toward_eye, axis=-1, keepdims=True)
    points = strata(np.random.default_rng(1), len(start), side)
    cosine = 1.0 / np.sqrt(1.0 + alpha**2 * points[..., 0] / (1.0 - points[..., 0]))
    flat, turn = np.sqrt(1.0 - cosine**2), 2.0 * np.pi * points[..., 1]
    facet = np.stack([flat * np.cos(turn), cosine, flat * np.sin(turn)], axis=-1)
    along = dot(toward_eye, facet)
    ray = 2.0 * along[..., None] * facet - toward_eye
    above = (along > 0.0) & (ray[..., 1] > 0.0)

    def hidden(cosine: Float64) -> Float64:
        return 0.5 * np.sqrt(1.0 + alpha**2 * (1.0 / cosine**2 - 1.0)) - 0.5

    up, down = toward_eye[..., 1], np.where(above, ray[..., 1], 1.0)
    weight = np.where(above, along / (up * cosine * (1.0 + hidden(up) + hidden(down))), 0.0)
    start = np.broadcast_to(start, ray.shape)
    number = Tracer(triangles).closest(start.reshape(-1, 3), ray.reshape(-1, 3)).reshape(above.shape)
    a, b, c = triangles[number].transpose(2, 0, 1, 3)
    normal = np.cross(b - a, c - a)
    with np.errstate(divide="ignore", invalid="ignore"):
        place = np.nan_to_num(start + (dot(normal, a - start) / dot(normal, ray))[..., None] * ray)
    made = np.zeros((*on_floor.shape, 3))
    made[on_floor] = (light(place) * (weight * (number >= 0))[..., None]).mean(axis=1)
    return made


@pytest.mark.slow
@pytest.mark.parametrize(("roughness", "of_mirror"), [(0.3, 0.6), (0.5, 0.25)])
def test_a_rough_floor_is_nearer_to_rays_than_a_mirror(roughness: float, of_mirror: float) -> None:
    """Rays of the truth also find what the picture does not have, which is most of the error that is left."""
    scene = room()
    view = EngineView.of(scene, SIZE)
    chosen = (view.surfaces.node == 0) & Reflection.of(view, scene).in_picture
    truth = facets_seen(view, scene, roughness)[chosen]
    error = {
        given: np.sqrt(np.mean((shown(view, base=0.0, roughness=given)[0][chosen] - truth) ** 2))
        for given in (0.0, roughness)
    }
    assert error[roughness] < of_mirror * error[0.0], error


def test_roughness_as_a_picture() -> None:
    """One value everywhere is that number; where the picture is 0, pixels are those of a mirror."""
    view = EngineView.of(room(), SIZE)
    ways = np.full((SIZE[1], SIZE[0], 1), 0.4, np.float32)
    mirror, rough, by_value = (shown(view, roughness=one)[0] for one in (0.0, 0.4, pg.Value("rough", default=0.4)))
    np.testing.assert_array_equal(by_value, rough)
    np.testing.assert_array_equal(shown(view, roughness=pg.Input("roughness", default=ways))[0], rough)
    ways[:, : SIZE[0] // 2] = 0.0
    halves, _ = shown(view, roughness=pg.Input("roughness", default=ways))
    left = np.s_[:, : SIZE[0] // 2]
    # facets that are all alike, whose normals are rounded
    assert (np.abs(halves - mirror)[left] < 1e-3).mean() > 0.99
    assert np.abs(mirror - rough)[left].mean() > 0.1


def test_alpha_and_what_is_no_number_stay() -> None:
    view = EngineView.of(room(), SIZE)
    frame = np.random.default_rng(3).random((SIZE[1], SIZE[0], 4), np.float32)
    frame[40, 50, 1], frame[30, 60, 2] = np.nan, np.inf
    made = ssr(pg.Input("frame"), view.distance(), camera=CAMERA, reflectance=1.0)
    with pg.compile(made, "numpy", non_finite="keep") as program:
        picture = program(frame=frame, depth=view.depth)["ssr"]
    np.testing.assert_array_equal(picture[..., 3], frame[..., 3])
    assert (~np.isfinite(picture)).sum() == 2


def test_devices_agree_on_reflections() -> None:
    scene = pg.Scene((floor(1.0), cube((0.0, 0.25, 0.0), 0.5)), CAMERA, ())
    view, size = EngineView.of(scene, (21, 13)), (13, 21, 4)
    frame = np.random.default_rng(1).random(size, np.float32)
    for options in ({}, {"roughness": 0.4, "rays": 2}):
        camera = pg.Value("camera", pg.Camera, default=CAMERA)
        made = ssr(pg.Input("frame"), pg.Input("depth"), camera=camera, steps=8, **options)  # type: ignore[arg-type]
        assert_within_bounds(made, frame=frame, depth=view.surfaces.depth[..., None].astype(np.float32))
