"""Tiles from and to TIFF files, Zarr stores, memory maps and dask arrays; files are whole or not there."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import dask.array
import numpy as np
import pytest
import tifffile
import zarr
from PIL import Image as pillow

import passgraph as pg
from passgraph.tiles.grid import block_of
from passgraph.tiles.sources import Blocks, open_source
from tests.files.tile_graphs import frame, kernel, same, untiled

SIZE = (301, 211)
TILE = (100, 64)


def stored(dtype: str, channels: int = 3) -> Any:
    values = np.random.default_rng(5).random((SIZE[1], SIZE[0], channels))
    high = {"u1": 255, "u2": 65535}.get(dtype[-2:])
    made = values * high if high else values
    return (made if channels > 1 else made[:, :, 0]).astype(dtype)


def soft(format_: str = "rgb32f") -> pg.Target:
    made: pg.Target = kernel("soft3")(frame(), into=pg.target("soft", format_))
    return made


def tiled(source: Any, sink: Any, format_: str = "rgb32f", **options: Any) -> None:
    pg.tiled(soft(format_), source, sink, **{"tile": TILE, "progress": False, **options})


def left(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


# Sources


@pytest.mark.parametrize("dtype", ["u1", "u2", ">u2", "f2", "f4", "f8"])
@pytest.mark.parametrize(
    "layout",
    [
        {},
        {"rowsperstrip": 7},
        {"tile": (64, 48)},
        {"tile": (64, 48), "planarconfig": "separate"},
        {"planarconfig": "separate", "rowsperstrip": 9},
        {"compression": "zlib", "rowsperstrip": 13},
        {"compression": "zlib", "tile": (32, 64), "bigtiff": True},
        {"bigtiff": True, "rowsperstrip": 211},
    ],
    ids=lambda layout: "-".join(map(str, layout.values())) or "plain",
)
def test_tiff_files_of_every_layout(dtype: str, layout: dict[str, Any], tmp_path: Path) -> None:
    picture = stored(dtype)
    given = np.moveaxis(picture, 2, 0) if layout.get("planarconfig") == "separate" else picture
    order = ">" if dtype[0] == ">" else "<"
    tifffile.imwrite(tmp_path / "in.tif", given, photometric="rgb", byteorder=order, **layout)
    source = open_source(tmp_path / "in.tif", "input", 1 << 20)
    assert source.shape == (SIZE[1], SIZE[0], 3)
    for top, bottom, left_, right in [(0, 211, 0, 301), (60, 70, 40, 300), (210, 211, 300, 301), (0, 211, 7, 8)]:
        assert same(source.read((top, bottom, left_, right)), picture[top:bottom, left_:right])
    source.close()


@pytest.mark.parametrize("channels", [1, 2, 4])
def test_tiff_files_of_other_channels(channels: int, tmp_path: Path) -> None:
    picture = stored("u1", channels)
    tifffile.imwrite(tmp_path / "in.tif", picture, photometric="rgb" if channels > 2 else "minisblack",
                     planarconfig="contig" if channels > 1 else None, tile=(64, 64))  # fmt: skip
    source = open_source(tmp_path / "in.tif", "input", 1 << 20)
    assert same(source.read((3, 200, 5, 300)), picture.reshape(*SIZE[::-1], channels)[3:200, 5:300])
    source.close()


def test_tiles_left_out_of_a_tiff_file_are_zero(tmp_path: Path) -> None:
    tiles = iter([np.full((64, 64), 9, np.uint8), None, None, None])
    tifffile.imwrite(tmp_path / "in.tif", tiles, shape=(128, 128), dtype="u1", tile=(64, 64))
    source = open_source(tmp_path / "in.tif", "input", 1 << 20)
    assert source.read((0, 128, 0, 128)).sum() == 9 * 64 * 64
    source.close()


def test_what_no_tile_can_be_read_from_is_told(tmp_path: Path) -> None:
    tifffile.imwrite(tmp_path / "turned.tif", stored("u1"), photometric="rgb", extratags=[(274, "H", 1, 6, True)])
    tifffile.imwrite(tmp_path / "ink.tif", stored("u1", 4), photometric="separated")
    (tmp_path / "broken.tif").write_bytes(b"II*\0not a picture")
    (tmp_path / "photo.png").write_bytes(b"")
    zarr.open_group(tmp_path / "group.zarr", mode="w").create_array("level0", shape=(4, 4), dtype="u1")
    (tmp_path / "empty.zarr").mkdir()
    for name, text in {
        "turned.tif": "is stored turned (tag Orientation); turn it upright first",
        "ink.tif": "is SEPARATED; expected gray (MINISBLACK) or RGB",
        "broken.tif": "is no TIFF file that can be read",
        "photo.png": "tiles come from TIFF (.tif, .tiff), OpenEXR (.exr), Zarr (.zarr), or an array",
        "group.zarr": "is a Zarr group; give the path of one of its arrays: level0",
        "empty.zarr": "cannot be read as Zarr",
    }.items():
        with pytest.raises(pg.InputError) as caught:
            open_source(tmp_path / name, "input 'frame'", 0)
        assert text in str(caught.value)
        assert name in str(caught.value)


def test_predictors_are_undone(tmp_path: Path) -> None:
    tifffile.imwrite(tmp_path / "in.tif", stored("u2"), photometric="rgb", predictor=True, compression="zlib")
    source = open_source(tmp_path / "in.tif", "input", 1 << 20)
    assert same(source.read((0, 211, 0, 301)), stored("u2"))
    source.close()


def test_a_compression_that_needs_a_package_names_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pillow.fromarray(stored("u1")).save(tmp_path / "in.tif", compression="tiff_lzw")

    def decode(*_: Any) -> None:
        raise ValueError("<COMPRESSION.LZW: 5> requires the 'imagecodecs' package")

    monkeypatch.setattr("passgraph.tiles.tiff.TiffSource._decode", decode)
    with pytest.raises(pg.InputError, match=r"in.tif\): .* requires the 'imagecodecs' package, which decodes it; inst"):
        tiled(tmp_path / "in.tif", tmp_path / "out.tif")
    assert left(tmp_path) == ["in.tif"]


def test_blocks_that_do_not_fit_are_told(tmp_path: Path) -> None:
    tifffile.imwrite(tmp_path / "in.tif", np.zeros((3000, 2000, 3), np.uint8), photometric="rgb", compression="zlib",
                     rowsperstrip=3000)  # fmt: skip
    with pytest.raises(pg.InputError, match=r"in.tif\) is stored in blocks of 2000x3000 pixels, which takes 54 MB"):
        tiled(tmp_path / "in.tif", np.zeros((3000, 2000, 3), np.uint8), memory="50 MB")


def test_blocks_are_read_once_row_by_row(tmp_path: Path) -> None:
    """Neighbouring tiles share the blocks at their edges, which are decoded for the first of them."""
    tifffile.imwrite(tmp_path / "in.tif", stored("u1"), photometric="rgb", tile=(32, 32), compression="zlib")
    source = open_source(tmp_path / "in.tif", "input", 1 << 20)
    assert isinstance(source, Blocks)
    read, seen = source.source.read, []
    source.source.read = lambda part: seen.append(part) or read(part)
    for top in range(0, 211, 32):
        for column in range(0, 301, 96):
            source.read((max(0, top - 7), min(211, top + 39), max(0, column - 7), min(301, column + 103)))
    assert len(seen) == len(set(seen)) == 7 * 10
    source.close()


@pytest.mark.parametrize("kind", ["zarr", "zarr store", "memmap", "dask", "list"])
def test_arrays_of_every_kind_are_sources(kind: str, tmp_path: Path) -> None:
    picture = stored("u1")
    given: Any = {
        "zarr": lambda: zarr.create_array(store=str(tmp_path / "a.zarr"), data=picture, chunks=(64, 50, 3)),
        "zarr store": lambda: (
            zarr.create_array(store=str(tmp_path / "a.zarr"), data=picture, chunks=(64, 50, 2)) and tmp_path / "a.zarr"
        ),
        "memmap": lambda: np.memmap(tmp_path / "a.raw", np.uint8, "w+", shape=picture.shape),
        "dask": lambda: dask.array.from_array(picture, chunks=(50, 80, 3)),
        "list": lambda: (picture / np.float32(255)).tolist(),
    }[kind]()
    if kind == "memmap":
        given[:] = picture
    result = np.zeros(picture.shape, np.float32)
    tiled(given, result)
    assert same(result, untiled(soft(), frame=picture))


# Sinks


@pytest.mark.parametrize("format_", ["rgb8", "rgb16", "rgb16f", "rgb32f"])
@pytest.mark.parametrize("suffix", ["tif", "zarr"])
def test_new_files_hold_the_targets_numbers(format_: str, suffix: str, tmp_path: Path) -> None:
    picture, path = stored("u1"), tmp_path / f"out.{suffix}"
    tiled(picture, path, format_)
    found = tifffile.imread(path) if suffix == "tif" else zarr.open(str(path), mode="r")[:]
    expected = untiled(soft(format_), frame=picture)
    steps = {"rgb8": 255, "rgb16": 65535}.get(format_)
    assert found.dtype == {"rgb8": "u1", "rgb16": "u2", "rgb16f": "f2", "rgb32f": "f4"}[format_]
    assert same(found / np.float32(steps) if steps else found.astype(np.float32), expected)
    assert left(tmp_path) == [path.name]


def test_a_tiff_file_is_read_by_others(tmp_path: Path) -> None:
    picture = stored("u1")
    tiled(picture, tmp_path / "out.tif", "rgb8")
    expected = np.rint(untiled(soft("rgb8"), frame=picture) * 255)
    with pillow.open(tmp_path / "out.tif") as opened:
        assert same(np.asarray(opened), expected)


@pytest.mark.parametrize("channels", [1, 2, 4])
def test_other_channels_are_written(channels: int, tmp_path: Path) -> None:
    kernels = {1: "float: return color[0, 0].r", 2: "vec2: return color[0, 0].rg", 4: "vec4: return color[0, 0]"}
    copy = pg.kernel(source=f"def copy(color: Image) -> {kernels[channels]}")
    picture = stored("u1", 4)
    for path in (tmp_path / "out.tif", tmp_path / "out.zarr"):
        made = copy(frame(), into=pg.target("made", {1: "r8", 2: "rg8", 4: "rgba8"}[channels]))
        pg.tiled(made, picture, path, tile=TILE, progress=False)
    assert same(tifffile.imread(tmp_path / "out.tif").reshape(*SIZE[::-1], channels), picture[:, :, :channels])
    assert same(zarr.open(str(tmp_path / "out.zarr"), mode="r")[:], picture[:, :, :channels])


@pytest.mark.parametrize("dtype", ["u1", "u2", "f2", "f8"])
def test_results_become_what_is_asked_for(dtype: str, tmp_path: Path) -> None:
    picture = stored("u1")
    expected = untiled(soft(), frame=picture)
    steps = {"u1": 255, "u2": 65535}.get(dtype)
    numbers = (np.rint(expected * np.float32(steps)) if steps else expected).astype(dtype)
    tiled(picture, tmp_path / "out.tif", dtype=dtype)
    assert same(tifffile.imread(tmp_path / "out.tif"), numbers)
    for array in (
        np.zeros(picture.shape, dtype),
        np.memmap(tmp_path / "a.raw", dtype, "w+", shape=picture.shape),
        zarr.create_array(store=str(tmp_path / "a.zarr"), shape=picture.shape, dtype=dtype, chunks=(90, 70, 3)),
    ):
        tiled(picture, array)
        assert same(array[:], numbers)


def test_shards_are_written_once() -> None:
    store = zarr.storage.MemoryStore()
    array = zarr.create_array(store=store, shape=(512, 512, 4), dtype="u1", chunks=(32, 32, 4), shards=(128, 128, 4))
    assert block_of(array) == (32, 32)
    assert block_of(array, written=True) == (128, 128)


def test_a_gray_result_fits_an_array_without_channels() -> None:
    luma = pg.kernel(source="def luma(color: Image) -> float: return dot(color[0, 0].rgb, vec3(0.25, 0.5, 0.25))")
    graph = luma(frame(), into=pg.target("luma", "r32f"))
    picture, result = stored("u1"), np.zeros(SIZE[::-1], np.float32)
    pg.tiled(graph, picture, result, tile=TILE, progress=False)
    assert same(result[:, :, None], untiled(graph, frame=picture))


def test_a_dask_array_holds_no_numbers() -> None:
    with pytest.raises(pg.InputError, match="is a dask array, which holds what is to be computed and no numbers"):
        tiled(stored("u1"), dask.array.zeros((*SIZE[::-1], 3)))


def test_dtypes_that_cannot_be_written(tmp_path: Path) -> None:
    for dtype, text in {"bool": "dtype bool cannot be written", "i4": "has dtype int32", "lots": "got 'lots'"}.items():
        with pytest.raises(pg.InputError, match=text):
            tiled(stored("u1"), tmp_path / "out.tif", dtype=dtype)
    assert left(tmp_path) == []


# Whole or not at all


@pytest.mark.parametrize("suffix", ["tif", "zarr"])
def test_a_file_is_replaced_when_the_new_one_is_whole(suffix: str, tmp_path: Path) -> None:
    path, seen = tmp_path / f"out.{suffix}", []
    tiled(stored("u1"), path)
    before = path.stat().st_ino

    def stop(done: int, total: int) -> None:
        seen.append(left(tmp_path))
        if done == 2:
            raise RuntimeError("stopped")

    with pytest.raises(RuntimeError, match="stopped"):
        tiled(stored("u1"), path, progress=stop)
    assert len(seen[0]) == 2
    assert left(tmp_path) == [path.name]
    assert path.stat().st_ino == before
    tiled(stored("u1"), path)
    assert left(tmp_path) == [path.name]
    assert path.stat().st_ino != before


@pytest.mark.parametrize("compression", [None, "zlib"])
def test_a_truncated_source_leaves_nothing_behind(compression: str | None, tmp_path: Path) -> None:
    file = tmp_path / "in.tif"
    tifffile.imwrite(file, stored("u1"), photometric="rgb", rowsperstrip=8, compression=compression)
    os.truncate(file, file.stat().st_size * 2 // 3)
    with pytest.raises(
        pg.InputError, match=r"in.tif\): (ends before its picture does|truncated or corrupt|is no TIFF)"
    ):
        tiled(file, tmp_path / "out.tif")
    assert left(tmp_path) == ["in.tif"]


def test_a_broken_chunk_is_told(tmp_path: Path) -> None:
    zarr.create_array(store=str(tmp_path / "in.zarr"), data=stored("u1"), chunks=(64, 64, 3))
    (tmp_path / "in.zarr" / "c" / "2" / "1" / "0").write_bytes(b"no chunk")
    with pytest.raises(pg.InputError, match=r"in.zarr\): truncated or corrupt at rows 128 to 192 \("):
        tiled(tmp_path / "in.zarr", tmp_path / "out.zarr")
    assert left(tmp_path) == ["in.zarr"]


def test_a_full_disk_leaves_nothing_behind(tmp_path: Path) -> None:
    """A limit on the size of files stands for it."""
    soft_limit, hard_limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    picture = np.zeros((1100, 1000, 3), np.uint8)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2 << 20, hard_limit))
    try:
        with pytest.raises(pg.InputError, match=r"out.tif\): cannot be written \(.*; check the folder's permissions"):
            tiled(picture, tmp_path / "out.tif", "rgb8", tile=(1000, 256))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft_limit, hard_limit))
    assert left(tmp_path) == []


def test_a_killed_process_leaves_the_older_file(tmp_path: Path) -> None:
    code = f"""
import os
import numpy as np
from tests.files.test_tiles_files import tiled, stored
tiled(stored("u1"), {str(tmp_path / "out.tif")!r}, progress=lambda done, total: os._exit(9))
"""
    (tmp_path / "out.tif").write_bytes(b"older")
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=Path(__file__).parents[2])
    assert run.returncode == 9, run.stderr
    assert (tmp_path / "out.tif").read_bytes() == b"older"


@pytest.mark.parametrize("suffix", ["tif", "zarr"])
def test_a_file_may_be_source_and_sink(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"both.{suffix}"
    tiled(stored("u1"), path, "rgb8")
    expected = untiled(soft("rgb8"), frame=untiled(soft("rgb8"), frame=stored("u1")))
    tiled(path, path, "rgb8")
    found = tifffile.imread(path) if suffix == "tif" else zarr.open(str(path), mode="r")[:]
    assert same(found / np.float32(255), expected)
    assert left(tmp_path) == [path.name]


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "link.tif").symlink_to(tmp_path / "real" / "out.tif")
    tiled(stored("u1"), tmp_path / "link.tif")
    assert (tmp_path / "link.tif").is_symlink()
    assert left(tmp_path / "real") == ["out.tif"]


MEASURED = """
import sys
import passgraph as pg
from tests.files.tile_graphs import frame, kernel
from passgraph.effects.filters.blur import gaussian_blur
import numpy as np, tifffile

def held(what):
    # What getrusage tells begins with the process that started this one.
    lines = open("/proc/self/status").read().splitlines()
    return next(1024 * int(line.split()[1]) for line in lines if line.startswith(what))

graph = kernel("soft3")(kernel("soft3")(frame(), into=pg.target("first", "rgb32f")), into=pg.target("soft", "rgb8"))
pg.tiled(graph, np.zeros((64, 64, 3), np.uint8), np.zeros((64, 64, 3), np.uint8))
before = held("VmRSS:")
grid = pg.tiled(graph, sys.argv[1], sys.argv[2], memory="150 MB")
print(len(grid), grid.bytes, held("VmHWM:") - before)
"""


def test_memory_stays_below_what_was_counted(tmp_path: Path) -> None:
    """The picture alone takes 230 MB as float32, and the whole run would take 1 GB."""
    file = tmp_path / "in.tif"
    with tifffile.TiffWriter(file) as writer:
        writer.write(np.full((4000, 4800, 3), 77, np.uint8), photometric="rgb", tile=(256, 256))
    command = [sys.executable, "-c", MEASURED, str(file), str(tmp_path / "out.tif")]
    run = subprocess.run(command, capture_output=True, text=True, cwd=Path(__file__).parents[2])
    assert run.returncode == 0, run.stderr
    tiles, counted, taken = map(int, run.stdout.split())
    assert tiles > 8
    assert counted <= 150_000_000
    assert taken <= counted
    assert (tifffile.imread(tmp_path / "out.tif") == 77).all()


def _notes_and_channels(path: Path) -> tuple[int, bytes, float]:
    with tifffile.TiffFile(path) as made:
        page = made.pages[0]
        resolution = page.tags.valueof(282, (0, 1))
        return page.samplesperpixel, page.tags.valueof(34675, b""), resolution[0] / resolution[1]


@pytest.mark.parametrize("dtype", ["u1", "u2", "f4"])
def test_a_result_has_the_channels_and_notes_of_its_source(tmp_path: Path, dtype: str) -> None:
    """Alpha is left out until a pixel has some; then the whole file has it."""
    from PIL import ImageCms

    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    picture = (np.random.default_rng(0).random((600, 700, 3)) * 255).astype(np.uint8)
    tifffile.imwrite(
        tmp_path / "a.tif", picture, photometric="rgb", iccprofile=profile, resolution=(300, 300), resolutionunit="INCH"
    )
    same = pg.kernel(source="def same(c: Image) -> vec4: return c[0, 0]")
    holed = pg.kernel(
        source="def holed(c: Image) -> vec4:\n"
        "    return vec4(c[0, 0].rgb, 0.0 if pixel().x > 600 and pixel().y > 500 else 1.0)"
    )
    made = {}
    for graph, channels in ((same, 3), (holed, 4)):
        path = tmp_path / f"{channels}.tif"
        pg.tiled(graph(pg.Input("c")), tmp_path / "a.tif", path, dtype=dtype, tile=(256, 256), progress=False)
        assert _notes_and_channels(path) == (channels, profile, 300)
        made[channels] = tifffile.imread(path).astype(np.float64) / (1 if dtype == "f4" else np.iinfo(dtype).max)
    assert np.abs(made[3] - picture / 255).max() < 1e-6
    assert np.array_equal(made[4][..., :3], made[3])
    hole = np.zeros((600, 700), bool)
    hole[501:, 601:] = True
    assert np.array_equal(made[4][..., 3], np.where(hole, 0.0, 1.0))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["3.tif", "4.tif", "a.tif"]


@pytest.mark.parametrize(("kinds", "warns"), [((0, 0), True), ((0, 1, 1), False)])
def test_a_stack_is_read_with_a_warning(kinds: tuple[int, ...], warns: bool, tmp_path: Path) -> None:
    with tifffile.TiffWriter(tmp_path / "in.tif") as writer:
        for kind in kinds:
            writer.write(stored("u1"), photometric="rgb", subfiletype=kind)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        open_source(tmp_path / "in.tif", "input", 1 << 20).close()
    words = [str(one.message) for one in told]
    assert (
        words
        == [
            f"input ({tmp_path / 'in.tif'}): holds several pictures; the first is read. Read the others with "
            "tifffile, and pass arrays"
        ]
        * warns
    )
