"""Contact penumbra on a height field, held against the field's and the bodies' formulas."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects.ambient.contact import Contact, contact_passes
from passgraph.graph.targets import Absolute
from passgraph.scene.matrices import translation
from passgraph.scene.shipped_scene import ball
from tests.agreement import assert_within_bounds
from tests.effects.scenes import Float64, Picture, cube, render, sun

SIZE = (64, 48)
MAP = 64
THRESHOLD = 0.4
Field = Callable[[Float64, Float64], Float64]


def ramp(x: Float64, z: Float64) -> Float64:
    return 0.35 * x + 0.1 * z + 2.0


def waves(x: Float64, z: Float64) -> Float64:
    return 0.25 * np.sin(2.0 * x) * np.cos(1.5 * z) - 1.0


FIELDS: dict[str, Field] = {"ramp": ramp, "waves": waves}
#: Steepest slope of each, and its distance from flat triangles: cell² / 8 times the second derivative's norm.
CELL = 8.0 / 160
SLOPE = {"ramp": 0.37, "waves": 0.55}
FACET = {"ramp": 1e-6, "waves": CELL**2 / 4 * 0.25 * 4.0}


def terrain(field: Field, half: float = 4.0) -> pg.Node:
    count = round(2 * half / CELL)
    axis = np.linspace(-half, half, count + 1)
    x, z = np.meshgrid(axis, axis)
    index = np.arange((count + 1) ** 2).reshape(count + 1, -1)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    triangles = np.concatenate([np.stack([a, d, c], -1), np.stack([a, c, b], -1)]).reshape(-1, 3)
    mesh = pg.Mesh.make(np.stack([x, field(x, z), z], -1).reshape(-1, 3), triangles)
    return pg.Node(mesh, pg.Material("earth", (0.6, 0.6, 0.5, 1)), name="terrain")


def sphere(at: tuple[float, float, float], radius: float = 0.5) -> pg.Node:
    return pg.Node(ball(radius, 64), pg.Material("white", (1, 1, 1, 1)), translation(at), "sphere")


def passes(field: Field, *bodies: pg.Node, darkness: float = 1.0, camera: pg.Camera | None = None) -> Contact:
    middle = float(field(np.zeros(1), np.zeros(1))[0])
    seen = camera or pg.Camera((2.5, middle + 3, 4), (0, middle, 0), vertical_fov_rad=0.7)
    made = pg.Scene((terrain(field), *bodies), seen, (sun(50, 20),))
    return contact_passes(made, floor="terrain", threshold=THRESHOLD, darkness=darkness, map_size=MAP)


def texels(half: float, middle: tuple[float, float] = (0.0, 0.0)) -> tuple[Float64, Float64]:
    """World x and z of each texel's centre on a map of this half width."""
    at = ((np.arange(MAP) + 0.5) / MAP * 2 - 1) * half
    return np.meshgrid(middle[0] + at, middle[1] + at)


def half_of(extent: float) -> float:
    return 0.5 * extent * (1 + 8 / MAP)


def shown(made: pg.Target, backend: str) -> Picture:
    declared = isinstance(made.spec.size, Absolute)  # the map has a size of its own
    return render(made, size=None if declared else SIZE, backend=backend)[made.name]


@pytest.mark.parametrize("name", FIELDS)
def test_under_a_hovering_cube_the_gradient_is_the_height_over_the_field(name: str, backend_name: str) -> None:
    field = FIELDS[name]
    bottom = float(field(np.zeros(1), np.zeros(1))[0]) + 0.25
    got = shown(passes(field, cube((0, bottom, 0))).map, backend_name)[:, :, 0]
    x, z = texels(half_of(1.0))
    expected = np.clip((bottom - field(x, z)) / THRESHOLD, 0.0, 1.0)
    texel = 2 * half_of(1.0) / MAP
    inside = (abs(x) < 0.5 - texel) & (abs(z) < 0.5 - texel)
    outside = (abs(x) > 0.5 + texel) | (abs(z) > 0.5 + texel)
    # half floats near 1, snapping to 1/256 texel on the slope, facets
    bound = 2.0**-11 + (SLOPE[name] * texel / 256 + FACET[name]) / THRESHOLD + 1e-5
    assert abs(got - expected)[inside].max() <= bound
    assert (got[outside] == 1.0).all()
    assert (expected[inside] < 0.3).any() and (expected[inside] > 0.95).any()


@pytest.mark.sampled
@pytest.mark.parametrize("sunk", [0.25, 0.5, 0.8], ids=["a little", "to the middle", "most"])
@pytest.mark.parametrize("name", FIELDS)
def test_a_sunk_sphere_leaves_no_gap_and_no_false_dark(name: str, sunk: float, backend_name: str) -> None:
    """Dark inside the body, the gradient under its flank, all light where only buried faces lie below."""
    field, radius = FIELDS[name], 0.5
    height = float(field(np.zeros(1), np.zeros(1))[0]) + radius - sunk
    got = shown(passes(field, sphere((0, height, 0))).map, backend_name)[:, :, 0]
    x, z = texels(half_of(1.0))
    floor = field(x, z) - height
    reach = np.sqrt(np.clip(radius**2 - x**2 - z**2, 0, None))
    over = np.clip((-reach - floor) / THRESHOLD, 0.0, 1.0)
    expected = np.where(floor > reach, 1.0, over)
    expected[np.hypot(x, z) >= radius] = 1.0
    # where the sphere's side is nearly upright a texel sees another height
    texel = 2 * half_of(1.0) / MAP
    upright = abs(np.hypot(x, z) - radius) < 2 * texel
    waterline = abs(floor - reach) < 2 * texel * (SLOPE[name] + np.hypot(x, z) / np.maximum(reach, texel))
    sure = ~upright & ~(waterline & (np.hypot(x, z) < radius) & (floor > 0))
    assert sure.mean() > 0.6
    bad = abs(got - expected)
    # the sphere's own facets: chords of 1/64 half turn
    bound = 2.0**-11 + (radius * (np.pi / 64) ** 2 + FACET[name]) / THRESHOLD + 4 * SLOPE[name] / 256 * texel
    gaps, false_dark = sure & (got > expected + bound), sure & (got < expected - bound)
    assert not gaps.any(), f"{gaps.sum()} texels too light, by {bad[gaps].max():.3f}"
    assert not false_dark.any(), f"{false_dark.sum()} texels too dark, by {bad[false_dark].max():.3f}"


def test_what_is_buried_whole_darkens_nothing(backend_name: str) -> None:
    """Its box reaches over a lower part of the floor, so that it is drawn."""
    body = sphere((1.0, 1.9, 0), 0.4)  # the ramp is 0.42 away from its middle
    marker = cube((-1.0, 1.7, 0), 0.2)
    got = shown(passes(ramp, body, marker).map, backend_name)[:, :, 0]
    assert (got[:, MAP // 2 :] == 1.0).all()
    assert (got[:, : MAP // 2] < 0.1).sum() >= 4


@pytest.mark.slow
@pytest.mark.parametrize("name", FIELDS)
def test_the_picture_shows_it_on_the_slope(name: str, backend_name: str) -> None:
    """Every pixel of the floor keeps what the formula says for its place; the cube's own pixels keep all."""
    field = FIELDS[name]
    bottom = float(field(np.zeros(1), np.zeros(1))[0]) + 0.2
    camera = pg.Camera((-2.5, bottom + 0.8, 2.5), (0, bottom - 0.1, 0), vertical_fov_rad=0.5)
    made = passes(field, cube((0, bottom, 0)), camera=camera)
    found = render(made.share, size=SIZE, backend=backend_name)["contact share"][:, :, 0]
    x, z, on_floor = seen_floor(field, camera, bottom)
    expected = np.clip((bottom - field(x, z)) / THRESHOLD, 0.0, 1.0)
    expected[(abs(x) > 0.5) | (abs(z) > 0.5)] = 1.0
    texel = 2 * half_of(1.0) / MAP
    edge = (abs(np.maximum(abs(x), abs(z)) - 0.5) < 1.5 * texel) & on_floor
    sure = on_floor & ~edge
    bound = 2.0**-10 + (SLOPE[name] * texel + FACET[name]) / THRESHOLD
    off = abs(found - expected)[sure] > bound
    # a pixel on the cube's silhouette may be the floor's by one way of counting and the cube's by the other
    assert off.mean() <= 0.003
    assert (expected[sure] < 0.9).sum() > 20


def seen_floor(field: Field, camera: pg.Camera, bottom: float) -> tuple[Float64, Float64, Float64]:
    """World x and z where each pixel's ray meets the field, and whether the cube is not before it."""
    half = np.tan(0.5 * camera.vertical_fov_rad)
    u = (2 * (np.arange(SIZE[0]) + 0.5) / SIZE[0] - 1) * half * SIZE[0] / SIZE[1]
    v = (1 - 2 * (np.arange(SIZE[1]) + 0.5) / SIZE[1]) * half
    u, v = np.meshgrid(u, v)
    turn = camera.view_rotation()[:3, :3].T
    rays = np.stack([u, v, np.full_like(u, -1.0)], -1) @ turn.T
    steps = np.linspace(0.5, 12.0, 6000)
    eye = np.asarray(camera.eye)
    first = np.full(u.shape, np.nan)
    hit_cube = np.zeros(u.shape, bool)
    for t in steps:
        p = eye + rays * t
        open_ = np.isnan(first) & ~hit_cube
        centred = abs(p - [0, bottom + 0.5, 0])
        hit_cube |= open_ & (centred <= 0.5).all(axis=-1)
        first = np.where(open_ & ~hit_cube & (p[..., 1] <= field(p[..., 0], p[..., 2])), t, first)
    p = eye + rays * first[..., None]
    on_floor = ~np.isnan(first) & (abs(p[..., 0]) < 3.9) & (abs(p[..., 2]) < 3.9)
    return np.nan_to_num(p[..., 0], nan=9.0), np.nan_to_num(p[..., 2], nan=9.0), on_floor


@pytest.mark.parametrize("far", [6.0, 60.0, 400.0])
def test_the_floor_drawn_over_itself_loses_no_pixel(far: float, backend_name: str) -> None:
    """A wide sheet hangs over the waves and is seen by nobody; no light pixel has dark ones on all sides."""
    sheet = pg.Mesh.make(np.array([[-3, 0, 3], [3, 0, 3], [3, 0, -3], [-3, 0, -3.0]]), [[0, 2, 1], [0, 3, 2]])
    body = pg.Node(sheet, pg.Material("sheet", (1, 1, 1, 1)), translation((0, -0.74, 0)), "sheet")
    turned = np.array([0.5, 0.25, 0.8])
    camera = pg.Camera(tuple(far * turned), (0, -1, 0), vertical_fov_rad=3.0 / far, near=0.1, far=2000.0)
    seen = pg.Scene((terrain(waves), body), camera, (sun(50, 20),))
    share = shown(contact_passes(seen, floor="terrain", threshold=0.6, map_size=MAP).share, backend_name)[:, :, 0]
    dark = share < 0.9
    around = dark[:-2, 1:-1] & dark[2:, 1:-1] & dark[1:-1, :-2] & dark[1:-1, 2:]
    assert around.sum() > 500
    assert not (around & ~dark[1:-1, 1:-1]).any()


@pytest.mark.slow
def test_every_target_agrees_with_the_reference() -> None:
    made = passes(waves, cube((0.8, -0.9, 0.4), 0.6), sphere((-0.6, -0.8, 0)), darkness=0.7)
    assert made.heights is not None
    # what becomes of the share is as on a flat floor, which the conformance suite has
    report = assert_within_bounds((made.share, made.map, made.heights), (16, 12))
    assert "contact heights" in {target.target for target in report.backends[0].targets}


def test_a_floor_that_is_not_there_is_named() -> None:
    made = pg.Scene((terrain(ramp), cube((0, 2, 0))), pg.Camera((3, 3, 5), (0, 0, 0)))
    with pytest.raises(pg.GraphError, match="no node 'terain'; did you mean 'terrain'"):
        contact_passes(made, floor="terain")
    with pytest.raises(pg.GraphError, match="within"):
        contact_passes(made.with_(nodes=(terrain(ramp), cube((0, 5, 0)))), floor="terrain")
