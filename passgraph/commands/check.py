"""``passgraph check``: your own kernels and graphs on every backend, held against the oracle."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from passgraph.commands.options import BackendType, SizeType
from passgraph.commands.progress import progress
from passgraph.errors import DeviceMissingError, InputError

if TYPE_CHECKING:
    from passgraph.commands.own_file import Graph
    from passgraph.conformance.case import Case, Picture
    from passgraph.conformance.judging import Verdict

CHECK_SIZE = (96, 64)


class InputType(click.ParamType[tuple[str, Path]]):
    """NAME=FILE."""

    name = "NAME=FILE"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, Path]:
        if isinstance(value, tuple):
            return value
        name, sign, path = str(value).partition("=")
        if not (name and sign and path):
            self.fail(f"{value!r} is not NAME=FILE, such as frame=photo.png", param, ctx)
        return name, Path(path)


@click.command()
@click.argument("file", metavar="FILE", type=click.Path(path_type=Path))
@click.option("--input", "-i", "inputs", multiple=True, type=InputType(), help="Picture of an input; else one is made.")
@click.option("--size", type=SizeType(), help=f"Size of what is made. [default: {CHECK_SIZE[0]}x{CHECK_SIZE[1]}]")
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
        pictures = _read(graphs, inputs)
        opened = _opened(backends)
        try:
            for name, graph in graphs.items():
                say(name)
                well &= _check(name, graph, pictures, size, opened, golden, record)
        finally:
            for backend in opened:
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
    from passgraph.conformance.case import Case
    from passgraph.conformance.judging import Judge

    if golden is not None and not record:
        size, given = recorded.recorded_inputs(golden, name)
    else:
        size, given = _inputs(graph, pictures, size)
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


def _opened(names: Sequence[str]) -> list[Any]:
    """The backends named, or all that are here."""
    from passgraph.backends.registry import backend_names, open_backend

    if names:
        return [open_backend(name) for name in names]
    made = []
    for name in backend_names():
        if name not in ("reference", "null"):
            try:
                made.append(open_backend(name))
            except DeviceMissingError as error:
                click.echo(f"{name}: missing: {' '.join(str(error).split())}")
    if not made:
        raise InputError("no backend is here to be checked; see: passgraph backends")
    return made


def _read(graphs: Mapping[str, Graph], inputs: Sequence[tuple[str, Path]]) -> dict[str, Picture]:
    from passgraph.pictures import load
    from passgraph.plan.collect import inputs_behind

    known = sorted({name for graph in graphs.values() for name in inputs_behind(list(graph.values()))})
    for name, _ in inputs:
        if name not in known:
            raise InputError(f"there is no input {name!r}; there are {', '.join(known) or 'none'}")
    return {name: load(path) for name, path in inputs}


def _inputs(
    graph: Graph, pictures: Mapping[str, Picture], size: tuple[int, int] | None
) -> tuple[tuple[int, int], dict[str, Picture]]:
    """The output's size and a picture for each input: given, its default, or made."""
    from passgraph.conformance.scenes import picture, with_special
    from passgraph.plan.collect import inputs_behind

    first = next(iter(pictures.values()), None)
    chosen = size or (CHECK_SIZE if first is None else (first.shape[1], first.shape[0]))
    made = {}
    for number, (name, spec) in enumerate(inputs_behind(list(graph.values())).items()):
        channels = 4 if spec.format is None else spec.format.channels
        if name in pictures:
            made[name] = pictures[name][:, :, :channels]
        elif spec.default is None:
            kind = "float" if spec.format is None else spec.format.kind
            made[name] = with_special(picture(spec.size or chosen, number)[:, :, :channels], kind)
    return chosen, made


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
