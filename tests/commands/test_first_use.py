"""The first five minutes: what someone meets who has the README, ``--help`` and errors, and nothing else.

Each test does what a newcomer does, with the text that they should see.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import passgraph as pg
from passgraph.commands.entry import COMMANDS, run
from passgraph.effects.effect_table import EFFECTS
from tests.commands.told import Outcome

MINE = '''
import passgraph as pg
from passgraph import Const, Image, dot, vec3, vec4

@pg.kernel
def black_and_white(
    color: Image, weights: vec3 = (0.2126, 0.7152, 0.0722), gain: float = 1.0, invert: bool = False
) -> vec4:
    """Luma of each pixel (Rec. 709 weights).

    Parameters
    ----------
    weights : share of red, green and blue. They sum to 1.
    gain : times as bright
    """
    c = color[0, 0]
    y = dot(c.rgb, weights) * gain
    if invert:
        y = 1.0 - y
    return vec4(y, y, y, c.a)
'''
DIMMED = '''
from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import passgraph as pg
from passgraph.effects import effect


@dataclass(frozen=True)
class Look:
    share: float


fade = pg.kernel(source="def fade(color: Image, share: float) -> vec4: return color[0, 0] * share")


@effect("dimmed")
def dimmed(frame: pg.Target, share: Annotated[float, pg.Range(0, 1, above=True, unit="of 1")] = 0.5) -> pg.Target:
    """A picture with less light.

    Parameters
    ----------
    frame : any picture
    share : of the light that is left
    """
    return fade(frame, Look(share).share, into=pg.target("dimmed", "rgba32f"))
'''
MIXED = """
def mixed(color: Image, other: Image, share: float) -> vec4:
    return mix(color[0, 0], other[0, 0], share)
"""
GRADED = '''
import passgraph as pg
from passgraph import Image, mix, vec4
from passgraph.effects import effect

@pg.kernel
def through(color: Image, table: Image, share: float) -> vec4:
    c = color[0, 0]
    return mix(c, vec4(table.sample3(c.rgb * 0.5 + 0.25).rgb, c.a), share)

@effect("graded")
def graded(frame: pg.Target, table: pg.Target, share: float) -> pg.Target:
    """Colours through a table of 2 slices.

    Parameters
    ----------
    frame : any picture
    table : its slices below one another
    share : of the table in the result
    """
    return through(frame, table.slices(2), share)
'''


@pytest.fixture(autouse=True)
def in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("PASSGRAPH_TRACEBACK", raising=False)
    for name, text in {"mine.py": MINE, "dimmed.py": DIMMED, "mixed.txt": MIXED, "graded.py": GRADED}.items():
        Path(name).write_text(text)
    colours = np.arange(7 * 5 * 3, dtype=np.uint8).reshape(5, 7, 3) * 2
    Image.fromarray(colours).save("photo.png")


def said(capsys: pytest.CaptureFixture[str], line: str) -> tuple[int, str, str]:
    """Status, stdout and stderr of a command line."""
    capsys.readouterr()
    status = run(line.split())
    return (status, *capsys.readouterr())


def well(capsys: pytest.CaptureFixture[str], line: str) -> str:
    status, out, error = said(capsys, line)
    assert (status, error) == (0, ""), error
    return out


def refused(capsys: pytest.CaptureFixture[str], line: str) -> str:
    status, out, error = said(capsys, line)
    assert (status, out) == (2, "")
    assert error.startswith("passgraph: error: ")
    return error


def colours(name: str) -> np.ndarray:
    return np.asarray(Image.open(name).convert("RGB")).astype(np.int64)


# A file of one's own, wherever an effect's name may stand


def test_apply_runs_a_kernel_of_my_file(capsys: pytest.CaptureFixture[str]) -> None:
    assert "out.png: 7x5 by numpy" in well(capsys, "apply mine.py photo.png -o out.png")
    luma = np.rint(colours("photo.png") @ [0.2126, 0.7152, 0.0722])
    assert np.abs(colours("out.png") - luma[..., None]).max() <= 1  # a luma may lie near a half


def test_its_parameters_are_options(capsys: pytest.CaptureFixture[str]) -> None:
    shown = " ".join(well(capsys, "apply mine.py --help").split())
    assert "Usage: passgraph apply mine.py" in shown and "Luma of each pixel (Rec. 709 weights)." in shown
    assert "--weights VEC3 Share of red, green and blue [default: (0.2126,0.7152,0.0722)]" in shown
    assert "--gain NUMBER Times as bright [default: 1.0]" in shown and "--invert / --no-invert" in shown
    well(capsys, "apply mine.py photo.png -o red.png --weights 1,0,0 --gain 0.5 --invert")
    assert (colours("red.png") == np.rint(255 - colours("photo.png")[..., :1] * 0.5)).all()


def test_ranges_of_an_effect_of_mine_hold(capsys: pytest.CaptureFixture[str]) -> None:
    shown = " ".join(well(capsys, "apply dimmed.py --help").split())
    assert "--share NUMBER Of the light that is left (of 1) [default: 0.5; 0.0<x<=1.0]" in shown
    assert "'--share': 2.0 is not in the range 0.0<x<=1.0" in refused(
        capsys, "apply dimmed.py photo.png -o out.png --share 2"
    )
    well(capsys, "apply dimmed.py photo.png -o out.png --share 0.25")
    assert np.abs(colours("out.png") - colours("photo.png") / 4).max() <= 0.5


def test_a_text_of_kernels_takes_pictures_by_name(capsys: pytest.CaptureFixture[str]) -> None:
    assert "Missing option '--other'" in refused(capsys, "apply mixed.txt photo.png -o out.png --share 0.5")
    pg.save("white.png", np.ones((5, 7, 4), np.float32))
    well(capsys, "apply mixed.txt photo.png -o out.png --share 1 --other white.png")
    assert (colours("out.png") == 255).all()


def test_what_an_effect_needs_is_an_option_that_must_be_given(capsys: pytest.CaptureFixture[str]) -> None:
    """A picture and a number without a default; the table turns red into blue, by its corners."""
    assert "Missing option '--table'" in refused(capsys, "apply graded.py photo.png -o out.png --share 1")
    corners = np.stack([np.stack(np.meshgrid([0.0, 1.0], [0.0, 1.0], indexing="ij"), -1)] * 2)
    table = np.concatenate([np.array([0.0, 1.0])[:, None, None, None] * np.ones((2, 2, 2, 1)), corners], -1)
    np.save("table.npy", pg.stacked(table.astype(np.float32)))
    assert "Missing option '--share'" in refused(capsys, "apply graded.py photo.png -o out.png --table table.npy")
    well(capsys, "apply graded.py photo.png -o out.png --table table.npy --share 1")
    assert np.abs(colours("out.png") - colours("photo.png")[..., [2, 1, 0]]).max() <= 1
    assert "nothing is made up for its parameter 'share'; give it a default" in refused(capsys, "check graded.py")
    Path("given.py").write_text(GRADED.replace("share: float) -> pg", "share: float = 1.0) -> pg"))
    assert "graded" in well(capsys, "check given.py -b numpy --size 8x6 --most-ambiguous 1")


def test_a_kernel_that_reads_a_volume_needs_somebody_who_says_its_slices(capsys: pytest.CaptureFixture[str]) -> None:
    """Taken for a volume of one slice, a table is read as something else without a word."""
    said_so = refused(capsys, "apply graded.py:through photo.png --table photo.png -o out.png")
    assert "'table' is read as a volume, and the command line has pictures only" in said_so
    assert "table.slices(33)" in said_so


def test_a_shader_that_reads_a_volume_needs_one_too(capsys: pytest.CaptureFixture[str]) -> None:
    Path("lut.frag").write_text("""
        #version 330
        uniform sampler2D image;
        uniform sampler3D lut;
        in vec2 uv;
        out vec4 color;
        void main() { color = texture(lut, texture(image, uv).rgb); }
    """)
    for line in ("apply lut.frag photo.png -o out.png", "apply lut.frag photo.png --lut photo.png -o out.png",
                 "plan lut.frag photo.png", "check lut.frag"):  # fmt: skip
        said_so = refused(capsys, line)
        assert "lut.frag: 'lut' is a sampler3D, and the command line has pictures only" in said_so
        assert "lut=table.slices(33)" in said_so
    assert not Path("out.png").exists()
    table = pg.Input("table", "rgba32f", (2, 4)).slices(2)  # black for red 0, white for red 1
    graded = pg.load_shader("lut.frag")(pg.Input("photo"), lut=table)
    dark_and_light = np.float32([[[0, 0, 0, 1], [1, 1, 1, 1]]] * 4)
    with pg.compile(graded) as program:
        made = program(photo=np.float32([[[0, 0, 0, 1], [1, 0, 0, 1]]]), table=dark_and_light)["lut"]
    assert made[0, :, :3].tolist() == [[0, 0, 0], [1, 1, 1]]


@pytest.mark.parametrize("named", ["mine.py", "mine.py:black_and_white", "dimmed.py:dimmed", "black-and-white"])
def test_every_command_takes_the_same_names(named: str, capsys: pytest.CaptureFixture[str]) -> None:
    well(capsys, f"apply {named} photo.png -o out.png")
    assert "output 7x5" in well(capsys, f"plan {named} photo.png")
    assert well(capsys, f"plan photo.png --effect {named}") == well(capsys, f"plan --effect={named} photo.png")
    assert "numpy: within bounds" in well(capsys, f"compare --backend numpy {named} photo.png")
    assert "within, 0.00% ambiguous" in well(capsys, f"check {named} -b numpy --size 8x8")


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("apply mine.py:black photo.png -o out.png", "mine.py: has no 'black'"),
        ("apply dimmed.py:dimed photo.png -o out.png", "has no 'dimed' (did you mean 'dimmed'?); it has dimmed, fade"),
        ("check mine.py:black_and_whit", "(did you mean 'black_and_white'?)"),
        ("check gausian-blur", "there is no effect 'gausian-blur' (did you mean 'gaussian-blur'?)"),
        ("compare gausian-blur photo.png", "(did you mean 'gaussian-blur'?)"),
        ("plan photo.png", "Missing option '--effect' / '-e', or the name of an effect or FILE.py in front"),
        ("apply nowhere.py photo.png -o out.png", "nowhere.py: no such file"),
        ("apply empty.py photo.png -o out.png", "empty.py: has no effect and no kernel; mark a function"),
        ("apply two.py photo.png -o out.png", "two.py: has several effects; say which, such as two.py:a; it has a, b"),
        ("apply struct.py photo.png -o out.png", "parameter 'light' is a Light, which cannot be written on a command"),
        ("apply taken.py photo.png -o out.png", "Missing option '--kernel-output'"),
        ("apply mine.py photo.png -o out.png --weights 1,2", "weights is vec3, expected 3 numbers such as 1,0.9,0.8"),
        ("apply mine.py photo.png -o out.png --weights 1,2,x", "expected a number such as 0.5, got 'x'"),
        ("apply mine.py photo.png -o out.png --gain nan", "nan is not a finite number"),
    ],
)
def test_what_is_not_there_is_told_with_the_nearest(line: str, words: str, capsys: pytest.CaptureFixture[str]) -> None:
    kernel = "import passgraph as pg\n{0} = pg.kernel(source='def {0}(c: Image{1}) -> vec4: return c[0, 0]')\n"
    Path("empty.py").write_text("x = 3\n")
    Path("two.py").write_text(kernel.format("a", "") + kernel.format("b", ""))
    Path("taken.py").write_text(kernel.format("a", ", output: float"))
    Path("struct.py").write_text(
        "import passgraph as pg\n@pg.struct\nclass Light:\n    power: float\n"
        "@pg.kernel\ndef lit(color: pg.Image, light: Light) -> pg.vec4:\n    return color[0, 0] * light.power\n"
    )
    assert words in refused(capsys, line)
    assert not Path("out.png").exists()


# Help


@pytest.mark.parametrize(
    "line",
    [*(f"{name} --help" for name in COMMANDS), *(f"plan -e {name} --help" for name in EFFECTS), "apply mine.py --help"],
)
def test_help_says_no_limit_where_there_is_none(line: str, capsys: pytest.CaptureFixture[str]) -> None:
    shown = well(capsys, line)
    assert "None" not in shown and "=inf" not in shown


def test_help_loads_no_effect_but_the_one_that_it_shows() -> None:
    """Each takes as long to load as the rest of the command."""
    text = """
import sys
from passgraph.commands.entry import run
for name in ("apply", "compare", "plan", "render"):
    run([name, "--help"])
    families = {m.split(".")[2] for m in sys.modules if m.startswith("passgraph.effects.") and m.count(".") > 2}
    print(name, *sorted(families), file=sys.stderr)
"""
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    *others, render = done.stderr.splitlines()
    assert others == ["apply", "compare", "plan"]
    assert "shadows" in render and "light2d" not in render


@pytest.mark.parametrize(("given", "left"), [({}, "4"), ({"OPENBLAS_THREAD_TIMEOUT": "20"}, "20")])
def test_idle_threads_of_numpy_do_not_spin_unless_the_user_says_so(given: dict[str, str], left: str) -> None:
    text = """
import os, sys
from passgraph.commands import main
assert "numpy" not in sys.modules
try:
    main(["--version"])
finally:
    print(os.environ["OPENBLAS_THREAD_TIMEOUT"])
"""
    around = {name: value for name, value in os.environ.items() if name != "OPENBLAS_THREAD_TIMEOUT"}
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, env=around | given)
    assert done.stdout.splitlines()[-1] == left


# Errors


@pytest.mark.parametrize("line", ["apply wrong.py photo.png -o out.png", "check wrong.py", "plan wrong.py photo.png"])
def test_an_error_in_a_kernel_of_mine_keeps_its_caret(line: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("wrong.py").write_text(MINE.replace("dot(c.rgb, weights) * gain", "lerp(c.rgb, weights, gain).x"))
    first, text, caret, *rest = refused(capsys, line).split("\n")
    assert first.startswith("passgraph: error: ") and "wrong.py:17: name 'lerp' is not defined here; write mix" in first
    assert text == "        y = lerp(c.rgb, weights, gain).x" and caret == "            ^^^^" and rest == [""]


def test_an_error_that_appears_with_the_frames_keeps_its_caret(capsys: pytest.CaptureFixture[str]) -> None:
    Path("frames").mkdir()
    for number in range(2):
        Image.open("photo.png").save(f"frames/{number}.png")
    Path("deep.txt").write_text(
        "def deep(c: Image, n: Const[int] = 70000) -> vec4:\n"
        "    s = vec4(0.0)\n    for i in range(n):\n        s += c[i, 0]\n    return s\n"
    )
    error = refused(capsys, "apply deep.txt frames -o made.%02d.png")
    assert error.count("\n") == 3 and error.split("\n")[2].strip().strip("^") == ""


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("import passgraph as pg\n\nscale = undefined * 2\n", "NameError: name 'undefined' is not defined (line 3)"),
        ("def f():\n    return 1 / 0\n\nf()\n", "ZeroDivisionError: division by zero (line 2)"),
        ("def f(:\n", "SyntaxError: invalid syntax (broken.py, line 1)"),
    ],
)
def test_an_error_of_my_own_file_is_told_with_its_line(
    text: str, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("broken.py").write_text(text)
    assert refused(capsys, "apply broken.py photo.png -o out.png").endswith(f"broken.py: fails when run: {words}\n")


def test_motion_blur_with_a_velocity_needs_no_depth(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("a.0001", "a.0002", "v.0001", "v.0002"):
        np.save(f"{name}.npy", np.random.default_rng(len(name)).random((6, 9, 4)).astype(np.float32) * 4)
    for source, velocity, out in (("a.0001.npy", "v.0001.npy", "b.npy"), ("a.%04d.npy", "v.%04d.npy", "b.%04d.npy")):
        words = ("apply", "motion-blur", source, "--velocity", velocity, "-o", out)
        assert Outcome(capsys, *words).status == 0
    assert (pg.load("b.npy") == pg.load("b.0001.npy")).all()
    assert "nothing tells how surfaces move" in refused(capsys, "apply motion-blur a.0001.npy -o c.npy")
    assert "--depth" in refused(capsys, "apply fog a.0001.npy -o c.npy")


def test_a_log_has_lines_of_progress(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """By a clock of four seconds a call, so that about every third frame is told."""
    monkeypatch.chdir(tmp_path)
    pg.save("photo.png", np.zeros((4, 6, 3), np.uint8))
    clock = iter(range(0, 4000, 4))
    monkeypatch.setattr("passgraph.commands.running.perf_counter", lambda: float(next(clock)))
    outcome = Outcome(capsys, "apply", "sepia", "photo.png", "--frames", "12", "-o", "out.%02d.png")
    assert outcome.status == 0
    lines = [line for line in outcome.err.splitlines() if "frames/s" in line]
    assert lines == [
        f"photo.png: {done} of 12 frames, 0.2 frames/s, {left} left"
        for done, left in ((3, "36.00 s"), (6, "24.00 s"), (9, "12.00 s"), (12, "0.0 ms"))
    ]
