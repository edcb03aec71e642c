"""SMAA beside its authors' shaders on OpenGL, 1280x720: python tests/benchmarks/bench_smaa.py [runs]

Both find edges, weights and blended colors of the same float32 picture.  The original (npm ``postprocessing``) keeps
edges and weights in 8 bits; ours takes luma in a pass of its own, uploads the picture, and draws in either math.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import moderngl
import numpy as np
from numpy.typing import NDArray
from PIL import Image

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from harness import Ratio, interleaved, ratio_of

import passgraph as pg
from passgraph.effects import smaa
from tests.effects.smaa_original import Original
from tests.offscreen import offscreen

SIZE = (1280, 720)
#: Searches, in pixels, and the strength of corners: the preset "high" of the original.
STEPS, DIAGONAL_STEPS, CORNER, THRESHOLD = 16, 8, 0.25, 0.1


def picture() -> NDArray[np.float32]:
    """A photograph of few levels, whose edges are jagged."""
    from skimage.data import astronaut

    enlarged = Image.fromarray(astronaut()).resize(SIZE, Image.Resampling.BICUBIC)
    color = np.round(np.asarray(enlarged, np.float32) / 255.0 * 6.0) / 6.0
    return np.concatenate([color, np.ones((*color.shape[:2], 1))], 2).astype(np.float32)


def by_its_authors(context: moderngl.Context, frame: NDArray[np.float32]) -> Callable[[], None]:
    original = Original(context, THRESHOLD, STEPS, DIAGONAL_STEPS, CORNER)
    color, result = (context.texture(SIZE, 4, dtype="f4") for _ in range(2))
    edges, weights = (context.texture(SIZE, 4) for _ in range(2))

    def draw() -> None:
        with context:
            color.write(frame.tobytes())
            original.draw(color, edges, weights, result)
            context.finish()

    return draw


def by_passgraph(frame: NDArray[np.float32], math: str) -> Callable[[], None]:
    output = smaa(
        pg.Input("frame", "rgba32f", SIZE), THRESHOLD, STEPS, DIAGONAL_STEPS, CORNER, into=pg.target("out", "rgba32f")
    )
    program = pg.compile(output, "gl", SIZE, pg.Options(math=math))  # type: ignore[arg-type]

    def draw() -> None:
        program.run(frame=frame)
        program.finish()

    return draw


def ratios(runs: int = 9) -> list[Ratio]:
    """Ours over the original's, in both maths."""
    frame = picture()
    with offscreen() as context:
        jobs = {math: by_passgraph(frame, math) for math in ("exact", "native")}
        times = interleaved({"original": by_its_authors(context, frame), **jobs}, runs)
    return [ratio_of(f"SMAA, {math} / its authors' GLSL", times[math], times["original"], 1.1) for math in jobs]


if __name__ == "__main__":
    for ratio in ratios(int(sys.argv[1]) if len(sys.argv) > 1 else 9):
        print(f"{ratio.what}: {ratio.ms:.1f} ms / {ratio.other_ms:.1f} ms = {ratio.got:.2f} (at most {ratio.wanted})")
