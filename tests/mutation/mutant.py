"""One planted mistake, and the tree of sources that it is planted in."""

from __future__ import annotations

import compileall
import json
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from passgraph.verify.oracle.kept import PART
from tests.mutation.places import PARTS, ROOT, Place, places, sources

#: Generated code is kept under its text and its programs, so these may share a cache of compiled code; mistakes in what
#: compiles the text may not, as the cache would show the code of another mutant.
WRITES_TEXT = ("pixels/code.py", "pixels/body.py")
#: What the reference runs through too (beginnings of paths): for mistakes in it, what the oracle allows is found anew.
SHARED_WITH_ORACLE = (
    "passgraph/graph/reduction",
    "passgraph/plan/",
    "passgraph/run/compiled_steps.py",
    "passgraph/run/execution.py",
    "passgraph/run/parameters.py",
    "passgraph/run/storages.py",
    "passgraph/language/long_arrays.py",
    "passgraph/language/lower_arrays.py",
    "passgraph/language/composites.py",
    "passgraph/language/expand.py",
    "passgraph/language/quad_derivatives.py",
    "passgraph/language/uniform_layout.py",
    "passgraph/language/assignments.py",
)
#: A mutant that runs longer hangs, which counts as caught.
TIMEOUT_S = 600


@dataclass(frozen=True)
class Mutant:
    """A mistake: ``old`` becomes ``new`` in ``function``.

    Attributes
    ----------
    function : name of the definition, as in :func:`tests.mutation.places.places`; the file is found by it
    old, new : text; ``old`` occurs exactly once in definitions of that name; lines behind the first are indented as in
        a function that is not inside anything
    backend : the backend that the suite is run on
    catchers : beginnings of the names of conformance cases that should fail; tried before all others
    harmless : why no conforming test can see it; empty for a mistake that must be caught
    """

    function: str
    old: str
    new: str
    backend: str
    catchers: tuple[str, ...]
    harmless: str = ""

    @property
    def name(self) -> str:
        return f"{self.function}: {self.old.strip()!r} -> {self.new.strip()!r}"

    @property
    def place(self) -> Place:
        """Where it is planted.

        Raises ValueError where the text is no longer there, or there twice: such a mutant shows nothing.
        """
        found = places(self.function, self.old)
        times = sum(place.count(sources()[place.file], self.old) for place in found)
        if times != 1:
            raise ValueError(
                f"definitions named {self.function} have {self.old!r} {times} times; bring the mutant up to date"
            )
        return found[0]

    @property
    def source(self) -> str:
        """The text of the file that it is planted in."""
        return sources()[self.place.file]

    @property
    def planted(self) -> str:
        """The file's text with the mistake in it."""
        return self.place.replaced(self.source, self.old, self.new)


@dataclass(frozen=True)
class Fate:
    """What became of a mutant: the case that caught it and how (empty: it survived), and how many cases ran."""

    case: str
    outcome: str
    detail: str
    ran: int

    @property
    def caught(self) -> bool:
        return self.outcome not in ("", "stale")


class Tree:
    """A copy of the sources in a folder of its own; one mutant lives in it at a time.

    What the oracle allows is kept in ``bounds``, which trees may share.  The reference makes some mistakes too, so ask
    one of them for what passes without a mistake before any is planted.
    """

    def __init__(self, folder: Path, bounds: Path) -> None:
        self.folder, self.bounds = folder, bounds
        for part in PARTS:
            # With what Python compiled: files keep their times, so that it serves there too.
            ignored = shutil.ignore_patterns("*-pytest-*")
            shutil.copytree(ROOT / part, folder / "tree" / part, symlinks=True, ignore=ignored)
            compileall.compile_dir(folder / "tree" / part, quiet=2)
        bounds.mkdir(parents=True, exist_ok=True)

    def judge(self, mutant: Mutant, accepted: list[str], *, everything: bool) -> Fate:
        """Run the cases that should catch it, then, with ``everything``, all others, until one does."""
        file = mutant.place.file
        if (self.folder / "tree" / file).read_text(encoding="utf-8") != mutant.source:
            raise ValueError(f"{file} changed while mistakes were tried; start again")
        return self.judge_text(file, mutant.planted, mutant.backend, mutant.catchers, accepted, everything=everything)

    def judge_text(
        self, file: str, text: str, backend: str, first: tuple[str, ...], accepted: list[str], *, everything: bool
    ) -> Fate:
        """Run the cases on a tree in which a file has another text."""
        path = self.folder / "tree" / file
        kept, times = path.read_text(encoding="utf-8"), path.stat()
        path.write_text(text, encoding="utf-8")
        try:
            fresh = backend == "numpy" and not file.endswith(WRITES_TEXT)
            anew = file.startswith(SHARED_WITH_ORACLE)
            return self.run(backend, first, accepted, everything=everything, fresh=fresh, anew=anew)
        finally:
            path.write_text(kept, encoding="utf-8")
            os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))  # what was compiled from it serves again

    def passing(self, backend: str, first: tuple[str, ...], *, everything: bool) -> list[str]:
        """Names of the cases that pass on the tree as it is: of those that ``first`` names, and of the usual ones."""
        request = {"backend": backend, "first": first, "accepted": [], "everything": everything, "anew": False}
        lines = self._judge(request | {"list": True})
        if isinstance(lines, Fate):
            raise RuntimeError(f"the suite does not run on {backend} without a mistake: {lines.detail}")
        return list(lines["passing"])

    def run(
        self,
        backend: str,
        first: tuple[str, ...],
        accepted: list[str],
        *,
        everything: bool,
        fresh: bool = False,
        anew: bool = False,
    ) -> Fate:
        """The cases named ``accepted`` on the tree as it is, those in ``first`` before the others.

        ``fresh`` compiles everything anew; ``anew`` asks the oracle anew.
        """
        request = {"backend": backend, "first": first, "accepted": accepted, "everything": everything, "anew": anew}
        made = self._judge(request, fresh)
        return made if isinstance(made, Fate) else Fate(**made)

    def _judge(self, request: dict[str, Any], fresh: bool = False) -> dict[str, Any] | Fate:
        """What judge.py prints, or how it ended."""
        cache = self.folder / ("fresh" if fresh else "kept")
        if fresh:
            shutil.rmtree(cache, ignore_errors=True)
        cache.mkdir(exist_ok=True)
        if not (cache / PART).is_symlink():
            (cache / PART).symlink_to(self.bounds)
        environment = {
            **os.environ,
            "PYTHONPATH": str(self.folder / "tree"),
            "PASSGRAPH_CACHE": str(cache),
            "PYTHONDONTWRITEBYTECODE": "1",
            "PASSGRAPH_THREADS": "2",
        }
        command = [sys.executable, str(Path(__file__).with_name("judge.py"))]
        try:
            ended = subprocess.run(
                command, input=json.dumps(request), capture_output=True, text=True, env=environment, cwd=self.folder,
                timeout=TIMEOUT_S, check=False,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            return Fate("", "hung", f"no end after {TIMEOUT_S} s", 0)
        lines = ended.stdout.strip().splitlines()
        if ended.returncode or not lines:
            return Fate("", "crashed", ended.stderr.strip()[-2000:] or f"exit status {ended.returncode}", 0)
        found: dict[str, Any] = json.loads(lines[-1])
        return found
