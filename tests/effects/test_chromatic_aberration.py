"""Chromatic aberration against pictures scaled one by one with SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

import passgraph as pg
from passgraph.effects import chromatic_aberration
from passgraph.srgb import srgb_to_linear
from tests.conftest import DEVICES
from tests.effects.scenes import Float64, Picture, render

FRAME = pg.Input("frame")


def run(picture: Picture, *options: object, backend: str = "numpy") -> Picture:
    made = chromatic_aberration(FRAME, *options)  # type: ignore[arg-type]
    return render(made, size=None, backend=backend, frame=picture)["chromatic_aberration"]


def noise(height: int = 21, width: int = 34) -> Picture:
    return np.random.default_rng(5).random((height, width, 4), np.float32) * 4


def magnified(channel: Picture, factor: float) -> Float64:
    """Bilinear, about the middle; what is outside would be NaN."""
    height, width = channel.shape
    y, x = np.mgrid[0:height, 0:width].astype(np.float64)
    places = [(at - 0.5 * (n - 1)) / factor + 0.5 * (n - 1) for at, n in ((y, height), (x, width))]
    return np.asarray(map_coordinates(channel.astype(np.float64), places, order=1, cval=np.nan))


@pytest.mark.parametrize("backend_name", DEVICES, indirect=True)
@pytest.mark.parametrize("spread", [0.08, -0.08])
def test_each_channel_is_magnified_by_its_own_factor(spread: float, backend_name: str) -> None:
    """The least magnified is as it was and no place outside the picture is seen, up to its very border."""
    picture = noise()
    shown = run(picture, spread, 3, backend=backend_name)
    sizes = {True: (1.0, 0.96, 0.92), False: (0.92, 0.96, 1.0)}[spread > 0]
    for channel, part in enumerate(sizes):
        truth = magnified(picture[:, :, channel], 1.0 / part)
        assert np.isfinite(truth).all()
        np.testing.assert_allclose(shown[:, :, channel], truth, atol=2e-5)
    np.testing.assert_allclose(shown[:, :, 3], magnified(picture[:, :, 3], 1.0 / 0.96), atol=2e-5)


@pytest.mark.parametrize("samples", [3, 4, 9, 33])
def test_what_is_even_stays_even(samples: int) -> None:
    for size in ((1, 1), (5, 8)):
        picture = np.full((*size, 4), (0.7, 0.2, 11.0, 0.5), np.float32)
        np.testing.assert_allclose(run(picture, 0.2, samples), picture, rtol=1e-6)


def test_more_wavelengths_make_one_edge_of_three() -> None:
    """Between three samples a channel of an edge jumps from nothing to all; a spectrum rises by small steps."""
    edge = np.zeros((3, 256, 4), np.float32)
    edge[:, :240] = 1.0
    few, many = (np.abs(np.diff(run(edge, 0.1, samples)[1, :, 1])).max() for samples in (3, 33))
    assert few > 0.8
    assert many < 0.25


def test_bytes_of_an_srgb_format_are_linear_light() -> None:
    """Decoded once, as half floats."""
    stored = np.random.default_rng(7).integers(0, 256, (21, 34, 4), dtype=np.uint8)
    light = stored / np.float32(255)
    light[:, :, :3] = srgb_to_linear(light[:, :, :3])
    made = chromatic_aberration(pg.Input("frame", "rgba8_srgb", (34, 21)), 0.05)
    shown = render(made, size=None, backend="numpy", frame=stored)["chromatic_aberration"]
    np.testing.assert_allclose(shown, run(light, 0.05), atol=3e-4)


def test_spread_0_leaves_the_picture() -> None:
    np.testing.assert_allclose(run(noise(), 0.0), noise(), atol=3e-5)


def test_what_is_out_of_range_is_refused() -> None:
    with pytest.raises(pg.GraphError, match="samples must be 3 to 33, got 2"):
        chromatic_aberration(FRAME, samples=2)
    with pytest.raises(pg.GraphError, match=r"spread must be -0\.2 to 0\.2, got 0\.3"):
        chromatic_aberration(FRAME, 0.3)
