"""Time on one axis, error on the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from passgraph.bench.pareto import front
from passgraph.writing import NewFile

#: Distinguishable in print and to most colour-blind readers: M. Okabe, K. Ito, "Color Universal Design", 2008.
COLORS = ("#000000", "#E69F00", "#0072B2", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#8c6d31", "#7f7f7f", "#b30059")
MARKERS = "osD^vP*Xp<>h"
#: Marker areas by map size, points squared.
AREAS = (26.0, 52.0, 96.0, 150.0)
#: What an error of 0 is drawn as: the axis is logarithmic.
LEAST_ERROR = 1e-6


@dataclass(frozen=True)
class Point:
    """One way to make a picture.

    Attributes
    ----------
    name : written beside those that nothing beats
    series : what is drawn as one line, such as a method at several settings
    time_ms : of a frame
    error : RMSE
    map_size : texels along each side of a shadow map, which marks grow with; 0 where there is none
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
    """Time along x and error along y, a mark a point, and the front as a line.

    Parameters
    ----------
    points : on one scene and one backend
    title : over the plot
    path : a .png or .svg file
    error : what the error is, for its axis
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
        axes.scatter(times, errors, s=area, color=color, marker=marker, label=name,
                     edgecolors="white", linewidths=0.5, zorder=3)  # fmt: skip
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
    with NewFile(path) as made:
        figure.savefig(made.temporary)
        made.complete()


def _plain_ticks(axis: Any) -> None:
    """1, 2, 5, 10 … written as numbers."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
