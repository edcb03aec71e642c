"""Soft shadows where solid things surround the light and what the camera sees: against rays, which no filter shares."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.bench.bench_scenes import scene_named
from passgraph.bench.truth import truth_of
from passgraph.effects import soft_shadow_passes
from passgraph.effects.shadows.shadow_choice import SHADOW_FILTERS, Pcss, Penumbra
from passgraph.effects.surfaces.map_fit import pieces_of, seen_points
from passgraph.effects.surfaces.views import Casters, Seen
from passgraph.scene.matrices import transform_points
from tests.agreement import assert_within_bounds
from tests.effects.scenes import Picture, cube, floor, render, sun

pytestmark = pytest.mark.slow

SIZE = (160, 90)
#: Errors by scene and filter on a map of 1024: a little more than was measured on 160 × 90 pixels, and less than where
#: maps hold all casters and searches are as wide as the nearest of them asks.
WORST = {
    ("slab", "penumbra"): 0.015,
    ("slab", "pcss"): 0.01,
    ("room", "penumbra"): 0.02,
    ("room", "pcss"): 0.013,
    ("wide", "penumbra"): 0.016,
    ("wide", "pcss"): 0.009,
    ("chequer", "penumbra"): 0.025,
    ("chequer", "pcss"): 0.0135,
}


@lru_cache
def truth(name: str) -> tuple[Picture, NDArray[np.bool_]]:
    traced = truth_of(scene_named(name), SIZE, 144)
    return traced.share, traced.counts


def share(scene: pg.Scene, **options: object) -> Picture:
    passes = soft_shadow_passes(scene, ambient=0.0, **options)  # type: ignore[arg-type]
    assert passes.shadows_blurred is not None
    return next(iter(render(passes.shadows_blurred, size=SIZE, backend="numpy").values()))[:, :, 0]


@pytest.mark.parametrize(("name", "shadow_filter"), list(WORST))
def test_a_caster_in_the_plane_of_the_lamp_does_not_widen_every_search(name: str, shadow_filter: str) -> None:
    """A floor with an underside, walls, a floor 200 wide, and gaps as fine as the penumbra."""
    true, counts = truth(name)
    made = share(scene_named(name), filter=SHADOW_FILTERS[shadow_filter]())
    assert np.sqrt(np.mean((made - true)[counts] ** 2)) < WORST[name, shadow_filter]
    umbra = counts & (true == 0.0)
    assert umbra.sum() > 20 or name == "chequer"
    if umbra.any():
        assert np.mean(made[umbra] > 0.5) < 0.05


@pytest.mark.parametrize("shadow_filter", ["penumbra", "pcss"])
def test_a_larger_map_does_not_widen_searches(shadow_filter: str) -> None:
    """The nearest casters are looked for in the same share of a map whatever its texels."""
    true, counts = truth("room")
    errors = []
    for side in (1024, 2048, 4096):
        made = share(scene_named("room"), filter=SHADOW_FILTERS[shadow_filter](), map_size=side)
        errors.append(float(np.sqrt(np.mean((made - true)[counts] ** 2))))
    assert max(errors[1:]) <= 1.1 * errors[0]


def frustum_of(scene: pg.Scene, seen: Seen | None) -> NDArray[np.float64]:
    """The map that the default filter draws, projection times view."""
    from passgraph.effects.surfaces.map_fit import Fit
    from passgraph.effects.surfaces.views import MapView

    casters, camera = Casters.in_scene(scene), pg.Value("camera", pg.Camera)
    receivers = pieces_of([node for node in scene.nodes if node.receives], casters.origin)
    fit = Fit(camera, casters.origin, receivers, casters.pieces_for, 1024)
    look = MapView(pg.Value("light", pg.Light, default=scene.lights[0]), casters, fit=fit)
    view, projection = look.frustum(scene.lights[0], seen)
    return projection @ view


@pytest.mark.parametrize("eye", [(3, 2.4, 3.4), (0.5, 0.4, 6), (-8, 5, 0.1), (0.3, 9, 0.2)], ids=str)
def test_the_map_holds_all_that_casts_on_what_is_seen(eye: tuple[float, float, float]) -> None:
    """Casters on the way from any seen point of the floor to the light lie in the map, whatever the camera."""
    scene = pg.Scene((floor(30.0), cube(), cube((4, 0, 2), 0.7)), pg.Camera(eye, (0.5, 0.3, 0.5)), (sun(35, 20),))
    matrix = frustum_of(scene, (scene.camera, SIZE))
    rng = np.random.default_rng(1)
    inside, light = 0, scene.lights[0]
    for node in scene.nodes[1:]:
        places = transform_points(node.transform, node.mesh.positions)
        places = rng.dirichlet(np.ones(len(places)), 400) @ places
        below = places - np.array(light.direction) * (places[:, 1:2] / light.direction[1])
        local = transform_points(scene.camera.view_matrix(), below)
        half = np.tan(0.5 * scene.camera.vertical_fov_rad)
        seen = (abs(local[:, 1]) < -half * local[:, 2]) & (abs(local[:, 0]) < -half * local[:, 2] * SIZE[0] / SIZE[1])
        clip = np.concatenate([places[seen], np.ones((seen.sum(), 1))], axis=1) @ matrix.T
        assert (abs(clip[:, :3]) <= clip[:, 3:]).all()
        inside += int(seen.sum())
    assert inside > 50


def test_a_scene_two_hundred_wide_gets_the_texels_of_what_is_seen() -> None:
    """Texels at the ball's place, a scene unit across the light."""
    scene = scene_named("wide")

    def texels(matrix: NDArray[np.float64]) -> float:
        across = np.cross(scene.lights[0].direction, (0.0, 1.0, 0.0))
        a, b = (matrix @ [*(step * across), 1.0] for step in (0.0, 1e-3))
        return float(np.linalg.norm(b[:2] / b[3] - a[:2] / a[3])) * 1e3 * 512.0 / float(np.linalg.norm(across))

    assert texels(frustum_of(scene, (scene.camera, SIZE))) > 100.0


def test_a_thick_floor_is_a_ground_and_a_box_on_it_is_not() -> None:
    casters = Casters.in_scene(scene_named("slab"))
    assert [index for index, _, _ in casters.grounds] == [0]
    assert Casters.in_scene(pg.Scene((floor(1.0), cube()), pg.Camera((3, 3, 3), (0, 0, 0)))).grounds[0][0] == 0


def test_what_the_camera_sees_of_a_box_ends_at_its_frustum() -> None:
    camera = pg.Camera((0, 0, 10), (0, 0, 0), vertical_fov_rad=2.0 * np.arctan(0.1), near=1.0, far=30.0)
    points = seen_points(np.array([[[-100.0, -100.0, -0.5], [100.0, 100.0, 0.5]]]), camera, 2.0, np.zeros(3))
    assert points.min(axis=0).tolist() == pytest.approx([-2.1, -1.05, -0.5])
    assert points.max(axis=0).tolist() == pytest.approx([2.1, 1.05, 0.5])


def test_a_map_is_drawn_again_only_where_its_fit_changes() -> None:
    """A camera that moves a little leaves the map as it is, bit for bit; one that looks elsewhere does not."""
    scene = scene_named("wide")
    matrices = []
    for shift, angle in ((0.0, 0.55), (1e-4, 0.55), (0.0, 0.05)):
        eye, target = (tuple(np.add(place, (shift, 0, 0))) for place in (scene.camera.eye, scene.camera.target))
        camera = pg.Camera(eye, target, vertical_fov_rad=angle, near=0.5, far=60.0)
        matrices.append(frustum_of(scene, (camera, SIZE)))
    assert (matrices[0] == matrices[1]).all()
    assert not (matrices[0] == matrices[2]).all()


def test_runs_with_other_cameras_are_those_of_fresh_programs() -> None:
    """The light rests: only by its fit does the map know that it has to be drawn again."""
    scene = pg.Scene((floor(), cube(), cube((2, 0, 1), 0.4)), pg.Camera((3, 3, 5), (0.4, 0.3, 0)), (sun(radius=0.1),))
    passes = soft_shadow_passes(scene, ambient=0.0, map_size=64)
    assert passes.shadows is not None
    near = pg.Camera((3, 3, 5), (2, 0.2, 1), vertical_fov_rad=0.1)
    with pg.compile(passes.shadows, size=(48, 32)) as program:
        runs = [program(camera=camera)["shadows"] for camera in (scene.camera, near, scene.camera, near)]
    for camera, made in zip((scene.camera, near, scene.camera, near), runs, strict=True):
        with pg.compile(passes.shadows, size=(48, 32)) as fresh:
            assert (fresh(camera=camera)["shadows"] == made).all()
    assert (runs[0] != runs[1]).any()


def test_fit_is_view_or_scene() -> None:
    with pytest.raises(pg.GraphError, match=r"soft_shadow: fit cannot be 'all'; it is one of view, scene"):
        soft_shadow_passes(scene_named("box"), fit="all")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("name", "shadow_filter"),
    [
        ("room", "penumbra"),
        ("room", "pcss"),
        ("slab", "penumbra"),
        ("slab", "pcss"),
    ],
)
def test_every_pass_is_within_the_bounds_of_the_reference(name: str, shadow_filter: str) -> None:
    """Fitted maps, the nearest casters and both searches: under a spot on a thick floor and in a closed room."""
    options: dict[str, Any] = {"filter": {"penumbra": Penumbra, "pcss": Pcss}[shadow_filter](taps=4)}
    made = soft_shadow_passes(scene_named(name), ambient=0.0, map_size=32, **options)
    assert made.shadows_blurred is not None
    assert_within_bounds(made.shadows_blurred, (16, 10))
