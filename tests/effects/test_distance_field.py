"""Distance fields against SciPy's exact transform, within what jump flooding is known to miss."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

import passgraph as pg
from passgraph.effects import distance_field
from tests.agreement import assert_within_bounds
from tests.conftest import DEVICES
from tests.effects.scenes import Float64, Picture, render

FRAME = pg.Input("frame")
Mask = NDArray[np.bool_]
every_backend = pytest.mark.parametrize("backend_name", ["reference", *DEVICES], indirect=True)


def frame_of(mask: Mask) -> Picture:
    """Bright and opaque where the mask is set, HDR there and negative elsewhere."""
    return np.where(mask[..., None], 3.0, -1.0).astype(np.float32) * np.ones(4, np.float32)


def shown(mask: Mask, backend: str = "numpy", **options: Any) -> Float64:
    made = distance_field(FRAME, **options)
    return render(made, size=None, backend=backend, frame=frame_of(mask))["distance_field"][..., 0].astype(np.float64)


def shape(size: tuple[int, int], kind: str) -> Mask:
    random = np.random.default_rng(size[0])
    if kind == "points":
        return np.asarray(random.random(size) < 0.02)
    blobs = ndimage.gaussian_filter(random.random(size), 3.0)
    return np.asarray(blobs > np.median(blobs))


@every_backend
@pytest.mark.parametrize("kind", ["points", "blobs"])
@pytest.mark.parametrize("size", [(41, 64), (97, 31)], ids=str)
def test_it_is_the_exact_transform_but_for_few_pixels(size: tuple[int, int], kind: str, backend_name: str) -> None:
    mask = shape(size, kind)
    expected = ndimage.distance_transform_edt(~mask)
    off = shown(mask, backend_name) - expected
    # what is found is a pixel of the shape: no distance is too short
    assert off.min() > -1e-5
    assert off.max() < 1.0
    assert (off > 1e-5).mean() < 5e-4


@pytest.mark.parametrize("kind", ["points", "blobs"])
def test_signed_distances_are_those_to_either_side(kind: str) -> None:
    mask = shape((64, 80), kind)
    expected = ndimage.distance_transform_edt(~mask) - ndimage.distance_transform_edt(mask)
    off = np.abs(shown(mask, signed=True) - expected)
    assert off.max() < 1.0
    assert (off > 1e-5).mean() < 5e-4
    np.testing.assert_array_equal(shown(mask, signed=True) < 0, mask)


@pytest.mark.sampled
@every_backend
@pytest.mark.parametrize("reach", [1, 5, 8, 31])
def test_of_one_pixel_all_within_reach_are_exact(reach: int, backend_name: str) -> None:
    mask = np.zeros((33, 47), np.bool_)
    mask[11, 20] = True
    y, x = np.mgrid[:33, :47]
    expected = np.minimum(np.hypot(y - 11, x - 20), reach)
    np.testing.assert_allclose(shown(mask, backend_name, reach_px=reach), expected, rtol=1e-6)
    np.testing.assert_allclose(shown(mask, backend_name, reach_px=reach, unit_px=4.0), expected / 4.0, rtol=1e-6)


@pytest.mark.sampled
@every_backend
@pytest.mark.parametrize("size", [(1, 1), (1, 7), (5, 3)], ids=str)
def test_all_and_nothing(size: tuple[int, int], backend_name: str) -> None:
    full, empty = np.ones(size, np.bool_), np.zeros(size, np.bool_)
    assert (shown(full, backend_name) == 0.0).all()
    assert (shown(empty, backend_name, reach_px=9) == 9.0).all()
    assert (shown(full, backend_name, reach_px=9, signed=True) == -9.0).all()


def test_the_shape_may_be_what_is_opaque_and_nan_is_outside() -> None:
    frame = np.ones((9, 11, 4), np.float32)
    frame[..., 3] = 0.0
    frame[4, 5, 3], frame[:, 8:, 3] = 0.75, np.nan
    made = distance_field(FRAME, "alpha", pg.Value("least"))
    with pg.compile(made, "numpy", non_finite="keep") as program:
        distance = program(frame=frame, least=0.7)["distance_field"][..., 0]
    y, x = np.mgrid[:9, :11]
    np.testing.assert_allclose(distance, np.hypot(y - 4, x - 5), rtol=1e-6)


def test_distance_field_within_bounds_of_the_reference() -> None:
    mask = shape((17, 13), "blobs")
    assert_within_bounds(distance_field(FRAME, signed=True, reach_px=15), frame=frame_of(mask))
