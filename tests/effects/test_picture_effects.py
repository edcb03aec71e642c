"""Effects on pictures: properties that hold for every picture."""

from __future__ import annotations

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects import black_and_white, depth_aware_blur, gaussian_blur, tone_map
from passgraph.effects.blur import gaussian_weights
from tests.effects.scenes import Picture, render

FRAME = pg.Input("frame")


def run(target: pg.Target, **pictures: Picture) -> Picture:
    (result,) = render(target, size=(8, 8), backend="reference", **pictures).values()
    return result


def noise(height: int = 12, width: int = 20) -> Picture:
    return np.random.default_rng(3).random((height, width, 4), np.float32)


def test_black_and_white_is_the_weighted_sum_and_keeps_alpha() -> None:
    picture = noise()
    gray = run(black_and_white(FRAME), frame=picture)
    expected = picture[:, :, :3] @ np.array([0.2126, 0.7152, 0.0722], np.float32)
    np.testing.assert_allclose(gray[:, :, :3], np.repeat(expected[:, :, None], 3, 2), atol=1e-6)
    np.testing.assert_array_equal(gray[:, :, 3], picture[:, :, 3])


def test_black_and_white_of_white_is_white() -> None:
    assert run(black_and_white(FRAME), frame=np.ones((1, 1, 4), np.float32))[0, 0].tolist() == pytest.approx([1.0] * 4)


@pytest.mark.parametrize("curve", ["linear", "reinhard", "hable", "aces"])
@pytest.mark.parametrize("encode", [False, True])
def test_tone_curves_are_monotone_and_stay_in_range(curve: str, encode: bool) -> None:
    ramp = np.concatenate([[0.0], np.geomspace(1e-6, 6e4, 255)]).astype(np.float32)
    picture = np.repeat(ramp[None, :, None], 4, axis=2)
    into = pg.target("shown", "rgba32f")
    shown = run(tone_map(FRAME, curve=curve, encode=encode, into=into), frame=picture)[0, :, 0]  # type: ignore[arg-type]
    assert shown[0] == pytest.approx(0.0, abs=1e-7 if not encode else 2e-6)
    assert shown.max() <= 1.0
    assert shown[-1] > 0.99
    assert (np.diff(shown) >= -2e-7).all()


@pytest.mark.parametrize("curve", ["linear", "reinhard", "hable", "aces"])
def test_tone_map_makes_nan_black_and_infinity_white(curve: str) -> None:
    picture = np.array([[[np.nan, np.inf, -np.inf, 1.0], [-1.0, 1e38, 0.0, np.nan]]], np.float32)
    shown = run(tone_map(FRAME, 4.0, curve, into=pg.target("shown", "rgba32f")), frame=picture)  # type: ignore[arg-type]
    np.testing.assert_allclose(shown[0, :, :3], [[0, 1, 0], [0, 1, 0]], atol=0.01)
    assert np.isfinite(shown).all()


def test_exposure_may_be_a_run_value() -> None:
    shown = tone_map(FRAME, pg.Value("stops", default=1.0), "linear", encode=False)
    picture = np.full((1, 1, 4), 0.125, np.float32)
    assert run(shown, frame=picture)[0, 0, 0] == 0.25
    assert render(shown, frame=picture, stops=2.0)["tone_map"][0, 0, 0] == 0.5


def test_an_unknown_curve_is_refused() -> None:
    with pytest.raises(pg.GraphError, match="curve cannot be 'filmic'; it is one of linear"):
        tone_map(FRAME, curve="filmic")  # type: ignore[arg-type]


@pytest.mark.parametrize(("sigma", "radius"), [(0.5, 1), (2.0, 7), (3.0, 9), (40.0, 7)])
def test_gaussian_weights_add_up_to_one(sigma: float, radius: int) -> None:
    weights = gaussian_weights(sigma, radius)
    assert weights[0] + 2 * sum(weights[1:]) == pytest.approx(1.0, abs=1e-15)
    assert list(weights) == sorted(weights, reverse=True)


def test_a_blur_without_radius_is_its_input() -> None:
    assert gaussian_blur(FRAME, 3.0, 0) is FRAME
    assert gaussian_blur(FRAME, 0.0) is FRAME
    assert depth_aware_blur(FRAME, FRAME, 0) is FRAME


@pytest.mark.parametrize("radius", [-1, 301])
def test_a_radius_out_of_range_is_refused(radius: int) -> None:
    with pytest.raises(pg.GraphError, match="radius_px must be 0 to 300"):
        gaussian_blur(FRAME, 3.0, radius)


@pytest.mark.parametrize("blur", [gaussian_blur, depth_aware_blur])
def test_a_constant_picture_stays_constant(blur: object) -> None:
    picture = np.full((9, 11, 4), 0.7, np.float32)
    target = gaussian_blur(FRAME, 2.0, 7) if blur is gaussian_blur else depth_aware_blur(FRAME, FRAME, 7)
    np.testing.assert_allclose(run(target, frame=picture), 0.7, atol=3e-7)


def test_the_blur_of_a_point_is_the_product_of_the_weights() -> None:
    picture = np.zeros((15, 15, 4), np.float32)
    picture[7, 7] = 1.0
    weights = np.array(gaussian_weights(2.0, 7))
    line = np.concatenate([weights[:0:-1], weights])
    soft = run(gaussian_blur(FRAME, 2.0, 7), frame=picture)[:, :, 0]
    np.testing.assert_allclose(soft, np.outer(line, line), atol=1e-7)


def test_depth_aware_blur_blurs_a_slanted_plane_as_an_upright_one() -> None:
    step = (np.arange(24) < 12).astype(np.float32)
    mask = np.tile(step, (16, 1))
    upright = np.full((16, 24), 5.0, np.float32)
    slanted = np.tile((1.0 / np.linspace(0.1, 0.5, 24)).astype(np.float32), (16, 1))  # a plane: 1 / depth is linear
    made = depth_aware_blur(pg.Input("mask"), pg.Input("depth"), 5, 0.02)
    flat = run(made, mask=mask, depth=upright)[:, :, 0]
    steep = run(made, mask=mask, depth=slanted)[:, :, 0]
    assert 0.3 < flat[8, 12] < 0.7
    np.testing.assert_allclose(steep, flat, atol=1e-3)


def test_depth_aware_blur_does_not_cross_a_silhouette() -> None:
    step = (np.arange(24) < 12).astype(np.float32)
    mask = np.tile(step, (16, 1))
    made = depth_aware_blur(pg.Input("mask"), pg.Input("depth"), 5, 0.02)
    apart = run(made, mask=mask, depth=1.0 + 4.0 * mask)[:, :, 0]
    np.testing.assert_array_equal(apart, mask)


def test_a_tolerance_of_zero_is_refused() -> None:
    with pytest.raises(pg.GraphError, match="tolerance must be above 0"):
        depth_aware_blur(FRAME, FRAME, 3, 0.0)
