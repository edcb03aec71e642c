"""What bounds the search for casters: the least depths about each block of a shadow map."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import passgraph as pg
from passgraph import Image
from passgraph.effects.shadows.nearest_casters import AROUND, block_of, nearest_casters
from passgraph.effects.shadows.shadow_filters import FARTHEST
from tests.effects.scenes import render

#: Sizes of maps and of their blocks: a few blocks, the usual map, a little more than it, three blocks as one.
SIZES = {17: 8, 1024: 8, 1030: 16, 2100: 24}


def least_about(picture: NDArray[np.float32], reach: int) -> NDArray[np.float32]:
    """The least within so many texels to each side."""
    for axis in (0, 1):
        padded = np.pad(picture, [(reach, reach) if axis == a else (0, 0) for a in (0, 1)], constant_values=np.inf)
        picture = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1, axis).min(axis=-1)
    return picture


@pg.kernel
def block_written(map: Image, nearest: Image) -> float:
    return float(block_of(map, nearest))


@pytest.mark.parametrize(("size", "block"), list(SIZES.items()))
def test_the_least_depths_are_those_of_all_texels_so_near(size: int, block: int, backend_name: str) -> None:
    depths = np.random.default_rng(size).random((size, size), np.float32) ** 0.01
    depths[size // 3, -1] = 0.125
    map_ = pg.Input("map", "r32f", (size, size))
    nearest = nearest_casters(map_, size, "light")
    told = block_written(map_, nearest, into=pg.target("told", "r32f", (1, 1)))
    made = render(nearest, told, size=None, backend=backend_name, map=depths)
    side = -(-size // block)
    padded = np.pad(depths, (0, side * block - size), constant_values=np.inf)
    of_blocks = padded.reshape(side, block, side, block).min(axis=(1, 3))
    assert made["told"].item() == block
    for channel, around in enumerate(AROUND):
        assert (made[nearest.name][:, :, channel] == least_about(of_blocks, int(around))).all()


@pytest.mark.parametrize("size", [16, 1024, 1025, 2048, 4096, 8192])
def test_the_farthest_look_is_as_far_as_filters_reach(size: int) -> None:
    """In few blocks, so that what lies about them takes no longer to find in a larger map."""
    nearest = nearest_casters(pg.Input("map", "r32f", (size, size)), size, "light")
    with pg.compile(nearest, backend="null") as program:
        blocks = program.plan.steps[-1].size[0]
    assert blocks <= 128
    assert AROUND[-1] * (size / blocks) >= FARTHEST * size
