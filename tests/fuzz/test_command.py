"""``passgraph fuzz``: exit statuses, files of failures, replaying."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest

from passgraph.backends.reference import ReferenceBackend
from passgraph.backends.registry import BUILT_IN
from passgraph.commands.entry import run


class Skewed(ReferenceBackend):
    """A backend with a mistake in every pixel pass."""

    name = "skewed"

    def pixel_pass(self, step: Any) -> Any:
        compute = super().pixel_pass(step)

        def skewed(outputs: Any, images: Any, block: Any) -> None:
            compute(outputs, images, block)
            outputs[0].pixels[...] += 0.25

        return skewed


@pytest.fixture
def skewed(monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.setattr("passgraph.backends.registry.open_backend", lambda _: Skewed())
    monkeypatch.setitem(BUILT_IN, "skewed", "passgraph.backends.reference:ReferenceBackend")
    return "skewed"


def test_nothing_found_is_0_and_leaves_no_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "failures"
    arguments = ["fuzz", "--minutes", "0.01", "--what", "kernels", "-b", "reference", "--failures", str(folder)]
    assert run(arguments) == 0
    assert "verdicts: reference" in capsys.readouterr().out
    assert not folder.exists()


def test_a_failure_is_1_and_written_with_the_line_that_replays_it(
    skewed: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "failures"
    arguments = ["fuzz", "--minutes", "0.02", "--seed", "0", "--what", "kernels", "-b", skewed]
    arguments += ["--failures", str(folder), "--export-repro", str(tmp_path / "repro")]
    assert run(arguments) == 1
    (path,) = folder.glob("*.json")
    said = capsys.readouterr().out
    assert "no reproduction on skewed: skewed does not say what it sends for pass out" in said
    assert f"again: passgraph fuzz --replay {path} --backend skewed" in said
    kept = json.loads(path.read_text())
    assert kept["why"].startswith("skewed: pass out, target out: outside its bounds")
    assert [one["options"] for one in kept["conditions"]] == [{"seed": 0}]
    assert kept["conditions"][0]["devices"] == {"skewed": [vars(Skewed().device_info())]}
    assert run(["fuzz", "--replay", str(path), "-b", skewed]) == 1
    monkeypatch.undo()
    assert run(["fuzz", "--replay", str(folder), "-b", "reference"]) == 0
    assert "1 run again, 0 failed" in capsys.readouterr().out


def test_each_run_has_a_seed_of_its_own_and_says_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    seeds = []
    for given in ([], [], ["--seed", "7"]):
        assert run(["fuzz", "--minutes", "0", "-b", "reference", "--failures", str(tmp_path / "none"), *given]) == 0
        first = capsys.readouterr().out.splitlines()[0]
        seeds.append(first.removeprefix("seed ").split(";")[0])
        assert first == f"seed {seeds[-1]}; again: --seed {seeds[-1]}"
    assert len(set(seeds)) == 3
    assert seeds[2] == "7"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--minutes", "-1"], "is not in the range"),
        (["--what", "spells"], "is not one of"),
        (["--backend", "nothing"], "there is no backend 'nothing'"),
        (["--replay", "nothing.json", "-b", "reference"], "nothing.json cannot be read as a case"),
        (["--failures", "no/such/folder", "-b", "reference"], "make its parent first"),
    ],
)
def test_errors_are_one_line_and_2(arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["fuzz", *arguments]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert len(said.splitlines()) == 1


def test_without_hypothesis_the_message_says_what_installs_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "passgraph.verify.fuzz.search", None)
    assert run(["fuzz", "-b", "reference"]) == 2
    assert "pip install 'passgraph[fuzz]'" in capsys.readouterr().err
