"""Planar shadows and reflection: what each step may do to which pixel."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects.planar_shadows.planar import Planar, mirror, planar_passes, projection
from tests.agreement import assert_within_bounds
from tests.effects.scenes import cube, floor, floor_places, from_above, render, sun

SIZE = (48, 32)
CAMERA = pg.Camera((3, 3, 5), (0, 0.4, 0), vertical_fov_rad=0.8, near=0.5, far=40)


def scene(camera: pg.Camera = CAMERA, **options: Any) -> pg.Scene:
    # two cubes whose shadows overlap, each of several triangles
    nodes = (floor(2.5), cube((0, 0.3, 0)), cube((0.4, 0.5, 0.3), 0.6))
    return pg.Scene(nodes, camera, options.get("lights", (sun(50, 20),)))


def passes(made: pg.Scene, **options: Any) -> Planar:
    return planar_passes(made, **{"display": False, "fog": "none", **options})


@pytest.mark.parametrize("light", [sun(50, 20), pg.Light.point((-3, 6, 1), intensity=30.0)])
def test_a_shadow_darkens_each_pixel_once(light: pg.Light, backend_name: str) -> None:
    made = passes(scene(lights=(light,)), darkness=0.5)
    shown = render(made.shadowed, size=SIZE, backend=backend_name)["planar"][:, :, 0]
    before = render(made.objects, size=SIZE, backend=backend_name)["planar"][:, :, 0]
    ratio = shown / before
    dark = ratio < 0.9
    assert dark.mean() > 0.02
    assert abs(ratio[dark] - 0.5).max() < 2e-3
    assert (ratio[~dark] == 1.0).all()


def test_shadows_of_two_lights_multiply(backend_name: str) -> None:
    both = passes(scene(lights=(sun(50, 20), sun(55, 30))), darkness=0.5)
    shown = render(both.shadowed, size=SIZE, backend=backend_name)["planar"][:, :, 0]
    ratio = shown / render(both.objects, size=SIZE, backend=backend_name)["planar"][:, :, 0]
    near = np.abs(ratio[:, :, None] - np.array([1.0, 0.5, 0.25])).min(axis=2)
    assert near.max() < 2e-3
    assert (ratio < 0.3).any()
    assert ((ratio > 0.4) & (ratio < 0.6)).any()


def test_the_shadow_of_a_cube_lies_where_geometry_says(backend_name: str) -> None:
    camera = from_above()
    made = passes(pg.Scene((floor(4.0), cube((0, 0, 0))), camera, (sun(45),)), darkness=1.0)
    shown = render(made.shadowed, size=(96, 64), backend=backend_name)["planar"][:, :, 0]
    half = np.tan(0.5 * camera.vertical_fov_rad) * 8.0
    x = 0.5 + (2 * (np.arange(96) + 0.5) / 96 - 1) * half * 1.5
    dark = x[shown[32] < 0.01]
    assert dark.max() == pytest.approx(1.5, abs=0.1)  # a cube of height 1 under 45 degrees ends 1 farther


def test_the_reflection_is_a_mirrored_scene_inside_the_plane(backend_name: str) -> None:
    reflected = render(passes(scene()).reflection, size=SIZE, backend=backend_name)["planar"][:, :, :3]
    turned = tuple(pg.Node(n.mesh, n.material, mirror(0.0) @ n.transform) for n in scene().nodes[1:])
    up = pg.Light.directional(sun(50, 20).direction * np.array([1, -1, 1]), radius=0.0)
    plain = passes(pg.Scene(turned, CAMERA, (up,)), height=-50.0)
    expected = render(plain.objects, size=SIZE, backend=backend_name)["planar"][:, :, :3]
    # the plane's own pixels
    white = passes(pg.Scene((floor(2.5),), CAMERA), top_opacity=1.0, ambient=9.0)
    inside = render(white.objects, size=SIZE, backend=backend_name)["planar"][:, :, 0] > 5.0
    sky = reflected[0, 0]
    seen = (abs(reflected - sky) > 1e-3).any(axis=2)
    assert seen.sum() > 30
    assert not (seen & ~inside).any()
    differs = (abs(reflected - expected) > 2e-3).any(axis=2) & inside & seen
    assert differs.sum() <= 3


def test_from_below_the_bottom_is_seen(backend_name: str) -> None:
    below = pg.Camera((0, -4, 3), (0, 0, 0))
    made = passes(scene(below), bottom=(0.2, 0.4, 0.8), bottom_opacity=1.0, ambient=1.0)
    shown = render(made.shadowed, size=SIZE, backend=backend_name)["planar"]
    assert shown[16, 24, :3] == pytest.approx([0.2, 0.4, 0.8], abs=2e-3)


def test_opacity_mixes_the_reflection_in(backend_name: str) -> None:
    plane = pg.Scene((floor(4.0),), CAMERA)
    made = passes(plane, top=(1, 1, 1), top_opacity=0.25, ambient=0.5, fog_color=(1.0, 0.0, 0.0))
    shown = render(made.objects, size=SIZE, backend=backend_name)["planar"]
    assert shown[16, 24, :3] == pytest.approx([0.875, 0.125, 0.125], abs=2e-3)


@pytest.mark.parametrize("fog", ["linear", "exp", "exp2"])
def test_fog_is_the_formula(fog: Any, backend_name: str) -> None:
    made = passes(pg.Scene((floor(4.0),), from_above(8.0)), fog=fog, top_opacity=1.0, ambient=0.5,
                  fog_color=(1.0, 0.0, 0.0), fog_start=2.0, fog_end=14.0, fog_density=0.1)  # fmt: skip
    shown = render(made.fogged, size=SIZE, backend=backend_name)["planar fog"][16, 24]
    f = {"linear": 0.5, "exp": np.exp(-0.8), "exp2": np.exp(-0.64)}[fog]
    assert shown[:3] == pytest.approx([1 - f + 0.5 * f, 0.5 * f, 0.5 * f], abs=2e-3)


def crumpled_roof(height: float = 400.0, half: float = 700.0) -> pg.Node:
    """Some thousand triangles askew whose shadow covers everything below: no edge falls on one of the plane's."""
    axis = np.linspace(-half, half, 25)
    x, z = np.meshgrid(axis, axis)
    y = height + np.random.default_rng(3).uniform(-60, 60, x.shape)
    turned = np.stack([np.cos(0.4) * x - np.sin(0.4) * z, y, np.sin(0.4) * x + np.cos(0.4) * z], axis=-1)
    index = np.arange(x.size).reshape(x.shape)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    triangles = np.concatenate([np.stack([a, d, c], -1), np.stack([a, c, b], -1)]).reshape(-1, 3)
    return pg.Node(pg.Mesh.make(turned.reshape(-1, 3), triangles), pg.Material("roof", (1, 1, 1, 1)))


def share_lost_to_depth_rounding(lift: float, backend: str) -> float:
    """Of the plane's pixels, all of which lie in shadow."""
    camera = pg.Camera((0, 20, 390), (0, 0, 0), vertical_fov_rad=0.3, near=0.1, far=1000)
    of = pg.Scene((floor(400.0), crumpled_roof()), camera, (pg.Light.directional((0, -1, 0)),))
    made = passes(of, darkness=0.5, lift=lift)
    before = render(made.objects, size=(96, 64), backend=backend)["planar"][:, :, 0]
    ratio = render(made.shadowed, size=(96, 64), backend=backend)["planar"][:, :, 0] / before
    plane = abs(before - before[-1, 48]) < 1e-3
    assert plane.mean() > 0.5
    return float((ratio[plane] > 0.9).mean())


def test_far_away_lifted_shadows_lose_no_pixel_to_depth_rounding(backend_name: str) -> None:
    """Equal depths from other triangles speckle on every backend; a thousandth of a unit at 390 units does not."""
    assert share_lost_to_depth_rounding(0.0, backend_name) > 0.01
    assert share_lost_to_depth_rounding(0.001, backend_name) == 0.0


def slab(at: tuple[float, float, float], material: pg.Material | None = None, half: float = 0.5) -> pg.Node:
    """Faces down: a camera above sees its shadow and not itself."""
    plane = floor(half).mesh
    mesh = pg.Mesh.make(plane.positions + np.float32(at), plane.triangles[:, ::-1])
    return pg.Node(mesh, material or pg.Material("slab", (1, 1, 1, 1)), name="slab")


def test_a_spot_lights_and_shadows_inside_its_cone(backend_name: str) -> None:
    camera = from_above(8.0, 0.0)
    spot = pg.Light.spot((0, 4, 0), (0, -1, 0), intensity=16.0, cone_inner_rad=0.2, cone_outer_rad=0.45)
    # the slab's shadow is twice as large: all of the picture's right half
    of = pg.Scene((floor(6.0), slab((3, 2, 0), half=3.0)), camera, (spot,))
    made = passes(of, darkness=0.6, top_opacity=1.0, ambient=0.125)
    lit = render(made.objects, backend=backend_name)["planar"][:, :, 0]
    x, z = floor_places(camera)
    far = np.sqrt(x**2 + z**2 + 16.0)
    t = np.clip((4.0 / far - np.cos(0.45)) / (np.cos(0.2) - np.cos(0.45)), 0, 1)
    cone = t * t * (3 - 2 * t)
    np.testing.assert_allclose(lit, 0.125 + 16 * 4 / far**3 * cone, rtol=2e-3, atol=2e-4)
    assert (cone == 0).any() and (cone == 1).any()
    shadows = render(made.shadowed, backend=backend_name)["planar"][:, :, 0] / lit
    np.testing.assert_allclose(shadows[x < -0.1], 1.0, atol=1e-3)
    beside = x > 0.1
    np.testing.assert_allclose(shadows[beside], (1 - 0.6 * cone)[beside], atol=2e-3)


def test_a_translucent_slab_lets_its_colour_through(backend_name: str) -> None:
    """And adds nothing where a solid one already throws its shadow."""
    glass = pg.Material("glass", (1.0, 0.5, 0.0, 0.25), alpha_mode="blend")
    camera = from_above(8.0, 0.0)
    bodies = (slab((0, 1, 0), glass), slab((0.5, 2, 0)))
    of = pg.Scene((floor(6.0), *bodies), camera, (sun(45, 90.0),))
    made = passes(of, darkness=0.5, ambient=1.0, top_opacity=1.0)
    before = render(made.objects, backend=backend_name)["planar"]
    ratio = (render(made.shadowed, backend=backend_name)["planar"] / before)[:, :, :3]
    x, z = floor_places(camera)
    # at 45 degrees a slab's shadow lies as far off as it is high: z 0.5 to 1.5, and 1.5 to 2.5 for the solid one
    at = (abs(x) < 0.4) & (z > 0.6) & (z < 1.4)
    left = 1 - 0.5 * (1 - 0.75 * np.array([1, 0.5, 0]))
    np.testing.assert_allclose(ratio[at], np.tile(left, (at.sum(), 1)), atol=2e-3)
    solid = (abs(x - 0.5) < 0.4) & (z > 1.6) & (z < 2.2)
    np.testing.assert_allclose(ratio[solid], 0.5, atol=2e-3)
    over = passes(of.with_(nodes=(floor(6.0), slab((0, 1, 0), glass), slab((0, 0.99, 0)))), darkness=0.5, ambient=1.0)
    before = render(over.objects, backend=backend_name)["planar"]
    ratio = (render(over.shadowed, backend=backend_name)["planar"] / before)[:, :, :3]
    np.testing.assert_allclose(ratio[at & (z > 0.65)], 0.5, atol=2e-3)


def test_the_steps_keep_their_order() -> None:
    """Stencil, reflection, plane, objects, a shadow for each light (lifted by its matrix, step 5), fog."""
    made = planar_passes(scene(lights=(sun(50, 20), sun(55, 30)))).fogged
    with pg.compile(made, backend="null", size=SIZE) as program:
        names = [step.name for step in program.plan.steps]
    assert [int(name[0]) for name in names] == [1, 2, 3, 4, 6, 6, 7]


@pytest.mark.slow
def test_every_step_agrees_with_the_reference() -> None:
    """Of lights of three kinds, with a body that lets light through."""
    spot = pg.Light.spot((-2, 4, 2), (0.5, -1, -0.3), (1, 0.8, 0.6), 20.0, cone_outer_rad=0.5)
    lights = (sun(50, 20), pg.Light.point((2, 4, 2), (1, 0.8, 0.6), 8.0), spot)
    glass = pg.Material("glass", (1.0, 0.5, 0.0, 0.25), alpha_mode="blend")
    of = scene(lights=lights)
    made = planar_passes(
        of.with_(nodes=(*of.nodes, replace(cube((-1.2, 0.4, 0.5), 0.5), material=glass))), fog_start=3.0, fog_end=12.0
    )
    assert_within_bounds(made.picture, (20, 14))


def test_the_matrix_lands_on_the_plane_in_line_with_the_light() -> None:
    light, point = np.array([1.0, 5.0, -2.0, 1.0]), np.array([0.3, 2.0, 0.7, 1.0])
    flat = projection(light, 0.5) @ point
    flat = flat[:3] / flat[3]
    assert flat[1] == pytest.approx(0.5)
    assert np.cross(flat - light[:3], point[:3] - light[:3]) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("wrong", [{"fog": "smoke"}, {"darkness": 2.0}, {"lift": -1.0}, {"fog_start": 50.0}])
def test_what_cannot_be_is_named(wrong: dict[str, Any]) -> None:
    with pytest.raises(pg.GraphError, match=next(iter(wrong))):
        planar_passes(scene(), **wrong)
