"""`apply` on pictures that take more than ``--memory``: in tiles, as the whole, or an error whose advice works."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile

import passgraph as pg
from passgraph.commands.large_picture import large_picture
from passgraph.pictures import load_stored
from tests.commands.told import Outcome, refused

HEIGHT, WIDTH = 1500, 2000
#: Less than the whole takes, and more than a tile.
LITTLE = "130MB"


@pytest.fixture(autouse=True)
def in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def scan(channels: int, dtype: str) -> Any:
    numbers = np.random.default_rng(3).random((HEIGHT, WIDTH, channels), np.float32)
    return numbers.astype(np.float32) if dtype == "f4" else (numbers * np.iinfo(dtype).max).astype(dtype)


def made(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    outcome = Outcome(capsys, "apply", *arguments)
    assert outcome.status == 0, outcome.err
    return outcome.out


@pytest.mark.parametrize(
    ("channels", "dtype", "name", "result", "decoding"),
    [
        (3, "u1", "a.tif", "b.tif", "--linear"),
        (4, "u1", "a.tif", "b.png", "--as-stored"),
        (3, "u2", "a.tif", "b.tif", "--linear"),
        (1, "u2", "a.tif", "b.tif", "--as-stored"),
        (1, "u1", "a.png", "b.png", "--linear"),
        (3, "f4", "a.exr", "b.exr", "--as-stored"),
    ],
)
def test_tiles_make_the_same_file_as_the_whole(
    channels: int, dtype: str, name: str, result: str, decoding: str, capsys: pytest.CaptureFixture[str]
) -> None:
    effect = "unsharp", decoding
    if name.endswith(".tif"):
        kind = {"photometric": "rgb", "extrasamples": ["unassalpha"] * (channels == 4)} if channels > 1 else {}
        tifffile.imwrite(name, scan(channels, dtype), **kind)
    else:
        pg.save(name, scan(channels, dtype))
    assert " tiles of " not in made(capsys, *effect, name, "-o", f"whole{result}")
    assert " tiles of " in made(capsys, *effect, name, "-o", result, "--memory", LITTLE)
    whole, tiled = load_stored(Path(f"whole{result}")), load_stored(Path(result))
    assert whole.dtype == tiled.dtype == np.dtype("f4" if dtype == "f4" else dtype)
    assert np.array_equal(whole, tiled)


def test_a_result_larger_than_the_memory_is_written_in_parts(capsys: pytest.CaptureFixture[str]) -> None:
    tifffile.imwrite("a.tif", np.tile(scan(3, "u1"), (4, 4, 1)), photometric="rgb")
    made(capsys, "unsharp", "a.tif", "-o", "b.tif", "--memory", LITTLE)
    with tifffile.TiffFile("b.tif") as file:
        assert file.pages[0].is_tiled
        assert file.pages[0].shape == (4 * HEIGHT, 4 * WIDTH, 3)
    made(capsys, "unsharp", "a.tif", "-o", "whole.tif")
    assert np.array_equal(load_stored(Path("whole.tif")), load_stored(Path("b.tif")))


@pytest.mark.parametrize(("effect", "memory"), [("fxaa", "40MB"), ("unsharp", "3MB"), ("unsharp", "40MB")])
def test_what_an_error_advises_can_be_done(effect: str, memory: str, capsys: pytest.CaptureFixture[str]) -> None:
    pg.save("a.png", scan(3, "u1"))
    text = refused(capsys, "apply", effect, "a.png", "-o", "b.png", "--memory", memory)
    assert "fewer passes" not in text
    for _ in range(3):  # of what is held, then of the tiles
        advised = re.findall(r"ive --memory ([0-9.]+[MG]B)", text)[0]
        outcome = Outcome(capsys, "apply", effect, "a.png", "-o", "b.png", "--memory", advised)
        if outcome.status == 0:
            return
        assert f"ive --memory {advised}" not in outcome.err
        text = outcome.err
    pytest.fail(text)


def test_the_effect_that_needs_the_whole_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    pg.save("a.png", scan(3, "u1"))
    text = refused(capsys, "apply", "fxaa", "a.png", "-o", "b.png", "--memory", "40MB")
    assert "a.png: 2000x1500 pixels take about " in text
    assert "and --memory is 40 MB; the picture cannot be computed tile by tile: pass 'fxaa' reads" in text


def test_small_pictures_are_not_looked_at_twice() -> None:
    pg.save("a.png", np.zeros((20, 30, 3), np.float32))
    assert large_picture(Path("a.png"), False, None, takes_gray=True) is None
