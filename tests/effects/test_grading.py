"""Effects on the color of each pixel against OpenColorIO, scikit-image and formulas in float64."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import PyOpenColorIO as ocio
import pytest
from numpy.typing import NDArray
from skimage.color import xyz_tristimulus_values

import passgraph as pg
from passgraph.effects import black_and_white, brightness_contrast, color_grade, hue_saturation, sepia
from passgraph.effects.color.color_grade import XYZ_FROM_RGB
from tests.agreement import assert_within_bounds
from tests.conftest import DEVICES
from tests.effects.scenes import Picture, render

FRAME = pg.Input("frame")
REC709 = np.array([0.2126, 0.7152, 0.0722])
every_backend = pytest.mark.parametrize("backend_name", ["reference", *DEVICES], indirect=True)
every_size = pytest.mark.parametrize("size", [(1, 1), (17, 31)], ids=str)


def hdr_picture(size: tuple[int, int]) -> Picture:
    """Fourteen stops around middle gray, a fifth of them negative, alpha by chance."""
    random = np.random.default_rng(4)
    picture = 0.18 * 2.0 ** random.uniform(-7, 7, (*size, 4))
    picture[..., :3] *= np.where(random.random((*size, 3)) < 0.2, -1.0, 1.0)
    picture[..., 3] = random.random(size)
    return picture.astype(np.float32)


def shown(target: pg.Target, backend: str = "reference", **given: Any) -> Picture:
    (picture,) = render(target, size=None, backend=backend, **given).values()
    return picture


def through_ocio(transform: Any, picture: Picture) -> Picture:
    made = np.ascontiguousarray(picture)
    ocio.Config.CreateRaw().getProcessor(transform).getDefaultCPUProcessor().applyRGBA(made)
    return made


def white_of(illuminant: str) -> NDArray[np.float64]:
    """CIE XYZ, of the observer of 1931."""
    return np.array(xyz_tristimulus_values(illuminant=illuminant, observer="2"))  # type: ignore[no-untyped-call]


def luminance(picture: NDArray[Any]) -> NDArray[np.float64]:
    return np.asarray(picture[..., :3].astype(np.float64) @ REC709)


# color_grade


@every_backend
@every_size
def test_lift_gamma_gain_and_saturation_are_a_cdl(size: tuple[int, int], backend_name: str) -> None:
    lift, gamma, gain = np.array([0.05, -0.01, 0.0]), np.array([1.25, 0.9, 1.0]), np.array([0.9, 1.1, 1.3])
    cdl = ocio.CDLTransform(list(gain - lift), list(lift), list(1.0 / gamma), 0.7)
    cdl.setStyle(ocio.CDL_NO_CLAMP)
    picture = hdr_picture(size)
    made = color_grade(FRAME, lift=tuple(lift), gamma=tuple(gamma), gain=tuple(gain), saturation=0.7)
    # OpenColorIO's powers are good to some 1e-5; saturation takes differences of them.
    largest = np.abs(picture[..., :3]).max(axis=-1, keepdims=True)
    error = np.abs(shown(made, backend_name, frame=picture) - through_ocio(cdl, picture))
    assert (error <= 1e-4 * np.maximum(largest, 0.05)).all()


@every_backend
@every_size
def test_contrast_is_that_of_ocio_in_scene_linear_light(size: tuple[int, int], backend_name: str) -> None:
    primary = ocio.GradingPrimary(ocio.GRADING_LIN)
    primary.contrast, primary.pivot = ocio.GradingRGBM(1, 1, 1, 1.3), 0.0  # 0 stops from 0.18
    picture = hdr_picture(size)
    made = shown(color_grade(FRAME, contrast=1.3), backend_name, frame=picture)
    expected = through_ocio(ocio.GradingPrimaryTransform(primary, ocio.GRADING_LIN, False), picture)
    np.testing.assert_allclose(made, expected, rtol=5e-5)


@pytest.mark.parametrize(
    ("illuminant", "kelvin", "duv"),
    [("A", 2856, 0.0), ("D50", 5003, 0.0032), ("D55", 5503, 0.0032), ("D65", 6504, 0.0032), ("D75", 7504, 0.0032)],
)
def test_what_a_cie_illuminant_shows_as_white_becomes_white(illuminant: str, kelvin: float, duv: float) -> None:
    white = np.linalg.solve(np.array(XYZ_FROM_RGB), white_of(illuminant))
    picture = np.append(white, 1.0).astype(np.float32)[None, None]
    made = shown(color_grade(FRAME, kelvin, duv), frame=picture)[0, 0, :3]
    assert made.max() / made.min() < 1.006
    if illuminant == "A":
        assert white.max() / white.min() > 4.0


def bradford_in_numpy(xyz_white: NDArray[np.float64]) -> NDArray[np.float64]:
    """From a white to D65, in linear RGB: the steps as Lindbloom writes them, from XYZ."""
    cones = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
    rgb = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    d65 = np.array([0.95047, 1.0, 1.08883])
    adapted = np.linalg.inv(cones) @ np.diag((cones @ d65) / (cones @ xyz_white)) @ cones
    return np.asarray(np.linalg.inv(rgb) @ adapted @ rgb)


@every_backend
def test_white_balance_is_a_bradford_adaptation(backend_name: str) -> None:
    """Of tungsten light: within what the locus is off by, see the test above."""
    picture = np.abs(hdr_picture((5, 9)))
    matrix = bradford_in_numpy(white_of("A"))
    made = shown(color_grade(FRAME, 2856.0, 0.0), backend_name, frame=picture)
    expected = picture[..., :3].astype(np.float64) @ matrix.T
    error = np.abs(made[..., :3] - expected) / picture[..., :3].max(axis=-1, keepdims=True)
    assert error.max() < 0.02
    np.testing.assert_array_equal(made[..., 3], picture[..., 3])


@every_backend
@every_size
def test_split_toning_keeps_luminance_and_meets_at_the_pivot(size: tuple[int, int], backend_name: str) -> None:
    dark, light = np.array([0.6, 0.9, 1.4]), np.array([1.5, 1.0, 0.5])
    gray = np.abs(hdr_picture(size)[..., :1]) * np.ones(4, np.float32)
    gray[0, 0] = 0.25
    made = shown(color_grade(FRAME, pivot=0.25, shadows=tuple(dark), highlights=tuple(light)), backend_name, frame=gray)
    np.testing.assert_allclose(luminance(made), luminance(gray), rtol=1e-5)
    dark, light = dark / (dark @ REC709), light / (light @ REC709)
    np.testing.assert_allclose(made[0, 0, :3], 0.25 * (dark + light) / 2, rtol=1e-5)
    share = gray.astype(np.float64)[..., :1] / (gray[..., :1] + 0.25)
    np.testing.assert_allclose(made[..., :3], gray[..., :3] * (dark + (light - dark) * share), rtol=1e-5)


@every_backend
def test_grading_by_its_defaults_changes_nothing(backend_name: str) -> None:
    picture = hdr_picture((17, 31))
    made = shown(color_grade(FRAME), backend_name, frame=picture)
    largest = np.abs(picture).max(axis=-1, keepdims=True)
    assert (np.abs(made - picture) <= 4e-7 * largest).all()


def test_grades_are_run_values() -> None:
    picture = hdr_picture((5, 9))
    by_number = shown(color_grade(FRAME, 3200.0, 0.001, contrast=1.2), "numpy", frame=picture)
    stops = pg.Value("stops", float)
    for kelvin, given in ((pg.Value("kelvin"), 3200.0), (pg.Value("kelvin").map(lambda k: 100.0 * k), 32.0)):
        made = color_grade(FRAME, kelvin, pg.Value("duv"), contrast=stops)
        np.testing.assert_array_equal(
            shown(made, "numpy", frame=picture, kelvin=given, duv=0.001, stops=1.2), by_number
        )


def test_grading_within_bounds_of_the_reference() -> None:
    made = color_grade(
        FRAME, 4000.0, 0.0, 1.2, 0.2, (0.8, 1.0, 1.2), (1.2, 1.0, 0.8), (0.02, 0.0, -0.02), (1.2, 1.0, 0.9),
        (0.9, 1.0, 1.1), 0.8,
    )  # fmt: skip
    assert_within_bounds(made, frame=hdr_picture((17, 31)))


# hue_saturation and sepia


def svg_hue(angle: float) -> NDArray[np.float64]:
    """The matrix of SVG's hueRotate, entry by entry as W3C prints it."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array(
        [
            [0.213 + 0.787 * c - 0.213 * s, 0.715 - 0.715 * c - 0.715 * s, 0.072 - 0.072 * c + 0.928 * s],
            [0.213 - 0.213 * c + 0.143 * s, 0.715 + 0.285 * c + 0.140 * s, 0.072 - 0.072 * c - 0.283 * s],
            [0.213 - 0.213 * c - 0.787 * s, 0.715 - 0.715 * c + 0.715 * s, 0.072 + 0.928 * c + 0.072 * s],
        ]
    )


def svg_saturate(s: float) -> NDArray[np.float64]:
    return np.array(
        [
            [0.213 + 0.787 * s, 0.715 - 0.715 * s, 0.072 - 0.072 * s],
            [0.213 - 0.213 * s, 0.715 + 0.285 * s, 0.072 - 0.072 * s],
            [0.213 - 0.213 * s, 0.715 - 0.715 * s, 0.072 + 0.928 * s],
        ]
    )


def css_sepia(amount: float) -> NDArray[np.float64]:
    rest = 1.0 - amount
    return np.array(
        [
            [0.393 + 0.607 * rest, 0.769 - 0.769 * rest, 0.189 - 0.189 * rest],
            [0.349 - 0.349 * rest, 0.686 + 0.314 * rest, 0.168 - 0.168 * rest],
            [0.272 - 0.272 * rest, 0.534 - 0.534 * rest, 0.131 + 0.869 * rest],
        ]
    )


@every_backend
@every_size
@pytest.mark.parametrize(
    ("made", "matrix"),
    [
        (hue_saturation(FRAME, 1.0, 1.7), svg_saturate(1.7) @ svg_hue(1.0)),
        (hue_saturation(FRAME, pg.Value("angle", default=-2.5), 0.0), svg_saturate(0.0) @ svg_hue(-2.5)),
        (sepia(FRAME), css_sepia(1.0)),
        (sepia(FRAME, pg.Value("amount", default=0.3)), css_sepia(0.3)),
    ],
    ids=["hue", "gray", "sepia", "some sepia"],
)
def test_colors_go_through_the_matrices_of_w3c(
    made: pg.Target, matrix: NDArray[np.float64], size: tuple[int, int], backend_name: str
) -> None:
    picture = hdr_picture(size)
    result = shown(made, backend_name, frame=picture)
    error = np.abs(result[..., :3] - picture[..., :3].astype(np.float64) @ matrix.T)
    assert (error <= 1e-6 * np.abs(picture[..., :3]).max(axis=-1, keepdims=True)).all()
    np.testing.assert_array_equal(result[..., 3], picture[..., 3])


def test_a_turn_there_and_back_is_nearly_nothing() -> None:
    """The published matrices have three digits."""
    picture = np.random.default_rng(3).random((9, 14, 4), np.float32)
    there = hue_saturation(FRAME, 2.0, name="there")
    np.testing.assert_allclose(shown(hue_saturation(there, -2.0), frame=picture), picture, atol=3e-3)
    weights = (0.213, 0.715, 0.072)
    gray = shown(black_and_white(hue_saturation(FRAME, 2.0), weights), frame=picture)
    np.testing.assert_allclose(gray, shown(black_and_white(FRAME, weights), frame=picture), atol=1e-3)


@every_backend
def test_brightness_and_contrast_are_those_of_opencv(backend_name: str) -> None:
    """OpenCV scales and adds in bytes, and rounds: contrast * (brightness * c - 0.5) + 0.5."""
    picture = np.random.default_rng(4).integers(60, 200, (9, 13, 4), np.uint8)
    brightness, contrast = 1.1, 0.75
    made = brightness_contrast(pg.Input("photo", "rgba8"), brightness, pg.Value("contrast", default=contrast))
    result = shown(made, backend_name, photo=picture) * 255.0
    expected = cv2.convertScaleAbs(picture, alpha=brightness * contrast, beta=0.5 * (1.0 - contrast) * 255.0)
    assert np.abs(result[..., :3] - expected[..., :3]).max() <= 0.5001
    np.testing.assert_allclose(result[..., 3], picture[..., 3], atol=1e-4)


@pytest.mark.parametrize(
    "made",
    [hue_saturation(FRAME, 2.0, 1.5), sepia(FRAME, 0.5), brightness_contrast(FRAME, 1.3, 0.4)],
    ids=lambda made: made.name,
)
def test_color_matrices_within_bounds_of_the_reference(made: pg.Target) -> None:
    assert_within_bounds(made, frame=hdr_picture((17, 31)))
