"""docs/seeds.md: every point once, no cell empty, and everything that it names exists."""

from __future__ import annotations

import re
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

import pytest

from passgraph.backends.registry import backend_names

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
#: Points of each list.
COUNTS = {"S0": 12, "S1": 22, "S2": 10, "S3": 10, "S4": 7, "C": 6}
POINTS = [f"{group}.{number}" for group, count in COUNTS.items() for number in range(1, count + 1)]
OPEN = "TODO"


class Row(NamedTuple):
    point: str
    what: str
    where: str
    test: str
    shown: str
    backends: str


@lru_cache
def rows() -> tuple[Row, ...]:
    lines = (DOCS / "seeds.md").read_text(encoding="utf-8").splitlines()
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if re.match(r"\| (S\d|C)\.", line)]
    assert all(len(row) == len(Row._fields) for row in cells), "a row has more or fewer than six cells"
    return tuple(Row(*row) for row in cells)


def row(point: str) -> Row:
    return next(found for found in rows() if found.point == point)


@lru_cache
def known_tests(file: str) -> frozenset[str]:
    """Tests of a file; what a benchmark measures is its ``main``."""
    return frozenset(re.findall(r"^def (test_\w+|main)\(", (ROOT / file).read_text(encoding="utf-8"), re.MULTILINE))


def test_every_point_stands_there_once_in_order() -> None:
    assert [found.point for found in rows()] == POINTS


@pytest.mark.parametrize("point", POINTS)
def test_no_cell_is_empty_or_open(point: str) -> None:
    unfinished = [name for name, cell in row(point)._asdict().items() if not cell or OPEN in cell]
    assert not unfinished, f"{point}: {', '.join(unfinished)}"


@pytest.mark.parametrize("point", POINTS)
def test_what_is_named_exists(point: str) -> None:
    found = row(point)
    named = re.findall(r"`([\w.]+):(\w+)`", found.where)
    for module, name in named:
        assert hasattr(import_module(module), name), f"{module} has no {name}"
    tests = re.findall(r"`([\w/.]+\.py)::(\w+)`", found.test)
    for file, test in tests:
        assert (ROOT / file).is_file(), file
        assert test in known_tests(file), f"{file} has no {test}"
    for link in re.findall(r"\]\(([^)]+)\)", found.shown):
        assert (DOCS / link).is_file(), link
    # cells hold names of these forms and nothing else
    assert OPEN in found.where or len(named) == found.where.count("`") / 2 > 0
    assert OPEN in found.test or len(tests) == found.test.count("`") / 2 > 0


@pytest.mark.parametrize("point", POINTS)
def test_backends_are_known(point: str) -> None:
    names = row(point).backends.split(", ")
    assert names == [OPEN] or set(names) <= set(backend_names())
    assert len(set(names)) == len(names)
