"""A folder with everything that was measured: tables, plots, pictures, and a page that shows them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from html import escape
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from passgraph.bench.charts import Point, pareto_plot
from passgraph.bench.measure import Row, SceneResult, Settings
from passgraph.bench.pareto import front
from passgraph.bench.tables import SHOWN, as_csv, as_json, processor, truth_line
from passgraph.bench.truth import Float32, Mask
from passgraph.pictures import save
from passgraph.writing import write_text

STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; margin: 2em auto; max-width: 1320px; padding: 0 1em; color: #222 }
table { border-collapse: collapse; font-size: 13px; margin: 1em 0 }
td, th { padding: 2px 9px; text-align: right; border-bottom: 1px solid #ddd }
td:first-child, th:first-child { text-align: left }
tr.front td { font-weight: 600; background: #f2f7ee }
figure { display: inline-block; margin: 0 8px 14px 0 } figcaption { font-size: 12px } img { max-width: 100% }
"""
#: Difference maps: how many times the difference is drawn, about mid grey.
DIFFERENCE_GAIN = 2.0


def difference(share: Float32, truth: Float32, counts: Mask) -> NDArray[np.float32]:
    """Red where there is too much light, blue where there is too little, white where they agree; (h, w, 3)."""
    off = np.clip(np.where(counts, share - truth, 0.0) * DIFFERENCE_GAIN, -1.0, 1.0)
    made = np.ones((*off.shape, 3), np.float32)
    made[:, :, 1] -= np.abs(off)
    made[:, :, 2] -= np.maximum(off, 0.0)
    made[:, :, 0] -= np.maximum(-off, 0.0)
    return made


def write_report(
    results: Sequence[SceneResult], settings: Settings, folder: Path, say: Callable[[str], object] = lambda _: None
) -> list[Path]:
    """Write report.html, results.csv, results.json, a plot a scene and backend, and pictures; what was written."""
    pictures = folder / "pictures"
    pictures.mkdir(exist_ok=True)
    parts = [_head(settings)]
    for result in results:
        say(f"writing {result.name}")
        parts.append(_section(result, folder))
    write_text(folder / "results.csv", as_csv([row for r in results for row in r.rows]))
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
    """A name without what paths and shells mind."""
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
    made = [f"<h2>{escape(result.name)}</h2><p>{escape(truth_line(result))}</p>"]
    made += [f"<p>Left out: {escape(reason)}</p>" for reason in result.failed]
    for backend in dict.fromkeys(row.backend for row in result.rows):
        rows = [row for row in result.rows if row.backend == backend]
        plot = plot_name(result.name, backend)
        points = [Point(row.method, row.series, row.frame.wall, row.errors.rmse, row.map_size) for row in rows]
        pareto_plot(points, f"{result.name}, {backend}", folder / plot, "RMSE of the shadow factor")
        made.append(f"<h3>{escape(backend)}</h3><img src='{plot}' alt='time against error'>{_table(rows)}")
    made.append(_pictures(result, folder))
    return "\n".join(made)


def _table(rows: Sequence[Row]) -> str:
    best = set(front([(row.frame.wall, row.errors.rmse) for row in rows]))
    cells = ["<tr>" + "".join(f"<th>{escape(h)}</th>" for h in ("method", "map", *SHOWN, "passes, ms")) + "</tr>"]
    for number, row in enumerate(rows):
        shown = [row.method, str(row.map_size), *(show(row) for show in SHOWN.values())]
        passes = ", ".join(f"{name} {spent:.1f}" for name, spent in row.passes.passes.items())
        passes += f"; once: upload {row.passes.upload:.1f}; read back {row.passes.read_back:.1f}"
        kind = " class='front'" if number in best else ""
        cells.append(
            f"<tr{kind}>" + "".join(f"<td>{escape(c)}</td>" for c in shown)
            + f"<td style='text-align:left;font-size:11px'>{escape(passes)}</td></tr>"
        )  # fmt: skip
    return f"<table>{''.join(cells)}</table>"


def _pictures(result: SceneResult, folder: Path) -> str:
    """The truth, then each method's factor over its difference, on the first backend with the middle map size."""
    if not result.shares:
        return ""
    backend = next(iter(result.shares))[0]
    sizes = sorted({size for _, _, size in result.shares})
    size, name = sizes[len(sizes) // 2], file_name(result.name)
    counts = result.counts[backend]
    save(folder / "pictures" / f"{name}-truth.png", grey(np.where(counts, result.truth.share, 1.0)))
    made = [
        f"<h3>Pictures: {escape(backend)}, maps of {size}</h3><p>Below each the difference, twice: red has too much "
        "light, blue too little.</p>",
        _figure(f"{name}-truth.png", "rays"),
    ]
    for (of, method, map_size), share in result.shares.items():
        if (of, map_size) == (backend, size):
            both = np.concatenate(
                [grey(np.where(counts, share, 1.0)), difference(share, result.truth.share, counts)]
            )  # fmt: skip
            save(folder / "pictures" / f"{name}-{method}.png", both)
            made.append(_figure(f"{name}-{method}.png", method))
    return "\n".join(made)


def grey(share: NDArray[np.floating]) -> NDArray[np.float32]:
    """A share as three equal channels."""
    return np.repeat(np.asarray(share, np.float32)[:, :, None], 3, axis=2)


def _figure(file: str, caption: str) -> str:
    text = escape(caption)
    return f"<figure><img src='pictures/{file}' alt='{text}'><figcaption>{text}</figcaption></figure>"
