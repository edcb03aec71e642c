"""Squares, dither and halftone dots against means and thresholds by NumPy and SciPy."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage
from skimage.measure import block_reduce

import passgraph as pg
from passgraph.effects import dither, halftone, pixelate
from passgraph.effects.style import blue_noise
from tests.agreement import assert_within_bounds
from tests.conftest import DEVICES
from tests.effects.scenes import Picture, render

FRAME = pg.Input("frame")
every_backend = pytest.mark.parametrize("backend_name", ["reference", *DEVICES], indirect=True)
every_size = pytest.mark.parametrize("size", [(1, 1), (17, 31)], ids=str)


def picture(size: tuple[int, int]) -> Picture:
    """HDR and negative."""
    made = np.random.default_rng(size[0]).normal(0.5, 1.0, (*size, 4)).astype(np.float32)
    made[..., 3] = 1.0
    return made


def shown(target: pg.Target, backend: str = "reference", **given: Any) -> NDArray[np.float64]:
    (made,) = render(target, size=None, backend=backend, **given).values()
    return made.astype(np.float64)


@pytest.mark.sampled
@every_backend
@pytest.mark.parametrize("size", [(1, 1), (17, 31), (16, 32), (49, 98)], ids=str)
@pytest.mark.parametrize("side", [2, 7, 49])
def test_squares_are_means_of_blocks(side: int, size: tuple[int, int], backend_name: str) -> None:
    frame = picture(size)
    padded = frame.astype(np.float64)
    sums, counts = (
        block_reduce(each, (side, side, 1), np.sum)  # type: ignore[no-untyped-call]
        for each in (padded, np.ones_like(padded))
    )
    means = sums / counts
    expected = means.repeat(side, axis=0).repeat(side, axis=1)[: size[0], : size[1]]
    made = shown(pixelate(FRAME, side), backend_name, frame=frame)
    np.testing.assert_allclose(made, expected, atol=2e-5)
    assert pixelate(FRAME, 1) is FRAME


#: As Bayer printed it, 1973: rows of the 8 x 8 thresholds.
BAYER = np.array(
    [
        [0, 32, 8, 40, 2, 34, 10, 42], [48, 16, 56, 24, 50, 18, 58, 26],
        [12, 44, 4, 36, 14, 46, 6, 38], [60, 28, 52, 20, 62, 30, 54, 22],
        [3, 35, 11, 43, 1, 33, 9, 41], [51, 19, 59, 27, 49, 17, 57, 25],
        [15, 47, 7, 39, 13, 45, 5, 37], [63, 31, 55, 23, 61, 29, 53, 21],
    ]
)  # fmt: skip


@every_backend
@every_size
@pytest.mark.parametrize("levels", [2, 5, 256])
def test_dither_rounds_by_the_thresholds_of_bayer(levels: int, size: tuple[int, int], backend_name: str) -> None:
    frame = picture(size)
    y, x = np.mgrid[: size[0], : size[1]]
    threshold = (BAYER[y % 8, x % 8] + 0.5)[..., None] / 64
    steps = levels - 1
    expected = np.minimum(np.floor(np.clip(frame[..., :3].astype(np.float64), 0, 1) * steps + threshold) / steps, 1.0)
    made = shown(dither(FRAME, pg.Value("levels", int)), backend_name, frame=frame, levels=levels)
    np.testing.assert_allclose(made[..., :3], expected, atol=1e-6)
    np.testing.assert_array_equal(made[..., 3], frame[..., 3])


@every_backend
@pytest.mark.parametrize(("pattern", "off"), [("bayer", 1 / 128), ("gradient-noise", 0.01), ("blue-noise", 1 / 4096)])
def test_dither_keeps_means_and_levels(pattern: Any, off: float, backend_name: str) -> None:
    tones = np.linspace(0.0, 1.0, 24).astype(np.float32)
    frame = np.ones((64, 64 * 24, 4), np.float32) * tones.repeat(64)[None, :, None]
    made = shown(dither(FRAME, 3, pattern), backend_name, frame=frame)[..., 0]
    assert set(np.unique(made)) == {0.0, 0.5, 1.0}
    means = made.reshape(64, 24, 64).mean(axis=(0, 2))
    np.testing.assert_allclose(means, tones, atol=off / 2 + 1e-6)


def test_blue_noise_has_no_low_frequencies() -> None:
    """Below a third of the dots' own frequency, power is less than a tenth of white noise's, in every tone."""
    frequencies = np.hypot(*np.meshgrid(np.fft.fftfreq(64), np.fft.fftfreq(64)))
    levels = blue_noise.thresholds()[..., 0]
    for tone in (0.05, 0.1, 0.25, 0.5, 0.75, 0.9):
        dots = (levels < tone).astype(np.float64)
        power = np.abs(np.fft.fft2(dots - dots.mean())) ** 2 / dots.size
        low = (frequencies > 0) & (frequencies < np.sqrt(min(tone, 1 - tone)) / 3)
        assert power[low].mean() < 0.1 * tone * (1 - tone), tone


@every_backend
@pytest.mark.parametrize(("cell", "angle"), [(6.0, pi / 4), (9.3, 0.35), (17.0, 0.0)])
def test_dots_cover_as_much_as_the_picture_is_dark(cell: float, angle: float, backend_name: str) -> None:
    tones = np.linspace(0.0, 1.0, 9).astype(np.float32)
    for tone in tones if backend_name == "numpy" else tones[[0, 3, 8]]:
        frame = np.full((136, 136, 4), tone, np.float32)
        made = shown(halftone(FRAME, cell, angle, colored=False), backend_name, frame=frame)[..., 0]
        assert abs(made.mean() - tone) < 0.02, tone
        if tone in (0.0, 1.0):
            assert np.ptp(made) < 0.1


@every_backend
def test_the_mean_of_four_inks_is_the_color(backend_name: str) -> None:
    for color in ((0.9, 0.5, 0.2), (0.1, 0.3, 0.6), (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (4.0, -1.0, 0.5)):
        frame = np.full((150, 150, 4), (*color, 0.5), np.float32)
        made = shown(
            halftone(FRAME, pg.Value("cell"), pg.Value("angle")), backend_name, frame=frame, cell=6.3, angle=0.8
        )
        np.testing.assert_allclose(made[..., :3].mean(axis=(0, 1)), np.clip(color, 0.0, 1.0), atol=0.02)
        np.testing.assert_array_equal(made[..., 3], 0.5)


@every_backend
def test_dots_stand_a_cell_apart(backend_name: str) -> None:
    """A light tone has one dot in each cell, as many as cells fit."""
    frame = np.full((96, 96, 4), 0.8, np.float32)
    made = shown(halftone(FRAME, 12.0, 0.0, colored=False), backend_name, frame=frame)[..., 0]
    assert ndimage.label(made < 0.5)[1] == (96 / 12) ** 2


@pytest.mark.parametrize(
    "made",
    [pixelate(FRAME, 4), dither(FRAME), dither(FRAME, 3, "blue-noise"), halftone(FRAME)],
    ids=lambda made: made.name,
)
def test_patterns_within_bounds_of_the_reference(made: pg.Target) -> None:
    assert_within_bounds(made, frame=picture((17, 31)))
