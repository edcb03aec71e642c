"""What cannot be computed in tiles is refused before anything is made, with the pass and the mend."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import dask.array
import numpy as np
import pytest
import tifffile

import passgraph as pg
from passgraph.effects.lens.bloom import bloom
from passgraph.effects.lens.lens import dirty_lens
from tests.files.tile_graphs import GRAPHS, frame, kernel, picture

KERNELS = """
def sampled(color: Image) -> vec4: return color.sample(uv() * 0.5)
def nearby(color: Image) -> vec4: return color.nearest(uv())
def leveled(color: Image) -> vec4: return color.sample(uv(), lod=1.0)
def fetched(color: Image) -> vec4: return color.texel(pixel() // 2)
def kept(color: Image, last: Image) -> vec4: return color[0, 0] * 0.5 + last[0, 0] * 0.5
def copied(color: Image) -> vec4: return color[0, 0]
"""
PICTURE = picture(20, 10)
LATER = dask.array.from_array(PICTURE)
#: Rows that dask knows the number of when it has computed them.
UNKNOWN = LATER[LATER[:, 0, 0] > 0.5]


def made(name: str, *images: pg.Target, **options: Any) -> pg.Target:
    result: pg.Target = pg.kernel(source=KERNELS, name=name)(*images, **options)
    return result


def _history() -> pg.Target:
    spec = pg.target("kept", "rgba32f")
    return made("kept", frame(), pg.previous(spec), into=spec)


def _inside() -> pg.Target:
    """A pass that reads anywhere, fused into one that does not."""
    return made("copied", made("sampled", frame(), into=pg.target("first", "rgba32f")))


@pytest.mark.parametrize(
    ("graph", "text"),
    [
        (lambda: made("sampled", frame()), "pass 'sampled' reads 'frame' at places that it computes (.sample, .texel)"),
        (lambda: made("fetched", frame()), "pass 'fetched' reads 'frame' at places that it computes (.sample, .texel)"),
        (lambda: made("nearby", frame()), "pass 'nearby' reads 'frame' at places that it computes (.sample, .texel)"),
        (lambda: made("leveled", frame().mipmaps()), "pass 'frame level 1' makes 10x5 pixels of"),
        (_inside, "pass 'copied' (with first inside) reads 'frame' at places that it computes"),
        (_history, "pass 'kept' goes on from last run's content (pg.previous) by 'kept'"),
        (lambda: dirty_lens(frame()), "pass 'dirty_lens_scene' draws over the whole picture"),
        (lambda: bloom(frame(), levels=1), "pass 'bloom_down1' makes 10x5 pixels of 'bloom_bright' (20x10)"),
    ],
    ids=["sample", "texel", "nearest", "level", "fused", "previous", "draw", "scaled"],
)  # fmt: skip
def test_a_graph_that_reaches_too_far(graph: Any, text: str) -> None:
    result = np.zeros_like(PICTURE)
    with pytest.raises(pg.GraphError) as caught:
        pg.tiled(graph(), PICTURE, result, tile=(8, 8), progress=False)
    assert text in str(caught.value)
    assert str(caught.value).startswith("the picture cannot be computed tile by tile: ")
    assert str(caught.value).endswith("or run the program on the whole picture")
    assert not result.any()


def test_outputs_of_two_sizes() -> None:
    color = frame()
    half = made("sampled", color, into=pg.target("half", "rgba32f", scale=0.5))
    with pytest.raises(pg.GraphError, match=r"outputs of different sizes .*copied 20x10, half 10x5"):
        pg.tiled([made("copied", color), half], PICTURE, {}, progress=False)


def test_the_reference_runs_kernels_as_written() -> None:
    with pytest.raises(pg.BackendError, match="backend reference cannot compute tiles"):
        pg.tiled(GRAPHS["blur"]("clamp"), PICTURE, PICTURE.copy(), backend="reference", progress=False)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"source": None}, "input 'frame' is missing; give its file or array as the source"),
        ({"source": {"frmae": PICTURE}}, "source: there is no input 'frmae' in this graph; it has frame"),
        ({"source": np.zeros((4, 4, 5), np.float32)}, "must have the shape (h, w) or (h, w, 1 to 4)"),
        ({"source": np.zeros((0, 4, 3), np.float32)}, "at least one pixel"),
        ({"source": np.zeros((4, 4), np.int64)}, "has dtype int64; give uint8, uint16 or floats"),
        ({"source": UNKNOWN}, "must have the shape (h, w)"),
        ({"source": 5}, "input 'frame' must be a path or an array"),
        ({"source": "missing.tif"}, "there is no missing.tif"),
        ({"sink": "out.png"}, "out.png has the suffix '.png'; tiles are written to .tif, .tiff, .exr, .zarr, or "
         "an array"),
        ({"sink": "nowhere/out.tif"}, "the folder"),
        ({"sink": None}, "must be a path (.tif, .tiff, .exr, .zarr) or an array"),
        ({"sink": {"other": PICTURE.copy()}}, "each result (gaussian_blur) and nothing else, got 'other'"),
        ({"sink": np.zeros((10, 20, 3))}, "(10, 20, 3); the result is (height, width, channels) (10, 20, 4)"),
        ({"sink": np.zeros((10, 20, 4), np.int32)}, "has dtype int32"),
        ({"sink": np.zeros((10, 20, 4), bool)}, "has dtype bool"),
        ({"sink": np.broadcast_to(PICTURE, PICTURE.shape)}, "is read-only"),
        ({"sink": PICTURE}, "is the array of input 'frame' too; write into another one"),
        ({"sink": PICTURE.copy(), "dtype": "u1"}, "dtype is for new files; an array keeps its own"),
        ({"memory": "lots"}, "memory must be bytes, such as '1 GB' or '512 MiB', got 'lots'"),
        ({"memory": 0}, "memory (bytes) must be a whole number from 1"),
        ({"tile": (0, 4)}, "tile: each side must be a whole number from 1"),
        ({"tile": 8}, "tile must be (width, height) in pixels, got 8"),
        ({"progress": 3}, "progress must be a function, got 3"),
        ({"values": {"by": 1.0}}, "there is no input or value 'by' in this graph"),
        ({"values": 3}, "values must be a mapping"),
    ],
)  # fmt: skip
def test_arguments_that_do_not_fit(change: dict[str, Any], text: str, tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.chdir(tmp_path)
    given = {"source": PICTURE, "sink": np.zeros_like(PICTURE), "progress": False, **change}
    with pytest.raises(pg.PassgraphError) as caught:
        pg.tiled(GRAPHS["blur"]("clamp"), **given)
    assert text in str(caught.value)


def test_a_program_brings_its_backend() -> None:
    with (
        pg.compile(GRAPHS["blur"]("clamp")) as program,
        pytest.raises(pg.GraphError, match="a program has its backend and options already"),
    ):
        pg.tiled(program, PICTURE, PICTURE.copy(), backend="numpy", progress=False)


def test_a_program_that_looks_at_whole_targets() -> None:
    with (
        pg.compile(GRAPHS["blur"]("clamp"), check_finite=True) as program,
        pytest.raises(pg.GraphError, match="check_finite looks at what passes of a whole run write"),
    ):
        pg.tiled(program, PICTURE, PICTURE.copy(), progress=False)


class Short:
    """An array that does not hold what it says."""

    shape, dtype = (10, 20, 4), np.dtype(np.float32)

    def __getitem__(self, key: Any) -> Any:
        return PICTURE[key][:-1]


def test_an_array_that_gives_less_than_it_says() -> None:
    with pytest.raises(pg.InputError, match=r"rows 0 to 10 and columns 0 to 20 have shape \(9, 20, 4\); expected \(10"):
        pg.tiled(GRAPHS["blur"]("clamp"), Short(), PICTURE.copy(), progress=False)


def test_an_error_of_the_callers_array_is_the_callers() -> None:
    class Failing(Short):
        def __getitem__(self, key: Any) -> Any:
            raise ZeroDivisionError("mine")

    with pytest.raises(ZeroDivisionError, match="mine"):
        pg.tiled(GRAPHS["blur"]("clamp"), Failing(), PICTURE.copy(), progress=False)


def test_a_closed_program() -> None:
    program = pg.compile(GRAPHS["blur"]("clamp"))
    program.close()
    with pytest.raises(pg.GraphError, match="this program is closed"):
        pg.tiled(program, PICTURE, PICTURE.copy(), progress=False)


def test_declared_inputs_take_what_they_declare() -> None:
    graph = kernel("vignette")(pg.Input("frame", "rgba32f", (20, 11)), 0.5)
    with pytest.raises(pg.InputError, match="is 20x10 pixels, and is declared 20x11"):
        pg.tiled(graph, PICTURE, PICTURE.copy(), progress=False)
    graph = kernel("vignette")(pg.Input("frame", "rgb32f"), 0.5)
    with pytest.raises(pg.InputError, match=r"has 4 channel\(s\), and is declared rgb32f"):
        pg.tiled(graph, PICTURE, PICTURE.copy(), progress=False)


def test_what_is_not_finite_is_found_in_its_tile() -> None:
    given = PICTURE.copy()
    given[7, 15, 1] = np.nan
    with pytest.raises(pg.InputError, match=r"(?s)not finite.*counted in a tile that begins at column 8, row 0"):
        pg.tiled(GRAPHS["sobel"]("clamp"), given, np.zeros_like(given), tile=(10, 6), progress=False)


@pytest.mark.parametrize("compression", [None, "zlib"])
@pytest.mark.parametrize(("tag", "tile"), [(278, None), (322, (16, 16)), (323, (16, 16))])
def test_a_tiff_of_empty_strips_or_tiles_is_told(
    tmp_path: Path, tag: int, tile: tuple[int, int] | None, compression: str | None
) -> None:
    """Damage: RowsPerStrip, TileWidth or TileLength is 0."""
    file = tmp_path / "a.tif"
    tifffile.imwrite(file, np.zeros((40, 50, 3), np.uint8), photometric="rgb", tile=tile, compression=compression)
    with tifffile.TiffFile(file) as tiff:
        entry = tiff.pages.first.tags[tag]
        begin, size = entry.valueoffset, 4 if entry.dtype == 4 else 2
    data = bytearray(file.read_bytes())
    data[begin : begin + size] = bytes(size)
    file.write_bytes(data)
    with pytest.raises(pg.InputError, match=r"a\.tif\): says that it has .*; it is corrupt, make or copy it again"):
        pg.tiled(made("copied", frame()), source=file, sink=tmp_path / "b.tif")
