"""Temporal antialiasing and the velocity of pixels, against projections and means in NumPy."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

import passgraph as pg
from passgraph.effects import camera_velocity, jitter_px, jittered, scene_surfaces, taa
from tests.effects.scenes import cube, floor, sun

Float64 = NDArray[np.float64]
SIZE = (40, 30)
CAMERA = pg.Camera((2.0, 1.5, 3.0), (0.0, 0.2, 0.0), vertical_fov_rad=0.8, near=0.1, far=40.0)
CAMERAS = {
    "turned": (CAMERA, replace(CAMERA, target=(0.3, 0.1, 0.2))),
    "moved": (CAMERA, replace(CAMERA, eye=(1.7, 1.8, 3.1))),
    "zoomed": (CAMERA, replace(CAMERA, vertical_fov_rad=0.7)),
    "parallel": tuple(replace(CAMERA, orthographic_height=3.0, eye=eye) for eye in ((2, 1.5, 3), (1.7, 1.8, 3.1))),
    "shifted": (replace(CAMERA, shift=(0.2, -0.1)), replace(CAMERA, eye=(1.9, 1.5, 3.0))),
}


def clip_from_world(camera: pg.Camera) -> Float64:
    rotation = camera.view_rotation()[:3, :3]
    view = np.eye(4)
    view[:3, :3], view[:3, 3] = rotation, -rotation @ np.asarray(camera.eye, np.float64)
    return np.asarray(camera.projection_matrix(SIZE[0] / SIZE[1]) @ view)


def places(clip: Float64) -> Float64:
    """Of clip coordinates (..., 4), in pixels with (0, 0) at the top left."""
    at = clip[..., :2] / clip[..., 3:]
    return np.stack([(0.5 + 0.5 * at[..., 0]) * SIZE[0], (0.5 - 0.5 * at[..., 1]) * SIZE[1]], axis=-1)


@pytest.mark.parametrize("cameras", CAMERAS.values(), ids=list(CAMERAS))
def test_velocity_is_the_way_between_two_projections(cameras: tuple[pg.Camera, pg.Camera]) -> None:
    now, before = cameras
    depth = np.random.default_rng(3).uniform(0.5, 9.0, (SIZE[1], SIZE[0], 1)).astype(np.float32)
    x, y = np.meshgrid(np.arange(SIZE[0]) + 0.5, np.arange(SIZE[1]) + 0.5)
    # The point of each pixel at its distance along the view axis, through the inverse of the projection.
    matrix = now.projection_matrix(SIZE[0] / SIZE[1])
    w = depth[..., 0].astype(np.float64) if matrix[3, 3] == 0 else np.ones_like(x)
    flat = np.stack([2 * x / SIZE[0] - 1, 1 - 2 * y / SIZE[1]], axis=-1)
    ahead = np.stack([np.zeros_like(x), np.zeros_like(x), -depth[..., 0], np.ones_like(x)], axis=-1) @ matrix.T
    clip = np.stack([flat[..., 0] * w, flat[..., 1] * w, ahead[..., 2], w], axis=-1)
    world = clip @ np.linalg.inv(clip_from_world(now)).T
    there = world / world[..., 3:] @ clip_from_world(before).T
    with pg.compile(camera_velocity(pg.Input("depth"), now, pg.Value("before", pg.Camera)), backend="numpy") as program:
        made = program(depth=depth, before=before)["velocity"]
    np.testing.assert_allclose(made[..., :2], np.stack([x, y], -1) - places(there), atol=2e-3)
    distance = -(np.asarray(world / world[..., 3:]) - [*before.eye, 0])[..., :3] @ before.view_rotation()[2, :3]
    np.testing.assert_allclose(made[..., 2], distance, rtol=1e-4)


def test_the_sky_turns_and_what_lay_behind_the_eye_is_marked() -> None:
    now = replace(CAMERA, eye=(0.0, 0.0, 0.0), target=(0.0, 0.0, -1.0))
    aside, back = (replace(now, target=target) for target in ((0.1, 0.0, -1.0), (0.0, 0.0, 1.0)))
    made = camera_velocity(pg.Input("depth"), now, pg.Value("before", pg.Camera))
    with pg.compile(made, backend="reference") as program:
        sky = np.zeros((31, 41, 1))
        moved = program(depth=sky, before=replace(aside, eye=(5.0, 0.0, 0.0), target=(5.1, 0.0, -1.0)))["velocity"]
        # To the right by the angle's tangent, in units of half the height over its own tangent.
        assert moved[15, 20] == pytest.approx([0.1 * 15.5 / np.tan(0.4), 0.0, 0.0], abs=1e-5)
        assert program(depth=sky + 2.0, before=back)["velocity"][3, 5].tolist() == [0.0, 0.0, -1.0]


def converged(graph: Any, frames: list[dict[str, Any]], backend: str) -> NDArray[np.float32]:
    with pg.compile(graph, backend=backend) as program:
        for given in frames:
            program.run(**given)
        return np.array(program.read()["taa"])


def disc(shift: tuple[float, float], size: int = 48) -> NDArray[np.float32]:
    """Stripes as narrow as two pixels on a disc, point samples at the pixels' centers and a shift."""
    x, y = np.meshgrid(np.arange(size) + 0.5 + shift[0], np.arange(size) + 0.5 + shift[1])
    inside = np.hypot(x - 23.3, y - 24.1) < 17.7
    value = np.where(inside, 0.5 + 0.4 * np.sin(0.9 * x + 0.4 * y), 0.1)
    return np.dstack([value, 0.5 * value, 1.0 - value, np.ones_like(value)]).astype(np.float32)


@pytest.mark.parametrize("backend_name", ["numpy", "gl", "opencl", "reference"], indirect=True)
def test_a_still_picture_becomes_its_mean_over_the_pixel(backend_name: str) -> None:
    frames = [{"frame": disc(jitter_px(n)), "depth": np.ones((48, 48, 1), np.float32)} for n in range(32)]
    made = converged(taa(pg.Input("frame"), pg.Input("depth")), frames, backend_name)
    steps = (np.arange(16) - 7.5) / 16
    truth = np.mean([disc((dx, dy)) for dx in steps for dy in steps], axis=0)
    error, before = (np.sqrt(np.mean((shown - truth) ** 2)) for shown in (made, disc((0.0, 0.0))))
    assert error < 0.01 < 0.5 * before


def test_a_still_scene_becomes_what_many_samples_show() -> None:
    scene = pg.Scene((floor(3.0), cube((0, 0.5, 0), 1.0)), CAMERA, (sun(),))
    surfaces = scene_surfaces(scene)
    size = (64, 48)
    with pg.compile({"color": surfaces.base_color, "depth": surfaces.depth}, backend="numpy", size=size) as program:
        frames = [dict(program(camera=jittered(CAMERA, n, size))) for n in range(32)]
    with pg.compile(surfaces.base_color, backend="numpy", size=(64 * 16, 48 * 16)) as program:
        fine = next(iter(program(camera=CAMERA).values())).reshape(48, 16, 64, 16, 4)
    given = [{"frame": frame["color"], "depth": frame["depth"]} for frame in frames]
    made = converged(taa(pg.Input("frame"), pg.Input("depth"), camera=CAMERA), given, "numpy")
    error = np.sqrt(np.mean((made - fine.mean(axis=(1, 3)))[..., :3] ** 2))
    assert error < 0.01


def wall(columns: float, size: tuple[int, int] = (32, 24)) -> NDArray[np.float32]:
    """A wall with a pattern of single pixels, seen so many pixels to the side."""
    random = np.random.default_rng(8).random((size[1], 200, 4)).astype(np.float32)
    begin = round(columns)
    return random[:, 80 + begin : 80 + begin + size[0]]


def looking(columns: float, distance: float = 4.0) -> pg.Camera:
    """A camera that has moved so many pixels to the right before a wall 4 units away; 24 pixels are 4 units high."""
    x = columns * distance / 24.0
    return pg.Camera((x, 0, 0), (x, 0, -1), vertical_fov_rad=2 * np.arctan(0.5), near=0.1)


def test_history_is_carried_along_with_the_camera() -> None:
    """Without a box around history, what is carried to a wrong place would blur the pattern."""
    now, before = pg.Value("now", pg.Camera), pg.Value("before", pg.Camera)
    graph = taa(pg.Input("frame"), pg.Input("depth"), camera=now, previous_camera=before, sigmas=16.0)
    ways = [0, 3, 5, 4, -2, -2, 7]
    depth = np.full((24, 32, 1), 4.0, np.float32)
    frames = [
        {"frame": wall(way), "depth": depth, "now": looking(way), "before": looking(earlier)}
        for earlier, way in zip([0, *ways], ways, strict=False)
    ]
    np.testing.assert_allclose(converged(graph, frames, "numpy"), wall(ways[-1]), atol=1e-3)
    still = [{**frame, "before": frame["now"]} for frame in frames]
    assert np.abs(converged(graph, still, "numpy") - wall(ways[-1])).max() > 0.1


def test_what_was_hidden_begins_anew() -> None:
    """A near block moves over a wall; the wall that appears is the new frame's, and what stays is a mean."""
    now, before = pg.Value("now", pg.Camera), pg.Value("before", pg.Camera)
    graph = taa(pg.Input("frame"), pg.Input("depth"), camera=now, previous_camera=before, sigmas=16.0)
    frames = []
    for number, column in enumerate((20, 8)):
        depth = np.full((24, 32, 1), 4.0, np.float32)
        depth[:, column : column + 6] = 1.0
        frame = np.where((np.indices((24, 32)).sum(axis=0) % 2)[..., None], 0.75, 0.25 if number else 0.5)
        frames.append({"frame": frame, "depth": depth, "now": looking(0.0), "before": looking(0.0)})
        frames[-1]["frame"] = (frame * np.ones(4)).astype(np.float32)
    made, last = converged(graph, frames, "numpy")[..., 0], frames[1]["frame"][..., 0]
    np.testing.assert_array_equal(made[:, 21:25], last[:, 21:25])
    mean = 0.5 * (last + frames[0]["frame"][..., 0])
    np.testing.assert_allclose(made[:, 16:18], mean[:, 16:18], atol=1e-6)
    assert np.abs(mean - last)[:, 16:18].max() > 0.1


@pytest.mark.parametrize("backend_name", ["numpy", "gl", "opencl", "reference"], indirect=True)
def test_what_lay_behind_the_eye_begins_anew(backend_name: str) -> None:
    """A wall behind a camera that saw the sky, and turns about: the sky is no history of it."""
    now, before = pg.Value("now", pg.Camera), pg.Value("before", pg.Camera)
    graph = taa(pg.Input("frame"), pg.Input("depth"), camera=now, previous_camera=before, sigmas=16.0)
    ahead = looking(0.0)
    behind = replace(ahead, target=(0.0, 0.0, 1.0))
    sky = {"frame": 0.5 * wall(0.0), "depth": np.zeros((24, 32, 1), np.float32), "now": ahead, "before": ahead}
    turned = {"frame": wall(5.0), "depth": np.full((24, 32, 1), 4.0, np.float32), "now": behind, "before": ahead}
    np.testing.assert_array_equal(converged(graph, [sky, turned], backend_name), wall(5.0))


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_bad_pixel_stays_for_one_frame_and_spreads_nowhere(bad: float) -> None:
    frame = np.full((9, 9, 4), 0.5, np.float32)
    broken = frame.copy()
    broken[4, 4, 1] = bad
    depth = np.ones((9, 9, 1), np.float32)
    with pg.compile(taa(pg.Input("frame"), pg.Input("depth")), backend="numpy", non_finite="keep") as program:
        shown = [np.array(program(frame=given, depth=depth)["taa"]) for given in (frame, broken, frame)]
    assert (~np.isfinite(shown[1])).any(axis=2).sum() == 1
    np.testing.assert_array_equal(shown[2], frame)


@pytest.mark.parametrize("size", [(1, 1), (1, 5), (3, 2)])
@pytest.mark.parametrize("backend_name", ["numpy", "gl", "opencl"], indirect=True)
def test_few_pixels_large_and_negative_numbers_are_a_mean(size: tuple[int, int], backend_name: str) -> None:
    width, height = size
    depth = np.ones((height, width, 1), np.float32)
    frames = [{"frame": np.full((height, width, 4), v, np.float32), "depth": depth} for v in (-2.0, 6e4, -2.0)]
    made = converged(taa(pg.Input("frame"), pg.Input("depth"), sigmas=16.0), frames, backend_name)
    assert made.shape == (height, width, 4) and np.isfinite(made).all()
    # A box without width holds history to the new frame.
    np.testing.assert_allclose(made, -2.0, rtol=1e-6)


def test_places_of_samples_are_balanced_and_apart() -> None:
    places_px = np.array([jitter_px(n) for n in range(16)])
    np.testing.assert_allclose(places_px.mean(axis=0), 0.0, atol=1e-12)
    assert np.abs(places_px).max() <= 0.55
    apart = np.linalg.norm(places_px[:, None] - places_px[None], axis=-1) + np.eye(16)
    assert apart.min() > 0.1


def test_a_moving_camera_leaves_few_ghosts() -> None:
    """A block before a wall with a pattern leaves a trail over what it uncovers, where nothing follows the camera."""
    now, before = pg.Value("now", pg.Camera), pg.Value("before", pg.Camera)
    frames = []
    for number in range(5):
        # four times as near, and as fast
        block = np.zeros((24, 32), np.bool_)
        block[6:18, 22 - 4 * number : 28 - 4 * number] = True
        pattern = ndimage.gaussian_filter(wall(number), (1.5, 1.5, 0.0))
        frame = np.where(block[..., None], np.float32([2.0, 0.1, 0.0, 1.0]), pattern)
        depth = np.where(block, np.float32(1.0), np.float32(4.0))[..., None]
        earlier = looking(max(number - 1.0, 0.0))
        frames.append({"frame": frame, "depth": depth, "now": looking(number), "before": earlier})
    uncovered = (frames[0]["depth"] < 2.0) | (frames[3]["depth"] < 2.0)

    def ghosts(frames: list[dict[str, Any]], **options: Any) -> tuple[float, float]:
        made = converged(taa(pg.Input("frame"), pg.Input("depth"), **options), frames, "numpy")
        error = (made - frames[-1]["frame"])[..., :3] ** 2
        return float(np.sqrt(error[uncovered[..., 0]].mean())), float(np.sqrt(error.mean()))

    trail, everywhere = ghosts(frames, camera=now, previous_camera=before)
    still = [{name: one[name] for name in ("frame", "depth")} for one in frames]
    trail_without, everywhere_without = ghosts(still)
    assert trail < 0.25 * trail_without
    assert everywhere < 0.25 * everywhere_without
