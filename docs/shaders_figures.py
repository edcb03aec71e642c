"""What is measured of published shader files, one file after another: kept as it comes, in one document.

Each stage is a function of one file.  It runs in a process of its own, which is ended where a file takes longer than
the limit; what was measured already is not measured again.
"""

from __future__ import annotations

import json
import multiprocessing
import statistics
import sys
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

DOCS = Path(__file__).resolve().parent
sys.path[:0] = [str(DOCS.parent), str(DOCS.parent / "tests" / "shaders")]

import moderngl
from beside import CLOCK, FOLDER, Apart, Case, apart, files, read_original
from defined import used
from originals import Original, Picture

import passgraph as pg
from passgraph.errors import PassgraphError
from passgraph.plan.dependencies import inputs_behind
from passgraph.shaders.shader_file import load_shader
from passgraph.verify.compare import compare
from passgraph.verify.report import other_bits
from tests.offscreen import offscreen

KINDS = {"isf": "ISF", "transitions": "gl-transitions"}
#: Size and seed of the parameters (0 are the defaults) that pictures are compared at.
RUNS = (((64, 48), 0), ((53, 31), 0), ((64, 48), 1), ((53, 31), 2))
#: The same of what backends draw.
BACKEND_RUNS = (((53, 31), 0), ((53, 31), 1), ((53, 31), 2))
#: Held against numpy; where bits differ, both are held against the oracle, at a size of its own.
BESIDE, BOUNDS_SIZE = ("gl", "opencl"), (20, 14)
SPEED_SIZE, REPEATS = (640, 360), 5
#: Nothing but the order in which a driver adds and multiplies is settled.
ORDER = "order of arithmetic"


#: By file.
Rows = dict[str, dict[str, Any]]


def names() -> list[str]:
    """Every file, as container/name."""
    return [f"{kind}/{path.name}" for kind in KINDS for path in files(kind)]


def frames_of(path: Path) -> int:
    return 4 if read_original(path).persistent else 1


def _told(far: Apart) -> list[Any]:
    return [far.verdict, far.steps, far.share]


def agreement(path: Path, context: moderngl.Context) -> dict[str, Any]:
    """What refuses a file, or how far each run is from the original as the driver has it, and as it is settled.

    "runs" and "settled": verdict, steps and share of each run.  "cause", of files that are farther in a run: the one
    function whose definition alone brings the first such run together, or "several".
    """
    try:
        load_shader(path)
    except PassgraphError as error:
        return {"refused": str(error).splitlines()[0].replace(str(path.parent) + "/", "")}
    every = used(_texts(path))
    found: dict[str, Any] = {"runs": [], "settled": []}
    for size, seed in RUNS:
        case = Case(path, size, seed, frames_of(path))
        ours = case.ours()
        driver = apart(_original(case, context), ours)
        found["runs"].append(_told(driver))
        found["settled"].append(_told(apart(_original(case, context, every), ours)))
        if not driver.agrees and "cause" not in found:
            found["cause"] = _cause(case, context, ours, every)
    return found


def _texts(path: Path) -> str:
    return path.read_text(encoding="utf-8", errors="replace")


class _Refused(Exception):
    """The driver does not take a text."""


def _original(case: Case, context: moderngl.Context, settled: Iterable[str] | None = None) -> list[Picture]:
    try:
        return case.original(context, None if settled is None else frozenset(settled))
    except moderngl.Error as error:
        words = [line for line in str(error).splitlines() if "error" in line] or [str(error)]
        raise _Refused(words[0]) from None


def _cause(case: Case, context: moderngl.Context, ours: list[Picture], every: list[str]) -> str:
    for alone in ([], *([name] for name in every)):
        if apart(_original(case, context, alone), ours).agrees:
            return alone[0] if alone else ORDER
    return "several"


def backends(path: Path, _: moderngl.Context) -> dict[str, Any]:
    """By backend, beside numpy: the share of pixels with other bits, verdict, steps and share; the worst of all runs.

    Pictures are floats, so that bits are those of the last pass; steps are of 8 bits.
    """
    row: dict[str, Any] = {}
    for size, seed in BACKEND_RUNS:
        case = Case(path, size, seed, frames_of(path))
        ours = case.ours(shown="rgba32f")
        for name in BESIDE:
            theirs = case.ours(name, shown="rgba32f")
            bits = float(np.mean([other_bits(a, b).mean() for a, b in zip(ours, theirs, strict=True)]))
            found = [bits, *_told(apart(_shown(ours), _shown(theirs)))]
            row[name] = max(row.get(name, found), found, key=lambda told: (told[3], told[2], told[0]))
    return row


def bounds(path: Path, _: moderngl.Context) -> dict[str, Any]:
    """By backend: the largest share of a pass's pixels that lie outside of the oracle's bounds, that are undecided."""
    case = Case(path, BOUNDS_SIZE)
    graph, given = case.graph(), case.given()
    images = {name: given[name] for name in inputs_behind([graph]) if name in given}
    row: dict[str, Any] = {}
    for made in compare(graph, BESIDE, size=case.size, **images).backends:
        row[made.name] = [max(t.outside for t in made.targets), max(t.ambiguous + t.unpromised for t in made.targets)]
    return row


def _shown(pictures: list[Picture]) -> list[Picture]:
    return [np.clip(np.nan_to_num(picture), 0.0, 1.0) for picture in pictures]


def speed(path: Path, context: moderngl.Context) -> dict[str, Any]:
    """Milliseconds of processor time of a frame here and of the original, in turns, and of compiling both."""
    case = Case(path, SPEED_SIZE)
    begin = time.process_time()
    original = Original(context, case.file, case.size, exact=False)
    begin, theirs_compiled = time.process_time(), time.process_time() - begin
    original.show(case.given())
    ours, theirs = [], []
    with pg.compile(case.graph("rgba8"), backend="numpy", size=case.size) as program:
        compiled = time.process_time() - begin
        given = {n: np.uint8(np.round(p * 255)) for n, p in case.given().items() if n in program.inputs}
        for turn in range(REPEATS + 2):
            begin = time.process_time()
            program.run(**given)
            program.finish()
            between = time.process_time()
            for _ in original.run(case.values, turn, CLOCK):
                pass
            context.finish()
            if turn >= 2:
                ours.append(between - begin)
                theirs.append(time.process_time() - between)
    original.release()
    measured = {
        "ours": statistics.median(ours), "original": statistics.median(theirs),
        "compiled": compiled, "original_compiled": theirs_compiled,
    }  # fmt: skip
    return {name: round(1e3 * seconds, 3) for name, seconds in measured.items()}


#: By stage: what measures a file, and the seconds it may take.
STAGES: dict[str, tuple[Callable[[Path, moderngl.Context], dict[str, Any]], float]] = {
    "agreement": (agreement, 120.0), "backends": (backends, 240.0), "bounds": (bounds, 240.0),
    "speed": (speed, 60.0),
}  # fmt: skip


@dataclass
class Figures:
    """A document of what was measured: by stage and file."""

    file: Path

    def __post_init__(self) -> None:
        self.rows: dict[str, dict[str, Any]] = {stage: {} for stage in STAGES}
        with suppress(FileNotFoundError):
            self.rows |= json.loads(self.file.read_text(encoding="utf-8"))

    def write(self) -> None:
        """A row a line; another document is never half written."""
        parts = []
        for stage, rows in self.rows.items():
            lines = ",\n".join(f"  {json.dumps(name)}: {json.dumps(row)}" for name, row in sorted(rows.items()))
            parts.append(f" {json.dumps(stage)}: {{\n{lines}\n }}")
        beside = self.file.with_suffix(".part")
        beside.write_text("{\n" + ",\n".join(parts) + "\n}\n", encoding="utf-8")
        beside.replace(self.file)

    def measure(self, stage: str, again: bool = False, limit: float | None = None) -> None:
        """Every file that has no row yet, or was late, or every file; prints how far it is."""
        rows = self.rows[stage]
        if again:
            rows.clear()
        wanted = [n for n in names() if "late" in rows.get(n, {"late": 0}) and self._is_for(stage, n)]
        seconds = STAGES[stage][1] if limit is None else limit
        begin = time.monotonic()
        with _Worker() as worker:
            for number, name in enumerate(wanted, 1):
                rows[name] = worker.measured(stage, name, seconds)
                self.write()
                word = next((f": {k}, {rows[name][k]}" for k in ("late", "failed", "refused") if k in rows[name]), "")
                print(f"  {stage} {number}/{len(wanted)}, {time.monotonic() - begin:.0f} s, {name}{word}", flush=True)

    def _is_for(self, stage: str, name: str) -> bool:
        """Whether a stage measures a file: all but the first those that are read, "bounds" those of other bits."""
        beside = self.rows["backends"].get(name, {})
        differs = any(beside[backend][0] > 0 for backend in BESIDE if backend in beside)
        refused = "refused" in self.rows["agreement"].get(name, {})
        return stage == "agreement" or (not refused and (stage != "bounds" or differs))


class _Worker:
    """A process that measures; a new one follows on one that was ended."""

    def __enter__(self) -> _Worker:
        self.process: Any = None
        return self

    def __exit__(self, *_: object) -> None:
        self._end()

    def _end(self) -> None:
        if self.process is not None:
            self.process.kill()
            self.process.join()
            self.process = None

    def measured(self, stage: str, name: str, seconds: float) -> dict[str, Any]:
        """The row, or why there is none: "failed", or the seconds after which it was "late"."""
        if self.process is None:
            spawn = multiprocessing.get_context("spawn")
            self.pipe, far = spawn.Pipe()
            self.process = spawn.Process(target=_work, args=(far,), daemon=True)
            self.process.start()
            far.close()
        try:
            self.pipe.send((stage, name))
            if self.pipe.poll(seconds):
                return dict(self.pipe.recv())
        except (EOFError, OSError):
            self._end()
            return {"failed": "the process ended"}
        self._end()
        return {"late": seconds}


def _work(pipe: Any) -> None:
    with offscreen(430) as context:
        while True:
            try:
                stage, name = pipe.recv()
            except EOFError:  # who asked has gone
                return
            try:
                row = STAGES[stage][0](FOLDER / name, context)
            except (PassgraphError, _Refused) as error:
                row = {"failed": str(error).splitlines()[0]}
            except Exception as error:  # of drivers: they have several kinds
                row = {"failed": f"{type(error).__name__}: {error}".splitlines()[0]}
            pipe.send(row)
