"""Fog against the integral of its density along each ray, summed in float64."""

# mypy: disable-error-code="no-any-return"
from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph import Image
from passgraph.effects.screen.fog import fog, mean_of_exponential
from passgraph.effects.surfaces import engine_depth
from passgraph.scene.matrices import orthographic
from tests.agreement import assert_within_bounds
from tests.effects.scenes import render

Float64 = NDArray[np.float64]
SIZE = (13, 9)
CAMERA = pg.Camera((3, 2, 5), (0, 1.5, 0), vertical_fov_rad=0.9)
CAMERAS = [CAMERA, replace(CAMERA, orthographic_height=6.0), replace(CAMERA, shift=(0.5, -0.2))]
WHITE: tuple[float, float, float] = (1.0, 1.0, 1.0)


@pg.kernel
def mean_of(numbers: Image) -> float:
    """A function of the effect's, to be looked at alone."""
    return mean_of_exponential(numbers[0, 0].r)


def depths() -> NDArray[np.float32]:
    return np.random.default_rng(5).uniform(0.2, 60.0, (SIZE[1], SIZE[0], 1)).astype(np.float32)


def thickness(camera: pg.Camera, depth: NDArray[np.floating], density: float, falloff: float, base: float) -> Float64:
    """The optical depth of each pixel by Gauss-Legendre quadrature, 64 points on each of 32 parts."""
    half, middle = camera.window(SIZE[0] / SIZE[1])
    x = middle[0] + (2 * (np.arange(SIZE[0]) + 0.5) / SIZE[0] - 1) * half[0]
    y = middle[1] + (1 - 2 * (np.arange(SIZE[1]) + 0.5) / SIZE[1]) * half[1]
    flat = np.stack([*np.meshgrid(x, y), np.zeros((SIZE[1], SIZE[0]))], axis=-1)
    ahead, none = np.array([0.0, 0.0, -1.0]), np.zeros(3)
    begin, way = (flat, none + ahead) if camera.orthographic else (none, flat + ahead)
    up = camera.view_rotation()[:3, 1]
    points, weights = np.polynomial.legendre.leggauss(64)
    parts = (np.arange(32)[:, None] + 0.5 + 0.5 * points).ravel() / 32.0
    shares = np.tile(weights, 32) / 64.0
    ray = way * depth
    heights = camera.eye[1] - base + (begin @ up)[..., None] + (ray @ up)[..., None] * parts
    mean = (density * np.exp(-falloff * heights)) @ shares
    return np.asarray(mean * np.linalg.norm(ray, axis=-1))


@pytest.mark.parametrize("camera", CAMERAS, ids=["perspective", "parallel", "off-centre"])
@pytest.mark.parametrize(("falloff", "base"), [(0.0, 0.0), (0.05, 1.0), (0.8, -1.0), (1e-4, 0.0)])
def test_fog_is_the_integral_of_its_density(camera: pg.Camera, falloff: float, base: float) -> None:
    made = fog(pg.Input("frame"), pg.Input("depth"), density=0.02, falloff=falloff, height=base,
               fog_color=WHITE, camera=camera)  # fmt: skip
    depth = depths()
    seen = render(made, size=None, backend="numpy", frame=np.zeros((SIZE[1], SIZE[0], 4)), depth=depth)["fog"][..., 0]
    assert seen == pytest.approx(1.0 - np.exp(-thickness(camera, depth, 0.02, falloff, base)), abs=2e-6)


def test_fog_begins_at_the_eye_of_an_engine_whose_view_begins_behind_it(backend_name: str) -> None:
    """A parallel view from 10 units behind the eye to 20 before it: distances are the engine's."""
    projection = orthographic(3.0, 2.0, -10.0, 20.0)
    distances = np.array([-9.0, -0.5, 0.5, 4.0, 19.0])
    buffer = (0.5 + 0.5 * (-distances * projection[2, 2] + projection[2, 3])).reshape(1, -1, 1)
    depth = engine_depth.distances(pg.Input("depth"), pg.HardwareDepth.of_projection(projection))
    camera = pg.Value("camera", pg.Camera)
    for start in (0.0, 2.0):
        made = fog(pg.Input("frame"), depth, density=0.1, start=start, fog_color=WHITE, camera=camera)
        given = {"frame": np.zeros((1, 5, 4)), "camera": pg.Camera.from_matrices(np.eye(4), projection)}
        seen = render(made, size=None, backend=backend_name, depth=buffer.astype(np.float32), **given)["fog"]
        assert seen[0, :, 0] == pytest.approx(1.0 - np.exp(-0.1 * np.maximum(distances - start, 0.0)), abs=2e-6)


def test_level_rays_lose_nothing() -> None:
    """The integral's usual form divides a difference by the rise, of which level rays leave no digit."""
    level = pg.Camera((0, 1, 0), (0, 1, -5), vertical_fov_rad=1e-4)
    made = fog(pg.Input("frame"), pg.Input("depth"), density=0.01, falloff=0.3, fog_color=WHITE, camera=level)
    seen = render(made, size=None, backend="numpy", frame=np.zeros((1, 9, 4)), depth=np.full((1, 9, 1), 40.0))["fog"]
    assert seen[..., 0] == pytest.approx(1.0 - np.exp(-0.01 * 40.0 * np.exp(-0.3)), rel=2e-6)


@pytest.mark.parametrize("x", [0.0, 1e-12, 1e-3, 0.2499, 0.2501, 3.0, 1e30])
def test_the_mean_of_an_exponential_is_exact_on_both_sides_of_its_series(x: float) -> None:
    made = mean_of(pg.Input("x"), into=pg.target("mean", "r32f"))
    got = render(made, size=None, backend="numpy", x=np.full((1, 1, 1), x, np.float32))["mean"].item()
    assert got == pytest.approx(-np.expm1(-x) / x if x > 0.0 else 1.0, rel=1e-6)


@pytest.mark.parametrize("height", [-1e5, 1e5])
def test_far_above_and_below_the_base_nothing_overflows(height: float) -> None:
    camera = pg.Camera((0, height, 0), (0, height + 3, -5))
    made = fog(pg.Input("frame"), pg.Input("depth"), falloff=1.0, fog_color=WHITE, sky=True, camera=camera)
    depth = np.array([[[0.0], [1e-3], [1e6]]])
    seen = render(made, size=None, backend="numpy", frame=np.zeros((1, 3, 4)), depth=depth)["fog"][0, :, 0]
    assert seen.tolist() == ([1.0, 1.0, 1.0] if height < 0 else [0.0, 0.0, 0.0])


def test_the_sky_is_left_unless_it_is_asked_for() -> None:
    frame, depth = np.full((1, 1, 4), 0.25), np.zeros((1, 1, 1))
    for sky, expected in ((False, 0.25), (True, 1.0)):
        made = fog(pg.Input("frame"), pg.Input("depth"), fog_color=WHITE, sky=sky)
        assert render(made, size=None, backend="numpy", frame=frame, depth=depth)["fog"][0, 0, 0] == expected


def test_upward_the_sky_has_the_closed_integral() -> None:
    """Endless fog that thins: density / (falloff · sine of the ray's elevation)."""
    camera = pg.Camera((0, 0, 0), (0, 3, -4), vertical_fov_rad=1e-3)
    made = fog(pg.Input("frame"), pg.Input("depth"), density=0.03, falloff=0.1, fog_color=WHITE, sky=True,
               camera=camera)  # fmt: skip
    seen = render(made, size=None, backend="numpy", frame=np.zeros((1, 1, 4)), depth=np.zeros((1, 1, 1)))["fog"]
    assert seen[0, 0, 0] == pytest.approx(1.0 - np.exp(-0.03 / (0.1 * 0.6)), rel=1e-5)


def test_the_start_is_clear_and_the_most_is_not_exceeded() -> None:
    depth = np.array([[[4.9], [6.0], [1e4]]])
    made = fog(pg.Input("frame"), pg.Input("depth"), density=0.5, start=5.0, most=0.8, fog_color=WHITE,
               vertical_fov_rad=1e-3)  # fmt: skip
    seen = render(made, size=None, backend="numpy", frame=np.zeros((1, 3, 4)), depth=depth)["fog"][0, :, 0]
    assert seen == pytest.approx([0.0, 1.0 - np.exp(-0.5), 0.8], abs=1e-5)


def test_devices_agree_on_fog() -> None:
    depth = depths()
    depth[2, 3] = 0.0
    frame = np.random.default_rng(1).random((SIZE[1], SIZE[0], 4), np.float32)
    made = fog(pg.Input("frame"), pg.Input("depth"), falloff=0.2, sky=True, camera=CAMERAS[1])
    assert_within_bounds(made, frame=frame, depth=depth)
