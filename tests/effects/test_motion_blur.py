"""Motion blur against accumulated subframes, box filters in NumPy, and what no motion leaves."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.effects import jittered, motion_blur, scene_surfaces
from tests.effects.scenes import cube, floor, sun

Picture = NDArray[np.float32]
FRAME, DEPTH, VELOCITY = pg.Input("frame"), pg.Input("depth"), pg.Input("velocity")
SUBFRAMES = 64
every_backend = pytest.mark.parametrize("backend_name", ["numpy", "gl", "opencl", "reference"], indirect=True)


def shown(graph: Any, backend: str, **given: Any) -> Picture:
    with pg.compile(graph, backend=backend, non_finite="keep") as program:
        return np.array(program(**given)["motion_blur"])


def noise(size: tuple[int, int], seed: int = 5) -> Picture:
    return np.random.default_rng(seed).random((size[1], size[0], 4), np.float32)


def moving(size: tuple[int, int], way: tuple[float, float]) -> Picture:
    return np.full((size[1], size[0], 2), way, np.float32)


def rms(difference: Any) -> float:
    return float(np.sqrt(np.mean(difference[..., :3] ** 2)))


@every_backend
def test_without_motion_no_bit_changes(backend_name: str) -> None:
    frame = noise((45, 23)) * 100.0 - 50.0
    given = {"frame": frame, "depth": np.ones((23, 45, 1), np.float32)}
    still = motion_blur(FRAME, DEPTH, velocity=VELOCITY, longest_px=16, taps=8)
    np.testing.assert_array_equal(shown(still, backend_name, **given, velocity=moving((45, 23), (0.0, 0.0))), frame)
    camera = pg.Camera((0, 0, 0), (0, 0, -1))
    same = motion_blur(FRAME, DEPTH, camera=camera, previous_camera=camera, longest_px=16, taps=8)
    np.testing.assert_array_equal(shown(same, backend_name, **given), frame)
    np.testing.assert_array_equal(shown(motion_blur(FRAME, DEPTH), backend_name, **given), frame)


@every_backend
@pytest.mark.parametrize(("way", "step"), [((12.0, 0.0), (1, 0)), ((0.0, -12.0), (0, 1)), ((12.0, 12.0), (1, 1))])
def test_equal_velocity_is_a_box_filter(way: tuple[float, float], step: tuple[int, int], backend_name: str) -> None:
    """6 pixels while the shutter is open: five and two halves. Two taps a pixel meet each half once."""
    frame, size = 4.0 * noise((41, 33)) - 1.0, (41, 33)
    made = shown(
        motion_blur(FRAME, DEPTH, velocity=VELOCITY, taps=12, longest_px=30), backend_name,
        frame=frame, depth=np.full((33, 41, 1), 3.0, np.float32), velocity=moving(size, way),
    )  # fmt: skip
    padded = np.pad(frame.astype(np.float64), ((3, 3), (3, 3), (0, 0)), mode="edge")
    weights = np.array([0.5, 1, 1, 1, 1, 1, 0.5]) / 6.0
    places = [(3 + k * step[1], 3 + k * step[0]) for k in range(-3, 4)]
    expected = sum(w * padded[y : y + 33, x : x + 41] for w, (y, x) in zip(weights, places, strict=True))
    np.testing.assert_allclose(made, expected, atol=2e-5)


def test_streaks_are_cut_at_their_longest() -> None:
    frame, size = noise((61, 9)), (61, 9)
    depth = np.ones((9, 61, 1), np.float32)
    graph = motion_blur(FRAME, DEPTH, velocity=VELOCITY, longest_px=8, taps=16, shutter=1.0)
    long, cut = (shown(graph, "numpy", frame=frame, depth=depth, velocity=moving(size, (x, 0))) for x in (5e3, 8.0))
    np.testing.assert_allclose(long, cut, atol=1e-6)


def scene_frames(cameras: list[pg.Camera], size: tuple[int, int]) -> list[dict[str, Picture]]:
    """Colors and distances; sides of a cube differ by their normals."""
    scene = pg.Scene((floor(3.0), cube((0, 0.5, 0), 1.0), cube((0.8, 0.3, 1.2), 0.5)), cameras[0], (sun(),))
    surfaces = scene_surfaces(scene)
    graph = {"color": surfaces.base_color, "normals": surfaces.normals, "depth": surfaces.depth}
    with pg.compile(graph, backend="numpy", size=size) as program:
        made = [{name: np.array(one) for name, one in program(camera=camera).items()} for camera in cameras]
    for frame in made:
        frame["color"][..., :3] *= 0.5 + 0.5 * frame.pop("normals")[..., :3]
    return made


CAMERA = pg.Camera((2.0, 1.5, 3.0), (0.0, 0.2, 0.0), vertical_fov_rad=0.8, near=0.1, far=40.0)
#: How eye and target move in a frame, and the error that is left of that without blur. What moves apart, as before a
#: camera that goes forward, is blurred over what is behind it by the way of the fastest in its tile.
MOVES = {
    "sideways": ((0.3, 0.0, -0.2), (0.3, 0.0, -0.2), 0.2),
    "turns": ((0.0, 0.0, 0.0), (0.6, 0.3, 0.0), 0.3),
    "forward": ((-0.6, -0.4, -0.9), (0.0, 0.0, 0.0), 0.6),
}


@pytest.mark.parametrize("move", MOVES)
def test_a_moving_camera_is_close_to_accumulated_subframes(move: str) -> None:
    """The frame is the middle of the exposure, both without jagged edges; without blur the error is far larger."""
    size = (128, 96)

    def at(time: float) -> pg.Camera:
        eye, target = (np.multiply(time, way) for way in MOVES[move][:2])
        return replace(CAMERA, eye=tuple(CAMERA.eye + eye), target=tuple(CAMERA.target + target))

    times = ((np.arange(SUBFRAMES) + 0.5) / SUBFRAMES - 0.5) * 0.5
    middle = scene_frames([at(0.0)], size)[0]
    still = scene_frames([jittered(at(0.0), number, size) for number in range(16)], size)
    subframes = scene_frames([jittered(at(time), number, size) for number, time in enumerate(times)], size)
    frame, truth = (np.mean([one["color"] for one in frames], axis=0) for frames in (still, subframes))
    graph = motion_blur(FRAME, DEPTH, camera=pg.Value("now", pg.Camera), previous_camera=pg.Value("before", pg.Camera))
    made = shown(graph, "numpy", frame=frame, depth=middle["depth"], now=at(0.0), before=at(-1.0))
    without = rms(frame - truth)
    assert without > 0.02
    assert rms(made - truth) < MOVES[move][2] * without


def thing_before_wall(shift: float, thing_moves: bool) -> tuple[Picture, Picture, NDArray[np.bool_]]:
    """A disc before a wall, at distances of 2 and 5, with smooth patterns; one of them is moved to the right."""
    x, y = np.meshgrid(np.arange(96) + 0.5, np.arange(64) + 0.5)
    disc_x, wall_x = (x - shift, x) if thing_moves else (x, x - shift)
    inside = np.hypot(disc_x - 48.0, y - 32.0) < 15.0
    thing = np.dstack([0.7 + 0.3 * np.sin(0.5 * disc_x), 0.4 + 0.0 * x, 0.2 + 0.1 * np.cos(0.4 * y), 1.0 + 0.0 * x])
    wall = np.dstack([0.1 + 0.0 * x, 0.3 + 0.2 * np.sin(0.3 * wall_x + 0.2 * y), 0.6 + 0.0 * x, 1.0 + 0.0 * x])
    frame = np.where(inside[..., None], thing, wall).astype(np.float32)
    return frame, np.where(inside, 2.0, 5.0).astype(np.float32)[..., None], inside


@every_backend
@pytest.mark.parametrize("thing_moves", [True, False], ids=["thing", "wall"])
def test_one_of_two_surfaces_moves(thing_moves: bool, backend_name: str) -> None:
    """What stands before is as sharp as it was, and what moves before is blurred over what stands."""
    frame, depth, inside = thing_before_wall(0.0, thing_moves)
    velocity = np.where(inside[..., None] == thing_moves, np.float32([24.0, 0.0]), np.float32(0.0))
    times = ((np.arange(SUBFRAMES) + 0.5) / SUBFRAMES - 0.5) * 12.0
    truth = np.mean([thing_before_wall(time, thing_moves)[0] for time in times], axis=0)
    graph = motion_blur(FRAME, DEPTH, velocity=VELOCITY)
    made = shown(graph, backend_name, frame=frame, depth=depth, velocity=velocity)
    assert rms(made - truth) < rms(frame - truth) / 3.0
    if not thing_moves:
        np.testing.assert_array_equal(made[inside], frame[inside])


@every_backend
@pytest.mark.parametrize("size", [(1, 1), (1, 9), (21, 2), (41, 40)])
def test_bad_pixels_stay_and_spread_nowhere(size: tuple[int, int], backend_name: str) -> None:
    """A velocity and a distance that are not finite count as none and as the sky."""
    width, height = size
    frame = np.full((height, width, 4), 2.0, np.float32)
    frame[height // 2, width // 2] = np.nan
    velocity = moving(size, (20.0, 14.0))
    velocity[0, 0] = np.nan
    depth = np.full((height, width, 1), 3.0, np.float32)
    depth[:, ::3] = np.inf
    graph = motion_blur(FRAME, DEPTH, velocity=VELOCITY, longest_px=8, taps=5)
    made = shown(graph, backend_name, frame=frame, depth=depth, velocity=velocity)
    bad = np.isnan(frame).all(axis=2)
    assert np.isnan(made[bad]).all()
    np.testing.assert_allclose(made[~bad], 2.0, rtol=1e-5)


def test_alpha_is_blurred_with_its_color() -> None:
    frame = np.zeros((1, 15, 4), np.float32)
    frame[:, 7] = (0.5, 0.25, 0.0, 0.5)
    given = {"frame": frame, "depth": np.ones((1, 15, 1), np.float32), "velocity": moving((15, 1), (8.0, 0.0))}
    made = shown(motion_blur(FRAME, DEPTH, velocity=VELOCITY, taps=16), "numpy", **given)
    np.testing.assert_allclose(made[..., 3], made[..., 0], rtol=1e-6)
    assert made[..., 3].sum() == pytest.approx(0.5)


def test_a_velocity_needs_no_depth() -> None:
    random = np.random.default_rng(5)
    frame = random.random((9, 14, 4)).astype(np.float32)
    velocity = random.uniform(-6, 6, (9, 14, 2)).astype(np.float32)
    moved = pg.Input("velocity")
    with pg.compile(motion_blur(pg.Input("frame"), velocity=moved), backend="numpy") as program:
        found = program(frame=frame, velocity=velocity)["motion_blur"]
    with pg.compile(motion_blur(pg.Input("frame"), pg.Input("depth"), velocity=moved), backend="numpy") as program:
        expected = program(frame=frame, velocity=velocity, depth=np.ones((9, 14, 1), np.float32))["motion_blur"]
    assert (found == expected).all()
    assert (found != frame).any()
    with pytest.raises(pg.GraphError, match="motion_blur: nothing tells how surfaces move"):
        motion_blur(pg.Input("frame"))
