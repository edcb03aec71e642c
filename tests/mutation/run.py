"""Plants every mistake in turn and says which ones the conformance suite catches.

``python -m tests.mutation.run [--backend NAME] [--file PART] [--json FILE] [--workers N]`` from the root of the
repository.  Exit status: 0 where every mistake that matters is caught, 1 where some survive, 2 where some are out of
date.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from itertools import groupby
from pathlib import Path
from queue import SimpleQueue

from tests.mutation import gl_backend, numpy_backend, opencl_backend, shared
from tests.mutation.mutant import Fate, Mutant, Tree

MUTANTS: tuple[Mutant, ...] = (
    *shared.MUTANTS, *numpy_backend.MUTANTS, *gl_backend.MUTANTS, *opencl_backend.MUTANTS
)  # fmt: skip


def stale(mutants: tuple[Mutant, ...] = MUTANTS) -> list[str]:
    """Mutants whose text is no longer in the sources."""
    messages = []
    for mutant in mutants:
        try:
            mutant.planted()
        except (OSError, ValueError) as error:
            messages.append(str(error))
    return messages


def judged(mutants: list[Mutant], folder: Path, workers: int, *, named: bool = False) -> Iterator[tuple[Mutant, Fate]]:
    """Each with its fate, in order; a tree for each worker.

    Cases that do not pass without a mistake are left out; with ``named`` all pass, and only those that a mutant names
    are run.
    """
    trees: SimpleQueue[Tree] = SimpleQueue()
    for number in range(workers):
        trees.put(Tree(folder / str(number)))
    accepted: dict[str, list[str]] = {}
    tree = trees.get()
    for backend in () if named else dict.fromkeys(mutant.backend for mutant in mutants):
        needed = {name for mutant in mutants if mutant.backend == backend for name in mutant.catchers}
        accepted[backend] = tree.passing(backend, tuple(sorted(needed)))
        print(f"{backend}: {len(accepted[backend])} cases pass without a mistake", file=sys.stderr, flush=True)
    trees.put(tree)

    def fate(mutant: Mutant) -> tuple[Mutant, Fate]:
        tree = trees.get()
        try:
            return mutant, tree.judge(mutant, accepted.get(mutant.backend, []), everything=not named)
        finally:
            trees.put(tree)

    with ThreadPoolExecutor(workers) as pool:
        yield from pool.map(fate, mutants)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--backend", help="only mistakes that are judged on this backend")
    parser.add_argument("--file", default="", help="only files whose path contains this")
    parser.add_argument("--json", type=Path, help="write every fate")
    parser.add_argument("--named", action="store_true", help="only cases that a mistake names; all pass without one")
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    outdated = stale()
    for message in outdated:
        print(f"out of date: {message}")
    wanted = [
        m for m in MUTANTS
        if options.file in m.file and options.backend in (None, m.backend) and not stale((m,))
    ]  # fmt: skip
    fates: list[tuple[Mutant, Fate]] = []
    with tempfile.TemporaryDirectory(prefix="passgraph-mutants-") as folder:
        for mutant, fate in judged(wanted, Path(folder), options.workers, named=options.named):
            fates.append((mutant, fate))
            verdict = f"{fate.outcome} by {fate.case or 'every case'}" if fate.caught else "SURVIVED"
            print(f"{len(fates)}/{len(wanted)} {mutant.name}\n    {verdict} ({fate.ran} cases)", flush=True)
            if options.json:
                rows = [{**asdict(m), **asdict(f), "caught": f.caught} for m, f in fates]
                options.json.write_text(json.dumps(rows, indent=1), encoding="utf-8")
    return max(2 if outdated else 0, report(fates))


def report(fates: list[tuple[Mutant, Fate]]) -> int:
    """A line a file, the share, and who survived."""
    mattering = [(m, f) for m, f in fates if not m.harmless]
    for file, group in groupby(sorted(mattering, key=lambda row: row[0].file), key=lambda row: row[0].file):
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
