"""Ambient occlusion against analytic and ray-traced truth; where it fails on the screen; every backend."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from docs.occlusion_scenes import LEG_RADIUS, LEGS, RADIUS, WALL_Z, compared, legs_scene
from passgraph.effects.ambient.ambient_occlusion import ambient_occlusion_passes, occlusion
from passgraph.effects.ambient.contact import contact_passes
from passgraph.effects.screen.occluded import occluded
from passgraph.effects.surfaces.depth_normals import depth_normals
from passgraph.scene.matrices import translation
from passgraph.scene.shipped_scene import ball, cylinder
from tests.agreement import assert_within_bounds
from tests.effects.scenes import SIZE, Picture, cube, floor, render

Float64 = NDArray[np.float64]
WHITE = pg.Material("white", (1, 1, 1, 1))
#: A step of float16 just below 1, in which visibility is stored.
STEP = 2.0**-11
#: As many as give the integral: what is left is stated where it is used.
FINE = {"slices": 32, "steps": 128}
EVERYTHING = 1000.0


def visibility(
    scene: pg.Scene,
    size: tuple[int, int] = SIZE,
    backend: str = "numpy",
    camera: pg.Camera | None = None,
    **options: object,
) -> tuple[Float64, Float64]:
    """(h, w) of the final visibility, and (h, w, 3) world positions (NaN where there is no surface)."""
    made = ambient_occlusion_passes(scene, **options)  # type: ignore[arg-type]
    values = {} if camera is None else {"camera": camera}
    got = render(made.occlusion.visibility, made.depth, size=size, backend=backend, **values)
    return got["visibility"][:, :, 0].astype(np.float64), world_places(got["depth"], camera or scene.camera)


def world_places(depth: Picture, camera: pg.Camera) -> Float64:
    height, width = depth.shape[:2]
    half = np.tan(0.5 * camera.vertical_fov_rad)
    x = (2 * (np.arange(width) + 0.5) / width - 1) * half * width / height
    y = (1 - 2 * (np.arange(height) + 0.5) / height) * half
    z = np.where(depth[:, :, 0] > 0, depth[:, :, 0].astype(np.float64), np.nan)
    seen = np.stack([x[None, :] * z, y[:, None] * z, -z], axis=2)
    return seen @ camera.view_rotation()[:3, :3] + np.array(camera.eye)


def wall(half: float, height: float) -> pg.Node:
    corners = np.array([[-half, 0, 0], [half, 0, 0], [half, height, 0], [-half, height, 0]])
    return pg.Node(pg.Mesh.make(corners, [[0, 1, 2], [0, 2, 3]], np.tile([0.0, 0.0, 1.0], (4, 1))), WHITE, name="wall")


def wall_share(x: Float64, along: Float64, half: float, height: Float64 | float) -> Float64:
    """What an upright rectangle at x = 0 hides of a floor point's cosine-weighted sky (form factor)."""

    def corner(b: Float64) -> Float64:
        far = np.hypot(x, height)
        return (np.arctan(b / x) - x / far * np.arctan(b / far)) / (2 * pi)

    return np.asarray(corner(half - along) + corner(half + along))


def cosine_rays(count: int) -> Float64:
    """(count², 3) directions about +y, stratified, denser toward it."""
    a, b = np.meshgrid((np.arange(count) + 0.5) / count, (np.arange(count) + 0.5) / count)
    flat, turn = np.sqrt(a.ravel()), 2 * pi * b.ravel()
    return np.stack([flat * np.cos(turn), np.sqrt(1 - a.ravel()), flat * np.sin(turn)], axis=1)


def hit_upright(
    origin: Float64, rays: Float64, centre: tuple[float, float], radius: float, top: float
) -> NDArray[np.bool_]:
    """Whether rays from outside meet an upright cylinder from the floor to ``top``."""
    o = origin[[0, 2]] - np.array(centre)
    d = rays[:, [0, 2]]
    a, b, c = (d * d).sum(axis=1), d @ o, o @ o - radius * radius
    root = b * b - a * c
    t = (-b - np.sqrt(np.maximum(root, 0))) / np.maximum(a, 1e-12)
    return (root > 0) & (t > 0) & (origin[1] + t * rays[:, 1] < top)


def hit_ball(origin: Float64, rays: Float64, centre: Float64, radius: float) -> NDArray[np.bool_]:
    o = origin - centre
    b = rays @ o
    return (b * b - (o @ o - radius * radius) > 0) & (b < 0)


# Truth


@pytest.mark.sampled
@pytest.mark.parametrize("method", ["gtao", "ssao"])
@pytest.mark.parametrize(("elevation_deg", "far"), [(2.0, 30.0), (10.0, 5.0), (60.0, 5.0), (60.0, 5000.0)])
def test_a_plane_does_not_hide_itself(method: str, elevation_deg: float, far: float, backend_name: str) -> None:
    angle = np.radians(elevation_deg)
    eye = (0.3 * far, far * np.sin(angle), far * np.cos(angle))
    camera = pg.Camera(eye, (0, 0, 0), vertical_fov_rad=0.5, near=0.01 * far, far=10.0 * far)
    scene = pg.Scene((floor(2.0 * far),), camera, ())
    seen, places = visibility(scene, backend=backend_name, method=method, radius=0.3 * far)
    assert np.isfinite(places).any()
    # normals are stored to 2^-11: the light below a horizon that is off by d is d² / 2
    assert seen.min() >= 1.0 - STEP


def test_a_corner_has_the_analytic_visibility() -> None:
    half, height = 2.0, 1.0
    camera = pg.Camera((0, 40, 40), (0, 0.5, 0.5), vertical_fov_rad=0.06, near=10, far=200)
    scene = pg.Scene((floor(9.0), wall(half, height)), camera, ())
    size = (160, 100)
    seen, places = visibility(scene, size, radius=EVERYTHING, denoise=False, **FINE)
    x, along = places[:, :, 2], places[:, :, 0]
    pixel = 2 * np.tan(0.03) * 56.2 / size[1]  # scene units at the wall
    on_floor = (abs(places[:, :, 1]) < 0.5 * pixel) & (abs(along) < 0.5 * half) & (x > 2 * pixel)
    x, along, seen = x[on_floor], along[on_floor], seen[on_floor]
    truth = 1.0 - wall_share(x, along, half, height)
    # taps stand farther apart away from the pixel: of the wall, as much may be missed at its upper edge
    reach, away = sum(size), np.hypot(x, height) / pixel
    missed = (2.0 * np.sqrt(away * reach) / FINE["steps"] + 1.0) * pixel * np.sqrt(2.0)
    highest = 1.0 - wall_share(x, along, half, np.maximum(height - missed, 1e-6))
    # a slice of pi / 32 ends on the wall or beside it
    width = 0.5 / FINE["slices"]
    assert (seen >= truth - width).all()
    assert (seen <= highest + width).all()
    assert abs(seen - truth).mean() < 0.01
    # next to a wall that is endless from there, half of the light is left: (1 + x / sqrt(x² + h²)) / 2
    near = (x < 0.1) & (abs(along) < 0.2)
    assert seen[near] == pytest.approx(0.5 * (1 + x[near] / np.hypot(x[near], height)), abs=width)


@pytest.mark.parametrize("lift", [0.0, 0.5])
def test_a_ball_on_a_plane_against_rays(lift: float) -> None:
    """Half a ball in the floor; and a ball standing on it, below which a view from above sees no gap."""
    radius = 0.5
    node = pg.Node(ball(radius, 64), WHITE, translation((0.0, lift, 0.0)), "ball")
    camera = pg.Camera((0, 60, 0), (0, 0, 0), up=(0, 0, -1), vertical_fov_rad=0.06, near=10, far=100)
    scene = pg.Scene((floor(9.0), node), camera, ())
    size = (120, 90)
    seen, places = visibility(scene, size, radius=EVERYTHING, denoise=False, **FINE)
    rays = cosine_rays(64)
    centre = np.array([0.0, lift, 0.0])
    row = size[1] // 2
    for column in range(size[0]):
        place = places[row, column]
        distance = float(np.hypot(place[0], place[2]))
        if place[1] > 1e-3 or distance < radius + 0.05:
            continue
        place[1] = 0.0
        by_ball = hit_ball(place, rays, centre, radius)
        truth = 1.0 - float((by_ball | hit_upright(place, rays, (0.0, 0.0), radius, lift)).mean())
        got = float(seen[row, column])
        # taps miss the top of the ball by less than a step; half a slice's width; rays: 1 / 64
        assert got == pytest.approx(truth, abs=0.5 / FINE["slices"] + 1 / 64), distance
        if lift > 0:
            exact = 1.0 - radius**3 / (distance**2 + radius**2) ** 1.5
            assert 1.0 - float(by_ball.mean()) == pytest.approx(exact, abs=1 / 64)
            assert got <= exact + 1 / 64  # the screen never shows more light than there is, here


def test_half_the_size_gives_nearly_the_same() -> None:
    camera = pg.Camera((3, 3, 5), (0, 0.3, 0), vertical_fov_rad=0.5)
    scene = pg.Scene((floor(), cube()), camera, ())
    options = {"radius": 0.6, "slices": 4, "steps": 16}
    full, places = visibility(scene, (192, 128), **options)
    half, _ = visibility(scene, (192, 128), half_resolution=True, **options)
    beside = (places[:, :, 1] < 1e-3) & (abs(places[:, :, [0, 2]]).max(axis=2) < 1.2)
    assert full[beside].min() < 0.7
    assert abs(half - full)[beside].mean() < 0.02
    assert half[~(abs(places[:, :, [0, 2]]).max(axis=2) < 1.3)].min() >= 1.0 - 2 * STEP


def test_denoising_takes_the_pattern_away() -> None:
    """Along the foot of a wall visibility hardly changes; what changes from pixel to pixel is noise."""
    camera = pg.Camera((0, 20, 20), (0, 0.3, 0.3), vertical_fov_rad=0.06, near=5, far=100)
    scene = pg.Scene((floor(9.0), wall(4.0, 1.0)), camera, ())
    raw, places = visibility(scene, radius=0.8, denoise=False)
    clean, _ = visibility(scene, radius=0.8)
    rows = (abs(places[:, :, 1]) < 1e-3).all(axis=1) & (places[:, :, 2].mean(axis=1) < 0.4)
    noise = [float(np.abs(np.diff(seen[rows], axis=1)).mean()) for seen in (raw, clean)]
    assert noise[1] < 0.1 * noise[0]


# Where a search on the screen fails


KINDS = ("ssao_unchecked", "ssao", "gtao", "contact")


def seen_places(scene: pg.Scene, size: tuple[int, int]) -> Float64:
    made = ambient_occlusion_passes(scene).depth
    return world_places(render(made, size=size, backend="numpy")["depth"], scene.camera)


def beside(mask: NDArray[np.bool_], places: Float64, reach: int = 4) -> NDArray[np.bool_]:
    """Pixels up to ``reach`` to the left and right of masked ones that stand above the floor."""
    found = np.zeros_like(mask)
    for shift in range(1, reach + 1):
        for way in (shift, -shift):
            found |= np.roll(mask & (places[:, :, 1] > 0.05), way, axis=1)
    return found


def test_a_halo_on_a_far_wall_without_range_check() -> None:
    """The wall is six radii behind the legs: nothing there takes its light, and SSAO darkens a band of it."""
    scene = legs_scene(top=False)
    size = (160, 100)
    shown = compared(scene, size)
    places = seen_places(scene, size)
    # above what the floor in front of the wall darkens
    on_wall = (places[:, :, 2] < WALL_Z + 1e-3) & (places[:, :, 1] > RADIUS)
    band = on_wall & beside(places[:, :, 2] > -1.0, places)
    assert band.sum() > 50
    dark = {name: 1.0 - float(getattr(shown, name)[:, :, 0][band].mean()) for name in KINDS}
    assert dark["ssao_unchecked"] > 0.05, dark
    for name in ("ssao", "gtao"):
        assert dark[name] < STEP, dark
    assert dark["contact"] == 0.0, dark


def test_a_halo_that_the_range_check_leaves() -> None:
    """Nothing lies within the radius of the wall, but legs a little farther off pass in part: a fainter halo."""
    scene = legs_scene(wall_z=LEGS[0][1] - LEG_RADIUS - 1.3 * RADIUS, top=False)
    size = (160, 100)
    shown = compared(scene, size)
    places = seen_places(scene, size)
    on_wall = (abs(places[:, :, 2] - scene.nodes[1].bounds[0, 2]) < 1e-3) & (places[:, :, 1] > RADIUS)
    band = on_wall & beside(places[:, :, 2] > LEGS[0][1] - LEG_RADIUS - 1e-3, places)
    assert band.sum() > 50
    dark = {name: 1.0 - float(getattr(shown, name)[:, :, 0][band].mean()) for name in KINDS}
    assert dark["ssao"] > 0.02, dark
    assert dark["gtao"] < STEP, dark
    assert dark["contact"] == 0.0, dark


def test_darkness_at_a_place_depends_on_the_camera_but_not_that_of_contact() -> None:
    """A floor point under the rim of a cube that hovers: the screen shows other parts of the cube from elsewhere."""
    scene = pg.Scene((floor(), cube((0.0, 0.25, 0.0))), pg.Camera((3, 3, 5), (0, 0, 0)), ())
    place = np.array([0.0, 0.0, 0.42])
    size, at = (121, 81), (40, 60)  # odd: the middle pixel looks at the place
    seen: dict[str, list[float]] = {"ssao": [], "gtao": [], "contact": []}
    for eye in ((0.0, 0.9, 6.0), (0.0, 5.0, 3.0), (3.5, 1.5, 2.0)):
        camera = pg.Camera(eye, tuple(place), vertical_fov_rad=0.35)
        for method in ("ssao", "gtao"):
            values, places = visibility(
                scene, size, camera=camera, method=method, radius=0.5, taps=64, slices=8, steps=32
            )
            assert np.linalg.norm(places[at] - place) < 1e-3
            seen[method].append(float(values[at]))
        share = contact_passes(scene, threshold=0.5, darkness=1.0).share
        seen["contact"].append(float(render(share, size=size, backend="numpy", camera=camera)[share.name][at][0]))
    spread = {name: max(values) - min(values) for name, values in seen.items()}
    assert spread["ssao"] > 0.05, seen
    assert spread["contact"] <= 0.02, seen


# The rest of the effect


@pytest.mark.parametrize(
    "options",
    [
        {"method": "gtao", "bounces": True},
        {"method": "gtao", "half_resolution": True, "thickness": 0.1, "power": 1.5},
        {"method": "ssao", "taps": 8},
        {"method": "ssao", "range_check": False, "half_resolution": True, "taps": 8},
    ],
    ids=["gtao", "gtao-half", "ssao", "ssao-half"],
)
@pytest.mark.slow
def test_every_target_agrees_with_the_reference(options: dict[str, object]) -> None:
    nodes = (floor(), cube((0, 0, 0)), pg.Node(cylinder(0.1, 1.5), WHITE, translation((1.0, 0.0, 0.6)), "leg"))
    scene = pg.Scene(nodes, pg.Camera((3, 3, 5), (0, 0.3, 0), vertical_fov_rad=0.6), ())
    made = ambient_occlusion_passes(scene, radius=0.6, **options)  # type: ignore[arg-type]
    report = assert_within_bounds([made.picture, made.occlusion.visibility, made.occlusion.raw], (48, 30))
    compared = {target.target for target in report.backends[0].targets}
    assert {"linear depth", "raw visibility", "denoised_x", "visibility", "lit"} <= compared


def test_only_ambient_light_is_dimmed() -> None:
    scene = pg.Scene((floor(), cube()), pg.Camera((3, 3, 5), (0, 0.3, 0), vertical_fov_rad=0.6), ())
    made = ambient_occlusion_passes(scene, radius=0.6, power=2.0, display=False)
    assert made.picture is made.lit
    got = render(made.lit, made.unoccluded, made.occlusion.visibility, backend="numpy")
    share = got["visibility"][:, :, :1]
    # there is no other light: the picture is the visibility's; float16, three times rounded
    on = np.isfinite(world_places(render(made.depth, backend="numpy")["depth"], scene.camera)[:, :, :1])
    expected = np.where(on, got["unshadowed"] * share, got["unshadowed"])
    assert share.min() < 0.5
    assert abs(got["lit"] - expected)[:, :, :3].max() <= 3 * STEP


def test_bounces_lighten_and_power_darkens() -> None:
    scene = pg.Scene((floor(), cube()), pg.Camera((3, 3, 5), (0, 0.3, 0), vertical_fov_rad=0.6), ())
    plain, bounced = (
        render(ambient_occlusion_passes(scene, radius=0.6, bounces=on).lit, backend="numpy")["lit"]
        for on in (False, True)
    )
    assert (bounced >= plain - STEP).all()
    assert (bounced > plain + 0.01).any()
    once, twice = (visibility(scene, radius=0.6, power=power)[0] for power in (1.0, 2.0))
    assert (twice <= once + STEP).all()
    assert twice.min() < once.min() - 0.05


def test_normals_come_from_depth_alone(backend_name: str) -> None:
    camera = pg.Camera((3, 2, 5), (0, 0, 0), vertical_fov_rad=0.6)
    scene = pg.Scene((floor(20.0),), camera, ())
    made = ambient_occlusion_passes(scene)
    got = render(made.depth, made.normals, backend=backend_name)
    found = depth_normals(pg.Input("depth", "r32f"), pg.Value("camera", pg.Camera, default=camera), "normals")
    packed = render(found, backend=backend_name, depth=got["depth"])["normals"]
    inner = (slice(1, -1), slice(1, -1))
    # depth is float32 and its differences over a pixel are about 2^-7 of it; float16 normals: 2^-11
    assert abs(packed - got["normals"])[inner].max() < 2.0**-9
    frame = np.ones((SIZE[1], SIZE[0], 4), np.float32)
    for method in ("gtao", "ssao"):
        dimmed = occluded(
            pg.Input("frame", "rgba32f"), pg.Input("depth", "r32f"), radius=1.0, vertical_fov_rad=0.6, method=method
        )  # type: ignore[arg-type]
        assert render(dimmed, backend=backend_name, frame=frame, depth=got["depth"])["occluded"].min() >= 1.0 - 2 * STEP


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"method": "hbao"}, "method cannot be 'hbao'"),
        ({"radius": 0.0}, "radius must be above 0"),
        ({"slices": 0}, "slices must be 1 to 64"),
        ({"steps": 1000}, "steps must be 1 to 256"),
        ({"taps": 0}, "taps must be 1 to 256"),
        ({"falloff": 0.0}, "falloff must be above 0"),
        ({"thickness": 2.0}, "thickness must be 0 to 1"),
        ({"bias": -1.0}, "bias must be 0 to 1"),
        ({"power": -1.0}, "power must be 0 or more"),
    ],
)
def test_what_cannot_be_is_named(options: dict[str, object], message: str) -> None:
    depth, camera = pg.Input("depth", "r32f"), pg.Value("camera", pg.Camera)
    with pytest.raises(pg.GraphError, match=message):
        occlusion(depth, pg.Input("normals", "rgba16f"), camera, **{"radius": 1.0, **options})  # type: ignore[arg-type]
