"""Bloom's filters at every size: no light gained or lost, wherever it falls, and the values of a NumPy truth."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

import passgraph as pg
from passgraph.effects import bloom
from passgraph.graph.targets import Target
from tests.conftest import DEVICES
from tests.effects.scenes import Picture

Doubles = NDArray[np.float64]
FRAME = pg.Input("frame")
SIZES = ((1, 1), (2, 1), (1, 3), (5, 4), (6, 10), (7, 13), (31, 33))
LARGE = ((255, 257), (641, 361))


def shares(size: tuple[int, int], places: list[tuple[int, int]], levels: int, backend: str = "numpy") -> list[float]:
    """What the glow of one bright pixel holds of its light, for each place of it."""
    found = []
    with pg.compile(bloom(FRAME, threshold=1.0, intensity=1.0, levels=levels), backend=backend) as program:
        for x, y in places:
            picture = np.zeros((size[1], size[0], 4), np.float32)
            picture[y, x, :3] = 101.0
            glow = program(frame=picture)["bloom"].astype(np.float64) - picture
            found.append(float(glow[..., 1].sum()) / 100.0)
    return found


@pytest.mark.sampled
@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("levels", [1, 4])
def test_a_spot_keeps_its_light_wherever_it_is(size: tuple[int, int], levels: int) -> None:
    """Every place along a diagonal, so that a moving spot does not flicker either, corners and borders among them."""
    steps = max(size)
    places = [(k * (size[0] - 1) // max(steps - 1, 1), k * (size[1] - 1) // max(steps - 1, 1)) for k in range(steps)]
    np.testing.assert_allclose(shares(size, places, levels), 1.0, rtol=1e-4)


@pytest.mark.parametrize("size", LARGE, ids=str)
def test_large_odd_pictures_too(size: tuple[int, int]) -> None:
    width, height = size
    places = [(0, 0), (width - 1, height // 2), *((width // 3 + k, height // 3 + k) for k in range(9))]
    np.testing.assert_allclose(shares(size, places, 4), 1.0, rtol=1e-4)


@pytest.mark.parametrize("backend_name", DEVICES, indirect=True)
def test_every_backend_keeps_it(backend_name: str) -> None:
    places = [(0, 0), (30, 0), (11, 17), (12, 17), (30, 32)]
    np.testing.assert_allclose(shares((31, 33), places, 2, backend_name), 1.0, rtol=1e-4)


@pytest.mark.parametrize("size", [(31, 33), (7, 4)], ids=str)
def test_a_constant_picture_stays_constant_at_odd_sizes(size: tuple[int, int]) -> None:
    with pg.compile(bloom(FRAME, levels=3), backend="numpy") as program:
        made = program(frame=np.full((size[1], size[0], 4), 2.0, np.float32))["bloom"]
    np.testing.assert_allclose(made[..., :3], 2.6, rtol=1e-6)


# The truth: a filter is a matrix each way, made of lengths that intervals have in common.


def halved(count: int) -> int:
    return (count + 1) // 2


def mirrored(place: int, count: int) -> int:
    turned = place % (2 * count)
    return turned if turned < count else 2 * count - 1 - turned


def covering(count: int, width: float) -> Doubles:
    """Means over intervals, ``width`` pixels of half the size wide and centred on them, of a picture of ``count``."""
    made = halved(count)
    ratio = count / made
    rows = np.zeros((made, count))
    for pixel in range(made):
        low, high = (pixel + 0.5 - width / 2) * ratio, (pixel + 0.5 + width / 2) * ratio
        for texel in range(-count - 2, 2 * count + 2):
            common = max(0.0, min(high, texel + 1) - max(low, texel))
            rows[pixel, mirrored(texel, count)] += common / (high - low)
    return rows


def enlarging(count: int, taps: dict[int, float], parts: int = 400) -> Doubles:
    """Means over the pixels of a picture of ``count`` of taps around each place of one of half the size."""
    small = halved(count)
    places = (np.arange(count * parts) + 0.5) / parts * small / count - 0.5
    columns = []
    for texel in range(small):
        line = np.eye(small)[texel]
        read = sum(w * map_coordinates(line, [places + t], order=1, mode="reflect") for t, w in taps.items())
        columns.append(np.asarray(read).reshape(count, parts).mean(1))
    return np.array(columns).T


def shrunk(picture: Doubles) -> Doubles:
    total = np.zeros((halved(picture.shape[0]), halved(picture.shape[1])))
    for width in (1.0, 2.0):
        total += 0.5 * covering(picture.shape[0], width) @ picture @ covering(picture.shape[1], width).T
    return total


def enlarged(picture: Doubles, shape: tuple[int, int]) -> Doubles:
    if shape == (2 * picture.shape[0], 2 * picture.shape[1]):
        y, x = np.mgrid[: shape[0], : shape[1]] / 2.0 - 0.25
        total = np.zeros(shape)
        for dy, dx, weight in [(0, 1, 1), (0, -1, 1), (1, 0, 1), (-1, 0, 1)] + [
            (a, b, 2) for a in (-0.5, 0.5) for b in (-0.5, 0.5)
        ]:
            total += weight / 12 * map_coordinates(picture, [y + dy, x + dx], order=1, mode="reflect")
        return total
    taps = {-1: 1 / 6, 0: 2 / 3, 1: 1 / 6}
    return enlarging(shape[0], taps) @ picture @ enlarging(shape[1], taps).T


def truth(light: Doubles, levels: int) -> Doubles:
    chain = [light]
    for _ in range(levels):
        chain.append(shrunk(chain[-1]))
    glow = chain[-1]
    for level in range(levels - 1, 0, -1):
        glow = enlarged(glow, chain[level].shape)  # type: ignore[arg-type]
    return enlarging(light.shape[0], {0: 1.0}) @ glow @ enlarging(light.shape[1], {0: 1.0}).T


@pytest.mark.parametrize("size", [(31, 33), (24, 16), (13, 6)], ids=str)
def test_the_filters_are_those_of_numpy(size: tuple[int, int]) -> None:
    """Light of random brightness in every pixel, over a black picture's threshold of 0."""
    picture: Picture = np.random.default_rng(2).random((size[1], size[0], 4), np.float32) * 3
    target: Target = bloom(FRAME, threshold=0.0, intensity=1.0, levels=2)
    with pg.compile(target) as program:
        glow = program(frame=picture)["bloom"][..., 1].astype(np.float64) - picture[..., 1]
    np.testing.assert_allclose(glow, truth(picture[..., 1].astype(np.float64), 2), atol=3e-5)
