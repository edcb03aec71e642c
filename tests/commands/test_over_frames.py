"""``passgraph apply`` over frames: ``--progress 0..1``, ``--frames``, and the time that a frame lasts."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import passgraph as pg
from passgraph.commands.entry import run
from passgraph.files import Video
from tests.commands.told import refused
from tests.files.made import video
from tests.picture_files import names_in

FADE = "vec4 transition(vec2 p) { return mix(getFromColor(p), getToColor(p), progress); }"
SECONDS = """/*{"INPUTS": [{"NAME": "inputImage", "TYPE": "image"}]}*/
void main() { gl_FragColor = vec4(vec3(TIME) + 0.0 * IMG_THIS_PIXEL(inputImage).rgb, 1.0); }"""
LEVELS = """/*{"INPUTS": [
    {"NAME": "level", "TYPE": "float", "DEFAULT": 0.0},
    {"NAME": "steps", "TYPE": "color", "DEFAULT": [0, 0, 0, 1]}
]}*/ void main() { gl_FragColor = vec4(level, steps.gb, 1.0); }"""
SIZED = """/*{"INPUTS": [{"NAME": "inputImage", "TYPE": "image"}, {"NAME": "side", "TYPE": "float", "DEFAULT": 2.0}],
    "PASSES": [{"TARGET": "small", "WIDTH": "$side", "HEIGHT": "$side"}, {}]}*/
void main() { gl_FragColor = IMG_THIS_PIXEL(inputImage); }"""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PASSGRAPH_BACKEND", "reference")
    for name, text in (("fade.glsl", FADE), ("seconds.fs", SECONDS), ("levels.fs", LEVELS), ("sized.fs", SIZED)):
        Path(name).write_text(text)
    pg.save("black.png", np.zeros((4, 6, 3), np.float32))
    pg.save("white.png", np.ones((4, 6, 3), np.float32))
    return tmp_path


def done(*arguments: str) -> None:
    assert run(["apply", *arguments, "-b", "reference"]) == 0


def reds(pattern: str, count: int) -> list[int]:
    return [round(float(pg.load(pattern % number)[0, 0, 0]) * 255) for number in range(1, count + 1)]


def test_a_transition_goes_from_one_picture_to_the_other() -> None:
    done("fade.glsl", "black.png", "--to", "white.png", "--progress", "0..1", "--frames", "6", "-o", "f.%d.png")
    assert reds("f.%d.png", 6) == [0, 51, 102, 153, 204, 255]


def test_one_frame_is_the_first_value() -> None:
    done("fade.glsl", "black.png", "--to", "white.png", "--progress", "0.2..1", "--frames", "1", "-o", "f.%d.png")
    assert reds("f.%d.png", 1) == [51]


def test_numbers_of_files_are_the_way() -> None:
    """A gap in a sequence is a gap in the ramp, so that frames can be made anew one by one."""
    for number in (3, 4, 8):
        pg.save(f"in.{number}.png", np.zeros((4, 6, 3), np.float32))
    done("fade.glsl", "in.%d.png", "--to", "white.png", "--progress", "0..1", "-o", "f.%d.png")
    found = [round(float(pg.load(f"f.{number}.png")[0, 0, 0]) * 255) for number in (3, 4, 8)]
    assert found == [0, 51, 255]


def test_whole_frames_are_made_of_parameters_alone_and_vectors_change() -> None:
    arguments = ("--level", "1..0", "--steps", "0,0,0,1..0,1,0.4,1", "--frames", "3", "--size", "5x4")
    done("levels.fs", *arguments, "-o", "l.%d.npy")
    middle = np.load("l.2.npy")
    assert middle.shape == (4, 5, 4)
    np.testing.assert_allclose(middle[0, 0], [0.5, 0.5, 0.2, 1.0], atol=1e-3)  # rgba16f


def test_a_folder_gets_numbered_pictures() -> None:
    done("fade.glsl", "black.png", "--frames", "3", "-o", "out/")
    assert names_in("out") == [f"black.{n:04d}.png" for n in (1, 2, 3)]


def test_resume_makes_what_is_missing() -> None:
    arguments = ("fade.glsl", "black.png", "--to", "white.png", "--progress", "0..1", "--frames", "6", "-o", "f.%d.png")
    done(*arguments)
    Path("f.3.png").unlink()
    kept = Path("f.4.png").stat().st_mtime_ns
    done(*arguments, "--resume")
    assert reds("f.%d.png", 6) == [0, 51, 102, 153, 204, 255] and Path("f.4.png").stat().st_mtime_ns == kept


def test_time_goes_by_the_rate_of_the_video() -> None:
    """A video of 10 frames a second is at 0.3 s in its fourth frame, and at 0.3 of its brightness here."""
    video(Path("in.mkv"), 5)
    rate = Video(Path("in.mkv")).rate
    done("seconds.fs", "in.mkv", "-o", "t.%d.npy")
    assert [float(np.load(f"t.{n}.npy")[0, 0, 0]) for n in (1, 4)] == pytest.approx([0.0, float(3 / rate)], rel=1e-3)
    done("seconds.fs", "black.png", "--frames", "5", "--rate", "8", "--codec", "ffv1", "-o", "out.mkv")
    last = list(Video(Path("out.mkv")))[-1].read()
    assert Video(Path("out.mkv")).rate == Fraction(8) and abs(int(last[0, 0, 0]) - 128) <= 2  # 4 / 8 s


def test_a_time_that_is_given_stays() -> None:
    video(Path("in.mkv"), 3)
    done("seconds.fs", "in.mkv", "--time-step", "0.25", "-o", "t.%d.npy")
    assert float(np.load("t.3.npy")[0, 0, 0]) == 0.5


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("fade.glsl", "black.png", "--progress", "0..1", "-o", "f.png"), "--progress 0..1: changes over frames"),
        (("fade.glsl", "black.png", "--progress", "0..1.5", "--frames", "3", "-o", "f.%d.png"), "1.5 is not in"),
        (("fade.glsl", "black.png", "--progress", "0..", "--frames", "3", "-o", "f.%d.png"), "'' is not a valid float"),
        (("fade.glsl", "black.png", "--progress", "0..1..0", "--frames", "3", "-o", "f.%d.png"), "'1..0' is not a"),
        (("fade.glsl", "black.png", "--frames", "3", "-o", "f.png"), "there are 3 frames of black.png"),
        (("fade.glsl", "black.png", "--frames", "0", "-o", "f.%d.png"), "0 is not in the range"),
        (("fade.glsl", "black.png", "white.png", "--frames", "2", "-o", "f.%d.png"), "--frames 2: is for one picture"),
        (("fade.glsl", "black.png", "white.png", "-o", "f.png"), "is an option: black.png --to white.png"),
        (("levels.fs", "-o", "f.png", "--rate", "8"), "are for videos, and none is written"),
        (("fade.glsl", "black.png", "-o", "f.png", "--codec", "ffv1"), "are for videos, and none is written"),
        (("levels.fs", "-o", "f.mp4"), "say how many: --frames 100"),
        (("levels.fs", "--level", "0..1", "-o", "f.png"), "--level 0..1: changes over frames"),
        (("levels.fs", "--frames", "2", "--profile", "-o", "f.%d.png"), "--profile times the passes on one picture"),
        (("levels.fs", "--frames", "2", "-o", "out/"), "nothing names the files of frames"),
        (("sized.fs", "black.png", "--side", "1..3", "--frames", "3", "-o", "f.%d.png"), "--side: cannot change"),
        (("gaussian-blur", "black.png", "--sigma-px", "0..3", "--frames", "3", "-o", "f.%d.png"), "value; give one"),
    ],
)  # fmt: skip
def test_what_cannot_change_is_refused(
    capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], says: str
) -> None:
    assert says in refused(capsys, "apply", *arguments, "-b", "reference")


def test_an_author_hears_how_a_parameter_can_change(capsys: pytest.CaptureFixture[str]) -> None:
    Path("own.py").write_text("""
import passgraph as pg
from passgraph.effects import gaussian_blur
from passgraph.effects.checked import effect

@effect("softer")
def softer(color: pg.Target, width: float = 1.0) -> pg.Target:
    return gaussian_blur(color, width * 2.0)
""")
    line = ("own.py", "black.png", "--width", "0..3", "--frames", "3", "-o", "f.%d.png", "-b", "reference")
    assert "value; give one, or annotate it with | pg.Value, and use it in kernels only" in refused(
        capsys, "apply", *line
    )


def test_a_stream_has_no_last_frame(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    with Path("black.png").open("rb") as stream:
        monkeypatch.setattr("sys.stdin", type("Stream", (), {"buffer": stream})())
        assert "does not say how many there are" in refused(
            capsys, "apply", "fade.glsl", "-", "--progress", "0..1", "-o", "f.%d.png", "-b", "reference"
        )


def test_other_commands_take_one_value(capsys: pytest.CaptureFixture[str]) -> None:
    assert "'0..1' is not a valid float" in refused(capsys, "compare", "fade.glsl", "black.png", "--progress", "0..1")
