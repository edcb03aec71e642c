"""The suite as tests of a project elsewhere, which brings a backend of its own."""

from __future__ import annotations

from importlib.metadata import entry_points
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

pytest_plugins = ["pytester"]

root = Path(__file__).resolve().parents[2]
MODULE = "passgraph.verify.conformance.pytest_plugin"
#: Where passgraph is installed, pytest finds the plugin by itself.
INSTALLED = any(entry.value == MODULE for entry in entry_points(group="pytest11"))

BACKEND = """
from dataclasses import replace
from passgraph.backends.reference import ReferenceBackend


class PlainBackend(ReferenceBackend):
    name = "plain"


class NarrowBackend(ReferenceBackend):
    name = "narrow"
    limits = replace(ReferenceBackend.limits, not_kept={"u2": "wide fractions"})


class BrightBackend(ReferenceBackend):
    name = "bright"

    def download(self, storage):
        return super().download(storage) + 0.25
"""


@pytest.fixture
def project(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> pytest.Pytester:
    """A package with two backends, installed as far as entry points go, and one test of its own."""
    pytester.makepyfile(my_backends=BACKEND, test_own="def test_own(): pass")
    info = pytester.mkdir("my_backends-1.0.dist-info")
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: my-backends\nVersion: 1.0\n")
    lines = "plain = my_backends:PlainBackend\nbright = my_backends:BrightBackend\nnarrow = my_backends:NarrowBackend\n"
    (info / "entry_points.txt").write_text(f"[passgraph.backends]\n{lines}")
    monkeypatch.setenv("PYTHONPATH", f"{pytester.path}:{root}")
    return pytester


def run(project: pytest.Pytester, *arguments: str) -> pytest.RunResult:
    plugin = () if INSTALLED else ("-p", MODULE)
    return project.runpytest_subprocess(*plugin, "-p", "no:cacheprovider", *arguments)


def test_every_case_is_a_test(project: pytest.Pytester) -> None:
    result = run(project, "--passgraph-backend", "plain", "--passgraph-group", "sequences", "-v")
    result.assert_outcomes(passed=15)
    result.stdout.fnmatch_lines(["*passgraph/plain::conformance[[]plain-sequences/a running sum in rgba32f[]] PASSED*"])


def test_what_a_device_lacks_is_skipped(project: pytest.Pytester) -> None:
    group = ("--passgraph-group", "pictures", "-k", "r16 and 7x5 and clamp", "-rs")
    result = run(project, "--passgraph-backend", "narrow", *group)
    result.stdout.fnmatch_lines(["SKIPPED*is r16; *takes wide fractions*"])


def test_what_does_not_conform_fails_with_its_verdict(project: pytest.Pytester) -> None:
    group = ("--passgraph-group", "operations", "-k", "smoothstep or test_own")
    result = run(project, "--passgraph-backend", "bright", *group)
    result.assert_outcomes(failed=1, passed=1)
    result.stdout.fnmatch_lines(
        ["*operations/smoothstep on bright: diverged: frame 0, pass result0+result1, target result0: outside*"]
    )
    assert "Traceback" not in result.stdout.str()


def test_in_junit_files_class_and_name_have_the_backend_and_properties_its_device(project: pytest.Pytester) -> None:
    run(
        project,
        "--passgraph-backend",
        "plain",
        "--passgraph-group",
        "operations",
        "-k",
        "smoothstep",
        "--junitxml",
        "p.xml",
    )
    (case,) = ElementTree.parse(project.path / "p.xml").getroot().iter("testcase")
    assert case.attrib["classname"] == "passgraph.plain"
    assert case.attrib["name"] == "conformance[plain-operations/smoothstep]"
    properties = {one.attrib["name"]: one.attrib["value"] for one in case.iter("property")}
    assert properties == {"device": "CPU, float64", "driver": "numpy", "version": np.__version__}


def test_quick_leaves_cases_out(project: pytest.Pytester) -> None:
    arguments = ["--passgraph-backend", "plain", "--passgraph-group", "pictures", "--collect-only", "-q"]
    every, quick = (len(run(project, *arguments, *more).outlines) for more in ([], ["--passgraph-quick"]))
    assert 20 < quick < every


def test_without_the_option_nothing_is_added(project: pytest.Pytester) -> None:
    run(project).assert_outcomes(passed=1)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--passgraph-backend", "plain", "--passgraph-group", "nope"], "*there is no group 'nope' of cases*"),
        (["--passgraph-backend", "plane", "--passgraph-group", "sequences", "-k", "sum"], "*did you mean 'plain'*"),
    ],
)
def test_what_there_is_not_is_named(project: pytest.Pytester, arguments: list[str], message: str) -> None:
    result = run(project, *arguments)
    assert result.ret != 0
    (result.stderr if "nope" in arguments else result.stdout).fnmatch_lines([message])
