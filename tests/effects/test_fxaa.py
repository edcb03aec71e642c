"""FXAA: the original's own result, the truth of edges, and what it must leave alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import passgraph as pg
from passgraph.effects import fxaa
from passgraph.effects.antialias.fxaa import Quality
from passgraph.srgb import srgb_to_linear
from tests.agreement import assert_within_bounds
from tests.conftest import DEVICES
from tests.effects.scenes import Float64, Picture

FRAME = pg.Input("frame")
QUALITIES: tuple[Quality, ...] = ("12", "39")
#: What T. Lottes' own GLSL made of `star_and_noise` on llvmpipe, luma in alpha as float32: preset 12 over preset 39.
ORIGINAL = Path(__file__).parent / "recorded" / "fxaa-original.png"


def run(picture: Picture, backend: str = "numpy", **options: object) -> Picture:
    made = fxaa(FRAME, into=pg.target("smooth", "rgba32f"), **options)  # type: ignore[arg-type]
    with pg.compile(made, backend=backend, non_finite="keep") as program:
        return program(frame=picture)["smooth"]


def grey(values: Float64) -> Picture:
    picture = np.repeat(values[:, :, None], 4, axis=2).astype(np.float32)
    picture[:, :, 3] = 1.0
    return picture


def star_and_noise() -> Picture:
    """Edges at every angle, and steps of 1/64 by chance; exact in binary."""
    y, x = np.mgrid[0:64, 0:128]
    star = (np.arctan2(y - 32.3, x - 40.1) * 12.0 / np.pi).astype(np.int64) % 2
    noise = np.round(np.random.default_rng(1).random((64, 128)) * 64.0) / 64.0
    return grey(np.where(x < 88, 0.25 + 0.5 * star, noise))


def covered(size: tuple[int, int], slope: float, parts: int = 1) -> Float64:
    """The share of each pixel below a line through the middle, by so many samples each way."""
    width, height = size
    y, x = np.mgrid[0 : height * parts, 0 : width * parts]
    below = (y + 0.5) / parts - height / 2 > slope * ((x + 0.5) / parts - width / 2)
    return below.reshape(height, parts, width, parts).mean(axis=(1, 3))


@pytest.mark.parametrize("quality", QUALITIES)
@pytest.mark.parametrize("backend_name", DEVICES, indirect=True)
def test_it_is_the_original(quality: Quality, backend_name: str) -> None:
    """But for pixels where two edges are equally steep: there the original's rounding of positions decides."""
    with Image.open(ORIGINAL) as file:
        recorded = np.asarray(file, np.float64).reshape(2, 64, 128)[QUALITIES.index(quality)] / 255.0
    picture = star_and_noise()
    off = np.abs(run(picture, backend_name, quality=quality)[:, :, 0] - recorded)
    assert (np.abs(recorded - picture[:, :, 0]) > 2 / 255).mean() > 0.3
    assert (off > 0.6 / 255).mean() < 0.005
    assert np.sqrt(np.mean(off**2)) < 0.006


@pytest.mark.parametrize("slope", [0.05, 0.21, 0.5])
def test_edges_come_nearer_to_the_share_that_pixels_are_covered(slope: float) -> None:
    """The error at a straight edge is less than half of what it was."""
    jagged, truth = covered((96, 64), slope), covered((96, 64), slope, 16)
    inside = np.s_[16:-16, 30:-30]
    smooth = run(grey(jagged), quality="39", subpixel=0.0)[:, :, 0]

    def error(shown: Float64 | Picture) -> float:
        return float(np.sqrt(np.mean((shown - truth)[inside] ** 2)))

    assert error(smooth) < 0.5 * error(jagged)
    assert error(run(grey(jagged), quality="39")[:, :, 0]) < 0.75 * error(jagged)


@pytest.mark.parametrize("quality", QUALITIES)
def test_a_turned_picture_is_smoothed_alike(quality: Quality) -> None:
    """Half a turn: along rows and along columns, before and behind."""
    picture = grey(np.random.default_rng(4).random((23, 31)))
    turned = run(np.ascontiguousarray(picture[::-1, ::-1]), quality=quality)[::-1, ::-1]
    np.testing.assert_allclose(turned, run(picture, quality=quality), atol=1e-5)


def test_what_has_no_edges_stays_bit_for_bit() -> None:
    ramp = np.tile(np.linspace(0.0, 1.0, 64), (16, 1))
    for picture in (grey(ramp), grey(np.full((1, 1), 0.3)), grey(np.zeros((2, 1)))):
        np.testing.assert_array_equal(run(picture), picture)
    flat = grey(np.full((5, 7), 0.4))
    np.testing.assert_array_equal(run(flat, contrast=0.0, least_contrast=0.0), flat)


def test_alpha_goes_with_the_colour() -> None:
    picture = grey(covered((48, 32), 0.3))
    picture[:, :, 3] = picture[:, :, 0]
    smooth = run(picture)
    np.testing.assert_array_equal(smooth[:, :, 3], smooth[:, :, 0])
    assert ((smooth > 0.2) & (smooth < 0.8)).sum() > 40


def test_linear_light_has_its_edges_where_the_encoded_picture_has_them() -> None:
    encoded = grey(np.round(np.random.default_rng(6).random((40, 40)) * 40) / 40)
    light = encoded.copy()
    light[:, :, :3] = srgb_to_linear(encoded[:, :, :3])
    moved_encoded = run(encoded) != encoded
    moved_light = run(light, linear=True) != light
    assert (moved_encoded != moved_light).mean() < 0.01
    assert (moved_encoded != (run(light) != light)).mean() > 0.02


def test_the_default_reads_and_writes_bytes() -> None:
    picture = (star_and_noise() * 255).astype(np.uint8)
    with pg.compile(fxaa(pg.Input("frame", "rgba8", (128, 64)))) as program:
        shown = np.empty_like(picture)
        program(frame=picture, into={"fxaa": shown})
    exact = run(picture.astype(np.float32) / np.float32(255))
    assert np.abs(shown / 255.0 - exact).max() <= 0.5 / 255 + 1e-6


def test_nan_stays_where_it_is_and_light_above_1_makes_no_edges() -> None:
    picture = grey(np.full((9, 9), 0.5))
    picture[4, 4, :3] = np.nan
    spoilt = np.isnan(run(picture)).any(axis=2)
    assert spoilt[4, 4]
    assert spoilt.sum() <= 5
    bright = grey(np.where(np.arange(9)[:, None] > 4, 3.0, 50.0) * np.ones((1, 9)))
    np.testing.assert_array_equal(run(bright), bright)


def test_every_pass_is_within_bounds() -> None:
    report = assert_within_bounds(
        fxaa(FRAME, quality="39", into=pg.target("smooth", "rgba32f")), frame=star_and_noise()[20:44, 30:70]
    )
    assert report is not None


@pytest.mark.parametrize(("name", "wrong"), [("subpixel", 1.5), ("contrast", -0.1), ("least_contrast", 2.0)])
def test_what_is_out_of_range_is_refused(name: str, wrong: float) -> None:
    with pytest.raises(pg.GraphError, match=f"fxaa: {name} must be 0 to 1, got {wrong}"):
        fxaa(FRAME, **{name: wrong})  # type: ignore[arg-type]
    with pytest.raises(pg.GraphError, match="fxaa: quality cannot be '40'; it is one of 12, 39"):
        fxaa(FRAME, "40")  # type: ignore[arg-type]
