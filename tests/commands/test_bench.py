"""``passgraph bench`` from the command line."""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import numpy as np
import pytest

from passgraph.commands.entry import run


def test_the_list_names_scenes_and_methods(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["bench", "--list"]) == 0
    out = capsys.readouterr().out
    for name in ("shipped", "sphere", "pcss-32", "five-pass", "penumbra-16"):
        assert name in out


def test_a_quick_run_writes_its_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for package in ("skimage", "matplotlib"):
        pytest.importorskip(package)
    folder = tmp_path / "made"
    arguments = ["--quick", "--size", "64x36", "-b", "numpy", "-m", "hard", "-m", "pcf-3", "--frames", "1"]
    assert run(["bench", "box", *arguments, "-o", str(folder)]) == 0
    assert "truth by" in capsys.readouterr().out
    assert (folder / "report.html").exists()
    assert (folder / "box-numpy.png").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [(["-m", "magic"], "there is no shadow method 'magic'"), (["nowhere"], "there is no bench scene 'nowhere'")],
)
def test_what_is_not_there_is_refused(
    arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for package in ("skimage", "matplotlib"):
        pytest.importorskip(package)
    assert run(["bench", *arguments, "-o", str(tmp_path / "made")]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "made").exists()


FILE = """
import passgraph as pg
from passgraph import Image, uv, vec4

@pg.kernel
def scaled(color: Image, by: float) -> vec4:
    return color.sample(uv()) * by

frame = pg.Input("frame", "rgba32f")
outputs = {
    "exact": scaled(frame, by=0.5, into=pg.target("a", "rgba32f")),
    "near": scaled(frame, by=0.4375, into=pg.target("b", "rgba32f")),
    "small": scaled(frame, by=0.5, into=pg.target("c", "rgba32f", scale=0.5)),
}
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    for package in ("skimage", "matplotlib"):
        pytest.importorskip(package)
    np.save(tmp_path / "frame.npy", np.full((24, 32, 4), 0.75, np.float32))
    (tmp_path / "own.py").write_text(FILE)
    return tmp_path / "own.py"


def own(file: Path, *arguments: str) -> int:
    given = ["-i", f"frame={file.with_name('frame.npy')}", "-b", "numpy", "--frames", "1"]
    return run(["bench", str(file), *given, *arguments, "-o", str(file.with_name("made"))])


def test_versions_of_a_graph_are_held_against_the_exact_one(file: Path) -> None:
    assert own(file, "--exact", "exact", "-m", "near") == 0
    with open(file.with_name("made") / "results.csv", encoding="utf-8") as lines:
        exact, near = csv.DictReader(lines)
    assert (exact["version"], float(exact["rmse"]), float(exact["ssim"])) == ("exact", 0, 1)
    # a sixteenth of 0.75 in each value
    assert (near["version"], float(near["rmse"]), float(near["largest"])) == ("near", 0.046875, 0.046875)
    made = {path.name for path in file.with_name("made").iterdir()}
    assert made == {"results.csv", "numpy.png", "numpy-exact.png", "numpy-near.png"}


@pytest.mark.parametrize("is_installed", [True, False])
def test_flip_is_measured_if_it_is_installed(
    file: Path, is_installed: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    if is_installed:
        pytest.importorskip("flip_evaluator")
    else:
        monkeypatch.setitem(sys.modules, "flip_evaluator", None)
        monkeypatch.setattr("passgraph.bench.metrics.find_spec", lambda name: name != "flip_evaluator" or None)
    assert own(file, "--exact", "exact", "-m", "near") == 0
    with open(file.with_name("made") / "results.csv", encoding="utf-8") as lines:
        exact, near = csv.DictReader(lines)
    printed = capsys.readouterr()
    if is_installed:
        assert float(exact["flip"]) == 0.0 < float(near["flip"])
        assert printed.err == ""
    else:
        assert (exact["flip"], near["flip"]) == ("nan", "nan")
        assert "FLIP is not measured (nan); flip-evaluator is not installed; run: pip install 'passgraph[flip]'" in (
            printed.err
        )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "say which output the others are held against: --exact exact or near or small"),
        (["--exact", "best"], "has no output 'best'; there are exact, near, small"),
        (["--exact", "exact", "-m", "fast"], "has no output 'fast'"),
        (
            ["--exact", "exact"],
            "version 'small' is 16x12 with 4 channels, and 'exact', which it is held against, 32x24",
        ),
        (["--exact", "exact", "--map-size", "64"], "--map-size is for shadow methods on a scene"),
        (["--exact", "exact", "-i", "photo=frame.npy"], "there is no input 'photo'; there are frame"),
    ],
)
def test_versions_that_cannot_be_compared_are_refused(
    arguments: list[str], message: str, file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert own(file, *arguments) == 2
    assert message in capsys.readouterr().err


def test_one_version_is_nothing_to_compare(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file.write_text(FILE.partition("outputs")[0])
    assert own(file, "--exact", "scaled") == 2
    assert "bench compares versions of one picture; write outputs = {" in capsys.readouterr().err


def test_options_of_versions_are_refused_for_scenes(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["bench", "box", "--exact", "hard"]) == 2
    assert "--exact is for a file of your own, FILE.py" in capsys.readouterr().err
