"""``passgraph check``: your own kernels and graphs on every backend, held against the oracle."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from passgraph.commands.graph_inputs import MADE_SIZE, InputType, made_inputs, opened, read_inputs
from passgraph.commands.options import BackendType, SizeType
from passgraph.commands.progress import progress
from passgraph.errors import InputError

if TYPE_CHECKING:
    from passgraph.commands.own_file import Graph
    from passgraph.verify.conformance.case import Case, Picture
    from passgraph.verify.conformance.judging import Verdict


@click.command()
@click.argument("file", metavar="FILE", type=click.Path(path_type=Path))
@click.option("--input", "-i", "inputs", multiple=True, type=InputType(), help="Picture of an input; else one is made.")
@click.option("--size", type=SizeType(), help=f"Size of what is made. [default: {MADE_SIZE[0]}x{MADE_SIZE[1]}]")
@click.option("--backend", "-b", "backends", multiple=True, type=BackendType(), help="Without it all that are here.")
@click.option("--golden", type=click.Path(path_type=Path), metavar="FOLDER", help="Compare with what is recorded here.")
@click.option("--record", is_flag=True, help="With --golden: write inputs and outputs there instead.")
def check(
    file: Path,
    inputs: tuple[tuple[str, Path], ...],
    size: tuple[int, int] | None,
    backends: tuple[str, ...],
    golden: Path | None,
    record: bool,
) -> int:
    """Check FILE on every backend: a Python module of yours (it is run), or kernels as text (only parsed).

    Of a module its ``outputs`` are checked (a target, several, or a mapping), else its targets, else its effects on
    pictures, else each of its kernels.  Exit status: 0 all within bounds and as recorded, 1 something differs, 2 an
    error.
    """
    from passgraph.commands.own_file import graphs_of

    if record and golden is None:
        raise InputError("--record needs --golden FOLDER, where to write")
    if golden is not None and not record and (inputs or size):
        raise InputError("--golden brings its own inputs and size; give --input and --size with --record only")
    well = True
    with progress("reading") as say:
        graphs = graphs_of(file)
        pictures = read_inputs(graphs, inputs)
        devices = opened(backends)
        try:
            for name, graph in graphs.items():
                say(name)
                well &= _check(name, graph, pictures, size, devices, golden, record)
        finally:
            for backend in devices:
                backend.close()
    return 0 if well else 1


def _check(
    name: str,
    graph: Graph,
    pictures: Mapping[str, Picture],
    size: tuple[int, int] | None,
    backends: Sequence[Any],
    golden: Path | None,
    record: bool,
) -> bool:
    from passgraph.commands import golden as recorded
    from passgraph.verify.conformance.case import Case
    from passgraph.verify.conformance.judging import Judge

    if golden is not None and not record:
        size, given = recorded.recorded_inputs(golden, name)
    else:
        size, given = made_inputs(graph, pictures, size)
    judge = Judge(Case("check", name, lambda: graph, size, (given,), most_ambiguous=1.0, least_told=0.0))
    judge.passes.allowed(True)  # what cannot run at all is an error, not a verdict
    verdicts = [judge.verdict(backend) for backend in backends]
    _show(judge.case, verdicts)
    changes = [] if golden is None or record else recorded.changed(golden, name, judge)
    for change in changes:
        click.echo(str(change))
    if golden is not None and record:
        recorded.record(golden, name, judge, given)
        click.echo(f"{name}: recorded in {golden}")
    elif golden is not None and not changes:
        click.echo(f"{name}: as recorded")
    return not changes and all(verdict.outcome == "passed" for verdict in verdicts)


def _show(case: Case, verdicts: Sequence[Verdict]) -> None:
    """A row a target, a column a backend; then the first divergence of each."""
    from rich import box
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    table = Table(title=escape(case.name), title_justify="left", box=box.SIMPLE_HEAD)
    for heading in ("pass", "target"):
        table.add_column(heading, overflow="fold")
    ran = [verdict for verdict in verdicts if verdict.outcome != "failed"]
    for verdict in ran:
        table.add_column(verdict.backend, justify="right")
    for row in zip(*(verdict.targets for verdict in ran), strict=True):
        cells = [
            f"[bold red]outside {t.outside:.3%}[/]" if t.outside else f"within, {t.ambiguous:.2%} ambiguous"
            for t in row
        ]
        table.add_row(escape(row[0].step), escape(row[0].target), *cells)
    console = Console(highlight=False, width=None if sys.stdout.isatty() else 160)
    if ran:
        console.print(table)
    for verdict in verdicts:
        if verdict.outcome != "passed":
            console.print(str(verdict), markup=False, soft_wrap=True)
