"""``passgraph bench``: measure time and error of shadow methods, or of versions of a user's graph."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, astuple, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from passgraph.commands.input_values import InputType, made_inputs, opened, read_inputs
from passgraph.commands.options import BackendType, size_option
from passgraph.commands.running import file_name, progress
from passgraph.commands.tables import show_table
from passgraph.commands.written_files import check_folder
from passgraph.errors import InputError
from passgraph.pictures import save
from passgraph.writing import write_text

if TYPE_CHECKING:
    from passgraph.bench.measure import Row, SceneResult
    from passgraph.bench.versions import Version
    from passgraph.commands.own_file import Graph


Measured = TypeVar("Measured", "Row", "Version")
COLUMNS = ("backend", "version", "call_ms", "call_cpu_ms", "rmse", "largest", "ssim", "flip")


def bench_versions(
    file: Path,
    exact: str | None,
    inputs: Sequence[tuple[str, str]],
    names: Sequence[str],
    backends: Sequence[str],
    size: tuple[int, int] | None,
    frames: int,
    say: Callable[[str], object],
) -> list[Version]:
    """Measure the outputs of a user's file.

    ``names`` selects versions. ``exact`` is an output too; it is chosen by default if it is the last of two.
    """
    from passgraph.bench.versions import measure_versions
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
    with opened(backends) as devices:
        return measure_versions(chosen, exact, devices, picture_size, given, frames, say)


#: Default size of pictures, if neither an option nor an input sets it.
DEFAULT_SIZE = (1280, 720)


def _check_names(file: Path, names: Sequence[str], targets: Graph) -> None:
    for name in names:
        if name not in targets:
            raise InputError(f"{file}: has no output {name!r}; there are {', '.join(targets)}")


def show_versions(versions: Sequence[Version]) -> None:
    """Print a table for each backend, with the Pareto front marked."""
    from passgraph.bench.metrics import front

    headings = ("call ms", "CPU ms", "RMSE", "largest", "SSIM", "FLIP", "front")
    for backend, rows in _by_backend(versions).items():
        best = set(front([(row.call.wall, row.difference.rmse) for row in rows]))
        table = []
        for number, row in enumerate(rows):
            times = (f"{row.call.wall:.2f}", f"{row.call.cpu:.2f}")
            differences = (f"{n:.3g}" for n in astuple(row.difference))
            table.append((row.name, *times, *differences, "*" if number in best else ""))
        show_table(backend, ("version",), headings, table)


def _by_backend(rows: Sequence[Measured]) -> dict[str, list[Measured]]:
    backends = dict.fromkeys(row.backend for row in rows)
    return {backend: [row for row in rows if row.backend == backend] for backend in backends}


def _write(versions: Sequence[Version], file: Path, folder: Path) -> None:
    from passgraph.bench.bench_report import Point, csv_text, pareto_plot

    write_text(folder / "results.csv", csv_text(COLUMNS, [_flat(row) for row in versions]))
    for backend, rows in _by_backend(versions).items():
        points = [Point(row.name, row.name, row.call.wall, row.difference.rmse) for row in rows]
        plot = folder / f"{file_name(backend)}.png"
        pareto_plot(points, f"{file.name}, {backend}", plot, "RMSE against the exact version")
        for row in rows:
            save(folder / f"{file_name(backend)}-{file_name(row.name)}.png", row.picture)


def _flat(row: Version) -> dict[str, Any]:
    """Return a version as a row of plain values."""
    call = {"backend": row.backend, "version": row.name, "call_ms": row.call.wall, "call_cpu_ms": row.call.cpu}
    return call | asdict(row.difference)


def check_unused(given: Mapping[str, object], why: str) -> None:
    """Raise InputError for options that have no effect here."""
    for option, value in given.items():
        if value:
            raise InputError(f"{option} {why}; leave it out")


#: Defaults with --quick.
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
@click.option(
    "--backend", "-b", "backends", multiple=True, type=BackendType(), help="Backend to measure; may be repeated."
)
@click.option(
    "--method", "-m", "methods", multiple=True, metavar="NAME", help="Shadow method; may be repeated.  [default: all]"
)
@click.option("--exact", metavar="NAME", help="With FILE.py: the exact output, which the others are compared with.")
@click.option(
    "--input",
    "-i",
    "inputs",
    multiple=True,
    type=InputType(),
    help="With FILE.py: picture of an input.  [default: a generated one]",
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
@click.option("--frames", type=click.IntRange(1, 1000), metavar="NUMBER", help="Frames to time for each method.")
@click.option("--quick", is_flag=True, help="One small scene and one map size: seconds instead of minutes.")
@click.option("--list", "listed", is_flag=True, help="List scenes and methods, and exit.")
def bench(
    sources: tuple[str, ...], output: Path, backends: tuple[str, ...], methods: tuple[str, ...],
    exact: str | None, inputs: tuple[tuple[str, str], ...], map_sizes: tuple[int, ...], size: tuple[int, int] | None,
    frames: int | None, quick: bool, listed: bool,
) -> None:  # fmt: skip
    """Measure time against error.

    With SCENEs, compare frames of every shadow method with ray tracing. A SCENE is a name from --list, or a file; by
    default, all available scenes are measured.

    With FILE.py, a Python module of yours (it is run), compare its ``outputs``, a mapping from names to targets, with
    the output named by --exact.
    """
    from passgraph.bench.metrics import check_installed

    if listed:
        _list()
        return
    check_installed(lambda line: click.echo(f"passgraph: warning: {line}", err=True))
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
        versions = bench_versions(file, exact, inputs, methods, backends, size, frames, say)
        _write(versions, file, output)
    show_versions(versions)
    click.echo(f"{output}: written")


def _bench_shadows(
    scenes: tuple[str, ...], output: Path, backends: tuple[str, ...], methods: tuple[str, ...],
    map_sizes: tuple[int, ...], size: tuple[int, int] | None, frames: int | None, quick: bool,
) -> None:  # fmt: skip
    from passgraph.bench.bench_report import write_report
    from passgraph.bench.bench_scenes import SCENES, scene_named
    from passgraph.bench.measure import Settings, measure
    from passgraph.bench.methods import METHODS, method_named

    for name in methods:
        method_named(name)
    chosen = scenes or (QUICK_SCENES if quick else tuple(name for name, scene in SCENES.items() if scene.here))
    settings = Settings(QUICK_SIZE, (1024,), frames=QUICK_FRAMES) if quick else Settings()
    given: dict[str, Any] = {
        "size": size,
        "map_sizes": map_sizes,
        "methods": methods or tuple(METHODS),
        "backends": backends,
        "frames": frames,
    }
    settings = replace(settings, **{key: value for key, value in given.items() if value})
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
    from passgraph.bench.bench_scenes import SCENES
    from passgraph.bench.methods import METHODS

    for scene in SCENES.values():
        missing = "" if scene.here else f" (needs {scene.needs})"
        click.echo(f"scene   {scene.name:14} {scene.about}{missing}")
    for method in METHODS.values():
        click.echo(f"method  {method.name:14} {method.series}")


def _show(result: SceneResult) -> None:
    from passgraph.bench.bench_report import SHOWN, truth_line
    from passgraph.bench.metrics import front

    click.echo(truth_line(result))
    for reason in result.failed:
        click.echo(f"left out: {reason}")
    for backend, rows in _by_backend(result.rows).items():
        best = set(front([(row.frame.wall, row.errors.rmse) for row in rows]))
        table = [
            (row.method, str(row.map_size), *(show(row) for show in SHOWN.values()), "*" if number in best else "")
            for number, row in enumerate(rows)
        ]
        show_table(f"{result.name}, {backend}", ("method",), ("map", *SHOWN, "front"), table)
