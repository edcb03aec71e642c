"""The conformance suite can fail: mistakes planted in copies of the sources, each caught by a case.

A few of them at every run; ``python -m tests.mutation.run`` tries all.
"""

from __future__ import annotations

import json
import textwrap
from dataclasses import replace
from pathlib import Path

import pytest

from tests.conftest import require
from tests.mutation.mutant import SHARED_WITH_ORACLE, WRITES_TEXT, Fate, Mutant, Tree
from tests.mutation.places import ROOT, definitions, sources
from tests.mutation.run import MUTANTS, STALE, Record, judged, stale

#: One of each kind, by what is planted: an operation, a border, a quantiser, a fill rule, a draw state, the plan.
CHOSEN = (
    "b.fsub(y, x",
    "return y * (1.0 - a) + x * a",
    'b.index("less", number(0), size)',
    "return floor(min(max(0.0, x), 1.0) * steps + 0.5) / steps",
    "self.busy[0][0] <= first:",
    '"{x} * {da}"',
    "return value;",
    "share = d / (d - e), rest = -e / (d - e);",
)


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Tree:
    """A copy of the sources to plant mistakes in."""
    folder = tmp_path_factory.mktemp("mutated")
    return Tree(folder, folder / "bounds")


def chosen() -> list[Mutant]:
    found = [mutant for text in CHOSEN for mutant in MUTANTS if text in mutant.new]
    assert len(found) == len(CHOSEN), "each text stands for one mutant"
    return found


@pytest.mark.parametrize("backend", sorted({mutant.backend for mutant in chosen()}))
def test_a_mistake_is_caught(backend: str, tree: Tree) -> None:
    """By one of the cases that are named; those that catch one pass, by the same bounds, where none is planted."""
    require(backend)
    fates = {m.name: tree.judge(m, [], everything=False) for m in chosen() if m.backend == backend}
    assert all(fate.caught and fate.case for fate in fates.values()), fates
    catching = tuple(fate.case for fate in fates.values())
    assert set(catching) <= set(tree.passing(backend, catching, everything=False)), fates


def test_every_mistake_can_still_be_planted() -> None:
    assert stale() == []


def test_files_that_change_how_a_mistake_is_judged_are_there() -> None:
    for end in WRITES_TEXT:
        assert any(file.endswith(end) for file in sources()), end
    for beginning in SHARED_WITH_ORACLE:
        assert any(file.startswith(beginning) for file in sources()), beginning


def test_code_may_move_and_be_indented_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """A mistake of two lines finds its function by name: at the beginning of a line, in a class, beside its like."""
    mutant = Mutant("f", "x = 1\n    return x", "return 2", "gl", ())
    plain = "def f():\n    x = 1\n    return x\n"
    inside = "class C:\n" + textwrap.indent(plain, "    ")
    for text, name in ((plain, "f"), (inside, "C.f"), (plain + "\n\ndef g():\n    x = 1\n    return x\n", "f")):
        monkeypatch.setattr("tests.mutation.places.sources", lambda text=text: {"moved.py": text})
        monkeypatch.setattr("tests.mutation.mutant.sources", lambda text=text: {"moved.py": text})
        definitions.cache_clear()
        made = replace(mutant, function=name).planted
        assert "return 2" in made.partition("def g")[0]
        compile(made, "moved.py", "exec")
    definitions.cache_clear()


def test_a_mutated_tree_leaves_the_sources_alone(tree: Tree) -> None:
    """The copy is changed, run, and put back; nothing else is touched."""
    mutant = chosen()[0]
    file = mutant.place.file
    original = (ROOT / file).read_text(encoding="utf-8")
    tree.judge(mutant, ["none"], everything=False)
    assert (ROOT / file).read_text(encoding="utf-8") == original
    assert (tree.folder / "tree" / file).read_text(encoding="utf-8") == original


def test_a_mistake_whose_text_is_gone_is_stale_and_not_caught(tree: Tree) -> None:
    gone = Mutant("set_draw", "no such text", "", "numpy", ())
    assert "definitions named set_draw have 'no such text' 0 times" in stale((gone,))[0]
    ((_, fate),) = judged([gone], tree.folder / "other", 1, named=True)
    assert (fate.outcome, fate.caught) == (STALE, False)


def test_fates_that_are_known_stay_and_those_of_former_mutants_go(tmp_path: Path) -> None:
    rows = [
        {
            "function": mutant.function,
            "old": mutant.old,
            "new": mutant.new,
            "backend": mutant.backend,
            "outcome": outcome,
        }
        for mutant, outcome in zip(MUTANTS, ("diverged", STALE), strict=False)
    ]
    path = tmp_path / "fates.json"
    path.write_text(json.dumps([*rows, {**rows[0], "old": "what was mended"}]), encoding="utf-8")
    record = Record(path)
    assert [record.knows(mutant) for mutant in MUTANTS[:3]] == [True, False, False]
    record.write(MUTANTS[2], Fate("a case", "diverged", "", 1))
    kept = json.loads(path.read_text(encoding="utf-8"))
    assert [row["outcome"] for row in kept] == ["diverged", STALE, "diverged"]
    assert [row["old"] for row in kept] == [mutant.old for mutant in MUTANTS[:3]]
