"""Means over frames: two planes before a camera that moves by whole pixels, counted in NumPy; and less error for AO."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects.ambient.ambient_occlusion import ambient_occlusion_passes
from passgraph.effects.screen.occluded import occluded
from passgraph.effects.temporal.accumulate import accumulate, frame_number
from tests.conftest import DEVICES
from tests.effects.engine import EngineView
from tests.effects.scenes import Float64, Picture
from tests.effects.test_occluded import BY_RAYS, FALLOFF, RADIUS, SCENE, SIZE, by_horizons, by_rays, rms

#: A picture 16 pixels and 8 units wide at distance 8, 4 at distance 4: a step of 1 unit moves the wall by 2 pixels and
#: the board before it by 4.
WIDTH, HEIGHT, WALL, BOARD = 16, 8, 8.0, 4.0
HALF_WAY = 2.0 * np.arctan(0.25)


def at(x: float) -> pg.Camera:
    return pg.Camera((x, 0, 0), (x, 0, -1), vertical_fov_rad=HALF_WAY, near=0.1)


def depth_from(x: float, has_board: bool) -> Picture:
    """A board 4 pixels wide in columns 8 to 11 of the camera at 0."""
    depth = np.full((HEIGHT, WIDTH, 1), WALL, np.float32)
    if has_board:
        depth[2:6, int(8 - 4 * x) : int(12 - 4 * x)] = BOARD
    return depth


@pytest.mark.parametrize("backend_name", DEVICES, indirect=True)
def test_a_mean_follows_surfaces_and_starts_again_where_they_were_hidden(backend_name: str) -> None:
    """Each texel of the mean is the exact mean of the frames that saw its surface in a row."""
    camera, before = (pg.Value(name, pg.Camera) for name in ("camera", "before"))
    made = accumulate(pg.Input("noise", "rgba32f"), pg.Input("depth", "r32f"), camera, before, most_frames=3)
    rng = np.random.default_rng(2)
    # the camera's place, and whether there is a board, in each frame
    frames = [(0.0, True), (1.0, True), (1.0, False), (1.0, True), (0.0, True), (0.0, True)]
    expected, count = np.zeros((HEIGHT, WIDTH, 4)), np.zeros((HEIGHT, WIDTH))
    with pg.compile(made, backend_name) as program:
        for now, old in zip(frames, frames[:1] + frames, strict=False):
            noise, depth = rng.random((HEIGHT, WIDTH, 4), np.float32), depth_from(*now)
            shown = program(noise=noise, depth=depth, camera=at(now[0]), before=at(old[0]))["accumulated"]
            old_depth, old_mean, old_count = depth_from(*old), expected.copy(), count.copy()
            for row, column in np.ndindex(HEIGHT, WIDTH):
                there = column + round((now[0] - old[0]) * 2 * WALL / depth[row, column, 0])
                seen = 0 <= there < WIDTH and old_depth[row, there, 0] == depth[row, column, 0]
                gathered = min(old_count[row, there], 2) if seen else 0
                mean = old_mean[row, there] if gathered else 0.0
                expected[row, column] = (gathered * mean + noise[row, column]) / (gathered + 1)
                count[row, column] = gathered + 1
            np.testing.assert_allclose(shown, expected, atol=1e-5)
            # without history the frame itself, to the bit
            np.testing.assert_array_equal(shown[count == 1], noise[count == 1])
    # the wall beside the board was hidden, and the border outside, in the frame before the last but one
    assert {*np.unique(count)} == {2.0, 3.0}


def test_what_lay_behind_the_eye_and_what_is_no_number_start_again() -> None:
    made = accumulate(pg.Input("noise"), pg.Input("depth"), at(0.0), pg.Value("before", pg.Camera))
    around, ones = pg.Camera((0, 0, 0), (0, 0, 1)), np.ones((4, 4, 4), np.float32)
    bad, depth = ones.copy(), ones[..., :1].copy()
    depth[:, 3] = 0.0  # the sky
    bad[1, 2, 0] = np.nan
    with pg.compile(made, "numpy", non_finite="keep") as program:

        def after(noise: Picture, before: pg.Camera) -> Float64:
            return np.asarray(program(noise=noise, depth=depth, before=before)["accumulated"][..., 0], float)

        assert (after(ones, at(0.0)) == 1.0).all()
        assert np.isnan(after(bad, at(0.0))).sum() == 1
        back = after(3.0 * ones, at(0.0))
        assert back[1, 2] == 3.0
        assert back[0, 0] == pytest.approx(5.0 / 3.0)
        assert (after(9.0 * ones, around) == 9.0).all()


def test_frames_are_counted_and_begin_again() -> None:
    with pg.compile(frame_number("number"), "numpy") as program:
        counted = [float(program()["number"][0, 0, 0]) for _ in range(257)]
    assert counted == [*range(1, 256), 0, 1]


def test_one_slice_over_frames_is_nearer_to_the_truth_than_two_in_one_frame() -> None:
    """With as many taps a frame, against the integral over all texels along many slices."""
    view = EngineView.of(SCENE, SIZE)
    truth, on_floor = by_horizons(view, RADIUS, FALLOFF, slices=8), view.surfaces.node == 0

    def error(frames: int, slices: int, steps: int) -> float:
        made = occluded(
            pg.Input("frame"), view.distance(), radius=RADIUS, camera=view.camera, slices=slices, steps=steps,
            most_frames=frames,
        )  # fmt: skip
        with pg.compile(made, "numpy") as program:
            for _ in range(frames):
                shown = program(frame=np.ones((*view.depth.shape, 4), np.float32), depth=view.depth)["occluded"]
        return rms((shown[..., 0] - truth)[on_floor])

    accumulated = error(16, 1, 8)
    assert accumulated < 0.7 * error(1, 2, 4)
    assert accumulated < 0.95 * error(1, 1, 8)


def of_scene(
    frames: int, step_deg: float = 0.0, runs: int = 0, backend: str = "numpy", steady: bool = False
) -> Float64:
    """Visibility after so many runs, the camera turning to where the scene has it; ``steady`` says it stood still."""
    made = ambient_occlusion_passes(SCENE, radius=RADIUS, slices=1, steps=8, most_frames=frames)
    runs = runs or frames
    cameras = [SCENE.camera.orbited(np.radians(step_deg * (i - runs)), 0.0, 1.0) for i in range(runs + 1)]
    with pg.compile({"visibility": made.occlusion.visibility}, backend, size=SIZE) as program:
        for before, camera in pairwise(cameras):
            moved = {"previous_camera": camera if steady else before} if frames > 1 else {}
            shown = program(camera=camera, **moved)
    return np.asarray(shown["visibility"][..., 0], np.float64)


def test_a_scene_has_less_noise_over_frames() -> None:
    """Against the mean of many frames, and against rays."""
    view = EngineView.of(SCENE, SIZE)
    one, few, more, many = (of_scene(frames) for frames in (1, 4, 16, 64))
    noise = rms((one - many)[view.shown])
    assert noise > 0.003
    assert rms((few - many)[view.shown]) < 0.4 * noise
    assert rms((more - many)[view.shown]) < 0.25 * noise
    rays = by_rays(view, SCENE, RADIUS, FALLOFF)
    assert rms((more - rays)[view.shown]) < rms((one - rays)[view.shown]) < BY_RAYS


def test_a_camera_that_moves_smears_less_than_a_frame_has_noise() -> None:
    """By 1 degree a frame over 4 frames; and by more if a run does not say where the camera was."""
    shown = EngineView.of(SCENE, SIZE).shown
    many = of_scene(64)
    noise = rms((of_scene(1) - many)[shown])
    slow, fast = (rms((of_scene(4, step, 24) - many)[shown]) for step in (0.25, 1.0))
    assert slow < 0.65 * noise
    assert fast < 1.1 * noise
    assert fast < 0.85 * rms((of_scene(4, 1.0, 24, steady=True) - many)[shown])


def test_a_run_without_the_camera_before_is_refused() -> None:
    made = ambient_occlusion_passes(SCENE, most_frames=4).occlusion.visibility
    with pg.compile(made, "numpy", size=SIZE) as program, pytest.raises(pg.InputError, match="previous_camera"):
        program(camera=SCENE.camera)


@pytest.mark.parametrize("backend_name", DEVICES, indirect=True)
def test_a_scene_over_frames_is_alike_on_every_backend(backend_name: str) -> None:
    shown = of_scene(4, 0.5, backend=backend_name)
    assert np.quantile(np.abs(shown - of_scene(4, 0.5)), 0.999) < 0.01
