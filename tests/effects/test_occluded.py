"""Occlusion from picture and depth: against rays, and against the integral over horizons in float64."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.effects.screen.occluded import occluded
from passgraph.truth import Tracer
from passgraph.truth.surfaces import casting_triangles
from tests.effects.engine import EngineView
from tests.effects.scenes import cube, floor
from tests.effects.test_ambient_occlusion import cosine_rays

Float64 = NDArray[np.float64]
SIZE = (121, 81)
SCENE = pg.Scene(
    (floor(3.0), cube((0.1, 0, 0.2))), pg.Camera((0.9, 2.6, 1.7), (0, 0.2, 0), vertical_fov_rad=0.75, near=0.1), ()
)
RADIUS, FALLOFF = 0.5, 0.6
#: Root mean square of what visibility is off by, as measured, with room of a fifth.
FINE_ON_FLOOR, FINE = 0.017, 0.023
USUAL_ON_FLOOR, USUAL = 0.020, 0.023
BY_RAYS = 0.040


def found(view: EngineView, radius: float, **options: object) -> Float64:
    made = occluded(pg.Input("frame"), view.distance(), radius=radius, camera=view.camera, **options)  # type: ignore[arg-type]
    return view.run(made)[..., 0].astype(np.float64)


def by_horizons(view: EngineView, radius: float, falloff: float, slices: int) -> Float64:
    """The integral over the light between horizons, of every texel along every slice (the paper's equations 5 to 7).

    Beside it stands what the same slices see of an open hemisphere, which the result is divided by.
    """
    seen, turn = view.surfaces, view.camera.view_rotation()[:3, :3]
    place = (seen.positions - np.subtract(view.camera.eye, seen.origin)) @ turn.T
    n = seen.normals @ turn.T
    height, width = view.depth.shape
    half, _ = view.camera.window(width / height)
    row, column = np.mgrid[:height, :width]
    reach_px = int(radius / np.nanmin(-place[..., 2]) * 0.5 * height / half[1]) + 2
    toward = -place / np.linalg.norm(place, axis=-1, keepdims=True)
    across = np.cross(toward, (0.0, 1.0, 0.0))
    across /= np.linalg.norm(across, axis=-1, keepdims=True)
    along = np.cross(across, toward)
    total, whole = np.zeros((height, width)), np.zeros((height, width))
    for angle in (np.arange(slices) + 0.5) * np.pi / slices:
        way = np.cos(angle) * across + np.sin(angle) * along
        # where the slice's plane meets the screen
        on_screen = way[..., :2] - place[..., :2] / place[..., 2:] * way[..., 2:]
        step = on_screen * (0.5 * width / half[0], -0.5 * height / half[1])
        step /= np.linalg.norm(step, axis=-1, keepdims=True)
        normal_angle = np.arctan2(_dot(n, way), _dot(n, toward))
        length = np.hypot(_dot(n, way), _dot(n, toward))
        for side in (-1.0, 1.0):
            lowest = np.cos(normal_angle + side * 0.5 * np.pi)
            horizon = lowest.copy()
            for far_px in range(1, reach_px):
                x = np.rint(column + side * far_px * np.nan_to_num(step[..., 0])).astype(int)
                y = np.rint(row + side * far_px * np.nan_to_num(step[..., 1])).astype(int)
                inside = (x >= 0) & (y >= 0) & (x < width) & (y < height)
                offset = place[y.clip(0, height - 1), x.clip(0, width - 1)] - place
                far = np.linalg.norm(offset, axis=-1)
                near = np.clip((1.0 - far / radius) / falloff, 0.0, 1.0)
                raised = lowest + near * (_dot(offset, toward) / np.maximum(far, 1e-12) - lowest)
                horizon = np.where(inside & (near > 0.0), np.maximum(horizon, raised), horizon)
            total += length * _arc(side * np.arccos(np.clip(horizon, -1.0, 1.0)), normal_angle)
            whole += length * _arc(normal_angle + side * 0.5 * np.pi, normal_angle)
    return np.where(view.shown, total / whole, 1.0)


def _dot(a: Float64, b: Float64) -> Float64:
    return np.asarray((a * b).sum(axis=-1))


def _arc(horizon: Float64, normal_angle: Float64) -> Float64:
    """Equation 7: light from the line of sight to a horizon, in a slice."""
    made = -np.cos(2.0 * horizon - normal_angle) + np.cos(normal_angle) + 2.0 * horizon * np.sin(normal_angle)
    return np.asarray(0.25 * made)


def by_rays(view: EngineView, scene: pg.Scene, radius: float, falloff: float) -> Float64:
    """The share of 400 cosine-weighted rays a pixel that meet nothing.

    What they meet counts less toward the end of the radius: their lengths are spread evenly over that part.
    """
    seen = view.surfaces
    tracer = Tracer(casting_triangles(scene, seen.origin).corners)
    local = cosine_rays(20)
    lengths = radius * (1.0 - falloff * np.random.default_rng(0).permutation((np.arange(400) + 0.5) / 400))
    n = seen.normals[view.shown]
    beside = np.cross(n, (0.3, 0.5, 0.8))
    beside /= np.linalg.norm(beside, axis=1, keepdims=True)
    frames = np.stack([beside, n, np.cross(beside, n)], axis=1)
    rays = local @ frames
    begin = np.broadcast_to((seen.positions[view.shown] + 1e-5 * n)[:, None], rays.shape)
    ends = np.tile(lengths, len(n))
    blocked = tracer.blocked(begin.reshape(-1, 3), rays.reshape(-1, 3), ends).reshape(len(n), -1)
    made = np.ones(view.depth.shape)
    made[view.shown] = 1.0 - blocked.mean(axis=1)
    return made


def rms(error: Float64) -> float:
    return float(np.sqrt(np.mean(error**2)))


def test_it_is_the_integral_over_horizons() -> None:
    """Every texel of many slices, beside the few taps of a quick search, and those blurred over their pattern."""
    view = EngineView.of(SCENE, SIZE)
    truth = by_horizons(view, RADIUS, FALLOFF, slices=8)
    assert truth[view.shown].min() < 0.6
    for options, floor_bound, bound in (
        ({"slices": 8, "steps": 32}, FINE_ON_FLOOR, FINE),
        ({}, USUAL_ON_FLOOR, USUAL),
    ):
        error = found(view, RADIUS, **options) - truth
        assert rms(error[view.surfaces.node == 0]) < floor_bound
        # upright sides are a few pixels wide: their lowest row is off by the depth that changes within a texel
        assert rms(error[view.shown]) < bound


def test_it_is_near_what_rays_find() -> None:
    """A cube on a floor: what a picture cannot show is taken to be solid, so that some of it is too dark."""
    view = EngineView.of(SCENE, SIZE)
    error = found(view, RADIUS) - by_rays(view, SCENE, RADIUS, FALLOFF)
    assert rms(error[view.shown]) < BY_RAYS
    assert abs(float(error[view.shown].mean())) < 0.02


@pytest.mark.parametrize("orientation", range(8))
def test_the_tips_of_a_floor_are_as_light_as_the_rest(orientation: int) -> None:
    """Its far corners and edges are slivers of one pixel, whose normal a neighbor in the next row or column tells."""
    random = np.random.default_rng(orientation)
    turn, elevation = random.uniform(0, 2 * np.pi), np.radians(random.uniform(2.0, 20.0))
    eye = 7.0 * np.array([np.cos(elevation) * np.cos(turn), np.sin(elevation), np.cos(elevation) * np.sin(turn)])
    up = (0.4 * np.sin(turn), 1.0, -0.4 * np.cos(turn))
    camera = pg.Camera(tuple(eye), (0, 0, 0), up=up, vertical_fov_rad=0.75, near=0.1, far=40.0)
    view = EngineView.of(pg.Scene((floor(3.0),), camera, ()), (240, 150))
    around = sum(np.roll(view.shown, (y, x), (0, 1)) for y in range(-1, 2) for x in range(-1, 2))
    assert found(view, 0.5)[view.shown & (around > 1)].min() > 0.98


@pytest.mark.parametrize("bits", [32, 16])
@pytest.mark.parametrize("elevation_deg", [4.0, 25.0, 80.0])
def test_a_floor_does_not_hide_itself(bits: int, elevation_deg: float) -> None:
    """Seen awry, so that the depth changes along rows and columns; in a buffer of 16 bits too."""
    elevation = np.radians(elevation_deg)
    eye = (1.5, 5.0 * np.sin(elevation), 5.0 * np.cos(elevation))
    camera = pg.Camera(eye, (0, 0, 0), up=(0.4, 1, 0), vertical_fov_rad=0.5, near=0.5, far=40.0)
    view = EngineView.of(pg.Scene((floor(15.0),), camera, ()), (160, 100), bits=bits)
    share = found(view, 0.5)[view.shown]
    assert share.mean() > 0.9995
    assert share.min() > (0.98 if bits == 16 else 0.985)
