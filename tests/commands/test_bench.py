"""``passgraph bench`` from the command line."""

from __future__ import annotations

from pathlib import Path

import pytest

from passgraph.commands.entry import run


def test_the_list_names_scenes_and_methods(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["bench", "--list"]) == 0
    out = capsys.readouterr().out
    for name in ("shipped", "sphere", "pcss-32", "five-pass", "penumbra-16"):
        assert name in out


def test_a_quick_run_writes_its_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for package in ("skimage", "flip_evaluator", "matplotlib"):
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
    for package in ("skimage", "flip_evaluator", "matplotlib"):
        pytest.importorskip(package)
    assert run(["bench", *arguments, "-o", str(tmp_path / "made")]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "made").exists()
