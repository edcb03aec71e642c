"""A still of an effect with history: the frames before it are computed, and it has the time that was asked for."""

from __future__ import annotations

import json
import wave
from pathlib import Path

import numpy as np
import pytest

import passgraph as pg
from tests.commands.told import Outcome, refused

#: The number of frames, the sum of their times, and both of this frame.
SUM = "void mainImage(out vec4 c, in vec2 p) { c = texelFetch(iChannel0, ivec2(p), 0) + vec4(1.0, iTime, 0.0, 0.0); }"
SHOWN = """void mainImage(out vec4 c, in vec2 p) {
    c = vec4(texelFetch(iChannel0, ivec2(p), 0).rg, iTime, float(iFrame));
}"""
NUMBERS = ("-b", "reference", "--size", "4x3")


@pytest.fixture(autouse=True)
def in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    read = [{"channel": 0, "ctype": "buffer", "id": "5"}]
    passes = [
        {"name": "Image", "type": "image", "code": SHOWN, "inputs": read, "outputs": []},
        {"name": "Buffer A", "type": "buffer", "code": SUM, "inputs": read, "outputs": [{"id": "5"}]},
    ]
    Path("sum.json").write_text(json.dumps({"Shader": {"info": {"name": "sum"}, "renderpass": passes}}))


def still(capsys: pytest.CaptureFixture[str], *options: str) -> tuple[list[float], str]:
    outcome = Outcome(capsys, "apply", "sum.json", "-o", "still.npy", *NUMBERS, *options)
    assert outcome.status == 0, outcome.err
    return [round(float(number), 4) for number in pg.load("still.npy")[1, 1]], outcome.err


@pytest.mark.parametrize(
    ("options", "expected", "is_said"),
    [
        ([], [1, 0, 0, 0], False),
        (["--time", "1"], [5, 2.5, 1, 4], True),
        (["--time", "1", "--warm-up", "2"], [3, 2.25, 1, 2], False),
        (["--time", "1", "--warm-up", "0"], [1, 1, 1, 0], False),
        (["--warm-up", "3"], [4, 1.5, 0.75, 3], False),
    ],
)
def test_frames_before_a_still_are_computed(
    options: list[str], expected: list[float], is_said: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    found, said = still(capsys, "--time-step", "0.25", *options)
    assert found == expected
    line = "passgraph: 4 frames are computed before this one, for the effect's history; change it with --warm-up\n"
    assert said == (line if is_said else "")


def test_it_is_the_frame_of_a_sequence_from_second_0(capsys: pytest.CaptureFixture[str]) -> None:
    assert Outcome(capsys, "apply", "sum.json", "-o", "all.%d.npy", "--frames", "7", *NUMBERS).status == 0
    found, _ = still(capsys, "--time", "0.2")
    assert found == [round(float(number), 4) for number in pg.load("all.7.npy")[1, 1]]


def test_most_frames_of_a_mean_are_in_a_still(capsys: pytest.CaptureFixture[str]) -> None:
    rows, columns = np.mgrid[0:24, 0:24]
    np.save("depth.npy", (4.0 - 0.1 * (abs(rows - 12) + columns / 2)).astype(np.float32)[..., None])
    np.save("white.npy", np.ones((24, 24, 3), np.float32))
    options = ("occluded", "white.npy", "--depth", "depth.npy", "-b", "numpy", "--slices", "1", "--most-frames", "8")
    for name, more in (("1", ["--warm-up", "0"]), ("8", []), ("7", ["--warm-up", "7"])):
        assert Outcome(capsys, "apply", *options, "-o", f"{name}.npy", *more).status == 0
    assert (pg.load("8.npy") == pg.load("7.npy")).all()
    assert (pg.load("8.npy") != pg.load("1.npy")).any()


def test_sound_is_heard_in_the_frames_before(capsys: pytest.CaptureFixture[str]) -> None:
    """A click in the first frame is in a sum of all frames, and a still of the last one alone is silent."""
    text = json.loads(Path("sum.json").read_text())
    buffer = text["Shader"]["renderpass"][1]
    buffer["code"] = """void mainImage(out vec4 c, in vec2 p) {
        float heard = abs(texture(iChannel1, vec2(0.5, 0.75)).x - 0.5);
        c = max(texelFetch(iChannel0, ivec2(p), 0), vec4(heard, iTime, 0.0, 0.0));
    }"""
    buffer["inputs"] = [*buffer["inputs"], {"channel": 1, "ctype": "music", "id": "9"}]
    Path("sum.json").write_text(json.dumps(text))
    samples = np.zeros(44100, np.int16)
    samples[:4000] = 30000
    with wave.open("click.wav", "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(44100)
        file.writeframes(samples.tobytes())
    loud, _ = still(capsys, "--audio", "click.wav", "--time", "0.5", "--time-step", "0.05")
    late, _ = still(capsys, "--audio", "click.wav", "--time", "0.5", "--time-step", "0.05", "--warm-up", "0")
    assert loud[0] > 0.3
    assert late[0] < 0.01


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["sum.json", "-o", "a.npy", "--time", "1", "--time-step", "0.5", "--warm-up", "3"],
         "--warm-up 3: second 1 has 2 frames before it"),
        (["sepia", "p.npy", "-o", "a.npy", "--warm-up", "3"],
         "--warm-up 3: sepia reads no earlier frame; leave it out"),
        (["sum.json", "-o", "a.mp4", "--frames", "3", "--warm-up", "3"],
         "--warm-up runs frames before one picture, and --frames makes several pictures; leave out one"),
    ],
)  # fmt: skip
def test_what_cannot_be_warmed_up_is_refused(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    np.save("p.npy", np.ones((2, 2, 3), np.float32))
    assert words in refused(capsys, "apply", *arguments)
