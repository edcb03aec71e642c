"""Hashes of the outputs of every conformance case, to show that a change of the internals changes no bit.

    python -m tests.hashes --backend numpy --write before.json      # before the change
    python -m tests.hashes --backend numpy --against before.json    # after it: lists what differs, exits with 1

Every frame of each case is hashed, compiled in exact math with all optimizations; effects on pictures at two more
sizes. Hashes hold for one driver and one machine only: the file is kept while the work goes on, and not committed.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import passgraph as pg
from passgraph.backends.base import Backend
from passgraph.backends.registry import open_backend
from passgraph.verify.conformance import Case, cases

#: (width, height) of other pictures: smaller than the reach of most filters, and no multiple of a block of lanes.
OTHER_SIZES = ((5, 3), (131, 67))


def _resized(case: Case, size: tuple[int, int]) -> Case:
    """Return the case with its pictures repeated and cut to a size."""
    width, height = size

    def fitted(value: Any) -> Any:
        if not isinstance(value, np.ndarray) or value.ndim != 3:
            return value
        rows, columns, _ = value.shape
        return np.tile(value, (-(-height // rows), -(-width // columns), 1))[:height, :width]

    frames = tuple({name: fitted(value) for name, value in frame.items()} for frame in case.frames)
    return replace(case, name=f"{case.name} at {width}x{height}", size=size, frames=frames)


def all_cases(quick: bool, groups: list[str] | None) -> Iterator[Case]:
    """Yield the cases of the suite, and those of effects on pictures at :data:`OTHER_SIZES`."""
    for case in cases(groups, quick=quick):
        yield case
        if case.group == "effects" and "frame" in case.frames[0] and "depth" not in case.frames[0]:
            yield from (_resized(case, size) for size in OTHER_SIZES)


def outputs_hash(case: Case, backend: Backend) -> str:
    """Return the hash of all outputs after each frame, or the kind of error if the case cannot run."""
    digest = hashlib.sha256()
    try:
        with pg.compile(dict(case.graph()), backend=backend, size=case.size, non_finite="keep") as program:
            for frame in case.frames:
                program.run(**frame)
                for name, picture in sorted(program.read().items()):
                    digest.update(f"{name} {picture.shape} {picture.dtype}".encode())
                    digest.update(np.ascontiguousarray(picture).tobytes())
    except pg.PassgraphError as error:
        return f"{type(error).__name__}: {str(error)[:200]}"
    return digest.hexdigest()[:32]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--backend", required=True)
    parser.add_argument("--quick", action="store_true", help="only the cases of a short run")
    parser.add_argument("--group", action="append", help="only this group of cases; may be repeated")
    kept = parser.add_mutually_exclusive_group(required=True)
    kept.add_argument("--write", type=Path, metavar="FILE")
    kept.add_argument("--against", type=Path, metavar="FILE")
    given = parser.parse_args()
    found: dict[str, str] = {}
    chosen = list(all_cases(given.quick, given.group))
    with open_backend(given.backend) as backend:
        for number, case in enumerate(chosen, 1):
            found[case.id] = outputs_hash(case, backend)
            if sys.stderr.isatty():
                print(f"\r{number} of {len(chosen)} {case.id:.60}\x1b[K", end="", file=sys.stderr)
    if given.write:
        given.write.write_text(json.dumps(found, indent=0, sort_keys=True) + "\n", "utf-8")
        print(f"{len(found)} cases hashed")
        return 0
    before: dict[str, str] = json.loads(given.against.read_text("utf-8"))
    changed = [name for name, value in found.items() if before.get(name, value) != value]
    new = sum(name not in before for name in found)
    for name in changed:
        print(f"{name}: {before[name]} before, {found[name]} now")
    print(f"{len(found) - len(changed) - new} of {len(found)} cases are equal, {new} are new")
    return 1 if changed else 0


if __name__ == "__main__":
    raise SystemExit(main())
