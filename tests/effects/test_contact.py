"""Contact penumbra: how dark the floor is under what, and where it is not."""

from __future__ import annotations

import inspect
from dataclasses import replace

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects.ambient.contact import Contact, Darkness, contact, contact_passes
from passgraph.effects.surfaces.batches import merged
from passgraph.graph.targets import Absolute
from passgraph.scene.matrices import translation
from passgraph.scene.shipped_scene import ball
from tests.effects.scenes import Picture, cube, floor, floor_places, from_above, render, sun

SIZE = (48, 32)


def passes(*bodies: pg.Node, darkness: Darkness = 1.0) -> Contact:
    camera = pg.Camera((3, 3, 5), (0, 0.2, 0), vertical_fov_rad=0.7)
    made = pg.Scene((floor(), *bodies), camera, (sun(50, 20),))
    return contact_passes(made, threshold=0.4, darkness=darkness, map_size=32)


def shown(made: pg.Target, backend: str) -> Picture:
    declared = isinstance(made.spec.size, Absolute)  # the map has a size of its own
    return render(made, size=None if declared else SIZE, backend=backend)[made.name]


@pytest.mark.parametrize("height", [0.0, 0.1, 0.2, 0.3])
def test_darkness_falls_linearly_to_the_threshold(height: float, backend_name: str) -> None:
    seen = shown(passes(cube((0, height, 0))).map, backend_name)
    assert seen[16, 16, :3] == pytest.approx(height / 0.4, abs=1e-3)
    assert (seen[0] == 1.0).all()


def test_darkness_scales_it(backend_name: str) -> None:
    assert shown(passes(cube(), darkness=0.5).map, backend_name)[16, 16, 0] == pytest.approx(0.5, abs=1e-3)


def test_what_is_above_the_threshold_throws_nothing(backend_name: str) -> None:
    # the high one lies beside the low one, inside the map that both give
    seen = shown(passes(cube((-1, 0, 0), 0.5), cube((1, 0.41, 0), 0.5), cube((1, 0, 1), 0.1)).map, backend_name)
    left, right = seen[:, :16, 0], seen[:, 16:, 0]
    assert (left < 0.01).sum() > 20
    assert 0 < (right < 0.99).sum() <= 9


def test_a_translucent_body_throws_its_colour(backend_name: str) -> None:
    glass = pg.Material("glass", (1.0, 0.5, 0.0, 0.25), alpha_mode="blend")
    seen = shown(passes(pg.Node(cube().mesh, glass)).map, backend_name)
    assert seen[16, 16, :3] == pytest.approx([0.75, 0.375, 0.0], abs=2e-3)


def test_the_opacity_of_a_solid_body_means_nothing(backend_name: str) -> None:
    solid = pg.Material("solid", (1.0, 0.5, 0.0, 0.25), alpha_mode="opaque")
    seen = shown(passes(pg.Node(cube().mesh, solid)).map, backend_name)
    assert seen[16, 16, :3] == pytest.approx([0.0, 0.0, 0.0], abs=2e-3)


def test_a_floor_in_the_same_mesh_is_not_its_own_contact(backend_name: str) -> None:
    made = passes(pg.Node(merged([floor(2.0), cube()], np.zeros(3)), pg.Material("all", (1, 1, 1, 1))))
    seen = shown(made.map, backend_name)[:, :, 0]
    # the floor is 4 wide, and the map a quarter wider
    at = (np.arange(32) + 0.5) * 5 / 32 - 2.5
    away = np.maximum(*np.meshgrid(abs(at), abs(at)))
    assert (seen[away < 0.5 - 5 / 32] == 0.0).all()
    assert (seen[away > 0.5 + 5 / 32] == 1.0).all()


@pytest.mark.parametrize(("phase", "x"), [(0.0, 0.0), (1.5, 0.0), (1.5, 0.7)])
def test_the_shadow_follows_a_body_that_moves_and_deforms(phase: float, x: float, backend_name: str) -> None:
    """A cloth in waves, faces down so that a camera above sees the floor through it."""
    at = np.linspace(-1, 1, 81)
    u, v = np.meshgrid(at, at)
    index = np.arange(u.size).reshape(u.shape)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    faces = np.concatenate([np.stack([a, c, d], -1), np.stack([a, b, c], -1)]).reshape(-1, 3)
    cloth = np.stack([u + x, 0.2 + 0.1 * np.sin(4 * u + phase), v], -1).reshape(-1, 3)
    body = pg.Node(pg.Mesh.make(cloth, faces), pg.Material("cloth", (1, 1, 1, 1)), name="cloth")
    camera = from_above(8.0, 0.5)
    made = contact_passes(
        pg.Scene((floor(6.0), body), camera, (sun(50, 20),)), threshold=0.4, darkness=1.0, map_size=128
    )
    share = render(made.share, backend=backend_name)["contact share"][:, :, 0]
    on_x, on_z = floor_places(camera)
    texel = 2.0 * (1 + 8 / 128) / 128
    inside = (abs(on_x - x) < 1 - texel) & (abs(on_z) < 1 - texel)
    outside = (abs(on_x - x) > 1 + texel) | (abs(on_z) > 1 + texel)
    expected = (0.2 + 0.1 * np.sin(4 * (on_x - x) + phase)) / 0.4
    # chords of the waves' 1/40, of the texels between which is interpolated; half floats, stored twice
    bend = 0.1 * 16 / 8 * (0.025**2 + texel**2) / 0.4
    assert abs(share - expected)[inside].max() <= bend + 2.0**-10 + 0.4 * texel / 256 / 0.4
    assert (share[outside] == 1.0).all()
    assert inside.sum() > 500


def named(name: str, x: float, y: float = 0.0) -> pg.Node:
    return replace(cube((x, y, 0)), name=name)


def test_each_body_has_its_own_darkness(backend_name: str) -> None:
    """Of two over one texel the darker counts; a body without a name in the mapping takes 0.7."""
    bodies = (named("cloth", -1.5), named("figure", 0), named("shoe", 0, 0.1), named("bag", 1.5))
    seen = shown(passes(*bodies, darkness={"cloth": 0.2, "figure": 0.5, "shoe": 0.9}).map, backend_name)[16, :, 0]
    # the map is 4 wide and has a margin of an eighth to both sides together
    at = [16 + round(x * 32 / 5.0) for x in (-1.5, 0.0, 1.5)]
    expected = [0.8, min(0.5, 1 - 0.9 * (1 - 0.1 / 0.4)), 0.3]
    assert seen[at] == pytest.approx(expected, abs=1e-3)


@pytest.mark.parametrize("sunk", [0.3, 0.5, 0.8], ids=["a little", "to the middle", "most"])
def test_a_sphere_sunk_in_the_plane_darkens_only_what_it_is_over(sunk: float, backend_name: str) -> None:
    body = pg.Node(ball(0.5, 64), pg.Material("white", (1, 1, 1, 1)), translation((0, 0.5 - sunk, 0)), "ball")
    seen = shown(passes(body).map, backend_name)[:, :, 0]
    texel = 1.25 / 32
    at = (np.arange(32) + 0.5) * texel - 0.625
    away = np.hypot(*np.meshgrid(at, at))
    water = np.sqrt(0.25 - (0.5 - sunk) ** 2)  # radius of the circle in which the plane cuts it
    assert (seen[away < water - texel] == 0.0).all()
    assert (seen[away > 0.5 + texel] == 1.0).all()
    flank = (away > water + texel) & (away < 0.5 - texel)
    expected = 1.0
    if sunk < 0.5:
        expected = np.clip((0.5 - sunk - np.sqrt(np.clip(0.25 - away**2, 0, 1))) / 0.4, 0, 1)[flank]
    # chords of the sphere's 64 rings, and half floats
    assert abs(seen[flank] - expected).max(initial=0.0) <= 2.0**-11 + 0.5 * (np.pi / 64) ** 2 / 0.4


def test_what_cannot_be_is_named() -> None:
    with pytest.raises(pg.GraphError, match="within"):
        passes(cube((0, 2, 0)))
    with pytest.raises(pg.GraphError, match=r"darkness must be 0 to 1, got 1\.5"):
        passes(cube(), darkness=1.5)
    with pytest.raises(pg.GraphError, match="darkness of 'cube' must be 0 to 1, got -1"):
        passes(cube(), darkness={"cube": -1})
    with pytest.raises(pg.GraphError, match="no node 'cub'; did you mean 'cube'"):
        passes(cube(), darkness={"cub": 0.5})


def test_the_short_form_takes_the_same_options() -> None:
    made = pg.Scene((floor(), cube()), pg.Camera((3, 3, 5), (0, 0, 0)))
    assert inspect.signature(contact).parameters == inspect.signature(contact_passes).parameters
    assert "threshold : " in (contact.__doc__ or "")
    with pytest.raises(pg.GraphError, match="threshold"):
        contact(made, threshold=-1.0)
    with pytest.raises(TypeError, match="treshold"):
        contact(made, treshold=1.0)  # type: ignore[call-arg]
