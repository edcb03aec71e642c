"""Layers of OpenEXR files on the command line and in `passgraph.frames`: as INPUT, depth and further pictures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.commands import main
from passgraph.files import ToArrays

openexr = pytest.importorskip("OpenEXR")
NAMES = ("R", "G", "B", "Z", "diffuse.R", "diffuse.G", "diffuse.B", "forward.u", "forward.v")
rng = np.random.default_rng(4)


def apply(*words: str) -> int:
    with pytest.raises(SystemExit) as ended:
        main(["apply", *words])
    return int(ended.value.code or 0)


@pytest.fixture
def shots(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[int, dict[str, Any]]:
    """Frames 1 and 2 in the current folder, with their channels."""
    monkeypatch.chdir(tmp_path)
    values = {number: {name: rng.random((6, 8), np.float32) for name in NAMES} for number in (1, 2)}
    for number, channels in values.items():
        channels["forward.u"][:], channels["forward.v"][:] = 4, 0
        openexr.File({}, dict(channels)).write(f"shot.{number:04d}.exr")
    return values


def diffuse(channels: dict[str, Any]) -> Any:
    return np.stack([channels[f"diffuse.{letter}"] for letter in "RGB"], axis=-1)


SAME = ("gaussian-blur", "--radius-px", "0")


@pytest.mark.parametrize(
    "inputs",
    [
        ("shot.%04d.exr:diffuse",),
        ("shot.*.exr:diffuse",),
        ("shot.0001.exr:diffuse", "shot.0002.exr:diffuse"),
        ("shot.####.exr", "--layer", "diffuse"),
        (".", "--layer", "diffuse"),
    ],
)
def test_a_layer_of_each_frame(shots: dict[int, dict[str, Any]], inputs: tuple[str, ...]) -> None:
    assert apply(*SAME, *inputs, "-o", "out/") == 0
    for number, channels in shots.items():
        assert np.array_equal(pg.load(f"out/shot.{number:04d}.exr")[..., :3], diffuse(channels))


@pytest.mark.parametrize("words", [("shot.0001.exr:diffuse",), ("shot.0001.exr", "--layer", "diffuse")])
def test_a_layer_of_one_file(shots: dict[int, dict[str, Any]], words: tuple[str, ...]) -> None:
    assert apply(*SAME, *words, "-o", "out.exr") == 0
    assert np.array_equal(pg.load("out.exr")[..., :3], diffuse(shots[1]))


def test_frames_read_a_layer(shots: dict[int, dict[str, Any]]) -> None:
    same = pg.kernel(source="def same(color: Image) -> vec4: return color[0, 0]")
    made = ToArrays()
    with pg.compile(same(pg.Input("frame")), backend="reference") as program:
        assert pg.frames(program, "shot.%04d.exr:diffuse", made).whole
    assert np.array_equal(made.pictures[1][..., :3], diffuse(shots[2]))


@pytest.mark.parametrize("depth", ["shot.%04d.exr:Z", "shot.0001.exr:Z"])
def test_depth_from_the_same_files(shots: dict[int, dict[str, Any]], depth: str) -> None:
    for number, channels in shots.items():
        pg.save(f"z.{number}.exr", (channels if "%" in depth else shots[1])["Z"])
    assert apply("fog", "shot.%04d.exr", "--depth", depth, "-o", "fog.%04d.exr") == 0
    assert apply("fog", "shot.%04d.exr", "--depth", "z.%d.exr", "-o", "expected.%04d.exr") == 0
    for number in shots:
        assert np.array_equal(pg.load(f"fog.{number:04d}.exr"), pg.load(f"expected.{number:04d}.exr"))


@pytest.mark.parametrize("velocity", ["array.npy", "shot.0001.exr:forward", "shot.%04d.exr:forward"])
def test_motion_has_two_channels(shots: dict[int, dict[str, Any]], velocity: str) -> None:
    """Four pixels to the right, as a picture with blue 0 says."""
    motion = np.zeros((6, 8, 3), np.float32)
    motion[..., 0] = 4
    np.save("array.npy", motion[..., :2])
    pg.save("motion.exr", motion)
    blur = ("motion-blur", "shot.%04d.exr", "--depth", "shot.0001.exr:Z", "--velocity")
    assert apply(*blur, "motion.exr", "-o", "expected.%d.exr") == 0
    assert apply(*blur, velocity, "-o", "found.%d.exr") == 0
    assert np.array_equal(pg.load("found.2.exr"), pg.load("expected.2.exr"))
    assert not np.array_equal(pg.load("found.2.exr"), pg.load("shot.0002.exr"))


def test_a_file_is_not_overwritten_by_one_of_its_layers(
    shots: dict[int, dict[str, Any]], capsys: pytest.CaptureFixture[str]
) -> None:
    assert apply(*SAME, "shot.0001.exr:diffuse", "-o", "shot.0001.exr") == 2
    assert "would overwrite the input" in capsys.readouterr().err


def test_resume_knows_files_of_layers(shots: dict[int, dict[str, Any]], capsys: pytest.CaptureFixture[str]) -> None:
    for _ in range(2):
        assert apply(*SAME, "shot.%04d.exr:diffuse", "-o", "out.%d.exr", "--resume") == 0
    assert "2 frames there already" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ("photo.png", "--layer", "diffuse"),
            "--layer diffuse: is for OpenEXR files (.exr), and hdr for JPEG files (.jpg), got photo.png",
        ),
        (("shot.0001.exr", "--layer", "spec"), "no layer 'spec'; it has Z, diffuse, forward"),
    ],
)
def test_layers_that_are_not_there(
    shots: dict[int, dict[str, Any]], words: tuple[str, ...], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    pg.save("photo.png", np.zeros((2, 2)))
    assert apply(*SAME, *words, "-o", "out.png") == 2
    assert said in capsys.readouterr().err
