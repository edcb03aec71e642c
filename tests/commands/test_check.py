"""``passgraph check`` and ``compare`` on what users bring: what must not pass, what is said of it, how it is mended.

Kernels here are ordinary mistakes, not planted ones: a root of what rounding takes below 0, a hash of sines, a change
of a picture inside of wide bounds.
"""

from __future__ import annotations

import json
import os
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.reference import ReferenceBackend
from passgraph.commands.entry import run

ROOT = "def root(color: Image) -> vec4:\n    c = color[0, 0].r\n    return vec4(vec3(sqrt(c * 0.1 - c / 10.0)), 1.0)\n"
HASH = """
def noise(color: Image) -> vec4:
    n = fract(sin(dot(vec2(pixel()), vec2(12.9898, 78.233))) * 43758.5453)
    return vec4(vec3(n), 1.0) * color[0, 0].a
"""
VALUES = """
import passgraph as pg
from passgraph import Image, ivec2, mat2, vec2, vec3, vec4

@pg.kernel
def tinted(color: Image, exposure: float, tint: vec3, turn: mat2, shift: ivec2, flip: bool) -> vec4:
    c = color.texel(pg.pixel() + shift).rgb * tint * exposure
    moved = turn * c.rg
    return vec4(c.b, moved.g, moved.r, 1.0) if flip else vec4(moved, c.b, 1.0)

outputs = tinted(
    pg.Input("frame"), pg.Value("exposure"), pg.Value("tint"), pg.Value("turn"), pg.Value("shift"), pg.Value("flip"),
    into=pg.target("out", "rgba32f"),
)
"""
SET = ["exposure=0.5", "tint=1, 0.5,0.25", "turn=0,1;2,0", "shift=1 0", "flip=yes"]


@pytest.fixture(autouse=True)
def in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def said(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    """Status, stdout and stderr."""
    capsys.readouterr()
    status = run(list(arguments))
    return (status, *capsys.readouterr())


def settings(*given: str) -> list[str]:
    return [word for one in given for word in ("--set", one)]


class Altered(ReferenceBackend):
    """The reference, other in one pixel of what it makes."""

    def __init__(self, name: str, value: float) -> None:
        super().__init__()
        self.name, self.value = name, value  # type: ignore[misc]

    def download(self, storage: Any) -> Any:
        made = super().download(storage).copy()
        if made.shape == (2, 4, 4):
            made[1, 2, 0] = self.value
        return made


def backends(monkeypatch: pytest.MonkeyPatch, **values: float) -> None:
    """Names of backends that are the reference with another value in one pixel."""
    monkeypatch.setattr("passgraph.backends.registry.open_backend", lambda name: Altered(name, values[name]))


# Another kind of value


def frame(*, red: float = 0.5) -> None:
    picture = np.full((2, 4, 4), 0.5, np.float32)
    picture[1, 2, 0] = red
    pg.save("frame.npy", picture)


def test_nan_in_the_place_of_a_number_does_not_pass(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The bounds of a root whose argument rounding may take below 0 allow everything."""
    Path("own.txt").write_text(ROOT)
    frame(red=1e-20)
    backends(monkeypatch, gl=float("nan"))
    status, out, err = said(capsys, "check", "own.txt", "-i", "color=frame.npy", "-b", "gl", "--most-ambiguous", "1")
    assert (status, err) == (1, "")
    assert "NaN or infinite 12.500%" in out
    assert re.search(
        r"root on gl: pass root, target root: NaN or infinity where the reference has numbers, or the reverse, at "
        r"12\.500% of pixels, such as column 2, row 1: \(nan, \S+, \S+, 1\.0\) where the reference has "
        r"\(\S+, \S+, \S+, 1\.0\), given color = \(1e-20, 0\.5, 0\.5, 0\.5\)\. The bounds allow both, since sqrt "
        r"\(own\.txt:3\) promises nothing below 0; mend the kernel there, such as: sqrt\(max\(x, 0\.0\)\)",
        out,
    ), out
    assert "on purpose" not in out  # that is said of inputs that are made


def test_the_mend_that_is_told_passes(capsys: pytest.CaptureFixture[str]) -> None:
    Path("own.txt").write_text(ROOT.replace("sqrt(c * 0.1 - c / 10.0)", "sqrt(max(c * 0.1 - c / 10.0, 0.0))"))
    frame()
    status, out, _ = said(capsys, "check", "own.txt", "-i", "color=frame.npy", "-b", "numpy", "--most-ambiguous", "1")
    assert status == 0, out


def test_what_overflows_on_made_inputs_says_that_they_are_made(capsys: pytest.CaptureFixture[str]) -> None:
    """The reference has no largest float32: c * c / c is a number there and NaN elsewhere."""
    Path("own.txt").write_text(
        "def same(color: Image) -> vec4:\n    c = color[0, 0]\n    return (c * c) / (c * c + 0.5)\n"
    )
    assert said(capsys, "check", "own.txt", "-b", "numpy", "--size", "24x8")[0] == 0, "plausible pictures"
    status, out, _ = said(capsys, "check", "own.txt", "-b", "numpy", "--size", "24x8", "--stress")
    assert status == 1
    assert "own, stress" in out or "same, stress" in out
    assert (
        "since mul (own.txt:3) may leave the range of float32; mend the kernel there, such as: min(x, 65504.0)" in out
    )


def test_what_hangs_on_a_decision_is_left_to_it(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """One pixel lies on the threshold between a number and infinity: either is right there, and nowhere else."""
    text = "def cut(color: Image) -> vec4: return vec4(1.0 / (0.0 if color[0, 0].r * 0.1 * 20.0 > 1.0 else 1.0))\n"
    Path("own.txt").write_text(text)
    picture = np.full((2, 4, 4), 0.25, np.float32)
    picture[1, 2] = 0.5
    pg.save("frame.npy", picture)
    backends(monkeypatch, gl=float("inf"))
    arguments = ["check", "own.txt", "-i", "color=frame.npy", "-b", "gl", "--most-ambiguous", "0.2", "--allow-nan"]
    status, out, _ = said(capsys, *arguments)
    assert status == 0, out
    picture[1, 2] = 0.25
    pg.save("frame.npy", picture)
    assert said(capsys, *arguments)[0] == 1


def test_compare_refuses_it_too(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """A stored half may overflow or not at its largest number; which, bounds leave open."""
    monkeypatch.setattr("passgraph.verify.compare.open_backend", lambda name: Altered(name, float("inf")))
    pg.save("frame.npy", np.full((2, 4, 4), 0.5, np.float32))
    status, out, _ = said(capsys, "compare", "frame.npy", "-e", "black-and-white", "-b", "gl")
    assert status == 1
    assert "gl: pass black_and_white, target black_and_white: NaN or infinity where the reference has numbers" in out


# Undecided


@pytest.mark.parametrize("backend", ["numpy", "gl"])
def test_what_hangs_on_rounding_everywhere_is_undecided(capsys: pytest.CaptureFixture[str], backend: str) -> None:
    Path("own.txt").write_text(HASH)
    status, out, err = said(capsys, "check", "own.txt", "-b", backend, "--size", "16x8")
    assert (status, err) == (1, "")
    found = re.search(
        rf"noise on {backend}: undecided: pass noise, target noise: rounding may turn decisions at (\d+\.\d+)% of "
        r"pixels, more than 5\.00%, so that next to any picture would pass; they are fract \(own\.txt:3\) at (\d+)",
        out,
    )
    assert found is not None, out
    assert float(found[1]) >= 50
    assert int(found[2]) > 0.5 * 16 * 8
    assert "Undecided is no pass" in out
    assert said(capsys, "check", "own.txt", "-b", backend, "--size", "16x8", "--most-ambiguous", "1")[0] == 0


@pytest.mark.parametrize(
    ("text", "operation"),
    [
        ("def wave(color: Image) -> float: return sin(uv().x * 1e9)", "sin (own.txt:1)"),
        ("def wide(color: Image) -> vec4:\n    c = color[0, 0] + 1e7\n    return c - 1e7", "sub (own.txt:3)"),
    ],
)
def test_bounds_as_wide_as_the_values_decide_nothing(
    capsys: pytest.CaptureFixture[str], text: str, operation: str
) -> None:
    Path("own.txt").write_text(text + "\n")
    status, out, _ = said(capsys, "check", "own.txt", "-b", "numpy", "--size", "48x32")
    assert status == 1
    assert "nearly any picture would pass. Precision is lost in" in out
    assert operation in out
    assert re.search(r"undecided, 0\.00% ambiguous, error \S+, at most \d+% of its bound", out)


SENSIBLE = {
    "box": "return (c[-1, 0] + c[0, 0] + c[1, 0]) / 3.0",
    "sharpen": "return c[0, 0] * 5.0 - c[-1, 0] - c[1, 0] - c[0, -1] - c[0, 1]",
    "gamma": "return pow(c[0, 0], vec4(1.0 / 2.2))",
    "reinhard": "return c[0, 0] / (c[0, 0] + 1.0)",
    "root": "return sqrt(c[0, 0])",
    "unit": "return vec4(normalize(c[0, 0].rgb), 1.0)",
    "threshold": "return vec4(1.0) if c[0, 0].r > 0.5 else vec4(0.0)",
    "wave": "return c.sample(uv() + vec2(0.01 * sin(uv().y * 40.0), 0.0))",
    "difference": "return c[0, 0] - c[1, 0]",
    "nothing": "return c[0, 0] * 0.0",
    "decay": "return exp(-c[0, 0])",
}


@pytest.mark.parametrize("name", SENSIBLE)
def test_what_a_beginner_writes_passes(capsys: pytest.CaptureFixture[str], name: str) -> None:
    Path("own.txt").write_text(f"def {name}(c: Image) -> vec4: {SENSIBLE[name]}\n")
    status, out, _ = said(capsys, "check", "own.txt", "-b", "numpy")
    assert status == 0, out


def test_longer_kernels_of_beginners_pass(capsys: pytest.CaptureFixture[str]) -> None:
    kernels = Path(__file__).with_name("beginner_kernels.py")
    status, out, _ = said(capsys, "check", str(kernels), "-b", "numpy")
    assert status == 0, out
    assert out.count("within") == 21


@pytest.mark.parametrize(
    ("body", "operation"),
    [
        ("return vec4(c[0, 0].rgb / c[0, 0].a, c[0, 0].a)", "div"),
        ("return log(c[0, 0])", "log"),
        ("return pow(c[0, 0] - 0.5, vec4(2.2))", "pow"),
    ],
)
def test_nan_that_the_reference_computes_too_is_told(
    capsys: pytest.CaptureFixture[str], body: str, operation: str
) -> None:
    Path("own.txt").write_text(f"def own(c: Image) -> vec4: {body}\n")
    status, out, _ = said(capsys, "check", "own.txt", "-b", "numpy")
    assert status == 1
    assert re.search(
        r"NaN or infinity at \d+\.\d+% of pixels, as the reference computes it, such as column 0, row 0", out
    )
    assert "given c = (0.0, 0.0, 0.0, 0.0)" in out
    assert f"{operation} (own.txt:1)" in out
    assert said(capsys, "check", "own.txt", "-b", "numpy", "--allow-nan")[0] == 0


def test_where_operations_promise_nothing_nothing_is_decided(capsys: pytest.CaptureFixture[str]) -> None:
    Path("own.txt").write_text("def root(color: Image) -> vec4: return sqrt(color[0, 0] - 2.0)\n")
    frame()
    status, out, _ = said(capsys, "check", "own.txt", "-b", "numpy", "-i", "color=frame.npy")
    assert status == 1
    assert "operations promise nothing for what they are given at 100.00% of pixels, more than 50%" in out
    assert "they are sqrt (own.txt:1) at 8" in out


def test_compare_is_undecided_at_the_same_share(capsys: pytest.CaptureFixture[str]) -> None:
    """A picture that lies on the threshold of a search: two of its twenty columns, a tenth."""
    Path("own.py").write_text(
        "import passgraph as pg\n"
        "near = pg.kernel(source='def near(c: Image) -> vec4: "
        "return vec4(1.0) if c[0, 0].r / 0.6 < 0.5 else vec4(0.0)')\n"
    )
    picture = np.full((10, 20, 4), 0.9, np.float32)
    picture[:, 5:7] = 0.3
    pg.save("frame.npy", picture)
    arguments = ["check", "own.py", "-i", "c=frame.npy", "-b", "numpy"]
    status, out, _ = said(capsys, *arguments)
    assert status == 1
    assert "undecided, 10.00% ambiguous" in out
    assert "they are less (<kernel text>:1) at 20" in out
    assert said(capsys, *arguments, "--most-ambiguous", "0.1")[0] == 0


# The same bits


def test_equality_of_bits_is_said_first(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    Path("own.txt").write_text("def half(color: Image) -> vec4: return color[0, 0] * 0.5\n")
    frame()
    arguments = ["check", "own.txt", "-i", "color=frame.npy", "-b", "gl", "-b", "numpy"]
    backends(monkeypatch, gl=0.25, numpy=0.25)
    status, out, _ = said(capsys, *arguments)
    assert status == 0
    assert out.startswith("half: bit for bit the same on gl and numpy\n")
    backends(monkeypatch, gl=0.25, numpy=-0.25)
    status, out, _ = said(capsys, *arguments)
    assert status == 1
    assert out.startswith(
        "half: not bit for bit the same: first in pass half, target half: gl and numpy differ at 1 pixel (12.500%), "
        "such as column 2, row 1: (0.25, 0.25, 0.25, 0.25) on gl, (-0.25, 0.25, 0.25, 0.25) on numpy\n"
    )


# Values


def test_values_without_a_default_are_set_by_the_kernels_types(capsys: pytest.CaptureFixture[str]) -> None:
    """A matrix is written row by row, as on paper: this one exchanges red and green and doubles one of them."""
    Path("own.py").write_text(VALUES)
    picture = np.zeros((2, 3, 4), np.float32)
    picture[:, 1:] = (0.5, 0.25, 0.125, 1.0)
    pg.save("in.npy", picture)
    arguments = ["check", "own.py", "-b", "numpy", "-b", "reference", "-i", "frame=in.npy", *settings(*SET)]
    status, out, err = said(capsys, *arguments, "--golden", "gold", "--record")
    assert (status, err) == (0, ""), out
    manifest = json.loads(Path("gold/manifest.json").read_text())["graphs"]["outputs"]
    recorded = np.load(Path("gold") / manifest["outputs"]["out"])
    # rgb tinted and exposed is (0.25, 0.0625, 0.015625); turned, (0.0625, 0.5); flipped, blue comes first.
    assert recorded[0, 0].tolist() == [0.015625, 0.5, 0.0625, 1.0]
    assert manifest["values"] == dict(one.split("=", 1) for one in SET)
    status, out, _ = said(capsys, "check", "own.py", "-b", "numpy", "--golden", "gold")
    assert status == 0
    assert "outputs: as recorded" in out


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ([], "outputs: value 'exposure' has no default; give --set exposure=0.5 (float)"),
        (["exposure=bright"], "--set exposure=bright: expected a number such as 0.5, got 'bright'"),
        (["exposure=1,2"], "--set exposure: exposure is float, expected 1 number such as 0.5, got 2"),
        (["exposure=1e99"], "--set exposure"),
        (["exposure"], "'exposure' is not NAME=VALUE, such as exposure=0.5 or tint=1,0.9,0.8"),
        (
            ["exposur=1"],
            "there is no value 'exposur' (did you mean 'exposure'?); there are exposure, flip, shift, tint",
        ),
        (["exposure=1", "tint=1,2"], "--set tint: tint is vec3, expected 3 numbers such as 1,0.9,0.8, got 2"),
        (["exposure=1", "tint=1,1,1"], "value 'turn' has no default; give --set turn=1,0;0,1 (mat2)"),
        (["exposure=1", "tint=1,1,1", "turn=1,0,0"], "turn is mat2, expected 4 numbers such as 1,0;0,1 (row by row)"),
        ([*SET[:3], "shift=1.5,0"], "--set shift=1.5,0: expected a whole number such as 2, got '1.5'"),
        ([*SET[:4], "flip=perhaps"], "--set flip=perhaps: expected true or false such as true, got 'perhaps'"),
    ],
)
def test_values_that_do_not_fit_are_refused(capsys: pytest.CaptureFixture[str], wrong: list[str], message: str) -> None:
    Path("own.py").write_text(VALUES)
    status, out, err = said(capsys, "check", "own.py", "-b", "reference", "--size", "4x4", *settings(*wrong))
    assert (status, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1


def test_parameters_of_a_kernel_by_itself_are_set(capsys: pytest.CaptureFixture[str]) -> None:
    """One has a default and one has not; what is not set keeps it, or is 0.5."""
    Path("own.txt").write_text("def level(low: float, high: float = 0.75) -> vec4: return vec4(low, high, 0.0, 1.0)\n")
    for given, wanted in ([], [0.5, 0.75, 0, 1]), (["low=0.125", "high=2"], [0.125, 2, 0, 1]):
        use = ["check", "own.txt", "-b", "numpy", "--size", "2x2", "--golden", "gold", "--record", *settings(*given)]
        assert said(capsys, *use)[0] == 0
        assert np.load("gold/level-output-level.npy")[0, 0].tolist() == wanted


# Golden


def record(capsys: pytest.CaptureFixture[str], text: str, *more: str) -> None:
    Path("own.txt").write_text(text)
    said(capsys, "check", "own.txt", "-b", "reference", "--golden", "gold", "--record", *more)


def golden(capsys: pytest.CaptureFixture[str], text: str, *more: str) -> tuple[int, str]:
    Path("own.txt").write_text(text)
    return said(capsys, "check", "own.txt", "-b", "reference", "--golden", "gold", "--most-ambiguous", "1", *more)[:2]


def test_a_change_inside_of_wide_bounds_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    """1 + 4e7 - 4e7 may be 0 to 4 in float32, so that bounds say little."""
    text = "def wide(color: Image) -> vec4: return vec4((color[0, 0].rgb + 40000.0) - 40000.0 {more}, 1.0)\n"
    frame()
    record(capsys, text.format(more=""), "-i", "color=frame.npy")
    status, out = golden(capsys, text.format(more="+ 0.001"))
    assert status == 1
    assert "within" in out  # so it was found by what is recorded, not by bounds
    assert re.search(
        r"wide: output wide is not as recorded: 100\.000% of pixels changed, in columns 0 to 3 and rows 0 to 1, by "
        r"at most \d+ ulp at column \d, row \d, channel \d: 0\.5 recorded, 0\.501 now\. Where that is meant, record it",
        out,
    ), out
    assert golden(capsys, text.format(more=""))[0] == 0


def test_a_change_of_one_digit_within_a_second_is_seen(capsys: pytest.CaptureFixture[str]) -> None:
    """Whatever Python keeps of the file: both texts have one length, and here one time."""
    module = """
import passgraph as pg
outputs = pg.kernel(source="def light{number}(color: Image) -> vec4: return color[0, 0]")(pg.Input("color"))
"""
    for number in (1, 2):
        Path("own.py").write_text(module.format(number=number))
        os.utime("own.py", (1_000_000_000, 1_000_000_000))
        assert f"light{number}" in said(capsys, "check", "own.py", "-b", "reference")[1]
    assert not Path("__pycache__").exists()


def test_steps_of_the_format_may_be_allowed(capsys: pytest.CaptureFixture[str]) -> None:
    module = """
import passgraph as pg
light = pg.kernel(source="def light(color: Image) -> vec4: return color[0, 0] * {factor}")
outputs = light(pg.Input("color", "rgba8"), into=pg.target("light", "rgba8"))
"""
    use = ["check", "own.py", "-b", "reference", "--golden", "gold"]
    pg.save("in.npy", np.full((4, 8, 4), 100 / 255, np.float32))
    Path("own.py").write_text(module.format(factor=1.0))
    assert said(capsys, *use, "--record", "-i", "color=in.npy")[0] == 0
    Path("own.py").write_text(module.format(factor=1.02))
    status, out, _ = said(capsys, *use)
    assert status == 1
    assert "100.000% of pixels changed" in out
    assert "by at most 2 steps of rgba8 (1/255) at column 0, row 0, channel 0: " in out
    assert said(capsys, *use, "--golden-steps", "1")[0] == 1
    status, out, _ = said(capsys, *use, "--golden-steps", "2")
    assert status == 0
    assert "output light is nearly as recorded" in out
    assert "outputs: as recorded" in out
    Path("own.py").write_text(module.format(factor=1.0).replace('"light", "rgba8"', '"light", "rgba16"'))
    status, _, err = said(capsys, *use)
    assert status == 2
    assert "output 'light' of 'outputs' was 8x4 rgba8, and is 8x4 rgba16 now; record it anew with --record" in err


def test_recordings_of_version_1_stay_readable(capsys: pytest.CaptureFixture[str]) -> None:
    text = "def half(color: Image) -> vec4: return color[0, 0] * 0.5\n"
    record(capsys, text)
    path = Path("gold/manifest.json")
    manifest = json.loads(path.read_text())
    for left_out in ("formats", "values"):
        del manifest["graphs"]["half"][left_out]
    path.write_text(json.dumps({**manifest, "version": 1}))
    status, out = golden(capsys, text)
    assert status == 0
    assert "half: as recorded" in out
    assert golden(capsys, text.replace("0.5", "0.25"))[0] == 1
    for broken in ({"size": "large"}, {"size": [8, 4], "inputs": 3, "outputs": {}}, []):
        path.write_text(json.dumps({"version": 2, "graphs": {"half": broken}}))
        assert said(capsys, "check", "own.txt", "-b", "reference", "--golden", "gold")[0] == 2


# What errors and help look like


def test_an_error_of_a_kernel_keeps_its_lines_and_its_caret(capsys: pytest.CaptureFixture[str]) -> None:
    Path("own.txt").write_text("def f(color: Image) -> vec4:\n    return color[0, 0] + 'red'\n")
    status, out, err = said(capsys, "check", "own.txt")
    assert (status, out) == (2, "")
    first, line, caret = err.splitlines()
    assert first.startswith("passgraph: error: own.txt:2: the kernel language has numbers and bools, not str")
    assert line.strip() == "return color[0, 0] + 'red'"
    assert line[caret.index("^") :].startswith("'red'")


def test_help_shows_ranges_that_are_there(capsys: pytest.CaptureFixture[str]) -> None:
    for command in (["compare"], ["apply"], ["render"], ["check"]):
        status, out, _ = said(capsys, *command, "--help")
        assert status == 0
        assert "None" not in out


@pytest.mark.parametrize(
    ("arguments", "meant"),
    [
        (["check", "own.txt", "--input", "colour=in.npy"], "(did you mean 'color'?)"),
        (["compare", "in.png", "-e", "gausian-blur"], "(did you mean 'gaussian-blur'?)"),
        (["compare", "in.png", "-e", "gaussian-blur", "--sigma", "2"], "--sigma-px"),
        (["chek", "own.txt"], "check"),
    ],
)
def test_what_was_meant_is_guessed(capsys: pytest.CaptureFixture[str], arguments: list[str], meant: str) -> None:
    Path("own.txt").write_text("def half(color: Image) -> vec4: return color[0, 0] * 0.5\n")
    status, _, err = said(capsys, *arguments)
    assert status == 2
    assert meant in err
