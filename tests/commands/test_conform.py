"""``passgraph conform`` and ``passgraph check`` from end to end."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.reference import ReferenceBackend
from passgraph.commands.entry import run
from passgraph.verify.conformance.case_inputs import picture, with_special

MODULE = """
import passgraph as pg
from passgraph import Image, vec3, vec4, dot

GAIN = {gain}

@pg.kernel
def gain(color: Image, by: float = GAIN) -> vec4:
    return color[0, 0] * by

@pg.kernel
def split(color: Image, mask: Image, level: float) -> tuple[vec4, vec4]:
    return color[0, 0] * mask[0, 0].r, color[0, 0] + level
"""


@pytest.fixture(autouse=True)
def in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def outcome(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    capsys.readouterr()
    status = run(list(arguments))
    return (status, *capsys.readouterr())


def without_groups(err: str) -> list[str]:
    """Lines of stderr beside those that name the group that `conform` begins with."""
    return [line for line in err.splitlines() if not line.startswith("passgraph: ") or "(case " not in line]


def well(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    status, out, err = outcome(capsys, *arguments)
    assert (status, *without_groups(err)) == (0,), out
    return out


class Bright(ReferenceBackend):
    name = "bright"

    def download(self, storage: Any) -> Any:
        return super().download(storage) + np.float32(0.25)


@pytest.fixture
def bright(monkeypatch: pytest.MonkeyPatch) -> None:
    """The reference as a backend that is wrong everywhere, under the name gl."""
    monkeypatch.setattr("passgraph.verify.conformance.suite.open_backend", lambda name: Bright())
    monkeypatch.setattr("passgraph.backends.registry.open_backend", lambda name: Bright())


# conform


def test_a_backend_conforms(capsys: pytest.CaptureFixture[str]) -> None:
    out = well(capsys, "conform", "--backend", "numpy", "--group", "sequences")
    assert "sequences" in out
    assert out.endswith("numpy: 14 passed\n")


def test_reports_are_written(capsys: pytest.CaptureFixture[str]) -> None:
    out = well(capsys, "conform", "-b", "reference", "-g", "sequences", "--report", "r.html", "--json", "r.json")
    assert "r.html: written" in out
    assert Path("r.html").read_text().startswith("<!doctype html>")
    assert json.loads(Path("r.json").read_text())["passed"] is True


@pytest.mark.usefixtures("bright")
def test_one_that_does_not_is_shown(capsys: pytest.CaptureFixture[str]) -> None:
    status, out, err = outcome(capsys, "conform", "-b", "gl", "-g", "sequences", "--report", "r.html")
    assert err == "passgraph: sequences (case 1 of 14)\n", "a pipe is told which group runs"
    assert status == 1
    assert "sequences/last frame's picture on bright: diverged: frame 0, pass " in out
    assert "gl: 14 diverged" in out
    assert Path("r.html").read_text().count("data:image/png") == 42


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["conform"], "Missing option '--backend' / '-b'"),
        (["conform", "-b", "nope"], "there is no backend 'nope'"),
        (["conform", "-b", "numpy", "-g", "nope"], "there is no group 'nope' of cases; there are operations, "),
        (["conform", "-b", "numpy", "--report", "none/r.html"], "the folder"),
        (["check", "nope.py"], "nope.py: no such file"),
        (["check", "empty.py"], "has neither outputs nor targets nor kernels"),
        (["check", "broken.py"], "broken.py: fails when run: ZeroDivisionError: division by zero"),
        (["check", "odd.py"], "outputs must be a target, several, or a mapping, got int"),
        (["check", "own.py", "--input", "color"], "'color' is not NAME=FILE"),
        (
            ["check", "own.py", "--input", "colour=in.png"],
            "there is no input 'colour' (did you mean 'color'?); there are color, mask",
        ),
        (["check", "own.py", "--record"], "--record needs --golden FOLDER"),
        (["check", "own.py", "--golden", "none"], "manifest.json: cannot be read"),
        (["check", "own.py", "--golden", "none", "--size", "8x8"], "--golden brings its own inputs, values and size"),
    ],
)
def test_refusals(capsys: pytest.CaptureFixture[str], arguments: list[str], message: str) -> None:
    Path("empty.py").write_text("x = 1\n")
    Path("broken.py").write_text("x = 1 / 0\n")
    Path("odd.py").write_text("outputs = 3\n")
    Path("own.py").write_text(MODULE.format(gain=0.5))
    status, out, err = outcome(capsys, *arguments)
    assert (status, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1


# check


def test_kernels_of_a_module_are_checked_one_by_one(capsys: pytest.CaptureFixture[str], backend_name: str) -> None:
    Path("own.py").write_text(MODULE.format(gain=0.5))
    out = well(capsys, "check", "own.py", "-b", backend_name)
    assert [line.split()[:2] for line in out.splitlines() if "within" in line] == [
        ["gain", "gain"],
        ["split", "split.0"],
        ["split", "split.1"],
    ]


def test_effects_of_a_module_are_checked_as_they_are_called(capsys: pytest.CaptureFixture[str]) -> None:
    """Those that it imports are not its own."""
    mine = """
from passgraph.effects import bloom, effect

@effect("twice")
def twice(frame: pg.Target, factor: float = 0.5) -> pg.Target:
    once = gain(frame, into=pg.target("once"))
    return gain(once, into=pg.target("twice"))
"""
    Path("own.py").write_text(MODULE.format(gain=0.5) + mine)
    out = well(capsys, "check", "own.py", "-b", "numpy", "--size", "20x10")
    assert [line.split()[1] for line in out.splitlines() if "within" in line] == ["once", "twice"]


@pytest.mark.parametrize("end", ["outputs = faded", "outputs = {'b': faded}", "", "outputs = [faded]"])
def test_a_graph_of_a_module_is_checked_whole(capsys: pytest.CaptureFixture[str], end: str) -> None:
    graph = 'faded = gain(gain(pg.Input("frame"), into=pg.target("once")), into=pg.target("faded", "rgba8"))\n'
    Path("own.py").write_text(MODULE.format(gain=0.5) + graph + end + "\n")
    out = well(capsys, "check", "own.py", "-b", "numpy", "--size", "20x10")
    assert [line.split()[1] for line in out.splitlines() if "within" in line] == ["once", "faded"]


def test_the_text_of_a_kernel_is_checked_and_not_run(capsys: pytest.CaptureFixture[str]) -> None:
    Path("own.txt").write_text("def half(color: Image) -> vec4: return color[0, 0] * 0.5\n")
    assert "within" in well(capsys, "check", "own.txt", "-b", "numpy")


def test_own_pictures_are_used(capsys: pytest.CaptureFixture[str]) -> None:
    """The one pixel of the picture lies on the threshold; made ones do not."""
    text = "def cut(color: Image) -> vec4: return vec4(1.0) if color[0, 0].r * 0.1 * 20.0 > 1.0 else vec4(0.0)\n"
    Path("own.txt").write_text(text)
    pg.save("in.npy", np.full((3, 5, 4), 0.5, np.float32))
    status, out, _ = outcome(capsys, "check", "own.txt", "-i", "color=in.npy", "-b", "numpy")
    assert status == 1
    assert "undecided, 100.00% ambiguous" in out


@pytest.mark.usefixtures("bright")
def test_what_differs_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    Path("own.py").write_text(MODULE.format(gain=0.5))
    status, out, _ = outcome(capsys, "check", "own.py", "-b", "gl")
    assert status == 1
    # Of the huge numbers among the made inputs the mistake is below the rounding.
    share = re.search(r"outside ([0-9.]+)%", out)
    assert share is not None
    assert float(share[1]) > 90.0
    assert "gain on bright: diverges first in pass gain, target gain: outside its bounds" in out


def test_recorded_pictures_hold_until_the_meaning_changes(capsys: pytest.CaptureFixture[str]) -> None:
    Path("own.py").write_text(MODULE.format(gain=0.5))
    out = well(capsys, "check", "own.py", "-b", "numpy", "--golden", "gold", "--record", "--size", "16x8")
    assert "gain: recorded in gold" in out
    manifest = json.loads(Path("gold/manifest.json").read_text())
    assert manifest["graphs"]["gain"]["size"] == [16, 8]
    assert np.load(Path("gold") / manifest["graphs"]["gain"]["outputs"]["gain"]).shape == (8, 16, 4)
    assert "gain: as recorded" in well(capsys, "check", "own.py", "-b", "numpy", "--golden", "gold")
    # The same product by another way, and then a little more.
    Path("own.py").write_text(MODULE.format(gain=0.5).replace("* by", "/ (1.0 / by)"))
    well(capsys, "check", "own.py", "-b", "numpy", "--golden", "gold")
    Path("own.py").write_text(MODULE.format(gain=0.50001))
    status, out, _ = outcome(capsys, "check", "own.py", "-b", "numpy", "--golden", "gold")
    assert status == 1
    assert "gain: output gain is not as recorded: " in out


def test_a_manifest_names_files_of_its_folder_only(capsys: pytest.CaptureFixture[str]) -> None:
    Path("own.py").write_text(MODULE.format(gain=0.5))
    well(capsys, "check", "own.py", "-b", "numpy", "--golden", "gold", "--record", "--size", "4x4")
    path = Path("gold/manifest.json")
    path.write_text(path.read_text().replace("gain-output-gain.npy", "../secret.npy"))
    pg.save("secret.npy", np.zeros((4, 4, 4), np.float32))
    status, _, err = outcome(capsys, "check", "own.py", "-b", "numpy", "--golden", "gold")
    assert status == 2
    assert "gold/secret.npy: cannot be read" in err


class Folded(ReferenceBackend):
    """Takes every NaN for what a compiler makes of it that folds 0 / x to 0."""

    name = "folded"

    def download(self, storage: Any) -> Any:
        return np.nan_to_num(super().download(storage), nan=1.0)


OVER = """
import passgraph as pg
over = pg.kernel(source="def over(c: Image) -> vec4: return 1.0 - 0.0 / c[0, 0]")
"""


@pytest.mark.parametrize("format", [None, "rgba16f", "rgba8", "r32f"])
def test_made_inputs_hold_zeros_so_that_a_folded_quotient_is_seen(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, format: str | None
) -> None:
    monkeypatch.setattr("passgraph.backends.registry.open_backend", lambda name: Folded())
    Path("own.py").write_text(f"{OVER}\noutputs = over(pg.Input('c', {format!r}), into=pg.target('o', 'rgba32f'))\n")
    status, out, err = outcome(capsys, "check", "own.py", "-b", "gl")
    assert (status, err) == (1, "")
    assert "where the reference has nan" in out


@pytest.mark.parametrize(
    ("kind", "wanted"),
    [
        ("f4", [0, 1, 0.5, -1, -2.5, 1e20, 3e38, 1e-37, -1e20]),
        ("f2", [0, 1, 0.5, -1, 65504, -65504, 2.0**-24]),
        ("u1", [0, 1, 0.5]),
        ("u2", [0, 1, 0.5]),
    ],
)
def test_made_inputs_hold_what_their_format_holds(kind: str, wanted: list[float]) -> None:
    plain = picture((96, 64))
    made = with_special(plain, kind)
    lower = made[48:]
    for channel in range(4):
        assert set(np.float32(wanted)) <= set(lower[..., channel].ravel())
    # Two channels meet in most combinations; most of the picture stays as it was.
    pairs = {tuple(pair) for pair in lower[:, :, :2].reshape(-1, 2).tolist()}
    assert len(pairs) >= 0.8 * len(np.unique(lower)) ** 2
    np.testing.assert_array_equal(made[:48], plain[:48])
    if kind.startswith("u"):
        assert 0 <= lower.min() <= lower.max() <= 1
