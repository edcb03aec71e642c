"""Rows as CSV, JSON and a table."""

from __future__ import annotations

import csv
import io
import json
import platform
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

from passgraph.bench.measure import Row, SceneResult, Settings

COLUMNS = (
    "scene", "backend", "method", "map_size", "frame_ms", "frame_cpu_ms", "filter_ms", "filter_cpu_ms", "upload_ms",
    "read_back_ms", "rmse", "penumbra_rmse", "ssim", "flip", "false_lit", "false_dark",
)  # fmt: skip


def flat(row: Row) -> dict[str, Any]:
    """One row with a plain value in each column."""
    errors = asdict(row.errors)
    return {
        "scene": row.scene, "backend": row.backend, "method": row.method, "map_size": row.map_size,
        "frame_ms": row.frame.wall, "frame_cpu_ms": row.frame.cpu,
        "filter_ms": row.filter.wall, "filter_cpu_ms": row.filter.cpu,
        "upload_ms": row.passes.upload, "read_back_ms": row.passes.read_back, **errors,
    }  # fmt: skip


def as_csv(rows: Sequence[Row]) -> str:
    """A line for each row."""
    return csv_text(COLUMNS, [flat(row) for row in rows])


def csv_text(columns: Sequence[str], rows: Sequence[Mapping[str, Any]]) -> str:
    """A heading, then a line for each row, numbers with six digits.

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
    """Everything but the pictures; NaN is null."""
    made = {
        "machine": {"system": platform.platform(), "processor": processor(), "python": platform.python_version()},
        "settings": asdict(settings),
        "scenes": [
            {
                "name": result.name, "triangles": result.scene.triangle_count,
                "truth": {
                    "samples": result.truth.samples, "noise": result.truth.noise, "tracer": result.truth.tracer,
                    "best_rmse": result.best_rmse, "penumbra_pixels": int(result.truth.penumbra.sum()),
                    "pixels": int(result.truth.counts.sum()),
                },
                "failed": list(result.failed),
                "rows": [{**flat(row), "series": row.series, "passes_ms": row.passes.passes} for row in result.rows],
            }
            for result in results
        ],
    }  # fmt: skip
    return json.dumps(_without_nan(made), indent=1, allow_nan=False) + "\n"


def _without_nan(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_nan(v) for key, v in value.items()}
    if isinstance(value, list | tuple):
        return [_without_nan(v) for v in value]
    return None if isinstance(value, float) and value != value else value


def processor() -> str:
    """The processor's name, where the system tells it."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as lines:
            found = next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "")
    except OSError:
        found = ""
    return found or platform.processor() or platform.machine()


def truth_line(result: SceneResult) -> str:
    """How sure the truth is."""
    truth = result.truth
    times = result.best_rmse / truth.noise if truth.noise > 0.0 else float("inf")
    return (
        f"{result.name}: truth by {truth.tracer}, {truth.samples} rays a pixel, standard error {truth.noise:.5f}, "
        f"{times:.0f} times below the least error of a method ({result.best_rmse:.4f})"
    )


#: What tables for people show: heading, and how a row is written there.
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
    """A table for a page, in the order of the rows."""
    headings = ["method", *(["map"] if with_map else []), *SHOWN]
    lines = ["| " + " | ".join(headings) + " |", "|" + "---|" * len(headings)]
    for row in rows:
        cells = [row.method, *([str(row.map_size)] if with_map else []), *(show(row) for show in SHOWN.values())]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)
