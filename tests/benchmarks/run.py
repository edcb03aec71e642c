"""Every benchmark, and one table of all ratios beside what is wanted of them.

    python tests/benchmarks/run.py [--quick] [--only NAME ...] [--document docs/performance.md]

Each benchmark runs in a process of its own.  One whose peer is not installed is named with what to install.
``--peer-python`` is the Python that has arcade and pygame-light2d, which want other library versions than others do.
``--document`` also measures how costs grow (growth.py) and writes the page with its plots.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import json
import platform
import statistics
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))
from harness import Ratio

#: Marks the line of a worker that holds its ratios.
MARK = "ratios: "
#: Seconds that one benchmark may take.
PATIENCE = 900


def cpu_table(quick: bool, _: str) -> list[Ratio]:
    bench = importlib.import_module("bench_cpu_table")
    made, asked = bench.jobs()
    for job in made.values():
        job()
    rounds = [bench.medians(made)[0] for _ in range(1 if quick else 3)]
    found = []
    for ours, peer, most in asked:
        # Other load on the machine only adds: the round with the smallest ratio met the least of it.
        best = min(rounds, key=lambda times: times[ours] / times[peer])
        found.append(Ratio(f"{ours} / {peer}", best[ours] / best[peer], most, best[ours], best[peer]))
    return found


def arrays(quick: bool, _: str) -> list[Ratio]:
    found: list[Ratio] = importlib.import_module("bench_arrays").ratios(9 if quick else 60)
    return found


def raster(quick: bool, _: str) -> list[Ratio]:
    bench = importlib.import_module("bench_raster")
    size, frames, found = ((960, 540), 3, []) if quick else ((1920, 1080), 9, [])
    for segments in (33,) if quick else (33, 125):
        made = bench.scene(segments)
        for name in ("shadow map", "G-buffer"):
            ratio = bench.measure(made, name, size, frames)
            found.append(Ratio(f"{name}, {made.triangle_count:,} triangles, numpy / gl", float(ratio), 1.0))
    return found


def soft_shadow(quick: bool, _: str) -> list[Ratio]:
    found: list[Ratio] = importlib.import_module("bench_soft_shadow").ratios(*(((640, 360), 3) if quick else ()))
    return found


def compiling(quick: bool, _: str) -> list[Ratio]:
    """Cold: nothing of this graph kept; warm: another process has compiled it.  Least of the warm ones."""
    import tempfile

    bench = importlib.import_module("bench_compile")
    found = []
    for backend in ("numpy",) if quick else ("numpy", "gl", "opencl"):
        with tempfile.TemporaryDirectory() as cache:
            bench.run(bench.PRIME, [bench.KERNELS], cache)
            cold, *warm = (float(bench.run(bench.SCRIPT, [backend], cache)) for _ in range(3))
        wanted = (2.0, 0.1) if backend == "numpy" else (None, None)
        found += [
            Ratio(f"compile soft_shadow, {backend}, {name}", spent, most, unit="s")
            for name, spent, most in zip(("cold", "warm"), (cold, min(warm)), wanted, strict=True)
        ]
    return found


def overhead(quick: bool, _: str) -> list[Ratio]:
    found: list[Ratio] = importlib.import_module("bench_overhead").ratios(15 if quick else 41)
    return found


def memory(quick: bool, _: str) -> list[Ratio]:
    found: list[Ratio] = importlib.import_module("memory").ratios()
    return found


def by_hand(module: str) -> Callable[[bool, str], list[Ratio]]:
    def ratios(quick: bool, _: str) -> list[Ratio]:
        found: list[Ratio] = importlib.import_module(module).ratios(9 if quick else 25)
        return found

    return ratios


def peers(module: str) -> Callable[[bool, str], list[Ratio]]:
    def ratios(quick: bool, python: str) -> list[Ratio]:
        found: list[Ratio] = importlib.import_module(module).ratios(python, 3 if quick else 7)
        return found

    return ratios


def occlusion(quick: bool, _: str) -> list[Ratio]:
    size, turns = ((640, 360), 3) if quick else ((1280, 720), 7)
    found: list[Ratio] = importlib.import_module("bench_ambient_occlusion").ratios(size, turns)
    return found


def stencil(quick: bool, _: str) -> list[Ratio]:
    bench = importlib.import_module("bench_stencil")
    given = ((320, 180), 3, ("numpy",)) if quick else ((1280, 720), 9)
    found: list[Ratio] = bench.ratios(*given)
    return found


def tiles(quick: bool, _: str) -> list[Ratio]:
    bench = importlib.import_module("bench_tiles")
    return list(bench.ratios(bench.measure(*((6000, 4000) if quick else (30_000, 20_000)), "1 GB")))


def video(quick: bool, _: str) -> list[Ratio]:
    bench = importlib.import_module("bench_video")
    found: list[Ratio] = bench.ratios(*((30, (640, 360), 3) if quick else (300, (1920, 1080), 3)))
    return found


def apply(quick: bool, _: str) -> list[Ratio]:
    found: list[Ratio] = importlib.import_module("bench_apply").ratios(3 if quick else 9)
    return found


@dataclass(frozen=True)
class Benchmark:
    """``needs`` maps modules to what installs them; ``apart`` says that they belong to the peers' Python."""

    run: Callable[[bool, str], list[Ratio]]
    needs: dict[str, str]
    apart: bool = False


BENCHMARKS = {
    "cpu": Benchmark(cpu_table, {"halide": "halide", "cv2": "opencv-python-headless"}),
    "arrays": Benchmark(arrays, {"cv2": "opencv-python-headless"}),
    "counts": Benchmark(by_hand("bench_counts"), {"cv2": "opencv-python-headless"}),
    "raster": Benchmark(raster, {}),
    "soft_shadow": Benchmark(soft_shadow, {}),
    "compile": Benchmark(compiling, {}),
    "overhead": Benchmark(overhead, {}),
    "memory": Benchmark(memory, {}),
    "gl": Benchmark(by_hand("bench_gl"), {"moderngl": "moderngl"}),
    "originals": Benchmark(by_hand("bench_originals"), {"moderngl": "moderngl", "skimage": "scikit-image"}),
    "opencl": Benchmark(by_hand("bench_opencl"), {}),
    "opencl host": Benchmark(by_hand("bench_opencl_host"), {}),
    "frames": Benchmark(by_hand("bench_frames"), {"moderngl": "moderngl"}),
    "light2d": Benchmark(peers("bench_light2d"), {"pygame_light2d": "pygame-light2d"}, apart=True),
    "bloom": Benchmark(peers("bench_bloom"), {"arcade": "arcade"}, apart=True),
    "ambient_occlusion": Benchmark(occlusion, {"pyvista": "pyvista"}),
    "stencil": Benchmark(stencil, {}),
    "tiles": Benchmark(tiles, {"tifffile": "tifffile"}),
    "video": Benchmark(video, {"av": "av"}),
    "apply": Benchmark(apply, {"cv2": "opencv-python-headless"}),
}


def missing(benchmark: Benchmark, peer_python: str) -> list[str]:
    """What to install for a benchmark."""
    python = peer_python if benchmark.apart else sys.executable
    script = "import importlib.util, sys; print(*[importlib.util.find_spec(m) is not None for m in sys.argv[1:]])"
    command = [python, "-c", script, *benchmark.needs]
    there = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    return [package for package, found in zip(benchmark.needs.values(), there, strict=True) if found == "False"]


@dataclass(frozen=True)
class Outcome:
    """A benchmark's ratios, or why there are none."""

    name: str
    ratios: tuple[Ratio, ...] = ()
    skipped: str = ""


def measured(name: str, quick: bool, peer_python: str) -> Outcome:
    """One benchmark in a process of its own."""
    absent = missing(BENCHMARKS[name], peer_python)
    if absent:
        return Outcome(name, skipped=f"needs {', '.join(absent)}: pip install {' '.join(absent)}")
    command = [
        sys.executable,
        __file__,
        "--worker",
        name,
        "--peer-python",
        peer_python,
        *(["--quick"] if quick else []),
    ]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    except subprocess.TimeoutExpired:
        return Outcome(name, skipped=f"failed: took longer than {PATIENCE} s")
    for line in done.stdout.splitlines():
        if line.startswith(MARK):
            return Outcome(name, tuple(Ratio(**each) for each in json.loads(line.removeprefix(MARK))))
    last = (done.stderr.strip().splitlines() or ["no message"])[-1]
    return Outcome(name, skipped=f"failed with status {done.returncode}: {last}")


def worker(name: str, quick: bool, peer_python: str) -> None:
    """What the benchmark itself prints goes to the errors, so that the last line stays alone."""
    with contextlib.redirect_stdout(sys.stderr):
        found = BENCHMARKS[name].run(quick, peer_python)
    print(MARK + json.dumps([ratio.plain() for ratio in found]))


HEADER = ("what", "got", "wanted", "ms", "peer's ms", "")


def cells(ratio: Ratio) -> tuple[str, ...]:
    """A row of the table."""

    def number(value: float | None) -> str:
        return "" if value is None else f"{value:.2f}" if value < 10 else f"{value:.1f}"

    relation = "≥" if ratio.at_least else "≤"
    wanted = "–" if ratio.wanted is None else f"{relation} {ratio.wanted:g} {ratio.unit}"
    verdict = {True: "met", False: "missed", None: ""}[ratio.met]
    return ratio.what, f"{number(ratio.got)} {ratio.unit}", wanted, number(ratio.ms), number(ratio.other_ms), verdict


def show(outcomes: Sequence[Outcome]) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(*HEADER[:1], *(f"{name}" for name in HEADER[1:]))
    for column in table.columns[1:5]:
        column.justify = "right"
    styles = {"met": "green", "missed": "red", "": None}
    for outcome in outcomes:
        for ratio in outcome.ratios:
            row = cells(ratio)
            table.add_row(*row, style=styles[row[-1]])
        if outcome.skipped:
            table.add_row(f"{outcome.name}: {outcome.skipped}", *[""] * 4, "skipped", style="yellow")
        table.add_section()
    Console(width=None if sys.stdout.isatty() else 150).print(table)


def markdown(outcomes: Sequence[Outcome]) -> str:
    """The table for the document."""
    lines = [f"| {' | '.join(HEADER)} |", "|---|---:|---:|---:|---:|---|"]
    for outcome in outcomes:
        lines += [f"| {' | '.join(cells(ratio))} |" for ratio in outcome.ratios]
        if outcome.skipped:
            lines.append(f"| {outcome.name}: {outcome.skipped} | | | | | skipped |")
    return "\n".join(lines)


def machine() -> str:
    import os

    model = platform.processor() or platform.machine()
    with contextlib.suppress(OSError):
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        model = next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), model)
    load = statistics.mean(os.getloadavg()) if hasattr(os, "getloadavg") else 0.0
    cores, version = os.cpu_count(), platform.python_version()
    return f"{model}, {cores} cores; Python {version}; load average {load:.1f}; taken {date.today()}"


def page(outcomes: Sequence[Outcome], growth: str, quick: bool) -> str:
    command = f"python tests/benchmarks/run.py{' --quick' if quick else ''} --document docs/performance.md"
    return "\n".join([
        "# Speed",
        "",
        f"`{command}` writes this page. Machine: {machine()}. Other work on the",
        "machine changes times more than ratios. `gl` is the machine's driver, or Mesa's llvmpipe if there is no GPU.",
        "",
        "## Ratios",
        "",
        "Medians of runs in turns. A ratio is passgraph's time divided by the other's, or the reverse for a minimum.",
        "Processor time is that of all threads: other work on the machine hardly changes it, nor do idle cores.",
        "",
        markdown(outcomes),
        "",
        "## How costs grow",
        "",
        growth,
    ])  # fmt: skip


def arguments() -> Any:
    parser = argparse.ArgumentParser(description="Every benchmark, and one table of all ratios.")
    parser.add_argument("--quick", action="store_true", help="smaller pictures and fewer runs")
    parser.add_argument("--only", nargs="+", choices=BENCHMARKS, default=list(BENCHMARKS), metavar="NAME",
                        help=", ".join(BENCHMARKS))  # fmt: skip
    parser.add_argument("--peer-python", default=sys.executable, help="a Python with arcade and pygame-light2d")
    parser.add_argument("--document", type=Path, help="write this page, with plots in images/performance beside it")
    parser.add_argument("--worker", choices=BENCHMARKS, help=argparse.SUPPRESS)
    return parser.parse_args()


def main() -> int:
    given = arguments()
    if given.worker:
        worker(given.worker, given.quick, given.peer_python)
        return 0
    from rich.progress import track

    outcomes = [measured(name, given.quick, given.peer_python) for name in track(given.only, "benchmarks")]
    show(outcomes)
    if given.document:
        from growth import section

        text = section(given.document.parent / "images" / "performance", given.quick)
        given.document.write_text(page(outcomes, text, given.quick) + "\n", encoding="utf-8")
        print(f"wrote {given.document}")
    return int(any(ratio.met is False for outcome in outcomes for ratio in outcome.ratios))


if __name__ == "__main__":
    sys.exit(main())
