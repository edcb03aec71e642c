"""Ray-traced shares of lights, against shares worked out by hand, and rays against every triangle."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from math import cos, hypot, pi, radians, sin
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.scene.matrices import translation
from passgraph.scene.shipped_scene import ball
from passgraph.truth import Tracer, first_surfaces, share, visible_share, visible_shares
from passgraph.truth.surfaces import casting_triangles
from tests.effects.scenes import Float64, cube, floor, from_above, moved, sun

SIZE = (96, 64)


def soup(count: int = 400) -> Float64:
    """Small triangles anywhere in a cube of side 2."""
    rng = np.random.default_rng(5)
    return rng.uniform(-1, 1, (count, 1, 3)) + rng.uniform(-0.4, 0.4, (count, 3, 3))


def rays(count: int = 3000) -> tuple[Float64, Float64]:
    rng = np.random.default_rng(6)
    directions = rng.normal(size=(count, 3))
    return rng.uniform(-1.5, 1.5, (count, 3)), directions / np.linalg.norm(directions, axis=1, keepdims=True)


def distances(corners: Float64, origin: Float64, direction: Float64) -> Float64:
    """To every triangle along one ray, infinite where it is missed: volumes of tetrahedra, by Cramer's rule."""
    a, ab, ac = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(ab, ac)
    det = -normal @ direction
    to = origin - a
    t = np.einsum("ij,ij->i", to, normal) / det
    moment = np.cross(to, direction)
    u, v = np.einsum("ij,ij->i", ac, moment) / det, -np.einsum("ij,ij->i", ab, moment) / det
    return np.where((t > 0) & (u >= 0) & (v >= 0) & (u + v <= 1), t, np.inf)


def test_the_nearest_triangle_is_found() -> None:
    corners = soup()
    origins, directions = rays()
    found = Tracer(corners).closest(origins, directions)
    far = np.array([distances(corners, o, d) for o, d in zip(origins, directions, strict=True)])
    expected = np.where(np.isfinite(far.min(axis=1)), far.argmin(axis=1), -1)
    assert 0.2 < (expected >= 0).mean() < 0.9
    # float32 may miss what a ray touches within 1e-6 of an edge: none in expectation among 3000 rays
    np.testing.assert_array_equal(found, expected)


def test_only_what_lies_before_the_light_blocks() -> None:
    corners = soup()
    origins, directions = rays()
    lengths = np.random.default_rng(7).uniform(0, 2, len(origins))
    far = np.array([distances(corners, o, d).min() for o, d in zip(origins, directions, strict=True)])
    blocked = Tracer(corners).blocked(origins, directions, lengths)
    np.testing.assert_array_equal(blocked, far < lengths)


def test_no_ray_slips_through_edges_and_vertices() -> None:
    """From inside a closed ball every ray meets it, those aimed at vertices and middles of edges too."""
    scene = pg.Scene((pg.Node(ball(1.0, 12)),), pg.Camera((0, 0, 5), (0, 0, 0)))
    corners = casting_triangles(scene, np.zeros(3)).corners
    middles = 0.5 * (corners + np.roll(corners, 1, axis=1))
    aims = np.concatenate([corners.reshape(-1, 3), middles.reshape(-1, 3)])
    origins = np.tile([0.05, 0.02, -0.03], (len(aims), 1))
    directions = aims - origins
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    rays = Tracer(corners)
    assert rays.closest(origins, directions).min() >= 0
    assert rays.blocked(origins, directions, np.full(len(aims), 9.0)).all()


def edge_share(x: Float64) -> Float64:
    """Share of a unit disc on one side of a line at distance x from its middle: a circular segment."""
    x = np.clip(x, -1.0, 1.0)
    return 0.5 + (x * np.sqrt(1.0 - x * x) + np.arcsin(x)) / pi


def half_plane(height: float) -> pg.Node:
    """All of x < 0 at a height, as far as it matters."""
    corners = np.array([[-9, 0, 9], [0, 0, 9], [0, 0, -9], [-9, 0, -9.0]])
    mesh = pg.Mesh.make(corners, [[0, 1, 2], [0, 2, 3]])
    return pg.Node(mesh, pg.Material(double_sided=True), translation((0, height, 0)), "half plane")


#: From the side below the half plane, so that the whole penumbra is seen.
LOW = pg.Camera((1.8, 0.35, 0), (0, 0, 0), vertical_fov_rad=0.6, near=0.01)
DISC_LIGHTS = {
    # an edge at height 0.5 throws the disc at distance 1 to half its radius
    "directional": (pg.Light.directional((0, -1, 0), radius=0.4), 0.4 * 0.5),
    # similar triangles: 1 over the edge, 0.5 under it
    "spot": (pg.Light.spot((0, 1.5, 0), (0, -1, 0), radius=0.6, cone_outer_rad=1.2), 0.6 * 0.5),
}


@pytest.mark.parametrize("kind", list(DISC_LIGHTS))
def test_an_edge_under_a_disc_has_the_profile_of_a_circular_segment(kind: str) -> None:
    light, half_width = DISC_LIGHTS[kind]
    scene = pg.Scene((floor(9.0), half_plane(0.5)), LOW, (light,))
    seen = first_surfaces(scene, SIZE)
    truth = visible_share(scene, SIZE, samples=256)
    on_floor = (seen.node == 0) & truth.valid
    x = (seen.positions + seen.origin)[on_floor, 0]
    expected = edge_share(x / half_width)
    penumbra = (abs(x) < half_width) & (abs(x) > 0)
    assert penumbra.sum() > 300
    off = truth.share[on_floor] - expected
    assert abs(off[~penumbra]).max() == 0.0
    # the reported error is that of the picture: a mean over hundreds of pixels knows it to a few percent
    told = np.sqrt(np.mean(truth.error[on_floor][penumbra] ** 2))
    assert np.sqrt(np.mean(off[penumbra] ** 2)) == pytest.approx(told, rel=0.2)
    assert told < 0.01


def cap_overlap(alpha: float, beta: float, apart: float) -> float:
    """Share of the cap of half angle alpha that a cap of half angle beta covers, middles ``apart``: a fine sum."""
    n = 400
    cosine = 1.0 - (1.0 - cos(alpha)) * (np.arange(n) + 0.5) / n
    angle = 2.0 * pi * (np.arange(n) + 0.5) / n
    c, a = np.meshgrid(cosine, angle)
    along = np.sqrt(1.0 - c * c) * np.cos(a) * sin(apart) + c * cos(apart)
    return float((along > cos(beta)).mean())


def test_a_ball_before_a_ball_of_light_covers_the_share_that_two_caps_have_in_common() -> None:
    """Floor points see light and caster as two discs of the sky, as in an eclipse."""
    place, radius, middle, size = np.array([0, 4.0, 0]), 0.8, np.array([0, 1.5, 0]), 0.4
    caster = pg.Node(ball(size, 96), transform=translation(middle), name="ball")
    camera = pg.Camera((1.6, 0.4, 0), (0, 0, 0), vertical_fov_rad=0.8, near=0.01)
    scene = pg.Scene((floor(9.0), caster), camera, (pg.Light.point(tuple(place), radius=radius),))
    seen = first_surfaces(scene, SIZE)
    truth = visible_share(scene, SIZE, samples=256)
    points = (seen.positions + seen.origin)[::5, ::5]
    on_floor = (seen.node == 0)[::5, ::5]
    off, told = [], []
    for p, got, error in zip(
        points[on_floor], *(x[::5, ::5][on_floor] for x in (truth.share, truth.error)), strict=True
    ):
        to_light, to_ball = place - p, middle - p
        a, b = np.linalg.norm(to_light), np.linalg.norm(to_ball)
        apart = np.arccos(np.clip(to_light @ to_ball / (a * b), -1, 1))
        expected = 1.0 - cap_overlap(np.arcsin(radius / a), np.arcsin(size / b), apart)
        off.append(got - expected)
        told.append(error)
        assert (got in (0.0, 1.0)) == (expected in (0.0, 1.0)) or abs(got - expected) < 0.01
    # the sum over caps has cells of 1/400; the mesh is thinner than a ball by 1 - cos(pi / 192), 1e-4
    assert np.sqrt(np.mean(np.square(off))) < hypot(1.3 * np.sqrt(np.mean(np.square(told))), 1 / 400)
    assert min(truth.share[seen.node == 0]) < 0.3


def test_a_light_without_extent_makes_a_hard_shadow() -> None:
    scene = pg.Scene((floor(9.0), cube()), from_above(6.0), (sun(45.0),))
    seen = first_surfaces(scene, SIZE)
    truth = visible_share(scene, SIZE)
    x, _, z = np.moveaxis(seen.positions + seen.origin, 2, 0)
    inside = (seen.node == 0) & (x > 0.5) & (x < 1.5) & (abs(z) < 0.5)
    lit = truth.valid & ~inside
    assert inside.sum() > 100
    assert truth.share[inside].max() == 0.0
    assert truth.share[lit].min() == 1.0
    assert (truth.samples, truth.noise) == (1, 0.0)


def everything(*lights: pg.Light) -> pg.Scene:
    nodes = (floor(), cube(), cube((-1.2, 0, 1.0), 0.6), pg.Node(ball(0.4), transform=translation((1.2, 0.4, 0.8))))
    return pg.Scene(nodes, pg.Camera((3, 3, 5), (0, 0.4, 0), vertical_fov_rad=0.6), lights)


ALL_LIGHTS = (
    sun(35, 20, radius=0.2),
    pg.Light.point((0.5, 2.5, 1.5), radius=0.3),
    pg.Light.spot((2, 4, 3), (-0.5, -1, -0.8), radius=0.3, cone_outer_rad=0.4),
)


class EveryTriangle:
    """Asks every triangle about every ray, in float64."""

    rounding = 1e-9

    def __init__(self, corners: Float64) -> None:
        self.corners = corners

    def blocked(self, origins: Float64, directions: Float64, lengths: Float64) -> NDArray[np.bool_]:
        each = zip(origins, directions, strict=True)
        with np.errstate(divide="ignore", invalid="ignore"):
            nearest = [distances(self.corners, origin, direction).min() for origin, direction in each]
        return np.array(nearest) < lengths


@pytest.mark.slow
def test_shares_are_those_of_asking_every_triangle(monkeypatch: pytest.MonkeyPatch) -> None:
    scene, size = everything(*ALL_LIGHTS), (24, 16)
    traced = visible_shares(scene, size, samples=16)
    monkeypatch.setattr(share, "Tracer", EveryTriangle)
    for one, other in zip(traced, visible_shares(scene, size, samples=16), strict=True):
        np.testing.assert_array_equal(one.valid, other.valid)
        assert 0.0 < one.share[one.valid].mean() < 1.0
        # the rays are the same: only those that graze an edge within float32's rounding may differ
        assert np.sqrt(np.mean((one.share - other.share)[one.valid] ** 2)) < 0.25 * one.noise


@pytest.mark.parametrize("light", ALL_LIGHTS, ids=lambda light: light.kind)
def test_the_noise_is_what_another_seed_changes(light: pg.Light) -> None:
    scene = everything(light)
    one, again, other, finer = (
        visible_share(scene, SIZE, samples=n, seed=seed) for n, seed in ((36, 1), (36, 1), (36, 2), (576, 1))
    )
    np.testing.assert_array_equal(one.share, again.share)
    change = np.sqrt(np.mean((one.share - other.share)[one.valid] ** 2))
    assert change == pytest.approx(np.hypot(one.noise, other.noise), rel=0.15)
    # 16 times the samples: a quarter of the noise for independent ones, less for stratified ones
    assert 0.0 < finer.noise < one.noise / 4.0


def test_only_geometry_between_surface_and_light_counts() -> None:
    """A ceiling over the lamps hides nothing below them."""
    ceiling = pg.Node(floor(9.0).mesh, transform=translation((0, 2.2, 0)), name="ceiling")
    lamps = (pg.Light.point((0, 2, 0), radius=0.15), pg.Light.spot((0, 2, 0), (0, -1, 0), radius=0.15))
    scene = pg.Scene((floor(3.0), ceiling), pg.Camera((0, 1, 3), (0, 0, 0)), lamps)
    for truth in visible_shares(scene, SIZE, samples=16):
        assert truth.valid.any()
        assert truth.share.min() == 1.0


def test_far_from_the_origin_the_share_is_the_same() -> None:
    near = everything(ALL_LIGHTS[0])
    far = moved(near, (1e7, -2e7, 1e7))
    a, b = (visible_share(scene, SIZE, samples=16) for scene in (near, far))
    # float64 keeps 4e-9 units at 2e7: a ray may fall to the other side of an edge, not more
    assert (abs(a.share - b.share) > 1.0 / 16).mean() < 1e-3


@pytest.mark.parametrize("camera", [{}, {"orthographic_height": 4.0}, {"shift": (0.3, -0.2)}], ids=str)
def test_first_surfaces_lie_where_the_rasteriser_puts_them(camera: dict[str, Any]) -> None:
    from passgraph.effects import soft_shadow_passes

    scene = everything(ALL_LIGHTS[0])
    scene = scene.with_(camera=replace(scene.camera, **camera))
    with pg.compile(soft_shadow_passes(scene, map_size=64).depth, backend="reference", size=SIZE) as program:
        raster = program()["depth"][:, :, 0]
    seen = first_surfaces(scene, SIZE)
    both = (seen.depth > 0) & (raster > 0)
    # vertices are snapped to 1/256 pixel, so that silhouettes may differ, and depths by as much on a slope
    assert ((seen.depth > 0) != (raster > 0)).sum() <= 2
    assert np.median(abs(seen.depth - raster)[both]) < 1e-4
    assert (abs(seen.depth - raster)[both] > 0.02).mean() < 2e-3


def test_back_faces_are_seen_through_unless_the_material_is_double_sided() -> None:
    for double_sided in (False, True):
        sheet = pg.Node(floor(1.0).mesh, pg.Material(double_sided=double_sided), translation((0, 1, 0)), "sheet")
        scene = pg.Scene((floor(9.0), sheet), pg.Camera((0, 0.5, 0), (0, 2, 0), up=(1, 0, 0)), ALL_LIGHTS[:1])
        up = first_surfaces(scene, (8, 8))
        assert set(up.node.ravel().tolist()) == ({1} if double_sided else {-1})
        down = first_surfaces(scene, (8, 8), pg.Camera((0, 3, 0), (0, 0, 0), up=(1, 0, 0), near=2.5))
        assert set(down.node.ravel().tolist()) == {0}, "the near plane cuts the sheet away"


def test_nodes_that_do_not_cast_or_receive_are_honoured() -> None:
    light = sun(45.0, radius=0.1)
    silent = pg.Scene((floor(), cube(casts=False)), from_above(6.0), (light,))
    truth = visible_share(silent, SIZE, samples=16)
    assert truth.share[first_surfaces(silent, SIZE).node == 0].min() == 1.0
    deaf = pg.Scene((floor(receives=False), cube()), from_above(6.0), (light,))
    truth = visible_share(deaf, SIZE, samples=16)
    assert not truth.valid[first_surfaces(deaf, SIZE).node == 0].any()
    assert truth.share[~truth.valid].min() == 1.0


def test_spot_cones_bound_where_a_share_means_something() -> None:
    light = pg.Light.spot((0, 2, 0), (0, -1, 0), radius=0.1, cone_outer_rad=radians(20))
    scene = pg.Scene((floor(),), from_above(6.0, 0.0), (light,))
    truth = visible_share(scene, SIZE, samples=4)
    x, _, z = np.moveaxis(first_surfaces(scene, SIZE).positions, 2, 0)
    np.testing.assert_array_equal(truth.valid, np.hypot(x, z) < 2 * np.tan(radians(20)))


def test_rays_come_in_batches_and_progress_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    most, steps = [], []

    class Counting:
        rounding = 1e-9

        def blocked(self, origins: Float64, directions: Float64, lengths: Float64) -> NDArray[np.bool_]:
            most.append(len(origins))
            return np.zeros(len(origins), np.bool_)

    monkeypatch.setattr(share, "RAYS", 4096)
    monkeypatch.setattr(share, "Tracer", lambda corners: Counting())
    visible_shares(everything(*ALL_LIGHTS), SIZE, samples=16, progress=steps.append)
    assert max(most) <= 4096
    assert len(steps) > 20
    assert steps == sorted(steps)
    assert steps[-1] == 1.0


def test_import_loads_neither_a_compiler_nor_a_tracer() -> None:
    code = "import sys, passgraph.truth; print({'numba', 'embreex', 'trimesh'} & set(sys.modules))"
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).resolve().parent.parent)}
    made = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
    assert made.stdout == "set()\n"


def _with_holes() -> pg.Scene:
    pixels = np.full((4, 4, 4), 255, np.uint8)
    material = pg.Material("lace", base_color_texture=pg.Texture.make(pixels), alpha_mode="mask")
    return pg.Scene((floor(), pg.Node(cube().mesh, material, name="sheet")), LOW, ALL_LIGHTS)


@pytest.mark.parametrize(
    ("scene", "options", "message"),
    [
        (everything(), {}, "no light to trace to"),
        (everything(*ALL_LIGHTS), {"samples": 0}, "samples: expected 1 to 65536, got 0"),
        (_with_holes(), {}, "node 'sheet': the holes of its material 'lace' come from a texture"),
    ],
    ids=["light", "samples", "holes"],
)
def test_what_cannot_be_traced_is_refused(scene: pg.Scene, options: dict[str, object], message: str) -> None:
    with pytest.raises(pg.InputError, match=message):
        visible_share(scene, SIZE, **options)  # type: ignore[arg-type]


def test_an_empty_picture_is_refused() -> None:
    with pytest.raises(pg.InputError, match="expected at least 1 x 1 pixels, got 0 x 4"):
        visible_share(everything(*ALL_LIGHTS), (0, 4))


def test_a_missing_embreex_is_told_with_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "embreex", None)
    monkeypatch.delitem(sys.modules, "embreex.mesh_construction", raising=False)
    with pytest.raises(pg.InputError, match=r"needs the package embreex .*: pip install 'passgraph\[truth\]'"):
        Tracer(soup(3))
