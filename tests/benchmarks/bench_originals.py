"""Effects beside the published GLSL that does the same: on OpenGL by hand, on gl and on numpy, 1280x720.

    python tests/benchmarks/bench_originals.py [FOLDER] [--runs 15] [--only EFFECT ...] [--document]

FOLDER holds the originals; original_passes.py says how to make it.  Without it, SMAA is measured, whose original is
in the repository.  The picture stays on the device, and results are not read back.  Everything runs on the processor
(llvmpipe draws), so times are processor time of all threads.  ``--document`` writes docs/original_times.json, which
docs/effect-times.md shows.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import passgraph as pg
from docs.effect_times import ORIGINALS, machine
from tests.benchmarks.harness import Job, Ratio, interleaved, ratio_of
from tests.benchmarks.original_effects import CASES, SIZE, Case
from tests.benchmarks.original_passes import SOURCES, Texts
from tests.offscreen import offscreen

#: Ours: the backend, the math, and the most of the original's time that is wanted.
KINDS = {"gl exact": ("gl", "exact", 1.1), "gl native": ("gl", "native", 1.1), "numpy": ("numpy", "exact", 0.7)}
#: Two pictures agree at a pixel if no channel differs by more: two steps of 8 bits.
SAME = 2.0 / 255.0


def picture(size: tuple[int, int]) -> NDArray[np.float32]:
    """Return a photograph of few levels, whose edges are jagged."""
    from skimage.data import astronaut

    enlarged = Image.fromarray(astronaut()).resize(size, Image.Resampling.BICUBIC)
    color = np.round(np.asarray(enlarged, np.float32) / 255.0 * 6.0) / 6.0
    return np.concatenate([color, np.ones((*color.shape[:2], 1))], 2).astype(np.float32)


def running(program: pg.Program, frame: NDArray[np.float32]) -> Callable[[], None]:
    def run() -> None:
        program.run(frame=frame)
        program.finish()

    return run


def measured(case: Case, texts: Texts, runs: int) -> tuple[list[Ratio], float]:
    """Return the ratio of each kind, and the share of pixels at which any differs from the original."""
    frame = picture(case.input_size)
    with ExitStack() as stack:
        context = stack.enter_context(offscreen(430))
        original = case.drawn(context, texts, frame)
        jobs: dict[str, Job] = {"original": original.draw}
        programs = {}
        for kind, (backend, math, _) in KINDS.items():
            handle = pg.Input("frame", "rgba32f", case.input_size, static=True)
            output = case.ours(handle, pg.target("out", case.format, size=SIZE))
            options = pg.Options(static=False, math=math)  # type: ignore[arg-type]
            programs[kind] = stack.enter_context(pg.compile(output, backend, SIZE, options))
            jobs[kind] = running(programs[kind], frame)
        times = interleaved(jobs, runs, clock=time.process_time)
        drawn = np.clip(original.read(), 0.0, 1.0)
        shown = [np.clip(program(frame=frame)["out"], 0.0, 1.0) for program in programs.values()]
    apart = max(float((np.abs(one - drawn) > SAME).any(axis=2).mean()) for one in shown)
    name = f"{case.effect} {case.options}".strip()
    ratios = [
        ratio_of(f"{name}, {kind} / {case.original}", times[kind], times["original"], wanted)
        for kind, (_, _, wanted) in KINDS.items()
    ]
    return ratios, apart


def row_of(case: Case, ratios: list[Ratio], apart: float) -> dict[str, Any]:
    return {
        "effect": case.effect, "options": case.options, "original": case.original,
        "ms": round(ratios[0].other_ms or 0.0, 1),
        "ratios": {kind: round(ratio.got, 2) for kind, ratio in zip(KINDS, ratios, strict=True)},
        "differs": case.differs, "apart": None if case.differs else round(apart, 4),
    }  # fmt: skip


def ratios(runs: int = 9) -> list[Ratio]:
    """Return those of the originals that the repository has."""
    return [one for case in CASES if case.effect == "smaa" for one in measured(case, Texts(Path()), runs)[0]]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=Path)
    parser.add_argument("--only", nargs="*", default=[], metavar="EFFECT")
    parser.add_argument("--runs", type=int, default=15)
    parser.add_argument("--document", action="store_true")
    given = parser.parse_args()
    if given.folder is None:
        print(f"Without a folder of originals, SMAA alone is measured. Make one:\n{SOURCES}")
    names = ["smaa"] if given.folder is None else given.only or [case.effect for case in CASES]
    rows = []
    loads = [os.getloadavg()[0]]
    for case in CASES:
        if case.effect in names:
            found, apart = measured(case, Texts(given.folder or Path()), given.runs)
            rows.append(row_of(case, found, apart))
            loads.append(os.getloadavg()[0])
            figures = (f"{kind} {ratio.got:.2f}" for kind, ratio in zip(KINDS, found, strict=True))
            print(f"{case.effect:21} {case.options:15} {found[0].other_ms:7.1f} ms", *figures, f"apart {apart:.2%}")
    print(f"load {min(loads):.1f} to {max(loads):.1f}")
    if given.document:
        where, _, day = machine().rpartition("; taken ")
        load = f"load average {min(loads):.1f} to {max(loads):.1f}"
        made = {"machine": f"{where}; {load}", "date": day, "runs": given.runs, "rows": rows}
        ORIGINALS.write_text(json.dumps(made, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
