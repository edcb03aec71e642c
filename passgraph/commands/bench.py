"""``passgraph bench``: time and error side by side, of shadow methods or of versions of a user's graph."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from passgraph.commands.bench_versions import bench_versions, check_unused, show_versions
from passgraph.commands.files import check_folder
from passgraph.commands.graph_inputs import InputType
from passgraph.commands.options import BackendType, size_option
from passgraph.commands.progress import progress
from passgraph.errors import InputError

if TYPE_CHECKING:
    from passgraph.bench.measure import Row, SceneResult

#: What --quick stands for where nothing else is said.
QUICK_SIZE, QUICK_FRAMES, QUICK_SCENES = (320, 180), 5, ("shipped",)

#: Calls of each version of a user's graph.
DEFAULT_FRAMES = 9


@click.command()
@click.argument("sources", metavar="[SCENE]... | FILE.py", nargs=-1)
@click.option(
    "--output",
    "-o",
    default="bench",
    show_default=True,
    type=click.Path(path_type=Path),
    metavar="FOLDER",
    help="Folder for report.html, results.csv, results.json, plots and pictures.",
)
@click.option("--backend", "-b", "backends", multiple=True, type=BackendType(), help="May be repeated.")
@click.option("--method", "-m", "methods", multiple=True, metavar="NAME", help="May be repeated; without it all.")
@click.option("--exact", metavar="NAME", help="Of FILE.py: the output that others are held against.")
@click.option(
    "--input", "-i", "inputs", multiple=True, type=InputType(), help="Of FILE.py: an input; else one is made."
)
@click.option(
    "--map-size",
    "map_sizes",
    multiple=True,
    type=click.IntRange(16, 8192),
    metavar="NUMBER",
    help="Texels along each side of shadow maps; may be repeated.",
)
@size_option()
@click.option("--frames", type=click.IntRange(1, 1000), metavar="NUMBER", help="Frames that are timed, of each method.")
@click.option("--quick", is_flag=True, help="One scene, small, one map size: minutes become seconds.")
@click.option("--list", "listed", is_flag=True, help="Show scenes and methods, and stop.")
def bench(
    sources: tuple[str, ...], output: Path, backends: tuple[str, ...], methods: tuple[str, ...],
    exact: str | None, inputs: tuple[tuple[str, Path], ...], map_sizes: tuple[int, ...], size: tuple[int, int] | None,
    frames: int | None, quick: bool, listed: bool,
) -> None:  # fmt: skip
    """Measure time against error.

    Of every shadow method on SCENEs: frames, against traced rays.  A SCENE is one of --list, or a file; without one
    all that are here are measured.  Of a Python module of yours, FILE.py (it is run): each of its ``outputs``, a
    mapping from names to targets, against the one that is --exact.
    """
    from passgraph.bench.likeness import check_installed

    if listed:
        _list()
        return
    check_installed()
    if not any(source.endswith(".py") for source in sources):
        check_unused({"--exact": exact, "--input": inputs}, "is for a file of your own, FILE.py")
        _bench_shadows(sources, output, backends, methods, map_sizes, size, frames, quick)
        return
    if len(sources) > 1:
        raise InputError(f"bench takes one file of your own at a time, got {', '.join(sources)}")
    check_unused({"--map-size": map_sizes, "--quick": quick}, "is for shadow methods on a scene")
    check_folder(output)
    with progress("reading") as say:
        file, frames = Path(sources[0]), frames or DEFAULT_FRAMES
        versions = bench_versions(file, exact, inputs, methods, backends, size, frames, output, say)
    show_versions(versions)
    click.echo(f"{output}: written")


def _bench_shadows(
    scenes: tuple[str, ...], output: Path, backends: tuple[str, ...], methods: tuple[str, ...],
    map_sizes: tuple[int, ...], size: tuple[int, int] | None, frames: int | None, quick: bool,
) -> None:  # fmt: skip
    from passgraph.bench.measure import Settings, measure
    from passgraph.bench.methods import METHODS, method_named
    from passgraph.bench.report import write_report
    from passgraph.bench.scenes import SCENES, scene_named

    for name in methods:
        method_named(name)
    chosen = scenes or (QUICK_SCENES if quick else tuple(name for name, scene in SCENES.items() if scene.here))
    settings = Settings(QUICK_SIZE, (1024,), frames=QUICK_FRAMES) if quick else Settings()
    given: dict[str, Any] = {
        "size": size, "map_sizes": map_sizes, "methods": methods or tuple(METHODS), "backends": backends,
        "frames": frames,
    }  # fmt: skip
    settings = settings.with_(**{key: value for key, value in given.items() if value})
    for name in chosen:
        scene_named(name)
    check_folder(output)
    with progress("reading the scenes") as say:
        results = [measure(name, settings, say) for name in chosen]
        written = write_report(results, settings, output, say)
    for result in results:
        _show(result)
    click.echo(f"{', '.join(map(str, written))}: written")
    if not any(result.rows for result in results):
        raise InputError(f"nothing could be measured: {'; '.join(r for result in results for r in result.failed)}")


def _list() -> None:
    from passgraph.bench.methods import METHODS
    from passgraph.bench.scenes import SCENES

    for scene in SCENES.values():
        missing = "" if scene.here else f" (needs {scene.needs})"
        click.echo(f"scene   {scene.name:14} {scene.about}{missing}")
    for method in METHODS.values():
        click.echo(f"method  {method.name:14} {method.series}")


def _show(result: SceneResult) -> None:
    from rich.console import Console

    from passgraph.bench.tables import truth_line

    console = Console(highlight=False, width=None if sys.stdout.isatty() else 200)
    console.print(truth_line(result), markup=False, soft_wrap=True)
    for reason in result.failed:
        console.print(f"left out: {reason}", markup=False, soft_wrap=True)
    for backend in dict.fromkeys(row.backend for row in result.rows):
        console.print(_table(f"{result.name}, {backend}", [row for row in result.rows if row.backend == backend]))


def _table(title: str, rows: list[Row]) -> Any:
    from rich import box
    from rich.table import Table

    from passgraph.bench.pareto import front
    from passgraph.bench.tables import SHOWN

    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD)
    table.add_column("method")
    for heading in ("map", *SHOWN, "front"):
        table.add_column(heading, justify="right", overflow="fold")
    best = set(front([(row.frame.wall, row.errors.rmse) for row in rows]))
    for number, row in enumerate(rows):
        shown = (show(row) for show in SHOWN.values())
        table.add_row(row.method, str(row.map_size), *shown, "*" if number in best else "")
    return table
