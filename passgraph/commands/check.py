"""``passgraph check``: your own kernels and graphs on every backend, held against the oracle."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from passgraph.commands.given_values import SettingType, known_values, run_values
from passgraph.commands.graph_inputs import (
    MADE_SIZE,
    InputType,
    extreme_input,
    made_inputs,
    opened,
    plain_input,
    read_inputs,
)
from passgraph.commands.options import BackendType, SizeType
from passgraph.commands.progress import progress
from passgraph.commands.range_ends import MOST_ENDS, Tries
from passgraph.commands.verdicts import (
    console,
    most_ambiguous_option,
    most_seconds_option,
    say_equality,
    say_faults,
    say_non_finite,
)
from passgraph.errors import InputError

if TYPE_CHECKING:
    from passgraph.commands.own_file import Graph
    from passgraph.verify.conformance.case import Picture
    from passgraph.verify.oracle.pace import Pace
    from passgraph.verify.report import Report


@dataclass(frozen=True)
class Golden:
    """The folder of recorded pictures, whether to write there, and how many steps may be between then and now."""

    folder: Path
    record: bool
    steps: int


@click.command()
@click.argument("file", metavar="FILE[:NAME]|EFFECT")
@click.option("--input", "-i", "inputs", multiple=True, type=InputType(), help="Picture of an input; else one is made.")
@click.option(
    "--set", "settings", multiple=True, type=SettingType(),
    help="A value of the run: a number, a vector (1,2,3), a matrix row by row (1,0;0,1), true or false.",
)  # fmt: skip
@click.option("--size", type=SizeType(), help=f"Size of what is made. [default: {MADE_SIZE[0]}x{MADE_SIZE[1]}]")
@click.option("--backend", "-b", "backends", multiple=True, type=BackendType(), help="Without it all that are here.")
@most_ambiguous_option
@most_seconds_option
@click.option(
    "--ends", type=click.IntRange(0, 1 << 10), default=MOST_ENDS, show_default=True, metavar="N",
    help="Runs more of a graph at most, each with one value at an end of its range; 0: none.",
)  # fmt: skip
@click.option("--stress", is_flag=True, help="Run again with extreme values in made pictures, and report that apart.")
@click.option("--allow-nan", is_flag=True, help="Pass NaN and infinity that the reference computes too.")
@click.option("--golden", type=click.Path(path_type=Path), metavar="FOLDER", help="Compare with what is recorded here.")
@click.option("--record", is_flag=True, help="With --golden: write inputs and outputs there instead.")
@click.option(
    "--golden-steps", type=click.IntRange(0, 1 << 30), default=0, show_default=True, metavar="N",
    help="Steps of the target's format (of floats: ulp) that values may lie from what is recorded.",
)  # fmt: skip
def check(
    file: str,
    inputs: tuple[tuple[str, Path], ...],
    settings: tuple[tuple[str, str], ...],
    size: tuple[int, int] | None,
    backends: tuple[str, ...],
    most_ambiguous: float,
    most_seconds: float | None,
    ends: int,
    stress: bool,
    allow_nan: bool,
    golden: Path | None,
    record: bool,
    golden_steps: int,
) -> int:
    """Check FILE on every backend: a Python module of yours (it is run), or kernels as text (only parsed).  Or EFFECT.

    Of a module its ``outputs`` are checked (a target, several, or a mapping), else its targets, else its effects on
    pictures, else each of its kernels.  Said first is whether backends made the same bits; then whether each is within
    what rounding allows. NaN and infinity fail, also where the reference computes them (--allow-nan). Where rounding
    may turn too many decisions, or bounds are too wide, the verdict is undecided. What passes is run again with values
    at the ends of their ranges, and with --stress with extreme values in the pictures that are made for it.

    Exit status: 0 all passed and as recorded, 1 something differs or is undecided, 2 an error.
    """
    from passgraph.commands.named import named_graphs
    from passgraph.verify.oracle.pace import Pace

    if record and golden is None:
        raise InputError("--record needs --golden FOLDER, where to write")
    if golden is not None and not record and (inputs or size or settings):
        raise InputError(
            "--golden brings its own inputs, values and size; give --input, --set and --size with --record only"
        )
    kept = None if golden is None else Golden(golden, record, golden_steps)
    well = True
    with progress("reading") as say:
        graphs = named_graphs(file)
        pictures = read_inputs(graphs, inputs)
        known_values(graphs, settings)
        devices = opened(backends)
        try:
            for name, graph in graphs.items():
                say(name)
                pace = Pace(most_seconds, _named(say, name))
                run = _Run(name, graph, pictures, dict(settings), size, kept, pace)
                passed = run.checked(devices, say, most_ambiguous, allow_nan)
                if passed and kept is None:
                    tries = Tries(ends, pictures, run.settings, size, devices, most_ambiguous)
                    passed = tries.passed(name, graph, pace, say)
                if stress and kept is None:
                    title = f"{name}, stress"
                    extreme = _Run(title, graph, pictures, dict(settings), size, None, pace, extreme_input)
                    passed &= extreme.checked(devices, say, most_ambiguous, True)
                well &= passed
        finally:
            for backend in devices:
                backend.close()
    return 0 if well else 1


class _Run:
    """One graph with what its run brings: what is given, recorded or made."""

    def __init__(
        self, name: str, graph: Graph, pictures: Mapping[str, Picture], settings: Mapping[str, str],
        size: tuple[int, int] | None, golden: Golden | None, pace: Pace,
        make: Callable[[tuple[int, int], int, str], Picture] = plain_input,
    ) -> None:  # fmt: skip
        from passgraph.commands.golden import recorded_run
        from passgraph.verify.oracle.passes import Passes

        self.name, self.golden, self.settings = name, golden, settings
        self.made: list[str] = []
        if golden is not None and not golden.record:
            size, self.inputs, self.settings = recorded_run(golden.folder, name)
        else:
            size, self.inputs = made_inputs(graph, pictures, size, made=make)
            self.made = [name for name in self.inputs if name not in pictures]
        values = run_values(name, graph, self.settings)
        self.settings = {name: text for name, text in self.settings.items() if name in values}
        self.passes = Passes(graph, size, [{**self.inputs, **values}], pace)

    def checked(
        self, backends: Sequence[Any], say: Callable[[str], None], most_ambiguous: float, allow_nan: bool
    ) -> bool:
        """Whether every backend passed and all is as recorded; all that is found is printed."""
        from passgraph.commands import golden as recorded
        from passgraph.verify.compare import compared

        self.passes.allowed(True)  # what cannot run at all is an error, not a verdict
        report = compared(self.passes, backends, _named(say, self.name), most_ambiguous)
        on = console()
        say_equality(on, report, self.name)
        _show(self.name, report)
        say_faults(on, report, self.name, self.made)
        finite = say_non_finite(on, report, self.name, allow_nan)
        if self.golden is None:
            return report.passed and finite
        if self.golden.record:
            recorded.record(self.golden.folder, self.name, self.passes, self.inputs, self.settings)
            click.echo(f"{self.name}: recorded in {self.golden.folder}")
            return report.passed
        changes = recorded.changed(self.golden.folder, self.name, self.passes, self.golden.steps)
        for change in changes:
            click.echo(str(change))
        if all(change.allowed for change in changes):
            click.echo(f"{self.name}: as recorded")
        return report.passed and all(change.allowed for change in changes)


def _named(say: Callable[[str], None], name: str) -> Callable[[str], None]:
    return lambda what: say(f"{name}: {what}")


def _show(name: str, report: Report) -> None:
    """A row a target, a column a backend."""
    from rich import box
    from rich.markup import escape
    from rich.table import Table

    table = Table(title=escape(name), title_justify="left", box=box.SIMPLE_HEAD)
    for heading in ("pass", "target"):
        table.add_column(heading, overflow="fold")
    for backend in report.ran:
        table.add_column(backend.name, justify="right")
    for row in zip(*(backend.targets for backend in report.ran), strict=True):
        cells = [f"{t.verdict if t.passed else f'[bold red]{t.verdict}[/]'}, {t.figures}" for t in row]
        table.add_row(escape(row[0].step), escape(row[0].target), *cells)
    if report.ran:
        console().print(table)
