"""The table of benchmarks and the fit of growth, on figures whose answers are known."""

from __future__ import annotations

import sys

import pytest

from tests.benchmarks import growth, run
from tests.benchmarks.harness import Ratio, ratio_of


def test_the_exponent_of_a_power_law_is_found() -> None:
    assert growth.exponent({n: 3.0 * n**1.5 for n in (1, 10, 250, 4000)}) == pytest.approx(1.5)
    assert growth.exponent({1: 2.0, 64: 2.0}) == pytest.approx(0.0)


def test_a_ratio_is_met_at_most_or_at_least() -> None:
    assert Ratio("time", 1.3, 1.3).met
    assert Ratio("time", 1.31, 1.3).met is False
    assert Ratio("saved", 40.0, 40.0, unit="%", at_least=True).met
    assert Ratio("saved", 39.9, 40.0, unit="%", at_least=True).met is False
    assert Ratio("seen", 5.0, None).met is None


def test_neighbours_in_time_are_what_a_ratio_compares() -> None:
    """The machine became three times slower half way, for both alike."""
    found = ratio_of("a / b", [1.0, 1.0, 3.0, 3.0], [2.0, 2.0, 6.0, 6.0], 0.6)
    assert (found.got, found.met) == (0.5, True)
    assert ratio_of("b / a", [1.0, 3.0], [2.0, 6.0], 1.0, faster=True).got == 2.0


def test_an_absent_peer_is_named_with_what_to_install() -> None:
    absent = run.Benchmark(run.memory, {"no_such_module": "no-such-package", "json": "json"})
    assert run.missing(absent, sys.executable) == ["no-such-package"]
    table = run.markdown([run.Outcome("bloom", skipped="needs arcade: pip install arcade")])
    assert table.splitlines()[-1] == "| bloom: needs arcade: pip install arcade | | | | | skipped |"


@pytest.mark.slow
@pytest.mark.opencl
@pytest.mark.parametrize("name", ["compile", "opencl", "opencl host", "overhead", "memory"])
def test_benchmarks_that_look_into_programs_run(name: str) -> None:
    found = run.measured(name, True, sys.executable)
    assert found.ratios, found.skipped


def test_a_row_says_what_was_wanted() -> None:
    assert run.cells(Ratio("a / b", 1.314, 1.3, 2.0, 1.522)) == ("a / b", "1.31 ×", "≤ 1.3 ×", "2.00", "1.52", "missed")
