"""Measures shadow methods and writes docs/speed-and-error.md with its plots: python docs/speed_and_error.py [SCENE ...]

What is measured is that of ``passgraph bench``; the report goes to out/speed-and-error.
"""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np

root = Path(__file__).resolve().parent.parent
if str(root) not in sys.path:
    sys.path.insert(0, str(root))

from passgraph.backends.registry import open_backend
from passgraph.bench.bench_report import as_markdown, difference, grey, plot_name, processor, truth_line, write_report
from passgraph.bench.bench_scenes import SCENES, scene_named
from passgraph.bench.measure import Row, SceneResult, Settings, measure
from passgraph.bench.methods import METHODS, frame_without_shadows
from passgraph.bench.timing import frame_times
from passgraph.bench.truth import PENUMBRA
from passgraph.pictures import save
from passgraph.run.compile import compile

PAGE, PICTURES = root / "docs" / "speed-and-error.md", root / "docs" / "images" / "speed-and-error"
REPORT = root / "out" / "speed-and-error"
NAMES = ("shipped", "samurai", "slab", "room", "wide", "chequer")
#: Scenes in which the map shows the uppermost of several casters, or one lamp is as wide as the things below it.
STACKED = ("two-sheets", "three-sheets", "shelf", "cage", "leaves", "furniture", "fence", "layers")
SETTINGS = Settings(size=(640, 360), map_sizes=(1024,), backends=("numpy", "gl"), frames=5)
STACKED_SETTINGS = replace(
    SETTINGS, methods=("pcss-32", "pcss-64", "penumbra-16", "penumbra-32"), backends=("numpy",), most_samples=400
)
#: Methods whose pictures the page shows beside the truth.
SHOWN = ("hard", "blur-world", "evsm4", "pcss-32", "penumbra-16")
#: The combination, and what it is held against.
OURS, HELD = "penumbra-16", "pcss-32"
HEADER = """# Speed and error of shadow methods

`python docs/speed_and_error.py` writes this page. `passgraph bench [SCENE…]` measures the same on any scene, and
writes a report with every picture. `passgraph bench FILE.py --exact NAME` compares the outputs of your own graph
with the exact one among them.

- **Time** is the median over frames, with a light that moves, so the shadow map is drawn in each frame. Frames of all
  methods run in turns. The figure is the ratio to the plain frame of the same round, times the median plain frame.
- **CPU** is the CPU time of all threads. Other programs on the machine disturb it less.
- **Filter** is the cost beyond a frame that draws the same map, surfaces and light, and looks up no shadow.
- **Error** is the error of the share of the light that arrives, compared with rays to a light of some size. It is taken
  over pixels that have the whole light above their own plane.
- **Penumbra** is the error over pixels whose true share is 0.01 to 0.99.
- **False lit** are pixels in full shadow that show more than 0.1. **False dark** are pixels in full light that show
  less than 0.9.
"""
REASONS = """
Hard < PCF < PCSS is as expected, up to noise. Moment maps mostly cost more than PCSS here, because the light moves:
they blur the whole map, a million texels, in each frame, and the picture has fewer pixels. With a light that stands
still they pay once. The depth-aware blur costs as much as PCSS or more. It reads three pictures at 15 taps in two
passes at every pixel, and PCSS stops early where its search finds no caster.
"""
STACKS = """
*False lit* is here the share of the pixels in full shadow. A map shows only the uppermost caster. `pcss` treats all
casters as one at their mean distance. `penumbra` compares each ray at the far casters, and again at the near ones.
Both miss what a thin side hides (the shelf's). They also miss strips of a lower caster that are narrow compared
with the upper one's penumbra (three sheets).
"""
RADII = (0.01, 0.05, 0.2)
GROWTH = """
A filter that compares has a fixed number of taps here. Wider penumbrae cost it more only where more pixels find a
caster. Moment maps are blurred with a box made of blocks, so their cost grows with the square root of the width. A
constant cost was expected. The rest of their cost is four passes over the whole map.
"""
CHOICE = """## Which method when

| Wanted | Take | Because |
|---|---|---|
| soft shadows, nothing else known | `filter=Auto()`, the default | `penumbra` where lights have a radius |
| edges of one width, chosen by hand | `"blur"` with `softness=…` | one blur for any number of lights |
| sharp shadows, the least time | `"hard"`, with a larger map | no filter at all |
| smooth edges a few texels wide | `"pcf"`, 3 to 5 texels | cheap, and no light leaks |
| the highest accuracy, time to spare | `"pcss"`, 64 taps | full size everywhere |
| the same under stacked casters, wide lamps | `"penumbra"`, 32 taps | casters near and far apart |
| wide shadows of a light that stands still | `"vsm"`, `"evsm4"`, `"msm"` | one blur for each position of the light |
"""


def main(names: Sequence[str]) -> None:
    results = []
    for name in names or NAMES:
        if not SCENES[name].here:
            print(f"{name}: left out, needs {SCENES[name].needs}")
            continue
        results.append(measure(name, SETTINGS, lambda text: print(text, flush=True)))
    REPORT.mkdir(parents=True, exist_ok=True)
    PICTURES.mkdir(parents=True, exist_ok=True)
    write_report(results, SETTINGS, REPORT)
    for result in results:
        for backend in SETTINGS.backends:
            shutil.copy(REPORT / plot_name(result.name, backend), PICTURES / plot_name(result.name, backend))
        strip(result)
    PAGE.write_text(page(results), encoding="utf-8")


def page(results: Sequence[SceneResult]) -> str:
    """The whole page."""
    width, height = SETTINGS.size
    machine = f"{os.cpu_count()} threads of {processor()}"
    taken = f"{width}×{height} pixels, {SETTINGS.frames} frames, {machine}; taken {date.today()}.\n"
    parts = [HEADER, taken]
    parts += [condition(results), stacked(), shape(results), growth(), CHOICE]
    parts += [section(result) for result in results]
    return "\n".join(parts)


def row_of(result: SceneResult, backend: str, method: str) -> Row:
    return next(row for row in result.rows if (row.backend, row.method) == (backend, method))


def condition(results: Sequence[SceneResult]) -> str:
    """The combination against 32-tap PCSS."""
    lines = [
        f"## `{OURS}` against `{HELD}`\n",
        "`penumbra` searches for casters in half the width and height, enlarges what it finds along surfaces, and\n"
        "makes twelve comparisons a pixel where penumbrae are narrow. The condition for a default: RMSE worse by at\n"
        "most a tenth, at half the filter's time or less. In small pictures, whose penumbrae are a few pixels wide,\n"
        "PCSS is the more accurate of the two.\n",
        "| scene | backend | RMSE | of PCSS | filter, time | filter, CPU | whole frame | condition |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for result in results:
        for backend in SETTINGS.backends:
            ours, held = row_of(result, backend, OURS), row_of(result, backend, HELD)
            wall, cpu = ours.filter.wall / held.filter.wall, ours.filter.cpu / held.filter.cpu
            met = ours.errors.rmse <= 1.1 * held.errors.rmse and cpu <= 0.5
            rmse = f"{ours.errors.rmse:.4f} | {held.errors.rmse:.4f}"
            frame = ours.frame.wall / held.frame.wall
            verdict = "met" if met else "not met"
            lines.append(f"| {result.name} | {backend} | {rmse} | {wall:.2f} | {cpu:.2f} | {frame:.2f} | {verdict} |")
    return "\n".join([*lines, ""])


def stacked() -> str:
    """Searching filters where casters lie one over the other."""
    methods = STACKED_SETTINGS.methods
    lines = ["## Casters one over the other\n", "On `numpy`; RMSE, and false lit in percent:\n"]
    lines += [f"| scene | {' | '.join(methods)} |", "|---|" + "---|" * len(methods)]
    for name in STACKED:
        result = measure(name, STACKED_SETTINGS, lambda text: print(text, flush=True))
        counts = result.counts["numpy"]
        hidden = float(np.mean(result.truth.share[counts] <= PENUMBRA[0]))
        cells = [
            f"{row.errors.rmse:.4f}, {100.0 * row.errors.false_lit / hidden:.2f}"
            for row in (row_of(result, "numpy", method) for method in methods)
        ]
        lines.append(f"| {name}: {SCENES[name].about} | {' | '.join(cells)} |")
    return "\n".join([*lines, STACKS])


def shape(results: Sequence[SceneResult]) -> str:
    """Hard < PCF < blur < moment maps < PCSS in cost: what was measured."""
    expected = ("hard", "pcf-5", "blur-world", "vsm", "pcss-32")
    lines = [
        "## The order of costs\n",
        f"Expected: {' < '.join(expected)}. Processor time of the filter, ms:\n",
        f"| scene | backend | {' | '.join(expected)} | order found |",
        "|---|---|" + "---|" * len(expected) + "---|",
    ]
    for result in results:
        for backend in SETTINGS.backends:
            cost = {name: row_of(result, backend, name).filter.cpu for name in expected}
            found = " < ".join(sorted(cost, key=lambda name: cost[name]))
            lines.append(f"| {result.name} | {backend} | {' | '.join(f'{cost[n]:.1f}' for n in expected)} | {found} |")
    lines.append(REASONS)
    return "\n".join(lines)


def growth() -> str:
    """Cost of filters as the light, and with it penumbrae, grow wider."""
    scene, size, methods = scene_named("box"), (320, 180), ("hard", "vsm", "blur-world", "pcss-32", OURS)
    lines = ["## The width of penumbrae and cost\n", "Processor time of the filter on the box scene at 320×180, ms:\n"]
    lines += [f"| backend | radius of the light | {' | '.join(methods)} |", "|---|---|" + "---|" * len(methods)]
    for backend in SETTINGS.backends:
        with open_backend(backend) as device:
            for radius in RADII:
                lit = scene.with_(lights=[replace(scene.lights[0], radius=radius)])
                graphs: dict[str, Any] = {name: METHODS[name].make(lit, 1024).picture for name in methods}
                graphs["none"] = frame_without_shadows(lit, 1024)
                with ExitStack() as stack:
                    programs = {
                        name: stack.enter_context(compile(graph, backend=device, size=size))
                        for name, graph in graphs.items()
                    }
                    times = frame_times(programs, lit.lights[0], SETTINGS.frames)
                spent = " | ".join(f"{times[name].cpu - times['none'].cpu:.1f}" for name in methods)
                lines.append(f"| {backend} | {radius} | {spent} |")
    return "\n".join([*lines, GROWTH])


def section(result: SceneResult) -> str:
    """One scene: its truth, plots, tables, pictures."""
    made = [f"## {result.name}: {SCENES[result.name].about}\n", f"{truth_line(result)}.\n"]
    for backend in SETTINGS.backends:
        rows = [row for row in result.rows if row.backend == backend]
        made += [
            f"### {result.name}, {backend}\n",
            f"![time against error](images/speed-and-error/{plot_name(result.name, backend)})\n",
        ]
        made += [as_markdown(rows, with_map=len(SETTINGS.map_sizes) > 1), ""]
    made.append(
        f"Left to right: rays, {', '.join(SHOWN)}; below, twice the difference: red too much light, blue too little.\n"
    )
    made.append(f"![{result.name}: shadow factors](images/speed-and-error/{result.name}.png)\n")
    return "\n".join(made)


def strip(result: SceneResult) -> None:
    """The truth and some methods in two rows."""
    backend, size = SETTINGS.backends[0], SETTINGS.map_sizes[0]
    counts = result.counts[backend]
    top, below = [grey(np.where(counts, result.truth.share, 1.0))], [np.ones((*counts.shape, 3), np.float32)]
    for method in SHOWN:
        share = result.shares[backend, method, size]
        top.append(grey(np.where(counts, share, 1.0)))
        below.append(difference(share, result.truth.share, counts))
    picture = np.concatenate([np.concatenate(top, axis=1), np.concatenate(below, axis=1)])
    save(PICTURES / f"{result.name}.png", picture[::2, ::2])


if __name__ == "__main__":
    main(sys.argv[1:])
