"""Light between surfaces of a picture: against the form factor of a wall, and against rays."""

from __future__ import annotations

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects import ssgi
from passgraph.truth import Tracer
from passgraph.truth.surfaces import seen_triangles
from tests.agreement import assert_within_bounds
from tests.conftest import DEVICES
from tests.effects.engine import EngineView
from tests.effects.scenes import Float64, Picture, floor
from tests.effects.test_ambient_occlusion import cosine_rays, wall, wall_share
from tests.effects.test_ssr import CAMERA, CAMERAS, SIZE, dot, paint, room


def lit(view: EngineView, frame: Picture, backend: str = "numpy", frames: int = 1, **options: object) -> Float64:
    """What is added to a picture, (h, w, 3)."""
    made = ssgi(pg.Input("frame"), view.distance(), camera=view.camera, reach=1e3, **options)  # type: ignore[arg-type]
    with pg.compile(made, backend) as program:
        for _ in range(frames):
            shown = program(frame=frame, depth=view.depth)["ssgi"]
    return (shown - frame)[..., :3].astype(np.float64)


@pytest.mark.parametrize("backend_name", DEVICES, indirect=True)
def test_a_floor_gets_the_form_factor_of_a_bright_wall(backend_name: str) -> None:
    """And twice as much with twice the albedo, as a number or as a picture."""
    half, height = 2.0, 1.0
    camera = pg.Camera((0, 40, 40), (0, 0.5, 0.5), vertical_fov_rad=0.06, near=10, far=200)
    view = EngineView.of(pg.Scene((floor(9.0), wall(half, height)), camera, ()), (160, 100))
    frame = np.repeat(np.float32(view.surfaces.node == 1)[..., None], 4, axis=2)
    light = lit(view, frame, backend_name, albedo=1.0, rays=16, steps=256)[..., 0]
    places = view.surfaces.positions + view.surfaces.origin
    away, along = places[..., 2], places[..., 0]
    for near, far in ((0.1, 0.2), (0.3, 0.4), (0.6, 0.8), (1.0, 1.2)):
        chosen = (view.surfaces.node == 0) & (away > near) & (away < far) & (np.abs(along) < 1.0)
        truth = wall_share(away[chosen], along[chosen], half, height)
        # rays start half a pixel above the floor, and the mean is over 4 by 4 pixels
        assert np.sqrt(np.mean((light[chosen] - truth) ** 2)) < 0.02
    # the wall gets nothing from the black floor; next to it, hits and the blur mix texels of both
    assert np.abs(light[(view.surfaces.node == 1) & (places[..., 1] > 0.1)]).max() < 0.01
    albedo = pg.Input("albedo", default=np.full((100, 160, 3), 0.5, np.float32))
    for given in (0.5, albedo):
        dimmed = lit(view, frame, backend_name, albedo=given, rays=16, steps=256)[..., 0]
        np.testing.assert_allclose(dimmed, 0.5 * light, atol=1e-6)


def gathered_by_rays(view: EngineView, scene: pg.Scene) -> Float64:
    """The mean paint that 256 cosine-weighted rays find, in the picture or not, black where they find nothing."""
    seen, on = view.surfaces, view.shown
    triangles, n = seen_triangles(scene, seen.origin).corners, seen.normals[on]
    beside = np.cross(n, (0.3, 0.5, 0.8))
    beside /= np.linalg.norm(beside, axis=1, keepdims=True)
    ray = cosine_rays(16) @ np.stack([beside, n, np.cross(beside, n)], axis=1)
    start = np.broadcast_to((seen.positions[on] + 1e-4 * n)[:, None], ray.shape)
    number = Tracer(triangles).closest(start.reshape(-1, 3), ray.reshape(-1, 3)).reshape(ray.shape[:2])
    a, b, c = triangles[number].transpose(2, 0, 1, 3)
    normal = np.cross(b - a, c - a)
    with np.errstate(divide="ignore", invalid="ignore"):
        place = np.nan_to_num(start + (dot(normal, a - start) / dot(normal, ray))[..., None] * ray)
    made = np.zeros((*on.shape, 3))
    made[on] = (paint(place) * (number >= 0)[..., None]).mean(axis=1)
    return made


@pytest.mark.slow
@pytest.mark.parametrize("camera", CAMERAS, ids=["perspective", "parallel", "off-centre"])
def test_a_room_is_nearer_to_rays_than_without(camera: pg.Camera) -> None:
    """Rays of the truth also find what the picture does not show, which is most of the error that is left."""
    view = EngineView.of(room(camera), SIZE)
    frame = np.ones((SIZE[1], SIZE[0], 4), np.float32)
    frame[..., :3] = np.where(view.shown[..., None], paint(np.nan_to_num(view.surfaces.positions)), 0.0)
    truth = gathered_by_rays(view, room(camera))[view.shown]

    def error(frames: int, **options: object) -> float:
        made = lit(view, frame, albedo=1.0, frames=frames, **options)[view.shown]
        return float(np.sqrt(np.mean((made - truth) ** 2)))

    without, plain = float(np.sqrt(np.mean(truth**2))), error(1)
    assert plain < 0.5 * without
    # one ray, without the blur, then over frames
    noisy, accumulated = error(1, rays=1, denoise=False), error(16, rays=1, denoise=False, most_frames=16)
    assert noisy > 0.9 * without
    assert accumulated < 0.6 * without


def test_the_sky_and_alpha_stay() -> None:
    view = EngineView.of(room(), SIZE)
    frame = np.random.default_rng(3).random((SIZE[1], SIZE[0], 4), np.float32)
    made = ssgi(pg.Input("frame"), view.distance(), camera=CAMERA)
    with pg.compile(made, "numpy") as program:
        shown = program(frame=frame, depth=view.depth)["ssgi"]
    np.testing.assert_array_equal(shown[..., 3], frame[..., 3])
    np.testing.assert_array_equal(shown[~view.shown], frame[~view.shown])
    assert (shown >= frame).all()
    assert (shown - frame).max() > 0.1


def test_devices_agree_on_light_between_surfaces() -> None:
    view = EngineView.of(room(), (21, 13))
    frame = np.random.default_rng(1).random((13, 21, 4), np.float32)
    made = ssgi(pg.Input("frame"), pg.Input("depth"), camera=CAMERA, rays=2, steps=6, most_frames=4)
    assert_within_bounds(made, frame=frame, depth=view.surfaces.depth[..., None].astype(np.float32))
