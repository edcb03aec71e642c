"""How pictures are cut: within the memory, covering everything, along the blocks of sinks."""

from __future__ import annotations

from itertools import product

import pytest

import passgraph as pg
from passgraph.plan.limits import bytes_of
from passgraph.plan.window import Footprint, Halo
from passgraph.tiles.grid import MOST_PIXELS, PIECE_PIXELS, Cost, grid_of, pieces

NEAR = Footprint(Halo(7, 7, 7, 7), frozenset())
SIZES = [(1, 1), (3, 2000), (2000, 3), (1000, 800), (30_000, 20_000), (100_000, 20_000)]


@pytest.mark.parametrize("size", SIZES)
def test_tiles_stay_within_the_memory_and_are_few(size: tuple[int, int]) -> None:
    blocks, memories = [(1, 1), (256, 256), (512, 512), (64, 4000)], [10**8, 10**9, 10**10]
    for block, memory in product(blocks, memories):
        grid = grid_of(size, NEAR, Cost(50_000_000, 90), memory, block)
        (width, height), (across, down) = grid.window, grid.core
        assert grid.bytes == 50_000_000 + 90 * width * height <= memory
        assert across <= width <= min(size[0], across + 14)
        assert down <= height <= min(size[1], down + 14)
        assert len(grid) * across * down >= size[0] * size[1]
        assert width * height <= 1.1 * across * down or min(size) < 100 or width * height < MOST_PIXELS


@pytest.mark.parametrize("memory", [10**9, 10**10])
def test_large_pictures_are_cut_along_the_blocks_of_their_sink(memory: int) -> None:
    grid = grid_of((100_000, 20_000), NEAR, Cost(50_000_000, 90), memory, (256, 256))
    across, down = grid.core
    assert across % 256 == 0 or across == 100_000
    assert down % 256 == 0
    assert grid.window[0] * grid.window[1] <= 1.1 * across * down


def test_a_far_halo_takes_larger_tiles() -> None:
    far = Footprint(Halo(300, 300, 300, 300), frozenset())
    grid = grid_of((100_000, 20_000), far, Cost(50_000_000, 90), 10**10, (256, 256))
    assert grid.window[0] * grid.window[1] <= 1.15 * grid.core[0] * grid.core[1]
    assert grid.window[0] * grid.window[1] > MOST_PIXELS


def test_tiles_asked_for_must_fit() -> None:
    cost = Cost(0, 100)
    assert grid_of((1000, 800), NEAR, cost, 100 * 114 * 64, (1, 1), (100, 50)).core == (100, 50)
    with pytest.raises(pg.InputError, match="a tile of 100x50 pixels, read with 114x64, takes 1 MB"):
        grid_of((1000, 800), NEAR, cost, 100 * 114 * 64 - 1, (1, 1), (100, 50))


def test_an_axis_that_must_be_whole_is() -> None:
    wide, high = (Footprint(Halo(1, 1, 1, 1), frozenset(), **{name: "why"}) for name in ("wide", "high"))
    assert grid_of((5000, 4000), wide, Cost(0, 100), 10**8, (1, 1)).core[0] == 5000
    assert grid_of((5000, 4000), high, Cost(0, 100), 10**8, (1, 1)).core[1] == 4000
    with pytest.raises(pg.InputError, match=r"is too little: a tile of 5000x1 pixels, read with 5000x3.*; why; give"):
        grid_of((5000, 4000), wide, Cost(0, 100), 10**6, (1, 1))


@pytest.mark.parametrize(
    ("text", "count"),
    [("1 GB", 10**9), ("1GB", 10**9), ("512 MiB", 512 << 20), ("1.5 kb", 1500), ("7", 7), ("2 TiB", 2 << 40), (5, 5)],
)
def test_memory_is_bytes(text: str | int, count: int) -> None:
    assert bytes_of(text) == count


@pytest.mark.parametrize(
    "text", ["", "GB", "-1 GB", "1 XB", "1 G B", "1e9", 0, -1, 1.5, None, True, 1 << 60, "9999999 TB"]
)
def test_memory_that_is_none(text: object) -> None:
    with pytest.raises(pg.InputError, match="memory"):
        bytes_of(text)


@pytest.mark.parametrize("block", [(1, 1), (256, 256), (7, 5), (2000, 3000)])
@pytest.mark.parametrize("part", [(0, 1, 0, 1), (0, 300, 0, 400), (100, 1900, 333, 5001)])
def test_pieces_cover_a_part_once_along_blocks(part: tuple[int, int, int, int], block: tuple[int, int]) -> None:
    area = 0
    for top, bottom, left, right in pieces(part, block):
        assert (bottom - top) * (right - left) <= max(PIECE_PIXELS, block[0] * block[1])
        assert top == part[0] or top % block[0] == 0
        assert left == part[2] or left % block[1] == 0
        area += (bottom - top) * (right - left)
    assert area == (part[1] - part[0]) * (part[3] - part[2])
