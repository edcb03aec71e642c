"""Pictures without channels are grey, whichever way they come in; one channel of data stays one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects import black_and_white, gaussian_blur

GREY = np.random.default_rng(3).random((9, 13), np.float32)
COPY = "def same(c: Image) -> vec4: return c[0, 0]"


def made(picture: object, input: pg.Target | None = None, backend: str = "numpy") -> np.ndarray:
    with pg.compile(pg.kernel(source=COPY)(input or pg.Input("frame")), backend) as program:
        return program(frame=picture)["same"].copy()


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.uint8, np.uint16, np.bool_])
@pytest.mark.parametrize("backend", ["numpy", "gl", "opencl", "webgpu", "reference"])
def test_an_array_without_channels_is_grey(dtype: type, backend: str) -> None:
    scale = 1 if np.dtype(dtype).kind in "fb" else np.iinfo(dtype).max
    array = (GREY > 0.5 if dtype is np.bool_ else GREY * scale).astype(dtype)
    got = made(array, backend=backend)

    np.testing.assert_allclose(got[..., :3], np.repeat(array[..., None] / scale, 3, axis=2), rtol=1e-6)
    assert (got[..., 3] == 1).all()


def test_effects_on_it_stay_grey_and_keep_their_brightness() -> None:
    for effect in (black_and_white, gaussian_blur):
        with pg.compile(effect(pg.Input("frame"))) as program:
            (got,) = program(frame=np.full((5, 7), 0.25, np.float32)).values()
        np.testing.assert_allclose(got[..., :3], 0.25, rtol=1e-5)


def test_one_channel_of_data_stays_one() -> None:
    expected = np.dstack([GREY, np.zeros_like(GREY), np.zeros_like(GREY), np.ones_like(GREY)])
    np.testing.assert_array_equal(made(GREY[..., None]), expected)
    np.testing.assert_array_equal(made(GREY, pg.Input("frame", "r32f")), expected)


@pytest.mark.parametrize(("format", "dtype", "most"), [("rgba32f", np.float32, 1), ("rgba8", np.uint8, 255)])
def test_it_fills_an_input_that_is_declared_with_colours(format: str, dtype: type, most: int) -> None:
    got = made((GREY * most).astype(dtype), pg.Input("frame", format))
    assert (got[..., 0] == got[..., 1]).all() and (got[..., 1] == got[..., 2]).all() and (got[..., 3] == 1).all()


def test_no_two_channels_become_others() -> None:
    with pytest.raises(pg.InputError, match=r"is rg32f with 2 channel\(s\), got 1"):
        made(GREY, pg.Input("frame", "rg32f"))


def test_dask_and_tiles_make_the_same_of_it(tmp_path: Path) -> None:
    dask_array = pytest.importorskip("dask.array")
    tifffile = pytest.importorskip("tifffile")
    graph = gaussian_blur(pg.Input("frame"), sigma_px=1.0, radius_px=2)
    with pg.compile(graph) as program:
        (whole,) = program(frame=GREY).values()
        blocks = pg.map_blocks(program, dask_array.from_array(GREY, chunks=(4, 5))).compute(scheduler="synchronous")
    np.testing.assert_array_equal(blocks, whole)
    tifffile.imwrite(tmp_path / "grey.tif", GREY)
    for source in (GREY, str(tmp_path / "grey.tif")):
        room = np.zeros_like(whole)
        pg.tiled(graph, source, room, tile=(8, 8))
        np.testing.assert_array_equal(room, whole)


def test_a_grey_file_is_grey(tmp_path: Path) -> None:
    pg.save(tmp_path / "grey.png", GREY)
    picture = pg.load(tmp_path / "grey.png")
    assert (made(picture)[..., 0] == made(picture)[..., 2]).all()
