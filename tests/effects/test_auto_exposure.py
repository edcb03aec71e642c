"""Auto exposure against sorted logarithms."""

from __future__ import annotations

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects import auto_exposure
from tests.conftest import DEVICES
from tests.effects.scenes import Picture, render

#: Half a bin of the histogram, in stops: no mean of bins' centres is farther from that of the numbers in them.
HALF_BIN = 1.0 / 16.0
FRAME = pg.Input("frame")


def grey(light: Picture) -> Picture:
    return (light[..., None] * np.ones(4)).astype(np.float32)


def stops(picture: Picture, backend: str = "numpy", **settings: float) -> float:
    """How many stops brighter the picture became, the same everywhere."""
    made = auto_exposure(FRAME, **settings)
    shown = render(made, size=None, backend=backend, frame=picture)["auto_exposure"]
    lit = picture[..., 0] > 0
    factors = np.log2(shown[..., 0][lit] / picture[..., 0][lit])
    np.testing.assert_allclose(factors, factors[0], atol=1e-4)
    np.testing.assert_array_equal(shown[..., 3], picture[..., 3])
    return float(factors[0])


@pytest.mark.parametrize("backend_name", DEVICES, indirect=True)
def test_the_clipped_mean_becomes_grey(backend_name: str) -> None:
    light = np.exp2(np.random.default_rng(1).normal(-4.0, 2.0, (20, 31)))
    logs = np.sort(np.log2(light / 0.18).ravel())
    count = logs.size
    ends = np.clip(np.arange(count + 1) / count, 0.2, 0.7)
    wanted = -np.average(logs, weights=np.diff(ends))
    found = stops(grey(light), backend_name, dark_share=0.2, bright_share=0.3)
    assert abs(found - wanted) <= HALF_BIN


def test_one_pixel_becomes_grey() -> None:
    assert abs(stops(grey(np.full((1, 1), 3.0))) + np.log2(3.0 / 0.18)) <= HALF_BIN


def test_lamps_black_corners_and_nan_do_not_count() -> None:
    picture = grey(np.full((20, 20), 0.09))
    picture[0] = 60000.0
    picture[1] = 0.0
    assert abs(stops(picture) - 1.0) <= HALF_BIN
    picture[2] = np.nan
    with pg.compile(auto_exposure(FRAME), non_finite="keep") as program:
        shown = program(frame=picture)["auto_exposure"][5, 5, 0]
    assert abs(np.log2(shown / 0.09) - 1.0) <= HALF_BIN


def test_the_exposure_stays_within_its_ends() -> None:
    assert stops(grey(np.full((3, 3), 1e-4)), most_stops=2.5) == pytest.approx(2.5, abs=1e-5)
    assert stops(grey(np.full((3, 3), 1e4)), least_stops=-1.5) == pytest.approx(-1.5, abs=1e-5)
    black = np.zeros((3, 3, 4), np.float32)
    assert render(auto_exposure(FRAME), size=None, frame=black)["auto_exposure"].max() == 0.0


def test_an_eye_adapts() -> None:
    """From the first run's exposure a share of the way in each."""
    dim = grey(np.full((8, 8), 0.09))
    made = auto_exposure(FRAME, settle_share=pg.Value("share", float))
    with pg.compile(made) as program:
        found = [
            float(np.log2(program(frame=dim * gain, share=0.25)["auto_exposure"][0, 0, 0] / (0.09 * gain)))
            for gain in (1, 1, 4, 4, 4)
        ]
    assert found[0] == found[1]
    apart = [stop - (found[0] - 2.0) for stop in found[1:]]
    np.testing.assert_allclose(apart, [2.0, 1.5, 1.125, 0.84375], atol=1e-4)


def test_shares_that_leave_nothing_are_refused() -> None:
    with pytest.raises(pg.GraphError, match=r"auto_exposure: dark_share must be 0 to 0\.49, got 0\.5"):
        auto_exposure(FRAME, dark_share=0.5)
