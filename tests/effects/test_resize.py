"""Resizing against Pillow's filters in floats, and against the definition of a filter in NumPy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

import passgraph as pg
from passgraph.commands.entry import run
from passgraph.effects import resize

Picture = NDArray[np.float32]
FRAME = pg.Input("frame")
#: Filter → Pillow's of the same kernel.
PILLOW = {
    "box": Image.Resampling.BOX, "bilinear": Image.Resampling.BILINEAR, "catmull-rom": Image.Resampling.BICUBIC,
    "lanczos3": Image.Resampling.LANCZOS,
}  # fmt: skip
#: (width, height) before and after: smaller, larger, both, and what has hardly a pixel.
SIZES = [
    ((40, 30), (20, 15)), ((41, 23), (13, 6)), ((9, 7), (31, 17)), ((16, 5), (5, 16)), ((1, 1), (3, 2)),
    ((5, 4), (1, 1)), ((12, 12), (12, 12)),
]  # fmt: skip
every_backend = pytest.mark.parametrize("backend_name", ["numpy", "gl", "opencl", "reference"], indirect=True)


def shown(graph: Any, backend: str, **given: Any) -> Picture:
    with pg.compile(graph, backend=backend, non_finite="keep") as program:
        return np.array(program(**given)["resize"])


def noise(size: tuple[int, int], seed: int = 5) -> Picture:
    """Light of any range, with alpha."""
    made = np.random.default_rng(seed).normal(1.0, 4.0, (size[1], size[0], 4)).astype(np.float32)
    made[..., 3] = np.random.default_rng(seed + 1).random((size[1], size[0]))
    return made


def to(size: tuple[int, int]) -> pg.TargetSpec:
    return pg.target("resize", "rgba32f", size)


@pytest.mark.sampled
@pytest.mark.parametrize("name", PILLOW)
@pytest.mark.parametrize(("before", "after"), SIZES, ids=str)
@every_backend
def test_pixels_are_those_of_pillow(
    name: Any, before: tuple[int, int], after: tuple[int, int], backend_name: str
) -> None:
    frame = noise(before)
    made = shown(resize(FRAME, filter=name, into=to(after)), backend_name, frame=frame)
    channels = [Image.fromarray(np.ascontiguousarray(frame[..., k])).resize(after, PILLOW[name]) for k in range(4)]
    np.testing.assert_allclose(made, np.dstack(channels), atol=2e-5)


def mitchell(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """As the paper writes it with B = C = 1/3, times 18."""
    near = 21.0 * x**3 - 36.0 * x**2 + 16.0
    far = -7.0 * x**3 + 36.0 * x**2 - 60.0 * x + 32.0
    return np.where(x < 1.0, near, np.where(x < 2.0, far, 0.0))


def filter_matrix(length: int, made: int) -> NDArray[np.float64]:
    wide = max(length / made, 1.0)
    away = np.arange(length) + 0.5 - (np.arange(made)[:, None] + 0.5) * (length / made)
    weights = mitchell(np.abs(away) / wide)
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


@pytest.mark.parametrize(("before", "after"), SIZES, ids=str)
@every_backend
def test_mitchell_is_its_formula(before: tuple[int, int], after: tuple[int, int], backend_name: str) -> None:
    frame = noise(before)
    made = shown(resize(FRAME, filter="mitchell", into=to(after)), backend_name, frame=frame)
    down, across = filter_matrix(before[1], after[1]), filter_matrix(before[0], after[0])
    np.testing.assert_allclose(made, np.einsum("ij,jkc,lk->ilc", down, frame, across), atol=2e-5)


@pytest.mark.parametrize("name", [*PILLOW, "mitchell"])
@every_backend
def test_even_pictures_stay_even_at_any_brightness(name: Any, backend_name: str) -> None:
    frame = np.full((11, 17, 4), 6e4, np.float32)
    np.testing.assert_allclose(shown(resize(FRAME, 0.37, name), backend_name, frame=frame), 6e4, rtol=1e-6)


@pytest.mark.parametrize("name", ["box", "bilinear", "catmull-rom", "lanczos3"])
@every_backend
def test_a_picture_of_its_own_size_keeps_every_bit(name: Any, backend_name: str) -> None:
    """NaN and infinity too, which spread no farther."""
    frame = noise((23, 11))
    frame[4, 7], frame[0, 0, 1] = np.nan, np.inf
    np.testing.assert_array_equal(shown(resize(FRAME, 1.0, name), backend_name, frame=frame), frame)


def test_sizes_are_a_share_rounded_up_or_the_targets_own() -> None:
    frame = noise((21, 10))
    for graph, shape in (
        (resize(FRAME, 0.5), (5, 11)), (resize(FRAME, 2.0), (20, 42)), (resize(FRAME, into=to((7, 3))), (3, 7)),
        (resize(FRAME, 0.1, into=pg.target("resize", "rgba16f")), (1, 3)),
        (resize(FRAME, into=pg.target("resize", "rgba8", scale=0.25)), (3, 6)),
    ):  # fmt: skip
        assert shown(graph, "numpy", frame=frame).shape[:2] == shape


def test_a_long_row_is_as_exact_as_a_short_one() -> None:
    """Distances to texels are of whole numbers: at the end of 20,000 texels as at their beginning."""
    frame = np.zeros((1, 20000, 4), np.float32)
    frame[0, [0, 19999]] = 1.0
    made = shown(resize(FRAME, into=to((6999, 1))), "numpy", frame=frame)[0, :, 0]
    np.testing.assert_allclose(made, made[::-1], atol=1e-7)


def test_apply_writes_a_picture_of_the_new_size(tmp_path: Path) -> None:
    """Of numbers as they are stored, which --from-space and --to-space make light."""
    half_white = np.zeros((4, 8, 3), np.uint8)
    half_white[:, ::2] = 255
    Image.fromarray(half_white).save(tmp_path / "in.png")
    out = tmp_path / "out.png"
    assert run(["apply", "resize", str(tmp_path / "in.png"), "-o", str(out), "--scale", "0.5", "--filter", "box"]) == 0
    with Image.open(out) as made:
        assert made.size == (4, 2)
        np.testing.assert_array_equal(np.asarray(made), 128)
