"""Lens distortion against OpenCV's camera model and SciPy's bilinear reads."""

from __future__ import annotations

from math import tan
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

import passgraph as pg
from passgraph.effects import lens_distortion
from tests.agreement import assert_within_bounds
from tests.conftest import DEVICES
from tests.effects.scenes import Picture, render

FRAME = pg.Input("frame")
FOV = 1.2
#: k1, k2, k3: a barrel, a pincushion, a mustache.
LENSES = [(-0.25, 0.05, 0.0), (0.3, 0.1, 0.02), (-0.2, 0.3, -0.05)]
every_backend = pytest.mark.parametrize("backend_name", ["reference", *DEVICES], indirect=True)
every_lens = pytest.mark.parametrize("lens", LENSES, ids=["barrel", "pincushion", "mustache"])


def smooth(size: tuple[int, int]) -> Picture:
    """Waves a few pixels long, HDR and negative."""
    y, x = np.mgrid[: size[0], : size[1]]
    waves = [np.sin(0.3 * x + 0.1 * y), 3.0 * np.cos(0.25 * y), np.sin(0.2 * x) * np.sin(0.3 * y), 0.5 + 0.0 * x]
    return np.dstack(waves).astype(np.float32)


def shown(target: pg.Target, backend: str = "reference", **given: Any) -> NDArray[np.float64]:
    (made,) = render(target, size=None, backend=backend, **given).values()
    return made.astype(np.float64)


def through(lens: tuple[float, ...], color: pg.Target = FRAME, **options: Any) -> pg.Target:
    k1, k2, k3 = lens
    return lens_distortion(color, k1, k2, k3, FOV, **options)


def expected(frame: Picture, lens: tuple[float, ...], undo: bool, zoom: float = 1.0) -> NDArray[np.float64]:
    """Where OpenCV says that each pixel's ray is, read by SciPy."""
    height, width = frame.shape[:2]
    focal = 0.5 * height / tan(0.5 * FOV)
    matrix = np.array([[focal, 0, 0.5 * (width - 1)], [0, focal, 0.5 * (height - 1)], [0, 0, 1]])
    coefficients = np.array([lens[0], lens[1], 0.0, 0.0, lens[2]])
    y, x = np.mgrid[:height, :width].astype(np.float64)
    pixels = np.stack([(x - matrix[0, 2]) / zoom + matrix[0, 2], (y - matrix[1, 2]) / zoom + matrix[1, 2]], axis=-1)
    if undo:
        rays = np.concatenate([(pixels - matrix[:2, 2]) / focal, np.ones((height, width, 1))], axis=-1)
        found, _ = cv2.projectPoints(rays.reshape(-1, 1, 3), np.zeros(3), np.zeros(3), matrix, coefficients)
    else:
        stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 500, 1e-13)
        found = cv2.undistortPoints(pixels.reshape(-1, 1, 2), matrix, coefficients, P=matrix, criteria=stop)
    at = found.reshape(height, width, 2)[..., ::-1].transpose(2, 0, 1)
    channels = [
        ndimage.map_coordinates(c, at, order=1, mode="nearest") for c in frame.astype(np.float64).transpose(2, 0, 1)
    ]
    return np.stack(channels, axis=-1)


@every_backend
@every_lens
@pytest.mark.parametrize("undo", [False, True], ids=["bent", "straightened"])
@pytest.mark.parametrize("size", [(1, 1), (31, 45), (45, 31)], ids=str)
def test_rays_go_where_opencv_says(size: tuple[int, int], undo: bool, lens: Any, backend_name: str) -> None:
    frame = smooth(size)
    made = shown(through(lens, zoom=1.1, undo=undo), backend_name, frame=frame)
    # a position of float32 in 45 texels is off by some 1e-5 of a texel
    np.testing.assert_allclose(made, expected(frame, lens, undo, 1.1), atol=1e-4)


@every_lens
def test_what_was_bent_is_straightened(lens: Any) -> None:
    frame = smooth((61, 81))
    there = through(lens, name="there")
    back = shown(through(lens, there, undo=True), "numpy", frame=frame)
    middle = (slice(15, -15), slice(20, -20))
    # each bilinear read takes up to an eighth of the second difference
    assert np.abs(back - frame)[middle].max() < 2 * 0.125 * (0.3**2 + 0.25**2) * 3.0
    assert np.abs(shown(there, "numpy", frame=frame) - frame)[middle].max() > 0.2


@every_backend
def test_without_coefficients_pictures_stay(backend_name: str) -> None:
    frame = smooth((31, 45))
    for undo in (False, True):
        made = shown(lens_distortion(FRAME, 0.0, undo=undo), backend_name, frame=frame)
        np.testing.assert_allclose(made, frame, atol=2e-5)


def test_lenses_are_run_values_and_within_bounds() -> None:
    frame = smooth((17, 31))
    made = lens_distortion(FRAME, pg.Value("k1"), 0.05, 0.0, pg.Value("fov"), pg.Value("zoom"))
    given: dict[str, Any] = {"frame": frame, "k1": -0.25, "fov": FOV, "zoom": 1.1}
    np.testing.assert_array_equal(
        shown(made, "numpy", **given), shown(lens_distortion(FRAME, -0.25, 0.05, 0.0, FOV, 1.1), "numpy", frame=frame)
    )
    assert_within_bounds(made, **given)


def test_where_the_polynomial_falls_numbers_stay_finite() -> None:
    """Past the middle of a lens that shows nothing there: radius 1.5 has no ray, as r (1 - r²) is at most 0.38."""
    made = shown(lens_distortion(FRAME, -1.0, vertical_fov_rad=2.4), "numpy", frame=smooth((17, 31)))
    assert np.isfinite(made).all()
