"""``passgraph bench FILE.py``: versions of a user's own graph against an exact one."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from passgraph.commands.capture import file_name
from passgraph.errors import InputError
from passgraph.writing import write_text

if TYPE_CHECKING:
    from passgraph.bench.versions import Version
    from passgraph.commands.own_file import Graph

COLUMNS = ("backend", "version", "call_ms", "call_cpu_ms", "rmse", "largest", "ssim", "flip")


def bench_versions(
    file: Path,
    exact: str | None,
    inputs: Sequence[tuple[str, Path]],
    names: Sequence[str],
    backends: Sequence[str],
    size: tuple[int, int] | None,
    frames: int,
    folder: Path,
    say: Callable[[str], object],
) -> list[Version]:
    """Measure the outputs of a user's file, write tables, plots and pictures, and return what was measured.

    ``names`` leaves out all other versions; ``exact`` is among the outputs, by itself where it is the last of two.
    """
    from passgraph.bench.versions import measure_versions
    from passgraph.commands.graph_inputs import made_inputs, opened, read_inputs
    from passgraph.commands.own_file import graphs_of

    graphs = graphs_of(file)
    targets = next(iter(graphs.values())) if len(graphs) == 1 else {}
    if len(targets) < 2:
        raise InputError(
            f"{file}: bench compares versions of one picture; write outputs = {{'fast': …, 'exact': …}} at the top of "
            f"the module, got {', '.join(targets or graphs)}"
        )
    if exact is None:
        raise InputError(f"{file}: say which output the others are held against: --exact {' or '.join(targets)}")
    _check_names(file, [exact, *names], targets)
    chosen = {name: target for name, target in targets.items() if not names or name in (*names, exact)}
    pictures = read_inputs({"": chosen}, inputs)
    picture_size, given = made_inputs(chosen, pictures, size, DEFAULT_SIZE)
    with ExitStack() as stack:
        devices = opened(backends)
        for device in devices:
            stack.callback(device.close)
        versions = measure_versions(chosen, exact, devices, picture_size, given, frames, say)
    _write(versions, file, folder)
    return versions


#: Size of pictures where none is given, here or by an input.
DEFAULT_SIZE = (1280, 720)


def _check_names(file: Path, names: Sequence[str], targets: Graph) -> None:
    for name in names:
        if name not in targets:
            raise InputError(f"{file}: has no output {name!r}; there are {', '.join(targets)}")


def show_versions(versions: Sequence[Version]) -> None:
    """A table a backend, those in front marked."""
    from rich import box
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    from passgraph.bench.pareto import front

    console = Console(highlight=False, width=None if sys.stdout.isatty() else 200)
    for backend, rows in _by_backend(versions).items():
        table = Table(title=escape(backend), title_justify="left", box=box.SIMPLE_HEAD)
        table.add_column("version")
        for heading in ("call ms", "CPU ms", "RMSE", "largest", "SSIM", "FLIP", "front"):
            table.add_column(heading, justify="right")
        best = set(front([(row.call.wall, row.difference.rmse) for row in rows]))
        for number, row in enumerate(rows):
            off = row.difference
            numbers = (off.rmse, off.largest, off.ssim, off.flip)
            times = (f"{row.call.wall:.2f}", f"{row.call.cpu:.2f}")
            table.add_row(escape(row.name), *times, *(f"{n:.3g}" for n in numbers), "*" if number in best else "")
        console.print(table)


def _by_backend(versions: Sequence[Version]) -> dict[str, list[Version]]:
    backends = dict.fromkeys(version.backend for version in versions)
    return {backend: [version for version in versions if version.backend == backend] for backend in backends}


def _write(versions: Sequence[Version], file: Path, folder: Path) -> None:
    from passgraph.bench.charts import Point, pareto_plot
    from passgraph.bench.tables import csv_text
    from passgraph.pictures import save

    write_text(folder / "results.csv", csv_text(COLUMNS, [_flat(row) for row in versions]))
    for backend, rows in _by_backend(versions).items():
        points = [Point(row.name, row.name, row.call.wall, row.difference.rmse) for row in rows]
        plot = folder / f"{file_name(backend)}.png"
        pareto_plot(points, f"{file.name}, {backend}", plot, "RMSE against the exact version")
        for row in rows:
            save(folder / f"{file_name(backend)}-{file_name(row.name)}.png", row.picture)


def _flat(row: Version) -> dict[str, Any]:
    """One version with a plain value in each column."""
    call = {"backend": row.backend, "version": row.name, "call_ms": row.call.wall, "call_cpu_ms": row.call.cpu}
    return call | asdict(row.difference)


def check_unused(given: Mapping[str, object], why: str) -> None:
    """Raise InputError for options that say nothing here."""
    for option, value in given.items():
        if value:
            raise InputError(f"{option} {why}; leave it out")
