"""Light streaks against exponential filters of SciPy in float64, and where the light of a lamp must lie."""

from __future__ import annotations

from math import atan2, pi
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

import passgraph as pg
from passgraph.effects import light_streaks
from tests.agreement import assert_within_bounds
from tests.conftest import DEVICES
from tests.effects.scenes import Float64, Picture, render
from tests.effects.test_god_rays import picture, places, read, source

FRAME = pg.Input("frame")
every_backend = pytest.mark.parametrize("backend_name", ["reference", *DEVICES], indirect=True)


def shown(target: pg.Target, backend: str = "numpy", **given: Any) -> Float64:
    (made,) = render(target, size=None, backend=backend, **given).values()
    return made.astype(np.float64)


def expected(frame: Picture, length: float, axes: list[tuple[int, bool]], strength: Float64) -> Float64:
    """Streaks along axes of the picture, each forward or backward, with threshold 0.5."""
    bright = source(frame, 0.5, None)
    kept = 0.01 ** (1.0 / max(length * bright.shape[0], 1.0))
    made, (x, y) = frame.astype(np.float64), places(frame.shape)
    for axis, backward in axes:
        turned = np.flip(bright, axis) if backward else bright
        streak = lfilter([1.0 - kept], [1.0, -kept], turned, axis=axis)
        streak = np.flip(streak, axis) if backward else streak
        halves = [0.5 * whole / half for whole, half in zip(frame.shape, bright.shape[:2], strict=False)]
        # Half a texel beyond the edge, the border's zero is mixed in.
        made[..., :3] += strength / len(axes) * read(streak, x * halves[1], y * halves[0], "grid-constant")
    return made


@pytest.mark.sampled
@every_backend
@pytest.mark.parametrize("size", [(1, 1), (24, 40), (31, 57), (5, 700)])
@pytest.mark.parametrize("length", [0.0, 0.1, 1.0])
def test_streaks_are_exponential_filters(length: float, size: tuple[int, int], backend_name: str) -> None:
    frame, tint = picture(size), (0.3, 0.5, 1.0)
    values = {"length": length, "intensity": 0.7, "angle": 0.0, "threshold": 0.5}
    graph = light_streaks(
        FRAME, pg.Value("threshold"), pg.Value("intensity"), pg.Value("length"), 2, pg.Value("angle"), tint
    )
    made = shown(graph, backend_name, frame=frame, **values)
    wanted = expected(frame, length, [(1, False), (1, True)], 0.7 * np.array(tint))
    # Places of reads are rounded: so many texels of a row times half a unit in the last place, times the largest step.
    np.testing.assert_allclose(made, wanted, rtol=2e-5, atol=2e-5 + max(size) * 2.0**-24 * 10.0)


def test_four_streaks_run_along_both_axes() -> None:
    frame = picture((30, 44))
    made = shown(light_streaks(FRAME, 0.5, 1.0, 0.2, 4), frame=frame)
    wanted = expected(frame, 0.2, [(0, False), (0, True), (1, False), (1, True)], np.ones(3))
    np.testing.assert_allclose(made, wanted, rtol=1e-4, atol=1e-4)


@every_backend
@pytest.mark.parametrize("angle", [0.3, 1.2, -2.5])
def test_one_streak_runs_in_its_direction_and_keeps_its_light(angle: float, backend_name: str) -> None:
    frame = np.zeros((160, 160, 4), np.float32)
    frame[80:82, 80:82, :3] = 100.0
    streak = shown(light_streaks(FRAME, 0.0, 0.5, 0.15, 1, angle), backend_name, frame=frame) - frame
    light = streak[..., 0]
    y, x = np.mgrid[:160, :160] - 80.5
    center = (light * x).sum() / light.sum(), -(light * y).sum() / light.sum()
    assert abs((atan2(center[1], center[0]) - angle + pi) % (2 * pi) - pi) < 0.02
    assert light.sum() == pytest.approx(0.5 * frame[..., 0].sum(), rel=0.02)


@pytest.mark.slow
def test_streaks_within_bounds_of_the_reference() -> None:
    assert_within_bounds(light_streaks(FRAME, 0.5, 0.8, 0.2, 3, 0.4), frame=picture((17, 31)))
