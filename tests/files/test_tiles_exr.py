"""Tiles from and to OpenEXR files: scanlines, tiles, layers, windows and associated alpha."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
import tifffile

import passgraph as pg
from passgraph.tiles.exr import TILE
from passgraph.tiles.sources import open_source
from tests.files.tile_graphs import frame

HEIGHT, WIDTH = 211, 301
rng = np.random.default_rng(6)


def exr(path: Path, pixels: Any, names: str = "RGBA", kind: str = "float", **how: Any) -> Path:
    """An OpenEXR file; ``display`` is the window (x, y, width, height) that is shown."""
    display = how.pop("display", None)
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind)
    spec.channelnames = tuple(names.split() if " " in names else names)
    spec.tile_width, spec.tile_height = how.pop("tile", (0, 0))
    if display is not None:
        spec.full_x, spec.full_y, spec.full_width, spec.full_height = display
    for name, value in how.items():
        spec.attribute(name, value)
    made: Any = oiio.ImageOutput.create("openexr")
    assert made.open(str(path), spec), made.geterror()
    assert made.write_image(np.ascontiguousarray(pixels, np.float32)), made.geterror()
    made.close()
    return path


def pixels_of(channels: int) -> Any:
    values = rng.random((HEIGHT, WIDTH, channels)).astype(np.float32)
    if channels == 4:
        values[..., 3] = 2.0 ** rng.integers(-2, 1, (HEIGHT, WIDTH))  # exact quotients
    return values


SOFT = pg.kernel(source="def soft(c: Image) -> vec4: return 0.25 * c[-2, 0] + 0.5 * c[1, 3] + 0.25 * c[0, -1]")


def soft() -> pg.Target:
    made: pg.Target = SOFT(frame(), into=pg.target("soft", "rgba32f"))
    return made


def whole(file: Path | str) -> Any:
    """The result of the whole picture, as it is loaded."""
    with pg.compile(soft()) as program:
        return np.array(program(frame=pg.load(file))["soft"])


@pytest.mark.parametrize(
    "how",
    [
        {"compression": "none"}, {"compression": "zip"}, {"compression": "piz"}, {"tile": (48, 32)}, {"kind": "half"},
        {"display": (0, 0, WIDTH, HEIGHT + 9)}, {"display": (-7, 5, WIDTH - 20, HEIGHT - 30), "tile": (32, 48)},
        {"display": (11, -6, WIDTH, HEIGHT), "compression": "zip"},
    ],
    ids=str,
)  # fmt: skip
def test_windows_of_every_layout(how: dict[str, Any], tmp_path: Path) -> None:
    file = exr(tmp_path / "in.exr", pixels_of(4), **how)
    out = tmp_path / "out.exr"
    pg.tiled(soft(), file, out, tile=(100, 64), progress=False)
    np.testing.assert_array_equal(pg.load(out), straight_again(whole(file)))


def straight_again(pixels: Any) -> Any:
    """Color times alpha in float32, divided again."""
    alpha = pixels[..., 3:]
    times = np.where(alpha == 0, 0, pixels[..., :3] * alpha)
    return np.concatenate([times / np.where(alpha == 0, 1, alpha), alpha], axis=2)


@pytest.mark.parametrize(
    "tile", [(100, 64), (64, 100), (1000, 7), (13, 1000), None], ids=lambda tile: str(tile).replace(" ", "")
)
def test_tiles_that_parts_cut_are_written_once(tile: tuple[int, int] | None, tmp_path: Path) -> None:
    file = exr(tmp_path / "in.exr", pixels_of(4))
    pg.tiled(soft(), file, tmp_path / "out.exr", tile=tile, progress=False)
    opened: Any = oiio.ImageInput.open(str(tmp_path / "out.exr"))
    assert (opened.spec().tile_width, opened.spec().tile_height) == (TILE, TILE)
    np.testing.assert_array_equal(pg.load(tmp_path / "out.exr"), straight_again(whole(file)))


@pytest.mark.parametrize(("names", "layer"), [("R G B A glow.R glow.G glow.B Z", "glow"), ("R G B Z", "Z")])
def test_a_layer(names: str, layer: str, tmp_path: Path) -> None:
    file = exr(tmp_path / "in.exr", pixels_of(len(names.split())), names)
    out = np.zeros((HEIGHT, WIDTH, 4), np.float32)
    pg.tiled(soft(), f"{file}:{layer}", out, tile=(100, 64), progress=False)
    np.testing.assert_array_equal(out[..., :3], whole(f"{file}:{layer}")[..., :3])


@pytest.mark.parametrize(("format_", "dtype", "kind"), [("rgba16f", None, "half"), ("rgba32f", "float16", "half"),
                                                        ("rgba8", None, "float"), ("r32f", None, "float")])  # fmt: skip
def test_results_of_every_format(format_: str, dtype: Any, kind: str, tmp_path: Path) -> None:
    file = exr(tmp_path / "in.exr", pixels_of(3), "RGB")
    same = pg.kernel(source=f"def same(c: Image) -> {'float' if format_ == 'r32f' else 'vec4'}: return c[0, 0]"
                            + (".r" if format_ == "r32f" else ""))  # fmt: skip
    graph = same(pg.Input("c"), into=pg.target("same", format_))
    pg.tiled(graph, file, tmp_path / "out.exr", dtype=dtype, progress=False)
    opened: Any = oiio.ImageInput.open(str(tmp_path / "out.exr"))
    assert str(opened.spec().format) == kind
    step = {"half": 2**-11, "float": 0}[kind] if format_ != "rgba8" else 0.51 / 255
    np.testing.assert_allclose(pg.load(tmp_path / "out.exr")[..., 0], pg.load(file)[..., 0], atol=step)


def test_metadata_goes_along(tmp_path: Path) -> None:
    file = exr(tmp_path / "in.exr", pixels_of(4), Artist="Ada")
    pg.tiled(soft(), file, tmp_path / "out.exr", progress=False)
    opened: Any = oiio.ImageInput.open(str(tmp_path / "out.exr"))
    assert opened.spec().getattribute("Artist") == "Ada"


@pytest.mark.parametrize("tag", [["assocalpha"], ["unassalpha"], None])
def test_alpha_of_tiff_is_straight_as_when_loaded(tag: list[str] | None, tmp_path: Path) -> None:
    file = tmp_path / "in.tif"
    tifffile.imwrite(file, pixels_of(4), photometric="rgb", planarconfig="contig", extrasamples=tag or ["unassalpha"])
    if tag is None:
        with tifffile.TiffFile(file, mode="r+") as opened:
            entry = opened.pages[0].tags["ExtraSamples"]
        data = bytearray(file.read_bytes())
        data[entry.offset : entry.offset + 2] = (65000).to_bytes(2, "little")  # no tag of that name
        file.write_bytes(data)
    source = open_source(file, "frame", 1 << 20)
    np.testing.assert_array_equal(source.read((0, HEIGHT, 0, WIDTH)), pg.load(file))
    source.close()


def test_damage_is_an_error_and_leaves_nothing_behind(tmp_path: Path) -> None:
    file = exr(tmp_path / "in.exr", pixels_of(4), compression="zip")
    data = file.read_bytes()
    file.write_bytes(data[: len(data) * 2 // 3])
    with pytest.raises(pg.InputError, match=r"in\.exr: truncated or corrupt"):
        pg.tiled(soft(), file, tmp_path / "out.exr", progress=False)
    assert [path.name for path in tmp_path.iterdir()] == ["in.exr"]
    with pytest.raises(pg.InputError, match="holds float16 or float32, got dtype uint8"):
        pg.tiled(soft(), file, tmp_path / "out.exr", dtype="uint8", progress=False)
    with pytest.raises(pg.InputError, match=r"there is no .*nowhere\.exr"):
        pg.tiled(soft(), tmp_path / "nowhere.exr:Z", tmp_path / "out.exr", progress=False)


MEASURED = """
import sys
import numpy as np
import passgraph as pg
from tests.files.tile_graphs import frame, kernel

def held(what):
    lines = open("/proc/self/status").read().splitlines()
    return next(1024 * int(line.split()[1]) for line in lines if line.startswith(what))

graph = kernel("soft3")(kernel("soft3")(frame(), into=pg.target("first", "rgb32f")), into=pg.target("soft", "rgb16f"))
pg.tiled(graph, sys.argv[3], sys.argv[2])
before = held("VmRSS:")
grid = pg.tiled(graph, sys.argv[1], sys.argv[2], memory="150 MB")
print(len(grid), grid.bytes, held("VmHWM:") - before)
"""


@pytest.mark.slow
@pytest.mark.parametrize("tile", [(0, 0), (256, 256)])
def test_memory_stays_below_what_was_counted(tile: tuple[int, int], tmp_path: Path) -> None:
    """The picture alone takes 230 MB as float32."""
    file = exr(tmp_path / "in.exr", np.full((4000, 4800, 3), 0.25, np.float32), "RGB", "half", tile=tile)
    small = exr(tmp_path / "small.exr", np.zeros((64, 64, 3), np.float32), "RGB", "half", tile=tile)
    command = [sys.executable, "-c", MEASURED, str(file), str(tmp_path / "out.exr"), str(small)]
    run = subprocess.run(command, capture_output=True, text=True, cwd=Path(__file__).parents[2])
    assert run.returncode == 0, run.stderr
    tiles, counted, taken = map(int, run.stdout.split())
    assert tiles > 8
    assert counted <= 150_000_000
    assert taken <= counted
    assert (pg.load(tmp_path / "out.exr")[..., :3] == 0.25).all()
