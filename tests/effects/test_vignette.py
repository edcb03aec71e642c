"""The vignette against rays through a pinhole."""

from __future__ import annotations

from math import tan

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects import vignette
from tests.conftest import DEVICES
from tests.effects.scenes import Picture, render

FRAME = pg.Input("frame")


def run(picture: Picture, *options: object, backend: str = "numpy", **values: object) -> Picture:
    made = vignette(FRAME, *options)  # type: ignore[arg-type]
    return render(made, size=None, backend=backend, frame=picture, **values)["vignette"]


@pytest.mark.parametrize("backend_name", DEVICES, indirect=True)
@pytest.mark.parametrize("size", [(1, 1), (31, 20), (20, 31)], ids=str)
def test_light_falls_by_the_fourth_power_of_the_cosine(size: tuple[int, int], backend_name: str) -> None:
    width, height = size
    y, x = np.mgrid[0:height, 0:width] + 0.5
    rays = np.stack([x - width / 2, y - height / 2, np.full_like(x, 0.5 * height / tan(0.5 * 1.2))], axis=2)
    cosine = rays[:, :, 2] / np.linalg.norm(rays, axis=2)
    shown = run(np.full((height, width, 4), 3.0, np.float32), 1.2, 1.0, backend=backend_name)
    np.testing.assert_allclose(shown[:, :, 1], 3.0 * cosine**4, rtol=1e-5)
    np.testing.assert_array_equal(shown[:, :, 3], np.float32(3.0))
    thrice = run(np.ones((height, width, 4), np.float32), 1.2, 3.0, backend=backend_name)
    np.testing.assert_allclose(thrice[:, :, 0], cosine**12, rtol=1e-5)


def test_strength_0_leaves_the_picture_bit_for_bit() -> None:
    picture = np.random.default_rng(2).random((9, 14, 4), np.float32)
    np.testing.assert_array_equal(run(picture, 2.5, 0.0), picture)


def test_the_angle_may_change_from_run_to_run() -> None:
    picture = np.ones((9, 14, 4), np.float32)
    angle = pg.Value("angle", float)
    np.testing.assert_array_equal(run(picture, angle, angle=1.4), run(picture, 1.4))


def test_an_angle_of_half_a_turn_is_refused() -> None:
    with pytest.raises(pg.GraphError, match=r"vignette: vertical_fov_rad must be 0\.001 to 3\.1, got 3\.2"):
        vignette(FRAME, 3.2)
