"""Write a report folder: tables, plots, pictures, and an HTML page."""

from __future__ import annotations

import csv
import io
import json
import platform
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.bench.measure import Row, SceneResult, Settings
from passgraph.bench.metrics import front
from passgraph.bench.truth import Float32, Mask
from passgraph.pictures import save
from passgraph.run.profile import Profile
from passgraph.writing import NewFile, write_text

#: Distinguishable in print and to most color-blind readers: M. Okabe, K. Ito, "Color Universal Design", 2008.
COLORS = ("#000000", "#E69F00", "#0072B2", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#8c6d31", "#7f7f7f", "#b30059")
MARKERS = "osD^vP*Xp<>h"
#: Marker areas by map size, points squared.
AREAS = (26.0, 52.0, 96.0, 150.0)
#: Errors below this are drawn here, since the axis is logarithmic.
LEAST_ERROR = 1e-6


@dataclass(frozen=True)
class Point:
    """A point of a plot: one way to compute a picture.

    Attributes
    ----------
    name : label of points on the Pareto front
    series : points drawn as one line, such as a method with several settings
    time_ms : time of a frame
    error : RMSE
    map_size : texels along each side of a shadow map, shown as marker size; 0 if there is none
    """

    name: str
    series: str
    time_ms: float
    error: float
    map_size: int = 0

    @property
    def place(self) -> tuple[float, float]:
        return self.time_ms, max(self.error, LEAST_ERROR)


def pareto_plot(points: Sequence[Point], title: str, path: Path, error: str) -> None:
    """Plot time along x and error along y, with a marker for each point and the Pareto front as a line.

    Parameters
    ----------
    points : points of one scene on one backend
    title : title of the plot
    path : a .png or .svg file
    error : name of the error, for its axis
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.6, 5.0), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    sizes = sorted({p.map_size for p in points})
    series = list(dict.fromkeys(p.series for p in points))
    best = [points[i] for i in front([p.place for p in points])]
    axes.plot(*zip(*(p.place for p in best), strict=True), color="#999999", linewidth=1.2, zorder=1, label="front")
    for number, name in enumerate(series):
        own = [p for p in points if p.series == name]
        color, marker = COLORS[number % len(COLORS)], MARKERS[number % len(MARKERS)]
        for size in sizes:
            line = [p.place for p in own if p.map_size == size]
            if len(line) > 1:
                axes.plot(*zip(*line, strict=True), color=color, linewidth=0.6, alpha=0.6, zorder=2)
        area = [AREAS[min(sizes.index(p.map_size), len(AREAS) - 1)] for p in own]
        times, errors = zip(*(p.place for p in own), strict=True)
        axes.scatter(
            times, errors, s=area, color=color, marker=marker, label=name, edgecolors="white", linewidths=0.5, zorder=3
        )
    for p in best:
        text = p.name if len(sizes) == 1 else f"{p.name}, {p.map_size}"
        axes.annotate(text, p.place, (5, 5), textcoords="offset points", fontsize=7, zorder=4)
    axes.set_xscale("log")
    axes.set_yscale("log")
    for axis in (axes.xaxis, axes.yaxis):
        _plain_ticks(axis)
    axes.set_xlabel("time of a frame, ms")
    axes.set_ylabel(error)
    axes.set_title(title, fontsize=10)
    axes.grid(which="both", linewidth=0.3, alpha=0.5)
    maps = f"; larger marks: larger maps ({', '.join(map(str, sizes))})" if len(sizes) > 1 else ""
    axes.legend(fontsize=7, loc="upper left", bbox_to_anchor=(1.0, 1.0), title="method")
    if maps:
        axes.text(0.0, -0.13, maps[2:], transform=axes.transAxes, fontsize=7)
    with NewFile(path) as file:
        figure.savefig(file.temporary)
        file.complete()


def _plain_ticks(axis: Any) -> None:
    """Label ticks 1, 2, 5, 10 … as plain numbers."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


COLUMNS = (
    "scene", "backend", "method", "map_size", "frame_ms", "frame_cpu_ms", "filter_ms", "filter_cpu_ms", "rmse",
    "penumbra_rmse", "ssim", "flip", "false_lit", "false_dark",
)  # fmt: skip


def milliseconds(profile: Profile) -> dict[str, float]:
    """Return the time of each pass, by its name; draws of one name are summed."""
    times: dict[str, float] = {}
    for each in profile.passes:
        times[each.name] = times.get(each.name, 0.0) + 1e3 * each.seconds
    return times


def flat(row: Row) -> dict[str, Any]:
    """Return a row with a plain value in each column."""
    errors = asdict(row.errors)
    return {
        "scene": row.scene, "backend": row.backend, "method": row.method, "map_size": row.map_size,
        "frame_ms": row.frame.wall, "frame_cpu_ms": row.frame.cpu,
        "filter_ms": row.filter.wall, "filter_cpu_ms": row.filter.cpu,
        **errors,
    }  # fmt: skip


def csv_text(columns: Sequence[str], rows: Sequence[Mapping[str, Any]]) -> str:
    """Return CSV: a heading, then a line for each row, numbers with six digits.

    >>> csv_text(("name", "ms"), [{"name": "fast", "ms": 1 / 3}])
    'name,ms\\nfast,0.333333\\n'
    """
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, lineterminator="\n")
    writer.writeheader()
    for row in rows:
        writer.writerow({key: f"{v:.6g}" if isinstance(v, float) else v for key, v in row.items()})
    return text.getvalue()


def as_json(results: Sequence[SceneResult], settings: Settings) -> str:
    """Return everything but the pictures as JSON; NaN is null."""
    document = {
        "machine": {"system": platform.platform(), "processor": processor(), "python": platform.python_version()},
        "settings": asdict(settings),
        "scenes": [
            {
                "name": result.name,
                "triangles": result.scene.triangle_count,
                "truth": {
                    "samples": result.truth.samples,
                    "noise": result.truth.noise,
                    "best_rmse": result.best_rmse,
                    "penumbra_pixels": int(result.truth.penumbra.sum()),
                    "pixels": int(result.truth.counts.sum()),
                },
                "failed": list(result.failed),
                "rows": [
                    {**flat(row), "series": row.series, "passes_ms": milliseconds(row.passes)} for row in result.rows
                ],
            }
            for result in results
        ],
    }
    return json.dumps(_without_nan(document), indent=1, allow_nan=False) + "\n"


def _without_nan(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_nan(v) for key, v in value.items()}
    if isinstance(value, list | tuple):
        return [_without_nan(v) for v in value]
    return None if isinstance(value, float) and value != value else value


def processor() -> str:
    """Return the processor's name, if the system reports it."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as lines:
            model = next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "")
    except OSError:
        model = ""
    return model or platform.processor() or platform.machine()


def truth_line(result: SceneResult) -> str:
    """Say how accurate the ground truth is."""
    truth = result.truth
    times = result.best_rmse / truth.noise if truth.noise > 0.0 else float("inf")
    return (
        f"{result.name}: truth by Embree, {truth.samples} rays a pixel, standard error {truth.noise:.5f}, "
        f"{times:.0f} times below the least error of a method ({result.best_rmse:.4f})"
    )


#: Columns of tables for people: heading, and a function that formats a row's entry.
SHOWN: dict[str, Callable[[Row], str]] = {
    "frame ms": lambda row: f"{row.frame.wall:.1f}",
    "CPU ms": lambda row: f"{row.frame.cpu:.1f}",
    "filter CPU ms": lambda row: f"{row.filter.cpu:.1f}",
    "RMSE": lambda row: f"{row.errors.rmse:.4f}",
    "penumbra": lambda row: f"{row.errors.penumbra_rmse:.3f}",
    "SSIM": lambda row: f"{row.errors.ssim:.4f}",
    "FLIP": lambda row: f"{row.errors.flip:.4f}",
    "false lit": lambda row: f"{row.errors.false_lit:.2%}",
    "false dark": lambda row: f"{row.errors.false_dark:.2%}",
}


def as_markdown(rows: Sequence[Row], with_map: bool = True) -> str:
    """Return a Markdown table with the rows in their order."""
    headings = ["method", *(["map"] if with_map else []), *SHOWN]
    lines = ["| " + " | ".join(headings) + " |", "|" + "---|" * len(headings)]
    for row in rows:
        cells = [row.method, *([str(row.map_size)] if with_map else []), *(show(row) for show in SHOWN.values())]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; margin: 2em auto; max-width: 1320px; padding: 0 1em; color: #222 }
table { border-collapse: collapse; font-size: 13px; margin: 1em 0 }
td, th { padding: 2px 9px; text-align: right; border-bottom: 1px solid #ddd }
td:first-child, th:first-child { text-align: left }
tr.front td { font-weight: 600; background: #f2f7ee }
figure { display: inline-block; margin: 0 8px 14px 0 } figcaption { font-size: 12px } img { max-width: 100% }
"""
#: Gain of difference maps, around mid gray.
DIFFERENCE_GAIN = 2.0


def difference(share: Float32, truth: Float32, counts: Mask) -> NDArray[np.float32]:
    """Return red where there is too much light, blue where there is too little, white where both agree; (h, w, 3)."""
    off = np.clip(np.where(counts, share - truth, 0.0) * DIFFERENCE_GAIN, -1.0, 1.0)
    shown = np.ones((*off.shape, 3), np.float32)
    shown[:, :, 1] -= np.abs(off)
    shown[:, :, 2] -= np.maximum(off, 0.0)
    shown[:, :, 0] -= np.maximum(-off, 0.0)
    return shown


def write_report(
    results: Sequence[SceneResult], settings: Settings, folder: Path, say: Callable[[str], object] = lambda _: None
) -> list[Path]:
    """Write report.html, results.csv, results.json, a plot for each scene and backend, and pictures; return the
    files."""
    pictures = folder / "pictures"
    pictures.mkdir(exist_ok=True)
    parts = [_head(settings)]
    for result in results:
        say(f"writing {result.name}")
        parts.append(_section(result, folder))
    write_text(folder / "results.csv", csv_text(COLUMNS, [flat(row) for r in results for row in r.rows]))
    write_text(folder / "results.json", as_json(results, settings))
    write_text(folder / "report.html", "\n".join([*parts, "</body></html>", ""]))
    return [folder / name for name in ("report.html", "results.csv", "results.json")]


def plot_name(scene: str, backend: str) -> str:
    """
    >>> plot_name("shipped", "opencl:1")
    'shipped-opencl-1.png'
    """
    return f"{file_name(scene)}-{file_name(backend)}.png"


def file_name(name: str) -> str:
    """Return a name without characters that are special in paths and shells."""
    return "".join(c if c.isalnum() or c in "-_." else "-" for c in Path(name).name)


def _head(settings: Settings) -> str:
    width, height = settings.size
    return (
        f"<!doctype html><html lang='en'><head><meta charset='utf-8'><title>Shadow methods</title>"
        f"<style>{STYLE}</style></head><body><h1>Shadow methods: time and error</h1>"
        f"<p>{width}×{height} pixels, {settings.frames} frames each, {escape(processor())}. Times are medians of "
        "frames run in turn; <i>filter</i> is what comes on top of a frame without shadows. Errors are those of the "
        "share of the light that arrives, against rays. Rows on a light ground lie on the front.</p>"
    )


def _section(result: SceneResult, folder: Path) -> str:
    lines = [f"<h2>{escape(result.name)}</h2><p>{escape(truth_line(result))}</p>"]
    lines += [f"<p>Left out: {escape(reason)}</p>" for reason in result.failed]
    for backend in dict.fromkeys(row.backend for row in result.rows):
        rows = [row for row in result.rows if row.backend == backend]
        plot = plot_name(result.name, backend)
        points = [Point(row.method, row.series, row.frame.wall, row.errors.rmse, row.map_size) for row in rows]
        pareto_plot(points, f"{result.name}, {backend}", folder / plot, "RMSE of the shadow factor")
        lines.append(f"<h3>{escape(backend)}</h3><img src='{plot}' alt='time against error'>{_table(rows)}")
    lines.append(_pictures(result, folder))
    return "\n".join(lines)


def _table(rows: Sequence[Row]) -> str:
    best = set(front([(row.frame.wall, row.errors.rmse) for row in rows]))
    cells = ["<tr>" + "".join(f"<th>{escape(h)}</th>" for h in ("method", "map", *SHOWN, "passes, ms")) + "</tr>"]
    for number, row in enumerate(rows):
        shown = [row.method, str(row.map_size), *(show(row) for show in SHOWN.values())]
        passes = ", ".join(f"{name} {spent:.1f}" for name, spent in milliseconds(row.passes).items())
        kind = " class='front'" if number in best else ""
        cells.append(
            f"<tr{kind}>"
            + "".join(f"<td>{escape(c)}</td>" for c in shown)
            + f"<td style='text-align:left;font-size:11px'>{escape(passes)}</td></tr>"
        )
    return f"<table>{''.join(cells)}</table>"


def _pictures(result: SceneResult, folder: Path) -> str:
    """Return the truth, then each method's factor above its difference, on the first backend at the middle map size."""
    if not result.shares:
        return ""
    backend = next(iter(result.shares))[0]
    sizes = sorted({size for _, _, size in result.shares})
    size, name = sizes[len(sizes) // 2], file_name(result.name)
    counts = result.counts[backend]
    save(folder / "pictures" / f"{name}-truth.png", grey(np.where(counts, result.truth.share, 1.0)))
    figures = [
        f"<h3>Pictures: {escape(backend)}, maps of {size}</h3><p>Below each the difference, twice: red has too much "
        "light, blue too little.</p>",
        _figure(f"{name}-truth.png", "rays"),
    ]
    for (measured_on, method, map_size), share in result.shares.items():
        if (measured_on, map_size) == (backend, size):
            both = np.concatenate([grey(np.where(counts, share, 1.0)), difference(share, result.truth.share, counts)])
            save(folder / "pictures" / f"{name}-{method}.png", both)
            figures.append(_figure(f"{name}-{method}.png", method))
    return "\n".join(figures)


def grey(share: NDArray[np.floating]) -> NDArray[np.float32]:
    """Repeat a share in three channels."""
    return np.repeat(np.asarray(share, np.float32)[:, :, None], 3, axis=2)


def _figure(file: str, caption: str) -> str:
    text = escape(caption)
    return f"<figure><img src='pictures/{file}' alt='{text}'><figcaption>{text}</figcaption></figure>"
