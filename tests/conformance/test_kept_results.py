"""Results of the suite that are kept: with their device, selected, repeated, and compared with earlier ones."""

from __future__ import annotations

import json
import os
import re
from datetime import UTC, datetime
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.reference import ReferenceBackend
from passgraph.backends.registry import open_backend
from passgraph.commands.entry import run as run_command
from passgraph.verify.conformance import GROUPS, cases, run
from passgraph.verify.conformance.kept_results import json_of, kept, load
from passgraph.verify.conformance.page import html_of
from passgraph.verify.conformance.selection import most_telling_first, selected

ADD, SINE = "operations/add", "operations/sin"


class Off(ReferenceBackend):
    """The reference, with 0.25 added to every download that ``is_off`` chooses by its number."""

    name = "off"

    def __init__(self, is_off: Any = lambda number: True) -> None:
        super().__init__()
        self.is_off, self.numbers = is_off, count()

    def download(self, storage: Any) -> Any:
        return super().download(storage) + np.float32(0.25 * self.is_off(next(self.numbers)))


@pytest.fixture(autouse=True)
def in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def command(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    capsys.readouterr()
    status = run_command(list(arguments))
    out, err = capsys.readouterr()
    return status, out, "".join(line for line in err.splitlines(True) if "(case " not in line)


def report_of(backend: Any, *names: str) -> dict[str, Any]:
    document: dict[str, Any] = json.loads(json_of(run(backend, selected(cases(), names))))
    return document


# The device


def test_a_report_has_its_device_and_all_that_it_depends_on(monkeypatch: pytest.MonkeyPatch, backend_name: str) -> None:
    monkeypatch.setenv("GALLIVM_PERF", os.environ.get("GALLIVM_PERF", "nopt"))
    with open_backend(backend_name) as backend:
        info = backend.device_info()
        report = run(backend, selected(cases(), [ADD]), math="native")
    document = json.loads(json_of(report))
    assert (info.name, info.missing) != ("", "")
    (listed,) = (one for one in type(backend).devices() if one == info)
    assert document["devices"] == {backend_name: [vars(listed)]}
    assert document["passgraph"] == pg.__version__
    assert document["libraries"]["numpy"] == np.__version__
    assert {"system", "cpu", "python"} <= document.keys()
    assert document["options"] == {"math": "native", "repeat": 1, "most_seconds": None}
    assert document["variables"]["GALLIVM_PERF"] == os.environ["GALLIVM_PERF"]
    assert datetime.fromisoformat(document["date"]).tzinfo == UTC
    page = html_of(report)
    for text in (info.name, info.driver, info.version, document["date"], document["system"]):
        assert text in re.sub("&amp;", "&", page)


# Which cases


def test_patterns_choose_cases() -> None:
    chosen = [case.id for case in selected(cases(), ["operations/add*", "operations/sub"], ["*ints"])]
    assert chosen == ["operations/add", "operations/sub"]
    # A name is taken as it stands: its brackets are no pattern.
    assert [case.id for case in selected(cases(), ["draws/blend from beyond [0, 1] into rgba8"])] == [
        "draws/blend from beyond [0, 1] into rgba8"
    ]


def test_a_pattern_that_names_no_case_is_refused() -> None:
    expected = "only: no case is named 'operations/ad' (did you mean 'operations/add'?); expected group/name"
    with pytest.raises(pg.InputError, match=re.escape(expected)):
        selected(cases(), ["operations/ad"])
    with pytest.raises(pg.InputError, match="skip: no case is named 'x'; expected"):
        selected(cases(), skip=["x"])


def test_every_group_comes_soon_and_cases_like_others_last() -> None:
    ordered = most_telling_first(cases())
    assert {case.group for case in ordered[: len(GROUPS)]} == set(GROUPS)
    assert sorted(case.id for case in ordered) == sorted(case.id for case in cases())
    for group in GROUPS:
        quick = [case.quick for case in ordered if case.group == group]
        assert quick == sorted(quick, reverse=True)


def test_no_case_begins_after_the_time() -> None:
    report = run("reference", selected(cases(), [ADD, SINE]), most_seconds=0.0)
    assert (report.verdicts, report.not_run, report.passed) == ((), (ADD, SINE), False)
    assert json.loads(json_of(report))["not run"] == [ADD, SINE]


def test_a_case_with_several_outcomes_is_flaky() -> None:
    right = Off(lambda number: False)
    run(right, selected(cases(), [ADD]))
    downloads = next(right.numbers)
    report = run(Off(lambda number: number < downloads), selected(cases(), [ADD]), repeat=3)
    (verdict,) = report.verdicts
    assert verdict.outcome == "flaky"
    assert f"{ADD} on off: flaky: of 3 runs 1 diverged, 2 passed. frame 0" in str(verdict)
    assert "outside its bounds" in str(verdict)
    assert not report.passed
    assert run(Off(), selected(cases(), [ADD]), repeat=2).verdicts[0].outcome == "diverged"


@pytest.mark.parametrize(("name", "value"), [("repeat", 0), ("repeat", 1.5), ("most_seconds", -1.0)])
def test_numbers_out_of_range_are_refused(name: str, value: Any) -> None:
    with pytest.raises(pg.InputError, match=name):
        run("reference", [], **{name: value})


# Against earlier results


@pytest.fixture
def off(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The backend that the command opens as gl: the last of the list."""
    opened: list[Any] = [Off()]
    monkeypatch.setattr("passgraph.verify.conformance.suite.open_backend", lambda name: opened[-1])
    return opened


def test_failures_of_the_baseline_pass_and_new_ones_fail(capsys: pytest.CaptureFixture[str], off: list[Any]) -> None:
    both = ["conform", "-b", "gl", "--only", ADD, "--only", SINE]
    status, _, _ = command(capsys, *both, "--skip", SINE, "--json", "base.json")
    assert status == 1
    status, out, err = command(capsys, *both, "--skip", SINE, "--baseline", "base.json")
    assert (status, err) == (0, "")
    assert out.endswith("1 known failure\n")
    status, out, _ = command(capsys, *both, "--baseline", "base.json")
    assert status == 1
    assert f"new failure: {SINE}: diverged, error 0.25, in base.json not run\n" in out
    assert out.endswith("1 new failure, 1 known failure\n")
    off.append(Off(lambda number: False))
    status, out, _ = command(capsys, *both, "--baseline", "base.json")
    assert status == 0
    assert f"mended: {ADD}: passed, error " in out
    assert out.endswith("1 mended, 1 good\n")


def test_another_way_to_fail_is_new(capsys: pytest.CaptureFixture[str], off: list[Any]) -> None:
    command(capsys, "conform", "-b", "gl", "--only", ADD, "--json", "base.json")

    class Raising(Off):
        def download(self, storage: Any) -> Any:
            raise RuntimeError("no such storage")

    off.append(Raising())
    status, out, _ = command(capsys, "conform", "-b", "gl", "--only", ADD, "--baseline", "base.json")
    assert status == 1
    assert f"new failure: {ADD}: failed, error 0, in base.json diverged, error 0.5\n" in out


def test_two_reports_are_compared_case_by_case(capsys: pytest.CaptureFixture[str]) -> None:
    good, bad = report_of("numpy", ADD, SINE), report_of(Off(), ADD, "operations/cos")
    Path("a.json").write_text(json.dumps(good))
    Path("b.json").write_text(json.dumps(bad))
    status, out, err = command(capsys, "conform", "--compare", "a.json", "b.json", "--report", "ab.html")
    assert (status, err) == (1, "")
    lines = out.splitlines()
    assert lines[0].startswith("A: numpy; ")
    assert lines[1].startswith("B: off; CPU, float64, numpy ")
    assert any(line.startswith("device: CPU, float64") and ", in A " in line for line in lines)
    assert f"new failure: {ADD}: diverged, error 0.5, in A passed, error 0" in lines
    assert "2 new failure, 1 not run" in lines
    page = Path("ab.html").read_text()
    for text in (ADD, SINE, "operations/cos", "Cases that differ: 3", "Cases that are the same: 0", "0.25"):
        assert text in page
    status, out, _ = command(capsys, "conform", "--compare", "b.json", "b.json")
    assert (status, out.splitlines()[2:]) == (0, ["2 known failure"])
    status, out, _ = command(capsys, "conform", "--compare", "b.json", "a.json")
    assert status == 0
    assert f"mended: {ADD}: passed, error 0, in A diverged, error 0.5\n" in out


def test_errors_that_moved_are_named(capsys: pytest.CaptureFixture[str]) -> None:
    one = report_of("numpy", ADD, SINE)
    for entry in one["cases"]:
        entry["error"] = 1e-7
    Path("a.json").write_text(json.dumps(one))
    one["cases"][1]["error"] = 3e-7
    Path("b.json").write_text(json.dumps(one))
    status, out, _ = command(capsys, "conform", "--compare", "a.json", "b.json")
    assert status == 0
    assert f"other error: {SINE}: passed, error 3e-07, in A passed, error 1e-07\n2 good\n" in out


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "base.json: is not JSON ("),
        ("[]", "base.json: is no report of the conformance suite (TypeError"),
        ('{"backend": "gl", "cases": [{"case": "a", "outcome": "odd"}]}', "unknown outcome 'odd'); write one with"),
    ],
)
def test_a_file_that_is_no_report_is_refused(capsys: pytest.CaptureFixture[str], text: str, message: str) -> None:
    Path("base.json").write_text(text)
    status, out, err = command(capsys, "conform", "-b", "numpy", "--baseline", "base.json")
    assert (status, out) == (2, "")
    assert message in err


def test_reports_of_earlier_versions_are_read() -> None:
    found = kept({"backend": "gl", "cases": [{"case": ADD, "outcome": "passed"}]}, "old.json")
    assert found.title == "gl; of no known date"
    assert str(found.cases[ADD]) == "passed, error nan"


def test_infinite_errors_survive_the_file() -> None:
    document = report_of("numpy", ADD)
    document["cases"][0]["error"] = "inf"
    Path("a.json").write_text(json.dumps(document))
    assert load(Path("a.json")).cases[ADD].error == np.inf


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--compare", "a.json", "b.json", "-b", "gl"], "--compare reads two reports and runs nothing; leave out"),
        (["--compare", "a.json", "b.json", "--quick"], "--compare reads two reports and runs nothing; leave out"),
        (
            ["-b", "numpy", "--functions", "--repeat", "2"],
            "--functions measures functions and runs no cases; leave out",
        ),
        (["-b", "numpy", "--only", "nothing"], "only: no case is named 'nothing'"),
    ],
)
def test_options_that_do_not_go_together(
    capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    status, out, err = command(capsys, "conform", *arguments)
    assert (status, out) == (2, "")
    assert message in err
