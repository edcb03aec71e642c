"""God rays against the sum of chapter 13 of GPU Gems 3, in float64 and with SciPy's bilinear reads."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

import passgraph as pg
from passgraph.effects import god_rays
from tests.agreement import assert_within_bounds
from tests.conftest import DEVICES
from tests.effects.scenes import Float64, Picture, render

FRAME, DEPTH = pg.Input("frame"), pg.Input("depth")
REC709 = np.array([0.2126, 0.7152, 0.0722])
every_backend = pytest.mark.parametrize("backend_name", ["reference", *DEVICES], indirect=True)


def picture(size: tuple[int, int]) -> Picture:
    """Lamps, HDR, on a ground that is dark and partly negative, under any alpha."""
    random = np.random.default_rng(size[0])
    light = random.random((*size, 4)) - 0.2
    light[random.random(size) < 0.2] *= 9.0
    return np.asarray(light, np.float32)


def shown(target: pg.Target, backend: str = "reference", **given: Any) -> Float64:
    (made,) = render(target, size=None, backend=backend, **given).values()
    return made.astype(np.float64)


def read(image: Float64, x: Float64, y: Float64, mode: str) -> Float64:
    """Bilinear reads at places from 0 to 1."""
    at = np.stack([y * image.shape[0] - 0.5, x * image.shape[1] - 0.5])
    return np.dstack([ndimage.map_coordinates(c, at, order=1, mode=mode) for c in image.transpose(2, 0, 1)])


def places(shape: tuple[int, ...]) -> tuple[Float64, Float64]:
    y, x = np.mgrid[: shape[0], : shape[1]]
    return (x + 0.5) / shape[1], (y + 0.5) / shape[0]


def source(frame: Picture, threshold: float, depth: NDArray[Any] | None) -> Float64:
    """Means of 2 by 2 pixels of what is above the threshold, and hidden by nothing."""
    color = np.clip(frame[..., :3].astype(np.float64), 0.0, 65504.0)
    light = color @ REC709
    share = np.maximum(light - threshold, 0.0) / np.maximum(light, 1e-300)
    if depth is not None:
        share[np.isfinite(depth[..., 0]) & (depth[..., 0] > 0.0)] = 0.0
    bright = color * share[..., None]
    height, width = ((n + 1) // 2 for n in bright.shape[:2])
    bright = np.pad(bright, ((0, 1), (0, 1), (0, 0)), "edge")
    return (
        sum(bright[j : j + 2 * height : 2, i : i + 2 * width : 2][:height, :width] for j in (0, 1) for i in (0, 1))
        / 4.0
    )  # type: ignore[return-value]


def toward(image: Float64, at: tuple[float, float], reach: tuple[float, float], strides: int, reads: int) -> Float64:
    """Weighted means over places that are ``density`` of the way nearer at the last of 216."""
    x, y = places(image.shape)
    total, weights = np.zeros_like(image), 0.0
    for k in range(0, reads * strides, strides):
        away, weight = (1.0 - reach[0]) ** (k / 215), reach[1] ** (k / 215)
        total += weight * read(image, at[0] + away * (x - at[0]), at[1] + away * (y - at[1]), "grid-constant")
        weights += weight
    return total / weights


def expected(frame: Picture, at: tuple[float, float], intensity: float, threshold: float, reach: tuple[float, float],
             depth: NDArray[Any] | None = None, reads: int = 6) -> Float64:  # fmt: skip
    rays = source(frame, threshold, depth)
    for strides in (1, 6, 36) if reads == 6 else (1,):
        rays = toward(rays, at, reach, strides, reads)
    made = frame.astype(np.float64)
    x, y = places(frame.shape)
    halves = [0.5 * whole / half for whole, half in zip(frame.shape, rays.shape[:2], strict=False)]
    made[..., :3] += intensity * read(rays, x * halves[1], y * halves[0], "nearest")
    return made


@pytest.mark.sampled
@every_backend
@pytest.mark.parametrize("at", [(0.4, 0.3), (1.4, -0.2)], ids=["inside", "outside"])
@pytest.mark.parametrize("size", [(1, 1), (24, 32), (17, 31)], ids=str)
def test_beams_are_the_published_sum(size: tuple[int, int], at: tuple[float, float], backend_name: str) -> None:
    frame = picture(size)
    made = god_rays(FRAME, pg.Value("x"), pg.Value("y"), 0.7, 0.5, pg.Value("density"), pg.Value("decay"))
    given = {"x": at[0], "y": at[1], "density": 0.8, "decay": 0.2}
    shown_here = shown(made, backend_name, frame=frame, **given)
    # a place of float32 in 32 texels is off by some 1e-5 of one, and lamps are of 7
    np.testing.assert_allclose(shown_here, expected(frame, at, 0.7, 0.5, (0.8, 0.2)), atol=2e-4)


@every_backend
def test_what_has_a_distance_hides_the_light(backend_name: str) -> None:
    frame, depth = picture((17, 31)), np.full((17, 31, 1), 3.0, np.float32)
    depth[:6], depth[0], depth[1], depth[2] = 0.0, np.inf, np.nan, -1.0
    made = god_rays(FRAME, 0.5, 0.1, threshold=0.0, occluders=DEPTH)
    with pg.compile(made, backend_name, non_finite="keep") as program:
        beams = program(frame=frame, depth=depth)["god_rays"]
    np.testing.assert_allclose(
        beams, expected(frame, (0.5, 0.1), 0.5, 0.0, (0.9, 0.1), np.maximum(depth, 0.0)), atol=2e-4
    )


def test_three_passes_are_one_sum_of_216_places() -> None:
    """But for what is read between texels three times."""
    y, x = np.mgrid[:64, :96]
    frame = np.repeat((2.0 + np.sin(0.15 * x + 0.1 * y))[..., None], 4, axis=2).astype(np.float32)
    at = (0.5, 0.5)
    one = expected(frame, at, 1.0, 0.5, (0.9, 0.3), reads=216)
    np.testing.assert_allclose(
        shown(god_rays(FRAME, *at, 1.0, 0.5, 0.9, 0.3), frame=frame)[8:-8, 8:-8], one[8:-8, 8:-8], atol=0.02
    )


@pytest.mark.parametrize("decay", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("density", [0.0, 0.5, 0.99])
def test_an_even_sky_adds_its_own_light(density: float, decay: float) -> None:
    frame = np.full((20, 30, 4), (3.0, 2.0, 4.0, 0.5), np.float32)
    made = shown(god_rays(FRAME, 0.5, 0.5, 0.25, 0.0, density, decay), "numpy", frame=frame)
    # beyond the picture is no light: half a texel at the rim
    np.testing.assert_allclose(made[2:-2, 2:-2, :3], 1.25 * frame[2:-2, 2:-2, :3], rtol=1e-5)
    np.testing.assert_array_equal(made[..., 3], 0.5)


def test_a_picture_without_light_or_intensity_stays() -> None:
    frame = picture((17, 31))
    np.testing.assert_array_equal(shown(god_rays(FRAME, intensity=0.0), "numpy", frame=frame), frame)
    np.testing.assert_array_equal(shown(god_rays(FRAME, threshold=100.0), "numpy", frame=frame), frame)


def test_beams_lie_on_lines_through_the_light() -> None:
    """A small lamp at the middle of a dark picture shines to no side of the line from the light through it."""
    frame = np.zeros((96, 96, 4), np.float32)
    frame[46:50, 46:50] = 100.0
    beam = shown(god_rays(FRAME, 0.5, 0.0, 1.0, 1.0, 0.9, 1.0), "numpy", frame=frame)[..., 0]
    y, x = np.nonzero(beam > 1e-3 * beam.max())
    assert y.max() > 90
    # as wide as the lamp, seen from the light, and two texels of half the size to each side
    assert np.all(np.abs(x - 47.5) <= 2.0 * (y + 0.5) / 46.0 + 4.0)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_no_number_does_not_spread(value: float) -> None:
    frame = picture((17, 31))
    frame[8, 9, 1] = value
    with pg.compile(god_rays(FRAME), "numpy", non_finite="keep") as program:
        assert (~np.isfinite(program(frame=frame)["god_rays"])).sum() == 1


@pytest.mark.slow
def test_god_rays_within_bounds_of_the_reference() -> None:
    assert_within_bounds(god_rays(FRAME, 0.3, 0.2, occluders=DEPTH), frame=picture((9, 13)), depth=np.zeros((9, 13, 1)))
