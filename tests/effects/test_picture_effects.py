"""Effects on pictures: properties that hold for every picture."""

from __future__ import annotations

from math import log2

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects import black_and_white, depth_aware_blur, gaussian_blur, tone_map
from passgraph.effects.color.tone_map import AGX_MEAN, AGX_SHARE, CURVES, Curve
from passgraph.effects.effect_table import EFFECTS
from passgraph.effects.filters.blur import gaussian_weights
from tests.agreement import assert_within_bounds
from tests.conftest import DEVICES
from tests.effects.scenes import Picture, render

FRAME = pg.Input("frame")


def run(target: pg.Target, **pictures: Picture) -> Picture:
    (result,) = render(target, size=None, backend="reference", **pictures).values()
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


@pytest.mark.parametrize("curve", CURVES)
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


@pytest.mark.parametrize("backend_name", DEVICES, indirect=True)
@pytest.mark.parametrize("curve", CURVES)
def test_tone_map_makes_nan_black_and_infinity_white(curve: Curve, backend_name: str) -> None:
    picture = np.array([[[np.nan, np.inf, -np.inf, 1.0], [-1.0, 1e38, 0.0, np.nan]]], np.float32)
    target = tone_map(FRAME, 4.0, curve, into=pg.target("shown", "rgba32f"))
    with pg.compile(target, backend=backend_name, non_finite="keep") as program:
        shown = program(frame=picture)["shown"]
    assert np.isfinite(shown).all()
    # what turns bright colours white leaves no channel black
    white = [[1, 1, 1], [1, 1, 1]] if curve in ("agx", "pbr-neutral") else [[0, 1, 0], [0, 1, 0]]
    np.testing.assert_allclose(shown[0, :, :3], white, atol=0.01)


def linear(curve: Curve, *colours: tuple[float, float, float]) -> Picture:
    """Colours through a curve on the reference, linear in and out."""
    picture = np.ones((1, len(colours), 4), np.float32)
    picture[0, :, :3] = colours
    return run(tone_map(FRAME, curve=curve, encode=False, into=pg.target("shown", "rgba32f")), frame=picture)[0, :, :3]


GREY = (0.18, 0.18, 0.18)


@pytest.mark.parametrize(
    ("curve", "published"),
    [
        ("reinhard", 0.18 / 1.18),
        ("aces", 0.18 * (2.51 * 0.18 + 0.03) / (0.18 * (2.43 * 0.18 + 0.59) + 0.14)),
        ("agx", 0.5**2.2),  # the pivot: half of the display's range
        ("pbr-neutral", 0.18 - 0.04),  # as it is, less the Fresnel reflection
    ],
)
def test_middle_grey_is_as_published(curve: Curve, published: float) -> None:
    np.testing.assert_allclose(linear(curve, GREY)[0], published, rtol=2e-6)


def test_agx_is_near_the_published_fit_of_its_curve() -> None:
    """B. Wrensch's polynomial of degree 6 (2023), itself rounded: nearer than one step of 8 bits."""
    x = np.linspace(0.0, 1.0, 201)
    grey = 2.0 ** (log2(0.18) - 10.0 + 16.5 * x)
    ours = linear("agx", *((v, v, v) for v in grey))[:, 1] ** (1 / 2.2)
    fit = np.polyval([15.5, -40.14, 31.96, -6.868, 0.4298, 0.1191, -0.00232], x)
    assert np.sqrt(np.mean((ours - fit) ** 2)) < 1 / 255


def test_agx_mixes_primaries_as_the_published_matrix_does() -> None:
    published = [
        [0.842479062253094, 0.0784335999999992, 0.0792237451477643],
        [0.0423282422610123, 0.878468636469772, 0.0791661274605434],
        [0.0423756549057051, 0.0784336, 0.879142973793104],
    ]
    ours = (1 - AGX_SHARE) * np.eye(3) + AGX_SHARE * np.tile(AGX_MEAN, (3, 1))
    np.testing.assert_allclose(ours, published, atol=1.5e-4)
    assert sum(AGX_MEAN) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("curve", CURVES)
def test_grey_stays_grey(curve: Curve) -> None:
    shown = linear(curve, *((v, v, v) for v in np.geomspace(1e-4, 1e4, 40)))
    np.testing.assert_allclose(np.ptp(shown, axis=1), 0.0, atol=1e-6)


def test_pbr_neutral_leaves_base_colours_less_the_fresnel_reflection() -> None:
    colours = [(0.6, 0.3, 0.1), (0.1, 0.7, 0.2), (0.08, 0.08, 0.5)]
    np.testing.assert_allclose(linear("pbr-neutral", *colours), np.array(colours) - 0.04, atol=1e-6)
    # darker than twice the reflection, it is taken away by and by: x² / 0.16 is left of the darkest channel
    np.testing.assert_allclose(linear("pbr-neutral", (0.5, 0.04, 0.3))[0, 1], 0.04**2 / 0.16, rtol=1e-5)


def hue(colours: Picture) -> Picture:
    """Where the middle channel lies between the darkest and the brightest, 0 to 1."""
    low, middle, high = np.sort(colours, axis=1).T
    return np.asarray((middle - low) / (high - low))


def test_pbr_neutral_keeps_the_hue_at_any_brightness() -> None:
    stops = 2.0 ** np.arange(-4.0, 9.0)
    shown = linear("pbr-neutral", *((v, 0.4 * v, 0.05 * v) for v in stops))
    np.testing.assert_allclose(hue(shown), (0.4 - 0.05) / 0.95, atol=2e-4)
    per_channel = hue(linear("aces", *((v, 0.4 * v, 0.05 * v) for v in stops[:9])))
    assert np.ptp(per_channel) > 0.3


@pytest.mark.parametrize("curve", ["agx", "pbr-neutral"])
def test_bright_pure_colours_turn_white(curve: Curve) -> None:
    """What curves on each channel alone cannot do: pure blue would stay pure blue."""
    shown = linear(curve, *((0.0, 0.0, v) for v in (0.5, 4.0, 32.0, 4096.0)))
    assert (np.diff(shown[:, 0]) > 0).all()
    assert shown[0, 0] < 0.1
    assert shown[-1, 0] > 0.95
    np.testing.assert_array_equal(linear("aces", (0.0, 0.0, 4096.0))[0, :2], 0.0)


@pytest.mark.parametrize("curve", CURVES)
@pytest.mark.slow
def test_every_curve_agrees_with_the_reference(curve: Curve) -> None:
    """Saturated ramps over 24 stops, with black and values below 0 among them."""
    levels = np.concatenate([[-1.0, 0.0], np.geomspace(2.0**-14, 2.0**10, 62)]).astype(np.float32)
    colours = np.array([(1, 1, 1), (1, 0, 0), (0.1, 0.6, 1), (0, 0, 1)], np.float32)
    picture = np.concatenate([levels[None, :, None] * colours[:, None], np.ones((4, 64, 1), np.float32)], axis=2)
    for encode, name in ((True, "rgba8"), (False, "rgba32f")):
        target = tone_map(FRAME, curve=curve, encode=encode, into=pg.target("shown", name))
        assert_within_bounds(target, frame=picture)


def test_exposure_may_be_a_run_value() -> None:
    shown = tone_map(FRAME, pg.Value("stops", default=1.0), "linear", encode=False)
    picture = np.full((1, 1, 4), 0.125, np.float32)
    assert run(shown, frame=picture)[0, 0, 0] == 0.25
    assert render(shown, size=None, frame=picture, stops=2.0)["tone_map"][0, 0, 0] == 0.5


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


@pytest.mark.parametrize("backend_name", DEVICES, indirect=True)
def test_srgb_is_encoded_within_two_ten_millionths(backend_name: str) -> None:
    """Against the standard's power, in float64; white is exactly 1."""
    light = np.concatenate([np.linspace(0.0, 1.0, 4095), np.geomspace(1e-6, 1.0, 4097)]).astype(np.float32)
    made = tone_map(pg.Input("frame"), curve="linear", into=pg.target("shown", "rgba32f"))
    with pg.compile(made, backend_name) as program:
        shown = program(frame=np.repeat(light[None, :, None], 4, axis=2))["shown"][0, :, 0]
    wide = light.astype(np.float64)
    truth = np.where(wide <= 0.0031308, 12.92 * wide, 1.055 * wide ** (1.0 / 2.4) - 0.055)
    assert np.abs(shown - truth).max() < 2.5e-7
    assert (shown[light == 1.0] == 1.0).all()


# Defaults

#: Effects that leave a picture as it is until they are told what to do, and the one that fills holes.
NEUTRAL = {"brightness-contrast", "color-grade", "hue-saturation", "fill"}


@pytest.mark.parametrize("name", [e.name for e in EFFECTS.values() if e.takes == "picture" and e.name not in NEUTRAL])
def test_defaults_show_on_a_photograph(name: str) -> None:
    """It is a noisy one of a window in a wall: white is 1, as in pictures for displays."""
    if name == "color-transform":
        pytest.importorskip("PyOpenColorIO")
    y, x = np.mgrid[0:96, 0:128] / 128
    photograph = np.dstack([0.3 * x, 0.2 * y, 0.1 + 0.1 * x, np.ones_like(x)]).astype(np.float32)
    photograph[20:50, 30:60, :3] = 1.0
    photograph[..., :3] += np.random.default_rng(5).normal(0.0, 0.02, (96, 128, 3))
    (shown,) = render(EFFECTS[name].build(FRAME), size=None, backend="numpy", frame=photograph).values()
    if shown.shape[:2] == photograph.shape[:2]:
        channels = min(shown.shape[2], 3)
        assert np.abs(shown[..., :channels] - photograph[..., :channels]).max() > 3 / 255
