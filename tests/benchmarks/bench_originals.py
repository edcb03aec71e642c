"""Effects beside the published GLSL that does the same: on OpenGL by hand, on gl and on numpy.

    python tests/benchmarks/bench_originals.py FOLDER [--runs 9] [--only EFFECT ...]

FOLDER holds the originals (original_passes.py says how to make it).
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
from numpy.typing import NDArray
from PIL import Image

import passgraph as pg
from tests.benchmarks.harness import interleaved, ratio_of
from tests.benchmarks.original_effects import CASES, SIZE, Case
from tests.benchmarks.original_passes import Drawn, Texts
from tests.offscreen import offscreen

#: Ours, by column: backend and math.
KINDS = {"gl exact": ("gl", "exact"), "gl native": ("gl", "native"), "numpy": ("numpy", "exact")}
SAME = 2.0 / 255.0


def picture(size: tuple[int, int]) -> NDArray[np.float32]:
    """A photograph of few levels, whose edges are jagged."""
    from skimage.data import astronaut

    enlarged = Image.fromarray(astronaut()).resize(size, Image.Resampling.BICUBIC)
    color = np.round(np.asarray(enlarged, np.float32) / 255.0 * 6.0) / 6.0
    return np.concatenate([color, np.ones((*color.shape[:2], 1))], 2).astype(np.float32)


def measured(case: Case, texts: Texts, runs: int) -> dict[str, Any]:
    frame = picture(case.input_size)
    with offscreen(430) as context:
        original = Drawn(context, case.passes(texts), frame)
        jobs: dict[str, Callable[[], object]] = {"original": original.draw}
        programs = {}
        for kind, (backend, math) in KINDS.items():
            handle = pg.Input("frame", "rgba32f", case.input_size, static=True)
            output = case.ours(handle, pg.target("out", case.format, size=SIZE))
            programs[kind] = pg.compile(output, backend, SIZE, pg.Options(static=False, math=math))
            jobs[kind] = lambda program=programs[kind]: (program.run(frame=frame), program.finish())
        times = interleaved(jobs, runs)
        drawn = original.read()
        shown = {kind: next(iter(program(frame=frame).values())) for kind, program in programs.items()}
    apart = {
        kind: float((np.abs(np.clip(one, 0, 1) - np.clip(drawn, 0, 1)) > SAME).any(axis=2).mean())
        for kind, one in shown.items()
    }
    ratios = {kind: ratio_of(kind, times[kind], times["original"], None) for kind in KINDS}
    return {
        "effect": case.effect,
        "options": case.options,
        "original": case.original,
        "differs": case.differs,
        "apart": apart,
        "ms": {kind: r.ms for kind, r in ratios.items()} | {"original": ratios["numpy"].other_ms},
        "ratios": {kind: r.got for kind, r in ratios.items()},
    }


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", nargs="*", default=[], metavar="EFFECT")
    parser.add_argument("--runs", type=int, default=9)
    given = parser.parse_args()
    texts = Texts(given.folder)
    for case in CASES:
        if given.only and case.effect not in given.only:
            continue
        try:
            row = measured(case, texts, given.runs)
        except Exception as error:
            print(case.effect, "FAILED", str(error)[:1500])
            continue
        print(
            f"{case.effect:22} {case.options:12}",
            f"{row['ms']['original']:7.1f} ms",
            *(f"{k} {row['ratios'][k]:.2f} ({row['apart'][k]:.2%})" for k in KINDS),
            f"load {os.getloadavg()[0]:.1f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
