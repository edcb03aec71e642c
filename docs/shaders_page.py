"""Published shader files beside their originals: figures of docs/shader-agreement.md and its pictures.

    python docs/shaders_page.py [STAGE ...] [--again] [--limit SECONDS] [--figures FILE]

measures on the collections beside the checkout (tests/shaders/beside.py says where) and writes the marked section of
docs/shader-agreement.md and docs/images/shaders/.  Stages are agreement, backends, bounds (where bits differ), speed,
sheets and page; left out, all run.  What is measured is kept in docs/shaders.json, row by row: a run that was ended
goes on where it was.  Figures of speed want a quiet machine: ``speed --again`` measures all of them anew.
"""

from __future__ import annotations

import argparse
import statistics
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw

DOCS = Path(__file__).resolve().parent
sys.path[:0] = [str(DOCS.parent), str(DOCS.parent / "tests" / "shaders")]

from beside import FOLDER, MISSING, Case

from docs.effect_times import machine
from docs.shaders_figures import (
    BACKEND_RUNS,
    BESIDE,
    BOUNDS_SIZE,
    KINDS,
    REPEATS,
    RUNS,
    SPEED_SIZE,
    STAGES,
    Figures,
    Rows,
    frames_of,
    names,
)  # fmt: skip

PAGE, FIGURES, PICTURES = DOCS / "shader-agreement.md", DOCS / "shaders.json", DOCS / "images" / "shaders"
BEGIN, END = "<!-- originals: written by docs/shaders_page.py -->", "<!-- end of originals -->"
TILE, COLUMNS = (112, 63), 12
VERDICTS = ("equal", "one step", "one step but for few", "farther")
_COLUMNS = "equal | ≤ 1 step | ≤ 1 step but for 0.1 % of pixels | farther"


def shown(figures: Figures) -> dict[str, list[str]]:
    """By container the files that are read, in their order on the sheet."""
    refused = {name for name, row in figures.rows["agreement"].items() if "refused" in row}
    return {kind: [n for n in names() if n.startswith(f"{kind}/") and n not in refused] for kind in KINDS}


def sheets(figures: Figures) -> None:
    """A contact sheet of each container."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    for kind, row in shown(figures).items():
        lines = -(-len(row) // COLUMNS)
        sheet = Image.new("RGB", (COLUMNS * (TILE[0] + 2), lines * (TILE[1] + 2)), (255, 255, 255))
        for number, name in enumerate(row):
            print(f"  {name}", flush=True)
            at = number % COLUMNS * (TILE[0] + 2), number // COLUMNS * (TILE[1] + 2)
            sheet.paste(_tile(FOLDER / name, str(number + 1)), at)
        sheet.save(PICTURES / f"{kind}.png", optimize=True)


def _tile(path: Path, number: str) -> Image.Image:
    # Defaults of filters often change nothing.
    drawn = Case(path, TILE, int(path.suffix == ".fs"), frames_of(path)).ours()[-1]
    # Over a checkerboard, since what is transparent would look black.
    y, x = np.mgrid[0 : TILE[1], 0 : TILE[0]]
    board = np.where((x // 8 + y // 8) % 2, 0.55, 0.45)[:, :, None]
    seen = np.clip(drawn[:, :, :3] * drawn[:, :, 3:] + board * (1 - drawn[:, :, 3:]), 0, 1)
    tile = Image.fromarray(np.uint8(np.round(np.nan_to_num(seen) * 255)))
    draw = ImageDraw.Draw(tile)
    draw.rectangle((0, 0, 7 * len(number) + 2, 11), (0, 0, 0))
    draw.text((2, 0), number, (255, 255, 255))
    return tile


_OPENING = """`python docs/shaders_page.py` measures published files that are not part of the repository: ISF files of
Vidvox and others, and the transitions of gl-transitions.com. Both have the MIT license, which also
covers what their pictures show. The originals run on OpenGL (llvmpipe) in a host that belongs to the
tests and shares no code with passgraph. It uses real framebuffers, vertex shaders on a quad, and
buffers that are kept over 4 frames. Machine: {machine}.

### How many are read, and how far they are from the original

Each file runs with {count} pairs of size and parameters ({runs}). The worst pair counts. A step is 1/255. Every pixel
counts.

{driver}

Drivers may choose the last digits of sines, powers and `mod`, the weights of texels, the power of a negative number,
and the order of additions and multiplications. Some shaders make noise of such digits, or compare numbers that differ
only there. So each original runs a second time with these *settled*. It then uses the functions and the filter of
[kernels](kernels.md), written in GLSL, and computes in the order of its text. The [conformance suite](conformance.md)
compares these functions with NumPy. Everything else in a shader is compared with the driver here.

{settled}

These files differ by more with the driver's own functions. The table names the one function that, settled, makes them
agree:

| farther | steps | pixels | because of | settled |
|---|--:|--:|---|---|
{farther}

Not read: {refused}.
"""


def section(figures: Figures) -> str:
    """The marked section of the page."""
    said = figures.rows["agreement"]
    opening = _OPENING.format(
        machine=machine(), count=len(RUNS), runs=_runs(RUNS),
        driver=_table(said, "runs", "as the driver has it"), settled=_table(said, "settled", "settled"),
        farther="\n".join(_farther(said)) or "| none | | | | |",
        refused="; ".join(f"`{n}` ({row['refused']})" for n, row in said.items() if "refused" in row) or "none",
    )  # fmt: skip
    lines = [BEGIN, "", opening, "### Backends", "", *_backends(figures.rows["backends"], figures.rows["bounds"]), ""]
    lines += ["### Speed", "", *_speed(figures.rows["speed"]), "", "### What they look like", ""]
    for kind, row in shown(figures).items():
        told = " · ".join(f"{number} {Path(name).stem}" for number, name in enumerate(row, 1))
        lines += [f"![{KINDS[kind]}](images/shaders/{kind}.png)", "", f"{KINDS[kind]}{_LOOKS[kind]}: {told}", ""]
    return "\n".join([*lines, END])


_LOOKS = {"isf": ", with random values of their parameters", "transitions": ", half-way"}


def _runs(runs: tuple[tuple[tuple[int, int], int], ...]) -> str:
    """By size, with how many sets of values."""
    told = []
    for size in dict.fromkeys(size for size, _ in runs):
        seeds = [seed for one, seed in runs if one == size]
        random = sum(seed != 0 for seed in seeds)
        kinds = ["defaults"] * (0 in seeds) + ["random values" if random == 1 else f"{random} sets of random values"]
        told.append(f"{size[0]}×{size[1]} with {' and '.join(kinds[: len(seeds)])}")
    return ", ".join(told)


def _worst(row: dict[str, Any], which: str) -> int:
    return max(VERDICTS.index(run[0]) for run in row[which])


def _table(said: Rows, which: str, title: str) -> str:
    lines = [f"| {title} | files | read | {_COLUMNS} | not judged |", "|---|--:|--:|--:|--:|--:|--:|--:|"]
    for kind in KINDS:
        rows = {name: row for name, row in said.items() if name.startswith(f"{kind}/")}
        counts = Counter(_worst(row, which) for row in rows.values() if "runs" in row)
        read = sum("refused" not in row for row in rows.values())
        cells = [len(rows), f"{read} ({read / max(1, len(rows)):.1%})", *(counts[v] for v in range(4))]
        lines.append(f"| {KINDS[kind]} | {' | '.join(map(str, cells))} | {read - counts.total()} |")
    return "\n".join(lines)


def _farther(said: Rows) -> Iterator[str]:
    for name, row in said.items():
        if "runs" in row and _worst(row, "runs") == 3:
            _, steps, share = max(row["runs"], key=lambda run: (run[2], run[1]))
            cause = row["cause"] if " " in row["cause"] or row["cause"] == "several" else f"`{row['cause']}`"
            yield f"| `{name}` | {steps:.0f} | {share:.2%} | {cause} | {VERDICTS[_worst(row, 'settled')]} |"
    for name, row in said.items():
        if "runs" not in row and "refused" not in row:
            yield f"| `{name}` | | | {_why(row)} | |"


def _why(row: dict[str, Any]) -> str:
    return f"not within {row['late']:.0f} s" if "late" in row else str(row.get("failed", ""))


def _backends(rows: Rows, bounds: Rows) -> Iterator[str]:
    if not rows:
        yield "Not measured."
        return
    yield f"{len(rows)} files on `gl` and `opencl` are compared with `numpy`, at {_runs(BACKEND_RUNS)}."
    yield "The worst run counts. Pictures are floats: their bits are compared first, then their steps of 8 bits."
    yield ""
    yield f"| backend | same bits | same 8 bits | {_COLUMNS.partition(' | ')[2]} | not judged |"
    yield "|---|--:|--:|--:|--:|--:|--:|"
    judged = [row for row in rows.values() if "gl" in row]
    for name in BESIDE:
        counts = Counter("bits" if row[name][0] == 0 else row[name][1] for row in judged)
        cells = [counts[verdict] for verdict in ("bits", *VERDICTS)]
        yield f"| {name} | {' | '.join(map(str, cells))} | {len(rows) - len(judged)} |"
    yield ""
    yield "Bits differ on `gl` where a pass reads 8-bit texels. The driver converts them to floats that are often one"
    yield "step from the exact quotient, and comparisons of equal colors depend on that. The table compares each such"
    yield "file with the oracle's [bounds](conformance.md). It shows the worst pass, with defaults, at"
    yield f"{'×'.join(map(str, BOUNDS_SIZE))}:"
    yield ""
    yield "| other bits | backend | pixels | steps | outside of bounds | undecided |"
    yield "|---|---|--:|--:|--:|--:|"
    for name, row in rows.items():
        for backend in BESIDE:
            if row.get(backend, [0])[0] > 0:
                share, _, steps, _ = row[backend]
                told = bounds.get(name, {})
                words = f"{told[backend][0]:.1%} | {told[backend][1]:.0%}" if backend in told else f"{_why(told)} |"
                yield f"| `{name}` | {backend} | {share:.1%} | {steps:.2g} | {words} |"
    late = [f"`{name}` ({_why(row)})" for name, row in rows.items() if "gl" not in row]
    if late:
        yield f"Not judged: {', '.join(late)}."


def _speed(rows: Rows) -> Iterator[str]:
    timed = {name: row for name, row in rows.items() if "ours" in row}
    if not timed:
        yield "Not measured."
        return
    ratios = sorted((row["ours"] / row["original"], name) for name, row in timed.items())
    middle = statistics.median(ratio for ratio, _ in ratios)
    over = [(ratio, name) for ratio, name in ratios if ratio > 1.5]
    width, height = SPEED_SIZE
    yield f"CPU time of a frame on `numpy`, divided by that of the original on llvmpipe, at {width}×{height}: median"
    yield f"{middle:.2f}, {len(over)} of {len(ratios)} above 1.5. Times are medians of {REPEATS} runs, compiled before."
    compiled = statistics.median(row["compiled"] for row in timed.values())
    theirs = statistics.median(row["original_compiled"] for row in timed.values())
    yield f"Compiling takes {compiled:.0f} ms (median), and {theirs:.0f} ms for the original."
    late = [f"`{name}` ({_why(row)})" for name, row in rows.items() if name not in timed]
    if late:
        yield f"Not measured: {', '.join(late)}."
    yield ""
    yield "| slowest against the original | numpy, ms | original, ms | ratio |"
    yield "|---|--:|--:|--:|"
    for ratio, name in reversed(ratios[-max(10, len(over)) :]):
        yield f"| `{name}` | {timed[name]['ours']:.1f} | {timed[name]['original']:.1f} | {ratio:.2f} |"


def write_page(figures: Figures) -> None:
    text = PAGE.read_text(encoding="utf-8")
    before, rest = text.split(BEGIN)
    PAGE.write_text(before + section(figures) + rest.split(END)[1], encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    known = [*STAGES, "sheets", "page"]
    parser.add_argument("stages", nargs="*", metavar="STAGE", help=f"of {', '.join(known)}; left out, all")
    parser.add_argument("--again", action="store_true", help="measure what was measured already, too")
    parser.add_argument("--limit", type=float, metavar="SECONDS", help="that a file may take in a stage")
    parser.add_argument("--figures", type=Path, default=FIGURES, metavar="FILE", help="where rows are kept")
    options = parser.parse_args()
    wrong = [stage for stage in options.stages if stage not in known]
    if wrong:
        parser.error(f"no stage is called {wrong[0]!r}; there are {', '.join(known)}")
    if not FOLDER.is_dir():
        sys.exit(MISSING)
    figures = Figures(options.figures)
    for stage in options.stages or known:
        print(stage, flush=True)
        if stage == "page":
            write_page(figures)
        elif stage == "sheets":
            sheets(figures)
        else:
            figures.measure(stage, options.again, options.limit)


if __name__ == "__main__":
    main()
