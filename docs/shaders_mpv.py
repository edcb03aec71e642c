"""mpv user shaders beside their originals: a section of docs/shader-agreement.md.

    git clone https://github.com/bloc97/Anime4K
    python docs/shaders_mpv.py Anime4K [FOLDER ...] --photo photo.png

reads those of the files below that lie in the folders, draws a photograph and a drawing with each at several sizes,
here and with the file's own GLSL on OpenGL (tests/shaders/original_mpv.py), and writes by how much they differ and what
both take.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
from PIL import Image

# Compiling is measured with nothing kept from earlier runs.
os.environ["MESA_SHADER_CACHE_DISABLE"] = "true"
os.environ["PASSGRAPH_CACHE"] = tempfile.mkdtemp()
DOCS = Path(__file__).resolve().parent
sys.path[:0] = [str(DOCS.parent), str(DOCS.parent / "tests" / "shaders")]

from original_mpv import MpvFile, Original, Picture, Size

import passgraph as pg
from docs.effect_times import machine

PAGE = DOCS / "shader-agreement.md"
BEGIN, END = "<!-- mpv: written by docs/shaders_mpv.py -->", "<!-- end of mpv -->"
#: What each is.
CHOSEN = {
    "Anime4K_Restore_CNN_S.glsl": "a small network",
    "Anime4K_Restore_CNN_M.glsl": "a larger one",
    "Anime4K_Upscale_CNN_x2_S.glsl": "a network that doubles",
    "Anime4K_Deblur_DoG.glsl": "a difference of Gaussians",
    "Anime4K_Darken_VeryFast.glsl": "passes of half the size",
    "Anime4K_Thin_VeryFast.glsl": "lines made thinner",
    "Anime4K_Clamp_Highlights.glsl": "least and most around",
    "FSR.glsl": "FSR 1 of the luma, EASU and RCAS",
    "FSR_EASU_RGB.glsl": "EASU of the colors",
    "AMD_CAS.glsl": "CAS",
    "adaptive-sharpen.glsl": "gathers and sorts",
    "SSimSuperRes.glsl": "passes at several stages",
    "FSRCNNX_x2_8-0-4-1.glsl": "a network of the luma",
    "nnedi3-nns16-win8x4.glsl": "offsets that are put back",
}
SIZES: tuple[Size, ...] = ((320, 180), (161, 91), (64, 48))
OUTPUT, REPEATS = 2, 7


def drawing(size: Size) -> Picture:
    """Discs with outlines, and a line."""
    width, height = size
    y, x = np.mgrid[0:height, 0:width].astype(np.float64)
    u, v = (x + 0.5) / width, (y + 0.5) / height
    made = np.ones((height, width, 4)) * (0.9, 0.85, 0.7, 1.0)
    for left, top, radius, color in ((0.3, 0.4, 0.22, (0.8, 0.2, 0.2)), (0.7, 0.6, 0.25, (0.1, 0.4, 0.7))):
        away = np.hypot((u - left) * width / height, v - top)
        made[away < radius, :3] = color
        made[np.abs(away - radius) < 1.5 / height, :3] = 0.03
    made[np.abs(u - v * 0.7 - 0.2) * width < 0.9, :3] = 0.0
    return np.float32(np.round(made * 255) / 255)


def photograph(path: Path, size: Size) -> Picture:
    shown = Image.open(path).convert("RGBA").resize(size, Image.Resampling.LANCZOS)
    return np.asarray(shown, np.float32) / np.float32(255)


def apart(path: Path, picture: Picture, context: moderngl.Context) -> tuple[float, float, float]:
    """Largest and mean difference, and the share of pixels that lie farther than a step of 8 bits."""
    size = (picture.shape[1], picture.shape[0])
    into = pg.target("out", "rgba32f")
    graph = pg.load_shader(path)(pg.Input("frame", "rgba32f", size), into=into, output_scale=float(OUTPUT))
    with pg.compile(graph) as program:
        ours = program(frame=picture)["out"]
    theirs = Original(context, MpvFile(path), size, (size[0] * OUTPUT, size[1] * OUTPUT)).draw(picture)
    if np.isnan(ours).any() or ours.shape != theirs.shape:
        raise SystemExit(f"{path.name}: {ours.shape} and {theirs.shape}, NaN: {np.isnan(ours).sum()}")
    away = np.abs(ours - theirs)
    return float(away.max()), float(away.mean()), float((away.max(axis=2) > 1 / 255).mean())


def timed(path: Path, picture: Picture, context: moderngl.Context) -> tuple[float, float, float, float]:
    """Milliseconds of processor time of a frame here and there, in turns; seconds of compiling here and there."""
    size = (picture.shape[1], picture.shape[0])
    given = np.uint8(np.round(picture * 255))
    ours, theirs, begin = [], [], time.process_time()
    graph = pg.load_shader(path)(pg.Input("frame", "rgba8", size), into=pg.target("out", "rgba8"))
    with pg.compile(graph) as program:
        program.run(frame=given)
        program.finish()
        between = time.process_time()
        original = Original(context, MpvFile(path), size, (size[0] * 2, size[1] * 2), exact=False)
        held = {"MAIN": original.texture(picture), **original.planes(picture)}
        original.run(held)
        context.finish()
        compiled = (between - begin, time.process_time() - between)
        for _ in range(REPEATS):
            begin = time.process_time()
            program.run(frame=given)
            program.finish()
            between = time.process_time()
            original.run(held)
            context.finish()
            ours.append(between - begin)
            theirs.append(time.process_time() - between)
    return 1e3 * statistics.median(ours), 1e3 * statistics.median(theirs), *compiled


_OPENING = """{begin}

`python docs/shaders_mpv.py` runs published files here and with their own GLSL on OpenGL. The files (Anime4K of bloc97,
and ports from configurations of players) are not part of the repository. The inputs are a photograph (scikit-image's
`astronaut.png`) and a drawing of discs and lines, at {sizes}. On both sides the result of a pass is rounded to the
nearest half float, which llvmpipe would truncate. A step of halves is 0.0005 below 1. Times are CPU time at {first},
medians of runs in turns, and compiling starts without a cache. Machine: {machine}.

Where `adaptive-sharpen.glsl` differs by more than a step of 8 bits, it is in the last column and row of odd sizes,
and the float64 reference agrees with `numpy`. FSR differs in single pixels. Gathers at the center of a texel
(nnedi3's other files) read its neighbor on llvmpipe at sizes that are no powers of two. Here they agree with the
files without gathers.

| file | what it is | photograph: most, mean | drawing: most, mean | > 1/255 | numpy, original | ratio | compiled in |
|---|---|--:|--:|--:|--:|--:|--:|
"""


def row(path: Path, photo: Path, context: moderngl.Context) -> str:
    cells, beyond = [], 0.0
    ours, theirs, here, there = timed(path, photograph(photo, SIZES[0]), context)
    for kind in (lambda size: photograph(photo, size), drawing):
        found = [apart(path, kind(size), context) for size in SIZES]
        cells.append(f"{max(one[0] for one in found):.1e}, {max(one[1] for one in found):.0e}")
        beyond = max(beyond, *(one[2] for one in found))
    cells += [f"{beyond:.2%}", f"{ours:.1f}, {theirs:.1f} ms", f"{ours / theirs:.2f}", f"{here:.1f}, {there:.1f} s"]
    return f"| `{path.name}` | {CHOSEN[path.name]} | {' | '.join(cells)} |\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path, metavar="FOLDER", help="where the files lie, at any depth")
    parser.add_argument("--photo", type=Path, required=True, help="the photograph")
    options = parser.parse_args()
    lying: dict[str, Any] = {path.name: path for folder in options.folders for path in folder.rglob("*.glsl")}
    context = moderngl.create_context(standalone=True, require=430, backend="egl")
    sizes = [f"{width}×{height}" for width, height in SIZES]
    text = _OPENING.format(begin=BEGIN, sizes=", ".join(sizes), first=sizes[0], machine=machine())
    for name in CHOSEN:
        if name in lying:
            print(name, flush=True)
            text += row(lying[name], options.photo, context)
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    PAGE.write_text(before + text + "\n" + END + rest.partition(END)[2], encoding="utf-8")


if __name__ == "__main__":
    main()
