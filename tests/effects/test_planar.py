"""Planar shadows and reflection: what each step may do to which pixel."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects.planar import Planar, planar_passes
from passgraph.effects.planar_matrices import mirror, projection
from tests.effects.scenes import Picture, cube, floor, from_above, render, sun

SIZE = (48, 32)
CAMERA = pg.Camera((3, 3, 5), (0, 0.4, 0), vertical_fov_rad=0.8, near=0.5, far=40)
#: An edge may fall to the other side of a pixel's centre.
SHARE_ON_EDGES = 0.01


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


def test_far_away_no_pixel_of_a_shadow_is_lost_to_depth_rounding(backend_name: str) -> None:
    wide = floor(400.0)
    lifted = np.eye(4)
    lifted[1, 3] = 400.0
    roof = pg.Node(wide.mesh, wide.material, lifted, "roof")
    camera = pg.Camera((0, 6, 300), (0, 0, 0), vertical_fov_rad=0.3, near=1.0, far=1000)
    made = passes(pg.Scene((wide, roof), camera, (pg.Light.directional((0, -1, 0)),)), darkness=0.5)
    ratio = render(made.shadowed, size=(96, 64), backend=backend_name)["planar"][:, :, 0]
    ratio = ratio / render(made.objects, size=(96, 64), backend=backend_name)["planar"][:, :, 0]
    rows = np.flatnonzero((ratio < 0.9).any(axis=1))
    inside = ratio[rows[0] + 1 :]  # from the plane's far edge to the bottom of the picture
    assert len(inside) > 20
    assert np.count_nonzero(inside > 0.9) == 0


@lru_cache
def pictures(backend: str) -> dict[str, Picture]:
    lights = (sun(50, 20), pg.Light.point((-2, 4, 2), (1, 0.8, 0.6), 8.0))
    made = planar_passes(scene(lights=lights), fog_start=3.0, fog_end=12.0)
    found = render(made.fogged, made.picture, size=SIZE, backend=backend)
    for name, target in {"reflection": made.reflection, "objects": made.objects, "shadowed": made.shadowed}.items():
        found[name] = render(target, size=SIZE, backend=backend)["planar"]
    return found


def test_every_step_agrees_with_the_reference(backend_name: str) -> None:
    expected, got = pictures("reference"), pictures(backend_name)
    for name, picture in got.items():
        bound = 2 / 255 if name == "picture" else 2.0**-8
        off = (abs(picture - expected[name]) > bound).any(axis=2).mean()
        assert off <= SHARE_ON_EDGES, f"{name}: {off:.2%} of the pixels differ by more than {bound:g}"


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
