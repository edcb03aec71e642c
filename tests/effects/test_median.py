"""The median against NumPy's, to the bit."""

from __future__ import annotations

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects import median
from passgraph.effects.filters.median import NINE, TWENTY_FIVE
from passgraph.language.lowering.channels import before_rounding, selection, single_channel
from passgraph.plan.build import build
from passgraph.plan.data import PixelStep
from tests.conftest import DEVICES
from tests.effects.scenes import Picture, render


def numpy_median(picture: Picture, size: int) -> Picture:
    reach = size // 2
    around = np.pad(picture, ((reach, reach), (reach, reach), (0, 0)), "edge")
    windows = np.lib.stride_tricks.sliding_window_view(around, (size, size), (0, 1))
    return np.median(windows, (3, 4))


@pytest.mark.parametrize("pairs", [NINE, TWENTY_FIVE], ids=["9", "25"])
def test_exchanges_bring_the_middle_one_to_its_place(pairs: tuple[tuple[int, ...], ...]) -> None:
    """Whatever of zeros and ones: then whatever the numbers are (the zero-one principle).  64 cases are one word."""
    count = 9 if pairs is NINE else 25
    words, bits = np.arange(1 << (count - 6)), np.arange(64)
    inside = [np.uint64(sum(1 << int(bit) for bit in bits[bits >> place & 1 == 1])) for place in range(6)]
    held = [np.full(words.size, word) for word in inside]
    held += [np.where(words >> place & 1, ~np.uint64(0), np.uint64(0)) for place in range(count - 6)]
    for a, b in pairs:
        held[a], held[b] = held[a] & held[b], held[a] | held[b]
    ones = sum(words >> place & 1 for place in range(count - 6))
    expected = [sum(1 << bit for bit in range(64) if bit.bit_count() + n > count // 2) for n in range(count - 5)]
    assert np.array_equal(held[count // 2], np.array(expected, np.uint64)[ones])


@pytest.mark.sampled
@pytest.mark.parametrize("backend_name", DEVICES, indirect=True)
@pytest.mark.parametrize("size_px", [3, 5])
def test_numbers_are_those_of_numpy(size_px: int, backend_name: str) -> None:
    random = np.random.default_rng(size_px)
    for size in ((1, 1), (3, 2), (70, 19)):
        picture = random.standard_normal((*size[::-1], 4)).astype(np.float32)
        picture[random.random(picture.shape) < 0.2] = 0.5
        shown = render(median(pg.Input("frame"), size_px), size=None, backend=backend_name, frame=picture)["median"]
        assert np.array_equal(shown, numpy_median(picture, size_px)), size


def test_infinities_are_numbers() -> None:
    picture = np.random.default_rng(1).choice([-np.inf, 0.0, 1.0, np.inf], (12, 9, 4)).astype(np.float32)
    with pg.compile(median(pg.Input("frame"), 5), non_finite="keep") as program:
        assert np.array_equal(program(frame=picture)["median"], numpy_median(picture, 5))


@pytest.mark.parametrize("format_", ["r8", "rg8", "rgb8", "r16"])
@pytest.mark.parametrize("size_px", [3, 5])
def test_stored_numbers_stay_as_they_are(format_: str, size_px: int) -> None:
    held = np.uint16 if format_ == "r16" else np.uint8
    channels = pg.target("any", format_).format.channels
    picture = np.random.default_rng(2).integers(0, np.iinfo(held).max, (20, 31, channels), endpoint=True).astype(held)
    made = median(pg.Input("frame", format_), size_px, into=pg.target("median", format_))
    found = np.empty_like(picture)
    with pg.compile(made) as program:
        program(frame=picture, into={"median": found})
    assert np.array_equal(found, numpy_median(picture, size_px))


@pytest.mark.parametrize("format_", ["r8", "rgba8"])
def test_bytes_are_compared_as_bytes(format_: str) -> None:
    """Where a pass only chooses among stored numbers, the numpy backend decodes none: four times as many a register."""
    color = pg.Input("frame", format_, (9, 9))
    (step,) = build({"made": median(color, 5, into=pg.target("made", format_))}).steps
    assert isinstance(step, PixelStep)
    program = before_rounding(step.program)
    single = single_channel(program, (step.output_formats[0].channels,))
    assert selection(single or program, step.image_formats, step.output_formats) is not None


@pytest.mark.parametrize("size_px", [3, 5])
def test_it_is_straight_code(size_px: int) -> None:
    """Arrays in memory and loops that stay would keep the numpy backend from computing all channels alike."""
    (step,) = build({"made": median(pg.Input("frame", "rgba32f", (9, 9)), size_px)}).steps
    assert isinstance(step, PixelStep)
    assert not step.program.arrays
    assert {type(i).__name__ for i in step.program.body} == {"LoadTexel", "Op"}


def test_other_sizes_are_refused() -> None:
    with pytest.raises(pg.GraphError, match="median: size_px must be odd, 3 to 5, got 7"):
        median(pg.Input("frame"), 7)
