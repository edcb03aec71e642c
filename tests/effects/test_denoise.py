"""Non-local means against scikit-image, and against the published sum in float64."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from skimage.restoration import denoise_nl_means

import passgraph as pg
from passgraph.effects import denoise
from tests.agreement import assert_within_bounds
from tests.conftest import DEVICES
from tests.effects.scenes import Float64, Picture, render

FRAME = pg.Input("frame")
every_backend = pytest.mark.parametrize("backend_name", ["reference", *DEVICES], indirect=True)


def picture(size: tuple[int, int], low: float = 0.0, high: float = 1.0) -> Picture:
    """Stripes with noise; alpha is 1."""
    random, x = np.random.default_rng(size[0]), np.arange(size[1])
    light = 0.5 + 0.4 * np.sin(0.9 * x)[None, :, None] + random.normal(0.0, 0.1, (*size, 4))
    light = low + (high - low) * np.clip(light, 0.0, 1.0)
    light[..., 3] = 1.0
    return np.asarray(light, np.float32)


def shown(target: pg.Target, backend: str = "numpy", **given: Any) -> Float64:
    (made,) = render(target, size=None, backend=backend, **given).values()
    return made.astype(np.float64)


@pytest.mark.sampled
@every_backend
@pytest.mark.parametrize("noise", [0.0, 0.1])
@pytest.mark.parametrize(("patch", "search"), [(1, 4), (2, 3)])
@pytest.mark.parametrize("size", [(1, 1), (17, 23)], ids=str)
def test_it_is_that_of_scikit_image(
    size: tuple[int, int], patch: int, search: int, noise: float, backend_name: str
) -> None:
    """It leaves out patches that differ by 5 times the square of the strength: of this one none do.

    Its exponential is that of N. Schraudolph, 1999, off by up to 3 %, of weights of the mean of values that are apart
    by 0.2. The sum below is exact.
    """
    frame = picture(size)
    made = denoise(FRAME.border("reflect-101"), pg.Value("strength"), pg.Value("noise"), patch, search)
    expected = denoise_nl_means(
        frame[..., :3].astype(np.float64), 2 * patch + 1, search, 0.46, False, noise, channel_axis=-1
    )
    given = {"frame": frame, "strength": 0.46, "noise": noise}
    np.testing.assert_allclose(shown(made, backend_name, **given)[..., :3], expected.reshape(*size, 3), atol=6e-3)


def brute(frame: Picture, strength: float, noise: float, patch: int, search: int) -> Float64:
    exact = frame.astype(np.float64)
    around = np.pad(exact, ((patch, patch), (patch, patch), (0, 0)), "edge")
    side = np.arange(-patch, patch + 1)
    weights = np.exp(-2.0 * (side[:, None] ** 2 + side**2) / patch**2)[..., None] / 3.0
    weights /= 3.0 * weights.sum()
    made = np.empty_like(exact)
    for y in range(frame.shape[0]):
        for x in range(frame.shape[1]):
            rows = range(max(y - search, 0), min(y + search + 1, frame.shape[0]))
            columns = range(max(x - search, 0), min(x + search + 1, frame.shape[1]))
            own, total, weight = around[y : y + len(side), x : x + len(side), :3], np.zeros(4), 0.0
            for j in rows:
                for i in columns:
                    apart = (weights * (around[j : j + len(side), i : i + len(side), :3] - own) ** 2).sum()
                    w = np.exp(-max(apart - 2.0 * noise**2, 0.0) / strength**2)
                    total, weight = total + w * exact[j, i], weight + w
            made[y, x] = total / weight
    return made


@every_backend
def test_of_any_light_it_is_the_published_sum(backend_name: str) -> None:
    frame = picture((11, 14), -2.0, 9.0)
    frame[..., 3] = np.random.default_rng(1).random((11, 14))
    made = shown(denoise(FRAME, 0.7, 0.3, 2, 3), backend_name, frame=frame)
    np.testing.assert_allclose(made, brute(frame, 0.7, 0.3, 2, 3), atol=2e-5)


def test_noise_goes_and_stripes_stay() -> None:
    random, x = np.random.default_rng(4), np.arange(60)
    clean = np.tile(np.where(x // 3 % 2, 0.7, 0.3)[None, :, None], (40, 1, 4))
    frame = np.asarray(clean + random.normal(0.0, 0.05, clean.shape), np.float32)
    made = shown(denoise(FRAME, 0.04, 0.05), frame=frame)
    assert np.sqrt(np.mean((made - clean) ** 2)) < 0.45 * 0.05
    even = np.full((9, 9, 4), 0.3, np.float32)
    np.testing.assert_allclose(shown(denoise(FRAME), frame=even), even, rtol=1e-6)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_bad_pixel_has_no_part_and_its_neighbors_stay(value: float) -> None:
    frame = picture((17, 17))
    frame[8, 8, 1] = value
    with pg.compile(denoise(FRAME), "numpy", non_finite="keep") as program:
        made = program(frame=frame)["denoise"]
    assert (~np.isfinite(made)).sum() == 1
    np.testing.assert_array_equal(made[7:10, 7:10], frame[7:10, 7:10])


def test_denoise_within_bounds_of_the_reference() -> None:
    assert_within_bounds(denoise(FRAME, 0.2, search_radius_px=2), frame=picture((9, 11)))
