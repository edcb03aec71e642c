"""How costs grow with pixels, triangles, lights, passes and threads, on numpy, gl and opencl.

    python tests/benchmarks/growth.py [--quick] [FOLDER]

For each backend an exponent e is fitted, cost ≈ c·nᵉ, by
least squares over the logarithms of times (of each point the least of several
runs, since other load on the machine only adds): 1 is a cost in
proportion, 0 one that does not grow, and -1 over threads would be perfect sharing.  One plot each is written.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from harness import Job, seconds

BACKENDS = ("numpy", "gl", "opencl")
#: Distinguishable by most colour-blind readers: M. Okabe, K. Ito, "Color Universal Design", 2008.
LOOKS = {"numpy": ("#0072B2", "o"), "gl": ("#D55E00", "s"), "opencl": ("#009E73", "^")}
FOLDER = Path("docs/images/performance")
#: One more point is not taken where the last one took longer, milliseconds.
ENOUGH = 4000.0
#: Runs of one point.
MOST_RUNS = 400


@contextmanager
def by_pixels(count: int, backend: str) -> Iterator[Job]:
    """A Gaussian blur of 15 taps, rgba16f, of so many pixels (16:9)."""
    import passgraph as pg
    from passgraph.effects import gaussian_blur

    width = round((count * 16 / 9) ** 0.5)
    size = width, round(count / width)
    picture = np.random.default_rng(0).random((size[1], size[0], 4), np.float32)
    blurred = gaussian_blur(pg.Input("frame", "rgba16f", size, static=True), 3.0, 7)
    with pg.compile(blurred, backend=backend, options=pg.Options(static=False)) as program:
        yield frame(program, frame=picture)


@contextmanager
def by_triangles(count: int, backend: str) -> Iterator[Job]:
    """The surfaces (color, normals, depth) of a teapot of about so many triangles, 640x360."""
    import bench_raster

    import passgraph as pg

    # bench_raster's teapot has about 64 triangles for each square of the segments.
    made = bench_raster.scene(max(2, round((count / 64) ** 0.5)))
    targets = list(bench_raster.targets(made)["G-buffer"])
    with pg.compile(targets, backend=backend, size=(640, 360), options=pg.Options(static=False)) as program:
        yield frame(program)


@contextmanager
def by_lights(count: int, backend: str) -> Iterator[Job]:
    """A map of so many round 2-D lamps among 16 boxes, 640x360, tables made anew for each frame."""
    import passgraph as pg
    from passgraph.effects.light2d import Light2D, Wall, Window, live_light_map

    size = (640, 360)
    walls = [
        Wall.box(60 + 150 * (i % 4), 40 + 80 * (i // 4), 90 + 150 * (i % 4), 60 + 80 * (i // 4)) for i in range(16)
    ]
    lights = [Light2D((40.0 + 150 * (i % 4), 30.0 + 80 * (i // 4)), (0.3, 0.25, 0.2), 250.0, 4.0) for i in range(count)]
    live = live_light_map(Window(0, 0, *size), size, room=1 << 16, shaded=16)
    with pg.compile(live.target, backend=backend) as program:

        def run() -> None:
            program.run(**live.inputs(lights, walls))
            program.finish()

        yield run


@contextmanager
def by_passes(count: int, backend: str) -> Iterator[Job]:
    """A chain of so many passes over 256x256 pixels, none fused."""
    import bench_overhead

    size = (256, 256)
    with bench_overhead.program(count, backend, size) as program:
        yield bench_overhead.runs(program, size)


def frame(program, **pictures):  # type: ignore[no-untyped-def]
    def run() -> None:
        program.run(**pictures)
        program.finish()

    return run


@dataclass(frozen=True)
class Axis:
    """What grows: its points, fewer of them for ``--quick``, and the job of each."""

    name: str
    job: Callable[[int, str], object]
    points: tuple[int, ...]
    quick: tuple[int, ...]


AXES = (
    Axis("pixels", by_pixels, (100_000, 300_000, 900_000, 2_700_000, 8_000_000), (100_000, 500_000, 2_000_000)),
    Axis("triangles", by_triangles, (1_000, 8_000, 64_000, 250_000, 1_000_000), (1_000, 16_000, 128_000)),
    Axis("lights", by_lights, (1, 2, 4, 8, 16), (1, 4, 16)),
    Axis("passes", by_passes, (1, 4, 16, 64), (1, 8, 64)),
    Axis("threads", by_pixels, (1, 2), (1, 2)),
)
#: Pixels of the pictures with which threads are counted.
THREADS_PIXELS = 1_000_000


def least(job: Job, spend: float) -> float:
    """Milliseconds of the quickest of at least three runs, which together take about so many seconds."""
    job()
    times = [seconds(job) for _ in range(3)]
    while sum(times) < spend and len(times) < MOST_RUNS:
        times.append(seconds(job))
    return 1e3 * min(times)


def measured(axis: Axis, backend: str, points: tuple[int, ...], spend: float) -> dict[int, float]:
    """Milliseconds by point."""
    found: dict[int, float] = {}
    for count in points:
        if axis.name == "threads":
            if count <= len(os.sched_getaffinity(0)):
                found[count] = on_cores(count, backend, spend)
            continue
        with axis.job(count, backend) as job:  # type: ignore[attr-defined]
            found[count] = least(job, spend)
        if found[count] > ENOUGH:
            break
    return found


def on_cores(cores: int, backend: str, spend: float) -> float:
    """In a process that may use so many cores, since drivers make their threads once."""
    command = [sys.executable, __file__, "--cores", str(cores), backend, str(spend)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return float(json.loads(done.stdout.splitlines()[-1]))


def one_process(cores: int, backend: str, spend: float) -> None:
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:cores])
    with by_pixels(THREADS_PIXELS, backend) as job:
        print(json.dumps(least(job, 2 * spend)))


def exponent(points: dict[int, float]) -> float:
    """Slope of a straight line through the logarithms, by least squares."""
    if len(points) < 2:
        return float("nan")
    counts, times = np.log(list(points)), np.log(list(points.values()))
    return float(np.polyfit(counts, times, 1)[0])


def plot(axis: Axis, found: dict[str, dict[int, float]], path: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

    figure = Figure(figsize=(5.6, 3.8), dpi=90, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    for backend, points in found.items():
        color, marker = LOOKS[backend]
        label = f"{backend}, exponent {exponent(points):.2f}"
        axes.plot(list(points), list(points.values()), color=color, marker=marker, label=label)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.xaxis.set_major_locator(FixedLocator(sorted({count for points in found.values() for count in points})))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: short(value)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_formatter(FuncFormatter(lambda value, _: f"{value:g}" if f"{value:g}"[0] in "25" else ""))
    axes.set_xlabel(axis.name)
    axes.set_ylabel("time of a run, ms")
    axes.grid(which="both", linewidth=0.3, alpha=0.5)
    axes.legend(fontsize=8, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)
    figure.savefig(path)


def short(count: float) -> str:
    """1000 → 1k, 1000000 → 1M."""
    for scale, letter in ((1e6, "M"), (1e3, "k")):
        if count >= scale:
            return f"{count / scale:g}{letter}"
    return f"{count:g}"


def section(folder: Path, quick: bool) -> str:
    """Measure and plot everything; the tables as Markdown, with plots beside them."""
    from rich.progress import track

    folder.mkdir(parents=True, exist_ok=True)
    work = [(axis, backend) for axis in AXES for backend in BACKENDS]
    found: dict[str, dict[str, dict[int, float]]] = {axis.name: {} for axis in AXES}
    for axis, backend in track(work, "growth"):
        points = axis.quick if quick else axis.points
        found[axis.name][backend] = measured(axis, backend, points, 0.3 if quick else 3.0)
    parts = [" ".join(__doc__.split("\n\n")[2].replace("  One plot each is written.", "").split()), ""]
    for axis in AXES:
        plot(axis, found[axis.name], folder / f"{axis.name}.png")
        parts += [table(axis, found[axis.name]), "", f"![{axis.name}](images/performance/{axis.name}.png)", ""]
    return "\n".join(parts).rstrip()


def table(axis: Axis, found: dict[str, dict[int, float]]) -> str:
    """Milliseconds by point, and the exponents."""
    counts = sorted({count for points in found.values() for count in points})
    about = (axis.job.__doc__ or "").strip() if axis.name != "threads" else "The same blur by cores, a million pixels."
    lines = [
        f"### {axis.name.capitalize()}", "", about, "",
        f"| Backend | {' | '.join(map(short, counts))} | exponent |", f"|---|{'---:|' * (len(counts) + 1)}",
    ]  # fmt: skip
    for backend, points in found.items():
        times = " | ".join(f"{points[c]:.2f} ms" if c in points else "" for c in counts)
        lines.append(f"| {backend} | {times} | {exponent(points):.2f} |")
    return "\n".join(lines)


def main() -> None:
    if sys.argv[1:2] == ["--cores"]:
        one_process(int(sys.argv[2]), sys.argv[3], float(sys.argv[4]))
        return
    rest = [word for word in sys.argv[1:] if word != "--quick"]
    print(section(Path(rest[0]) if rest else FOLDER, "--quick" in sys.argv))


if __name__ == "__main__":
    main()
