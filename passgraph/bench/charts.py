"""Time on one axis, error on the other."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from passgraph.bench.measure import Row
from passgraph.bench.pareto import front

#: Distinguishable in print and to most colour-blind readers: M. Okabe, K. Ito, "Color Universal Design", 2008.
COLORS = ("#000000", "#E69F00", "#0072B2", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#8c6d31", "#7f7f7f", "#b30059")
MARKERS = "osD^vP*Xp<>h"
#: Marker areas by map size, points squared.
AREAS = (26.0, 52.0, 96.0, 150.0)


def pareto_plot(rows: Sequence[Row], title: str, path: Path) -> None:
    """One series a method, one marker size a map size, and the front as a line.

    Parameters
    ----------
    rows : of one scene and one backend
    title : over the plot
    path : a .png or .svg file
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.6, 5.0), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    sizes = sorted({row.map_size for row in rows})
    series = list(dict.fromkeys(row.series for row in rows))
    best = [rows[i] for i in front([_point(row) for row in rows])]
    axes.plot(*zip(*map(_point, best), strict=True), color="#999999", linewidth=1.2, zorder=1, label="front")
    for number, name in enumerate(series):
        own = [row for row in rows if row.series == name]
        color, marker = COLORS[number % len(COLORS)], MARKERS[number % len(MARKERS)]
        for size in sizes:
            points = [_point(row) for row in own if row.map_size == size]
            if len(points) > 1:
                axes.plot(*zip(*points, strict=True), color=color, linewidth=0.6, alpha=0.6, zorder=2)
        area = [AREAS[min(sizes.index(row.map_size), len(AREAS) - 1)] for row in own]
        times, errors = zip(*map(_point, own), strict=True)
        axes.scatter(times, errors, s=area, color=color, marker=marker, label=name,
                     edgecolors="white", linewidths=0.5, zorder=3)  # fmt: skip
    for row in best:
        text = row.method if len(sizes) == 1 else f"{row.method}, {row.map_size}"
        axes.annotate(text, _point(row), (5, 5), textcoords="offset points", fontsize=7, zorder=4)
    axes.set_xscale("log")
    axes.set_yscale("log")
    for axis in (axes.xaxis, axes.yaxis):
        _plain_ticks(axis)
    axes.set_xlabel("time of a frame, ms")
    axes.set_ylabel("RMSE of the shadow factor")
    axes.set_title(title, fontsize=10)
    axes.grid(which="both", linewidth=0.3, alpha=0.5)
    maps = f"; larger marks: larger maps ({', '.join(map(str, sizes))})" if len(sizes) > 1 else ""
    axes.legend(fontsize=7, loc="upper left", bbox_to_anchor=(1.0, 1.0), title="method")
    if maps:
        axes.text(0.0, -0.13, maps[2:], transform=axes.transAxes, fontsize=7)
    figure.savefig(path)


def _point(row: Row) -> tuple[float, float]:
    return row.frame.wall, max(row.errors.rmse, 1e-6)


def _plain_ticks(axis: Any) -> None:
    """1, 2, 5, 10 … written as numbers."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
