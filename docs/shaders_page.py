"""Published shader files beside their originals: figures of docs/shaders.md and its pictures.

    python docs/shaders_page.py [STAGE ...] [--every N] [--parts FOLDER]

measures on the collections beside the checkout (tests/shaders/beside.py says where) and writes the marked section of
docs/shaders.md and docs/images/shaders/.  Stages are agreement, bounds (of what is farther), backends, speed, sheets
and page; left out, all run.  What is measured is kept in FOLDER (out/shaders-page): stages can run by themselves.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import statistics
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw

DOCS = Path(__file__).resolve().parent
sys.path[:0] = [str(DOCS.parent), str(DOCS.parent / "tests" / "shaders")]

from beside import CLOCK, FOLDER, MISSING, SHARE, Case, against_oracle, apart, files, host, read_original
from originals import Original

import passgraph as pg
from docs.gallery_page import machine
from passgraph.errors import PassgraphError
from passgraph.shaders.load import load_shader

PAGE, PICTURES = DOCS / "shaders.md", DOCS / "images" / "shaders"
BEGIN, END = "<!-- originals: written by docs/shaders_page.py -->", "<!-- end of originals -->"
KINDS = {"isf": "ISF", "transitions": "gl-transitions"}
#: Size and seed of the parameters (0 are the defaults) that pictures are compared at.
RUNS = (((64, 48), 0), ((53, 31), 0), ((64, 48), 1), ((53, 31), 2))
BOUNDS_SIZE, BOUNDS_SECONDS = (20, 14), 120
SPEED_SIZE, REPEATS = (640, 360), 5
TILE, COLUMNS = (112, 63), 12
VERDICTS = ("equal", "one step", "one step but for few", "farther")


def frames_of(path: Path) -> int:
    return 4 if read_original(path).persistent else 1


def loaded(every: int = 1) -> Iterator[Path]:
    """Every file that is read, or each so many."""
    for kind in KINDS:
        for path in files(kind)[::every]:
            try:
                load_shader(path)
            except PassgraphError:
                continue
            print(f"  {path.name}", flush=True)
            yield path


def key(path: Path) -> str:
    return f"{path.parent.name}/{path.name}"


def agreement(_: dict[str, Any]) -> dict[str, Any]:
    """By file: what refuses it, or the verdict, steps and share of each run."""
    found: dict[str, Any] = {}
    with host() as context:
        for kind in KINDS:
            for path in files(kind):
                print(f"  {path.name}", flush=True)
                try:
                    load_shader(path)
                except PassgraphError as error:
                    found[key(path)] = {"refused": str(error).splitlines()[0].replace(str(path.parent) + "/", "")}
                    continue
                try:
                    found[key(path)] = {"runs": [_compared(path, size, seed, context) for size, seed in RUNS]}
                except Exception as error:  # of the driver: it has several kinds
                    words = [line for line in str(error).splitlines() if "error" in line] or [str(error)]
                    found[key(path)] = {"driver": words[0]}
    return found


def _compared(path: Path, size: tuple[int, int], seed: int, context: Any) -> list[Any]:
    case = Case(path, size, seed, frames_of(path))
    far = apart(case.original(context), case.ours())
    return [far.verdict, far.steps, far.share]


def bounds(parts: dict[str, Any]) -> dict[str, Any]:
    """Of files that are farther somewhere: the oracle's word, at the parameters of the first such run."""
    found = {}
    for name, row in parts["agreement"].items():
        far = next((run for run, said in zip(RUNS, row.get("runs", []), strict=False) if said[2] > SHARE), None)
        if far is not None:
            print(f"  {name}", flush=True)
            found[name] = _in_time(_judged, FOLDER / name, far[1])
    return found


def _in_time(work: Callable[..., None], *arguments: Any) -> Any:
    """What a function puts into its queue, by a process of its own; None where it takes too long or fails."""
    spawn = multiprocessing.get_context("spawn")
    queue = spawn.Queue()
    process = spawn.Process(target=work, args=(queue, *arguments))
    process.start()
    process.join(BOUNDS_SECONDS)
    if process.is_alive():
        process.terminate()
        process.join()
        return None
    return queue.get() if not queue.empty() else None


def _judged(queue: Any, path: Path, seed: int) -> None:
    with host() as context:
        said = against_oracle(Case(path, BOUNDS_SIZE, seed, min(2, frames_of(path))), context)
    queue.put([said.outside, said.ambiguous])


def backends(parts: dict[str, Any]) -> dict[str, Any]:
    """By file and backend: how far its pictures are from numpy's."""
    found: dict[str, Any] = {}
    for path in loaded(parts["every"]):
        case = Case(path, (53, 31), 0, frames_of(path))
        ours, row = case.ours(), {}
        for name in ("gl", "opencl"):
            try:
                far = apart(ours, case.ours(name))
                row[name] = [far.verdict, far.steps, far.share]
            except PassgraphError as error:
                row[name] = ["failed", str(error).splitlines()[0], 1.0]
        found[key(path)] = row
    return found


def speed(parts: dict[str, Any]) -> dict[str, Any]:
    """By file: milliseconds of processor time of one frame here and of the original, in turns; and of compiling."""
    found = {}
    with host() as context:
        for path in loaded(parts["every"]):
            try:
                found[key(path)] = _timed(path, context)
            except Exception as error:  # of the driver: it has several kinds
                print(f"    {error}".splitlines()[0])
    return found


def _timed(path: Path, context: Any) -> list[float]:
    case = Case(path, SPEED_SIZE)
    begin = time.process_time()
    original = Original(context, case.file, case.size, exact=False)
    begin, theirs_compiled = time.process_time(), time.process_time() - begin
    original.show(case.given())
    ours, theirs = [], []
    graph = case.graph("rgba8")
    with pg.compile(graph, backend="numpy", size=case.size) as program:
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
    return [1e3 * v for v in (statistics.median(ours), statistics.median(theirs), compiled, theirs_compiled)]


def sheets(_: dict[str, Any]) -> dict[str, Any]:
    """A contact sheet of each container; by container the names in order."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    names: dict[str, Any] = {kind: [] for kind in KINDS}
    tiles: dict[str, list[Image.Image]] = {kind: [] for kind in KINDS}
    for path in loaded():
        # Defaults of filters often change nothing.
        shown = Case(path, TILE, int(path.suffix == ".fs"), frames_of(path)).ours()[-1]
        # Over a checkerboard, since what is transparent would look black.
        y, x = np.mgrid[0 : TILE[1], 0 : TILE[0]]
        board = np.where((x // 8 + y // 8) % 2, 0.55, 0.45)[:, :, None]
        seen = np.clip(shown[:, :, :3] * shown[:, :, 3:] + board * (1 - shown[:, :, 3:]), 0, 1)
        tile = Image.fromarray(np.uint8(np.round(np.nan_to_num(seen) * 255)))
        draw, number = ImageDraw.Draw(tile), str(len(names[path.parent.name]) + 1)
        draw.rectangle((0, 0, 7 * len(number) + 2, 11), (0, 0, 0))
        draw.text((2, 0), number, (255, 255, 255))
        names[path.parent.name].append(path.stem)
        tiles[path.parent.name].append(tile)
    for kind, row in tiles.items():
        lines = -(-len(row) // COLUMNS)
        sheet = Image.new("RGB", (COLUMNS * (TILE[0] + 2), lines * (TILE[1] + 2)), (255, 255, 255))
        for number, tile in enumerate(row):
            sheet.paste(tile, (number % COLUMNS * (TILE[0] + 2), number // COLUMNS * (TILE[1] + 2)))
        sheet.save(PICTURES / f"{kind}.png", optimize=True)
    return names


_HEADINGS = (
    "| container | files | read | equal | ≤ 1 step | ≤ 1 step but for 0.1 % of pixels | farther, within bounds | "
    "outside, not judged |\n|---|--:|--:|--:|--:|--:|--:|--:|"
)
_OPENING = """Measured by `python docs/shaders_page.py` on published files that are not part of the repository: ISF
files of Vidvox and others, and the transitions of gl-transitions.com, both under the MIT licence, which holds for what
their pictures show too. The originals run on OpenGL (llvmpipe) in a host of the tests' own, which
shares nothing with what is tested: real framebuffers, vertex shaders on a quad, buffers kept over 4 frames.
Machine: {machine}.

### How many are read, and how far they are from the original

Each file at {runs} pairs of size and parameters ({sizes}); its worst counts. A step is 1/255.

{rows}

Farther, within bounds: with sines and their inverses computed to the last bits in the original, each value of each pass
lies where the [oracle](conformance.md) says that rounding may take it ({bounds} pixels; passes are given the
reference's pictures). Such files make noise of a sine's last digits, or compare what is equal but for rounding.
"""


def section(parts: dict[str, Any]) -> str:
    """The marked section of the page."""
    said = parts["agreement"]
    width, height = SPEED_SIZE
    opening = _OPENING.format(
        machine=machine(), runs=len(RUNS), sizes=_runs(), bounds="×".join(map(str, BOUNDS_SIZE)),
        rows="\n".join([_HEADINGS, *(_row(kind, parts) for kind in KINDS)]),
    )  # fmt: skip
    lines = [BEGIN, "", opening]
    lines += ["| farther | steps | pixels | outside of bounds | hang on decisions |", "|---|--:|--:|--:|--:|"]
    for name, judged in parts["bounds"].items():
        worst = max(said[name]["runs"], key=lambda run: run[2])
        told = f"{judged[0]:.1%} | {judged[1]:.0%}" if judged else "not judged in time | "
        lines.append(f"| `{name}` | {worst[1]:.0f} | {worst[2]:.2%} | {told} |")
    refused = {name: row["refused"] for name, row in said.items() if "refused" in row}
    drivers = {name: row["driver"] for name, row in said.items() if "driver" in row}
    lines += ["", "Not read:", "", *(f"- `{name}`: {text}" for name, text in refused.items())]
    if drivers:
        lines += ["", "Read here, and refused by the driver:", "", *(f"- `{n}`: {t}" for n, t in drivers.items())]
    lines += ["", "### Backends", "", *_backends(parts["backends"]), ""]
    lines += ["### Speed", "", *_speed(parts["speed"], width, height), "", "### What they look like", ""]
    for kind, title in KINDS.items():
        names = " · ".join(f"{number} {name}" for number, name in enumerate(parts["sheets"][kind], 1))
        lines += [f"![{title}](images/shaders/{kind}.png)", "", f"{title}{_LOOKS[kind]}: {names}", ""]
    return "\n".join([*lines, END])


_LOOKS = {"isf": ", with random values of their parameters", "transitions": ", half-way"}


def _runs() -> str:
    kinds = {0: "defaults"}
    return ", ".join(f"{w}×{h} with {kinds.get(seed, 'random values')}" for (w, h), seed in RUNS)


def _row(kind: str, parts: dict[str, Any]) -> str:
    rows = {name: row for name, row in parts["agreement"].items() if name.startswith(kind)}
    worst = {n: max(VERDICTS.index(run[0]) for run in row["runs"]) for n, row in rows.items() if "runs" in row}
    read = sum("refused" not in row for row in rows.values())
    inside = [n for n, v in worst.items() if v == 3 and (parts["bounds"].get(n) or [1])[0] == 0]
    counts = Counter(worst.values())
    cells = [len(rows), f"{read} ({read / max(1, len(rows)):.1%})", counts[0], counts[1], counts[2], len(inside)]
    return f"| {KINDS[kind]} | {' | '.join(map(str, cells))} | {counts[3] - len(inside)} |"


def _backends(rows: dict[str, Any]) -> Iterator[str]:
    yield f"Pictures of `gl` and `opencl` beside those of `numpy`, of {len(rows)} files at 53×31 with defaults:"
    yield ""
    yield "| backend | equal | ≤ 1 step | ≤ 1 step but for 0.1 % of pixels | farther | failed |"
    yield "|---|--:|--:|--:|--:|--:|"
    for name in ("gl", "opencl"):
        counts = Counter(row[name][0] for row in rows.values())
        yield f"| {name} | {' | '.join(str(counts[v]) for v in (*VERDICTS, 'failed'))} |"
    other = [f"`{n}` ({b})" for n, row in rows.items() for b in row if row[b][0] in ("farther", "failed")]
    yield ""
    yield f"Farther or failed: {', '.join(other) or 'none'}."


def _speed(rows: dict[str, list[float]], width: int, height: int) -> Iterator[str]:
    ratios = sorted((ours / theirs, name) for name, (ours, theirs, *_) in rows.items())
    middle = statistics.median(ratio for ratio, _ in ratios)
    over = [(ratio, name) for ratio, name in ratios if ratio > 1.5]
    yield f"Processor time of a frame on `numpy` by that of the original on llvmpipe, {width}×{height}, medians of"
    yield f"{REPEATS} in turns, compiled before: median {middle:.2f}, {len(over)} of {len(ratios)} above 1.5."
    compiled = statistics.median(row[2] for row in rows.values())
    theirs = statistics.median(row[3] for row in rows.values())
    yield f"Compiling takes {compiled:.0f} ms in the median (kept code on disk), the original's {theirs:.0f} ms."
    yield ""
    yield "| slowest beside the original | numpy, ms | original, ms | ratio |"
    yield "|---|--:|--:|--:|"
    for ratio, name in reversed(ratios[-max(10, len(over)) :]):
        yield f"| `{name}` | {rows[name][0]:.1f} | {rows[name][1]:.1f} | {ratio:.2f} |"


def write_page(parts: dict[str, Any]) -> None:
    text = PAGE.read_text(encoding="utf-8")
    if BEGIN in text:
        before, rest = text.split(BEGIN)
        after = rest.split(END)[1]
    else:
        before, after = text.rstrip() + "\n\n## Beside the originals\n\n", "\n"
    PAGE.write_text(before + section(parts) + after, encoding="utf-8")


STAGES: dict[str, Callable[[dict[str, Any]], dict[str, Any]]] = {
    "agreement": agreement, "bounds": bounds, "backends": backends, "speed": speed, "sheets": sheets,
}  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("stages", nargs="*", metavar="STAGE", help=f"of {', '.join(STAGES)} and page; left out, all")
    parser.add_argument(
        "--parts", type=Path, default=DOCS.parent / "out" / "shaders-page", help="what was measured is kept there"
    )
    parser.add_argument("--every", type=int, default=1, metavar="N", help="of backends and speed: each Nth file alone")
    options = parser.parse_args()
    if not FOLDER.is_dir():
        sys.exit(MISSING)
    options.parts.mkdir(parents=True, exist_ok=True)
    chosen = options.stages or [*STAGES, "page"]

    def part(name: str) -> Any:
        file = options.parts / f"{name}.json"
        return json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}

    for name in chosen:
        print(name, flush=True)
        parts = {stage: part(stage) for stage in STAGES} | {"every": options.every}
        if name == "page":
            write_page(parts)
        else:
            made = STAGES[name](parts)
            (options.parts / f"{name}.json").write_text(json.dumps(made, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
