"""Plants every mistake in turn and says which ones the conformance suite catches.

``python -m tests.mutation.run [--backend NAME] [--file PART] [--json FILE [--missing]] [--workers N]`` from the root of
the repository.  Exit status: 0 where every mistake that matters is caught, 1 where some survive, 2 where some are out
of date.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import groupby
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from tests.mutation.mutant import Fate, Mutant, Tree
from tests.mutation.seams import MUTANTS

#: Outcome of a mutant whose text is no longer in the sources: it says nothing.
STALE = "stale"


def stale(mutants: tuple[Mutant, ...] = MUTANTS) -> list[str]:
    """Mutants whose text is no longer in the sources."""
    messages = []
    for mutant in mutants:
        try:
            _ = mutant.place
        except ValueError as error:  # the sources changed since they were looked at
            messages.append(str(error))
    return messages


def file_of(mutant: Mutant) -> str:
    """The file that it is planted in; empty for one that is out of date."""
    return "" if stale((mutant,)) else mutant.place.file


def judged(mutants: list[Mutant], folder: Path, workers: int, *, named: bool = False) -> Iterator[tuple[Mutant, Fate]]:
    """Each with its fate, in order; a tree for each worker.

    Cases that do not pass without a mistake are left out.  With ``named`` only those that a mutant names are run; so it
    is for mutants that are said to be harmless.
    """
    trees: SimpleQueue[Tree] = SimpleQueue()
    for number in range(workers):
        trees.put(Tree(folder / str(number), folder / "bounds"))
    accepted: dict[str, list[str]] = {}
    tree = trees.get()
    for backend in dict.fromkeys(mutant.backend for mutant in mutants):
        needed = {name for mutant in mutants if mutant.backend == backend for name in mutant.catchers}
        accepted[backend] = tree.passing(backend, tuple(sorted(needed)), everything=not named)
        print(f"{backend}: {len(accepted[backend])} cases pass without a mistake", file=sys.stderr, flush=True)
    trees.put(tree)

    def fate(mutant: Mutant) -> tuple[Mutant, Fate]:
        tree = trees.get()
        try:
            everything = not (named or mutant.harmless)
            return mutant, tree.judge(mutant, accepted[mutant.backend], everything=everything)
        except ValueError as error:
            return mutant, Fate("", STALE, str(error), 0)
        finally:
            trees.put(tree)

    with ThreadPoolExecutor(workers) as pool:
        yield from pool.map(fate, mutants)


class Record:
    """Fates in a file, a row a mutant; those that are not run again keep theirs."""

    def __init__(self, path: Path | None) -> None:
        self.path = path
        rows = json.loads(path.read_text(encoding="utf-8")) if path is not None and path.exists() else []
        self.rows: dict[tuple[str, ...], dict[str, Any]] = {_key(row): row for row in rows}

    def knows(self, mutant: Mutant) -> bool:
        row = self.rows.get(_key(vars(mutant)))
        return row is not None and row["outcome"] != STALE

    def write(self, mutant: Mutant, fate: Fate) -> None:
        entry = {name: getattr(mutant, name) for name in KEY}
        self.rows[_key(entry)] = entry | {"outcome": fate.outcome, "case": fate.case, "cases_run": fate.ran}
        self.save()

    def save(self) -> None:
        """In the order of the mutants, without those that there are no longer."""
        if self.path is not None:
            known = [(mutant, self.rows.get(_key(vars(mutant)))) for mutant in MUTANTS]
            rows = [row | {"harmless": mutant.harmless} for mutant, row in known if row is not None]
            self.path.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


#: What makes a mutant this one.
KEY = ("function", "old", "new", "backend")


def _key(row: dict[str, Any]) -> tuple[str, ...]:
    return tuple(row[name] for name in KEY)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--backend", help="only mistakes that are judged on this backend")
    parser.add_argument("--file", default="", help="only files whose path contains this")
    parser.add_argument("--json", type=Path, help="write every fate; those of mistakes that are not run stay")
    parser.add_argument("--missing", action="store_true", help="only mistakes without a fate in that file")
    parser.add_argument("--named", action="store_true", help="only cases that a mistake names")
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    record = Record(options.json)
    chosen = [
        m for m in MUTANTS
        if options.file in file_of(m) and options.backend in (None, m.backend)
        and not (options.missing and record.knows(m))
    ]  # fmt: skip
    record.save()
    wanted = []
    for mutant in chosen:
        outdated = stale((mutant,))
        if outdated:
            print(f"{STALE}: {outdated[0]}")
            record.write(mutant, Fate("", STALE, outdated[0], 0))
        else:
            wanted.append(mutant)
    fates: list[tuple[Mutant, Fate]] = []
    with tempfile.TemporaryDirectory(prefix="passgraph-mutants-") as folder:
        for mutant, fate in judged(wanted, Path(folder), options.workers, named=options.named):
            fates.append((mutant, fate))
            verdict = f"{fate.outcome} by {fate.case or 'every case'}" if fate.caught else fate.outcome or "SURVIVED"
            print(f"{len(fates)}/{len(wanted)} {mutant.name}\n    {verdict} ({fate.ran} cases)", flush=True)
            record.write(mutant, fate)
    return max(2 if len(wanted) < len(chosen) else 0, report(fates))


def report(fates: list[tuple[Mutant, Fate]]) -> int:
    """A line a file, the share, and who survived."""
    mattering = [(m, f) for m, f in fates if not m.harmless]
    for file, group in groupby(sorted(mattering, key=lambda row: file_of(row[0])), key=lambda row: file_of(row[0])):
        rows = list(group)
        print(f"{file}: {sum(f.caught for _, f in rows)} of {len(rows)} caught")
    survivors = [m for m, f in mattering if not f.caught]
    caught = len(mattering) - len(survivors)
    print(f"{caught} of {len(mattering)} mistakes caught ({caught / max(1, len(mattering)):.1%})")
    for mutant in survivors:
        print(f"survived: {mutant.name} on {mutant.backend}")
    for mutant, fate in fates:
        if mutant.harmless and fate.caught:
            print(f"said to be harmless, yet {fate.outcome} by {fate.case}: {mutant.name}")
    return 1 if survivors else 0


if __name__ == "__main__":
    sys.exit(main())
