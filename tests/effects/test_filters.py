"""Filters of small neighborhoods against SciPy, scikit-image, OpenCV and published formulas in float64."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import pytest
import skimage.filters
from numpy.typing import NDArray
from scipy import ndimage

import passgraph as pg
from passgraph.effects import bilateral, cas, kuwahara, morphology, sobel, unsharp
from passgraph.effects.filters.sobel import Weights
from passgraph.effects.pictures.alpha import on_straight_alpha
from tests.agreement import assert_within_bounds
from tests.conftest import DEVICES
from tests.effects.scenes import Picture, render

FRAME = pg.Input("frame")
REC709 = np.array([0.2126, 0.7152, 0.0722])
every_backend = pytest.mark.parametrize("backend_name", ["reference", *DEVICES], indirect=True)
every_size = pytest.mark.parametrize("size", [(1, 1), (17, 31)], ids=str)


def picture(size: tuple[int, int], low: float = -0.5, high: float = 4.0) -> Picture:
    """Smooth light with noise, HDR and negative, and alpha that is 1."""
    random = np.random.default_rng(size[0])
    y, x = np.mgrid[: size[0], : size[1]]
    light = 0.5 + 0.4 * np.sin(0.5 * x + 0.3 * y)[..., None] + random.normal(0.0, 0.05, (*size, 4))
    light = low + (high - low) * light
    light[..., 3] = 1.0
    return np.asarray(light, np.float32)


def shown(target: pg.Target, backend: str, **given: Any) -> NDArray[np.float64]:
    (made,) = render(target, size=None, backend=backend, **given).values()
    return made.astype(np.float64)


def blurred(channels: NDArray[np.float64], sigma: float, radius: int) -> NDArray[np.float64]:
    for axis in (0, 1):
        channels = ndimage.gaussian_filter1d(channels, sigma, axis, mode="nearest", radius=radius)
    return channels


@every_backend
@every_size
def test_unsharp_adds_what_the_blur_takes_away(size: tuple[int, int], backend_name: str) -> None:
    frame = picture(size)
    exact = frame.astype(np.float64)
    detail = exact - blurred(exact, 1.5, 5)
    made = shown(unsharp(FRAME, 0.8, 1.5), backend_name, frame=frame)
    np.testing.assert_allclose(made, exact + 0.8 * detail, rtol=0.0, atol=4e-6)
    detail = np.sign(detail) * np.maximum(np.abs(detail) - 0.1, 0.0)
    made = shown(unsharp(FRAME, 0.8, 1.5, 0.1), backend_name, frame=frame)
    np.testing.assert_allclose(made, exact + 0.8 * detail, rtol=0.0, atol=4e-6)


def test_unsharp_leaves_outlines_of_cut_out_pictures_without_a_halo() -> None:
    """One color, cut out: nothing is finer than the blur, but for alpha."""
    frame = np.full((20, 24, 4), (0.3, 0.6, 0.9, 0.0), np.float32)
    frame[5:15, 6:18, 3] = 1.0
    frame[8, 6:18, 3] = 0.5
    made = shown(on_straight_alpha(unsharp)(FRAME), "numpy", frame=frame)
    np.testing.assert_array_equal(made[..., 3], frame[..., 3])
    np.testing.assert_allclose(made[frame[..., 3] > 0.0][:, :3], [[0.3, 0.6, 0.9]] * 120, rtol=1e-6)


@every_backend
@every_size
@pytest.mark.parametrize("weights", ["sobel", "scharr", "prewitt"])
def test_edges_are_those_of_scikit_image(weights: Weights, size: tuple[int, int], backend_name: str) -> None:
    frame = picture(size)
    expected = getattr(skimage.filters, weights)(frame[..., :3].astype(np.float64) @ REC709, mode="nearest")
    made = shown(sobel(FRAME, weights, 2.0), backend_name, frame=frame)
    np.testing.assert_allclose(made[..., 0], 2.0 * expected, rtol=1e-5, atol=2e-6)
    np.testing.assert_array_equal(made[..., 3], 1.0)


def brute_bilateral(frame: Picture, radius: int, sigma_px: float, sigma_color: float) -> NDArray[np.float64]:
    exact, around = (
        frame.astype(np.float64),
        np.pad(frame.astype(np.float64), ((radius,) * 2, (radius,) * 2, (0, 0)), "edge"),
    )
    total, weight = np.zeros_like(exact), np.zeros(exact.shape[:2])
    for dy in range(-radius, radius + 1):
        for dx in range(-radius, radius + 1):
            if dx * dx + dy * dy <= radius * radius:
                tap = around[radius + dy :, radius + dx :][: exact.shape[0], : exact.shape[1]]
                unlike = ((tap - exact)[..., :3] ** 2).sum(axis=-1)
                w = np.exp(-(dx * dx + dy * dy) / (2 * sigma_px**2) - unlike / (2 * sigma_color**2))
                total, weight = total + tap * w[..., None], weight + w
    return np.asarray(total / weight[..., None])


@every_backend
@every_size
def test_bilateral_is_its_formula(size: tuple[int, int], backend_name: str) -> None:
    frame = picture(size)
    made = shown(bilateral(FRAME, 3, pg.Value("width"), 0.4), backend_name, frame=frame, width=2.0)
    np.testing.assert_allclose(made, brute_bilateral(frame, 3, 2.0, 0.4), rtol=2e-5, atol=2e-6)


def test_bilateral_of_gray_is_that_of_opencv() -> None:
    """OpenCV reads one channel; the distance of three equal ones is the square root of 3 times theirs."""
    gray = np.ascontiguousarray(picture((41, 53), 0.0, 1.0)[..., 0])
    expected = cv2.bilateralFilter(gray, 2 * 4 + 1, 0.15 / np.sqrt(3.0), 3.0, borderType=cv2.BORDER_REPLICATE)
    frame = np.repeat(gray[..., None], 4, axis=2)
    made = shown(bilateral(FRAME, 4, 3.0, 0.15), "reference", frame=frame)
    # OpenCV reads the exponential from a table
    np.testing.assert_allclose(made[..., 0], expected, atol=2e-4)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_bad_pixel_has_no_part_in_a_bilateral_filter(value: float) -> None:
    frame = picture((9, 9))
    frame[4, 4, 1] = value
    with pg.compile(bilateral(FRAME), "numpy", non_finite="keep") as program:
        bad = ~np.isfinite(program(frame=frame)["bilateral"]).all(axis=-1)
    assert bad.sum() == 1


def published_cas(frame: Picture, sharpness: float) -> NDArray[np.float64]:
    """The faster way of AMD's header, without its approximations, for colors from 0 to 1."""
    around = np.pad(frame[..., :3].astype(np.float64), ((1, 1), (1, 1), (0, 0)), "edge")
    e, b, h = around[1:-1, 1:-1], around[:-2, 1:-1], around[2:, 1:-1]
    d, f = around[1:-1, :-2], around[1:-1, 2:]
    green = np.stack([e, b, h, d, f])[..., 1]
    mn, mx = green.min(axis=0), green.max(axis=0)
    amp = np.sqrt(np.clip(np.minimum(mn, 1.0 - mx) / np.maximum(mx, 1e-300), 0.0, 1.0))
    w = (amp * (-1.0 / (8.0 + (5.0 - 8.0) * sharpness)))[..., None]
    return np.asarray(np.clip(((b + d + f + h) * w + e) / (1.0 + 4.0 * w), 0.0, 1.0))


@every_backend
@every_size
@pytest.mark.parametrize("sharpness", [0.0, 0.5, 1.0])
def test_cas_is_as_published(sharpness: float, size: tuple[int, int], backend_name: str) -> None:
    frame = np.clip(picture(size, -0.1, 1.1), 0.0, 1.0)
    made = shown(cas(FRAME, pg.Value("sharpness")), backend_name, frame=frame, sharpness=sharpness)
    np.testing.assert_allclose(made[..., :3], published_cas(frame, sharpness), atol=2e-6)
    np.testing.assert_allclose(made[..., 3], 1.0, atol=1e-6)


@every_backend
def test_cas_leaves_what_is_beyond_the_range_of_displays(backend_name: str) -> None:
    frame = picture((17, 31), 1.0, 9.0)
    frame[:, 15:] -= 12.0
    np.testing.assert_array_equal(shown(cas(FRAME), backend_name, frame=frame), frame)


@pytest.mark.sampled
@every_backend
@every_size
@pytest.mark.parametrize("radius", [1, 4])
def test_morphology_is_that_of_scipy_to_the_bit(radius: int, size: tuple[int, int], backend_name: str) -> None:
    frame = picture(size)
    side = (2 * radius + 1,) * 2
    of_scipy = {
        "erode": ndimage.grey_erosion, "dilate": ndimage.grey_dilation,
        "open": ndimage.grey_opening, "close": ndimage.grey_closing,
    }  # fmt: skip
    for operation, function in of_scipy.items():
        made = shown(morphology(FRAME, operation, radius), backend_name, frame=frame)  # type: ignore[arg-type]
        for channel in range(4):
            expected = function(frame[..., channel], size=side, mode="nearest")
            np.testing.assert_array_equal(made[..., channel], expected, err_msg=f"{operation} {channel}")


@pytest.mark.parametrize(
    "made",
    [
        unsharp(FRAME, 1.5, 1.0, 0.02),
        sobel(FRAME, "scharr"),
        bilateral(FRAME, 2),
        cas(FRAME),
        morphology(FRAME, "open"),
    ],
    ids=lambda made: made.name,
)
@pytest.mark.slow
def test_filters_within_bounds_of_the_reference(made: pg.Target) -> None:
    assert_within_bounds(made, frame=picture((17, 31)))


# kuwahara


def painted(frame: Picture, radius: int, sharpness: float) -> NDArray[np.float64]:
    """The anisotropic Kuwahara filter of Kyprianidis et al., 2010, by eigenvectors and angles, in float64."""
    exact = frame.astype(np.float64)
    channels = [exact[..., k] for k in range(3)]
    dx, dy = (np.dstack([ndimage.sobel(c, axis, mode="nearest") for c in channels]) / 4.0 for axis in (1, 0))
    products = [(a * b).sum(axis=-1) for a, b in ((dx, dx), (dx, dy), (dx, dy), (dy, dy))]
    tensor = blurred(np.stack(products, axis=-1), 2.0, 6).reshape(*frame.shape[:2], 2, 2)
    values, vectors = np.linalg.eigh(tensor)
    anisotropy = (values[..., 1] - values[..., 0]) / np.maximum(values.sum(axis=-1), 1e-300)
    edge = np.arctan2(vectors[..., 1, 0], vectors[..., 0, 0])
    overlap, end = 2.0 / radius, 3.0 * np.pi / 8.0
    narrow = (overlap + np.cos(end)) / np.sin(end) ** 2
    sums, squares, weights = (
        np.zeros((8, *frame.shape)),
        np.zeros((8, *frame.shape[:2])),
        np.zeros((8, *frame.shape[:2])),
    )
    reach = 2 * radius
    around = np.pad(exact, ((reach, reach), (reach, reach), (0, 0)), "edge")
    for y in range(-reach, reach + 1):
        for x in range(-reach, reach + 1):
            tap = around[reach + y :, reach + x :][: frame.shape[0], : frame.shape[1]]
            length, angle = np.hypot(x, y), np.arctan2(y, x) - edge
            u = length * np.cos(angle) / (radius * (1 + anisotropy))
            v = length * np.sin(angle) * (1 + anisotropy) / radius
            inside = np.maximum(1.0 - u * u - v * v, 0.0) ** 2
            for k in range(8):
                out, aside = np.hypot(u, v), np.arctan2(v, u) - k * np.pi / 4
                w = np.maximum(out * np.cos(aside) + overlap - narrow * (out * np.sin(aside)) ** 2, 0.0) ** 2 * inside
                weights[k] += w
                sums[k] += w[..., None] * tap
                squares[k] += w * (tap[..., :3] ** 2).sum(axis=-1)
    means = sums / weights[..., None]
    variance = squares / weights - (means[..., :3] ** 2).sum(axis=-1)
    share = (np.maximum(variance, 0.0) + 255.0**-2) ** (-0.5 * sharpness)
    return np.asarray((means * share[..., None]).sum(axis=0) / share.sum(axis=0)[..., None])


@every_backend
@pytest.mark.parametrize("size", [(1, 1), (19, 23)], ids=str)
def test_kuwahara_is_its_formula(size: tuple[int, int], backend_name: str) -> None:
    frame = picture(size)
    made = shown(kuwahara(FRAME, 2, pg.Value("sharpness")), backend_name, frame=frame, sharpness=4.0)
    np.testing.assert_allclose(made, painted(frame, 2, 4.0), atol=2e-5)


def test_kuwahara_leaves_even_pictures_and_turns_with_them() -> None:
    frame = picture((20, 20))
    even = np.full((9, 9, 4), 0.3, np.float32)
    np.testing.assert_allclose(shown(kuwahara(FRAME), "numpy", frame=even), even, rtol=1e-6)
    made = shown(kuwahara(FRAME), "numpy", frame=frame)
    turned = shown(kuwahara(FRAME), "numpy", frame=np.ascontiguousarray(np.rot90(frame)))
    np.testing.assert_allclose(np.rot90(made), turned, atol=2e-3)
