"""Glitch against NumPy's 32 bits without sign, to the bit, and its shares."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph.effects import glitch
from tests.agreement import assert_within_bounds
from tests.conftest import DEVICES
from tests.effects.scenes import Picture, render
from tests.effects.test_film_grain import pcg3d

FRAME = pg.Input("frame")
every_backend = pytest.mark.parametrize("backend_name", ["reference", *DEVICES], indirect=True)


def picture(size: tuple[int, int]) -> Picture:
    """HDR, negative, any alpha."""
    return np.asarray(9.0 * np.random.default_rng(size[0]).random((*size, 4)) - 3.0, np.float32)


def shown(target: pg.Target, backend: str = "numpy", **given: Any) -> Picture:
    (made,) = render(target, size=None, backend=backend, **given).values()
    return made


def even(bits: NDArray[Any], most: int) -> NDArray[np.int64]:
    return np.asarray(((bits & np.uint32(0xFFFF)).astype(np.int64) * (2 * most + 1) >> 16) - most)


def damaged(frame: Picture, amount: float, shift: int, split: int, band: int, block: int, key: int) -> Picture:
    rows, columns = frame.shape[:2]
    y, x = np.mgrid[:rows, :columns]
    row = pcg3d(y // band, np.full_like(y, -1), key)
    square = pcg3d(x // block, y // block, key)
    moved = (row[0] & np.uint32(0xFFFF)) < int(amount * 65536)
    blocks = (square[0] & np.uint32(0x3FFFF)) < int(amount * 65536)
    column = x + moved * even(row[1], shift) + blocks * even(square[1], shift)
    line = np.clip(y + blocks * even(square[2], shift), 0, rows - 1)
    apart = moved * even(row[2], split)
    red, other, blue = (np.clip(column + off, 0, columns - 1) for off in (apart, 0, -apart))
    return np.dstack([frame[line, red, 0], frame[line, other, 1], frame[line, blue, 2], frame[line, other, 3]])


@every_backend
@pytest.mark.parametrize("size", [(1, 1), (40, 52), (17, 31)], ids=str)
def test_it_is_the_published_hash_to_the_bit(size: tuple[int, int], backend_name: str) -> None:
    frame = picture(size)
    made = glitch(FRAME, pg.Value("amount"), 9, 3, 4, 7, pg.Value("index", int))
    made = shown(made, backend_name, frame=frame, amount=0.6, index=5)
    np.testing.assert_array_equal(made, damaged(frame, 0.6, 9, 3, 4, 7, 5))


def test_shares_of_bands_and_blocks_are_as_asked_for() -> None:
    frame = np.full((4000, 16, 4), np.arange(16)[:, None] + 1000.0, np.float32)
    for amount in (0.0, 0.25, 1.0):
        made = shown(glitch(FRAME.border("zero"), amount, 4096, 0, 1, 4096), frame=frame)
        assert (made[:, :, 1] != frame[:, :, 1]).any(axis=1).mean() == pytest.approx(amount, abs=0.03)


def test_pictures_differ_by_index_and_seed_and_stay_without_amount() -> None:
    frame = picture((64, 64))
    np.testing.assert_array_equal(shown(glitch(FRAME, 0.0), frame=frame), frame)
    first, second, third = (shown(glitch(FRAME, index=i, seed=s), frame=frame) for i, s in ((0, 0), (1, 0), (0, 1)))
    assert (first != second).mean() > 0.1 < (first != third).mean()


def test_glitch_within_bounds_of_the_reference() -> None:
    assert_within_bounds(glitch(FRAME, 0.5, 4, 2, 2, 5), frame=picture((13, 17)))
