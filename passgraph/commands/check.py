"""``passgraph check``: compare your kernels and graphs on every backend with the oracle's bounds."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import SNAPPED
from passgraph.commands.error_map import check_error_map, error_map_option, write_error_map
from passgraph.commands.input_values import (
    MADE_SIZE,
    InputType,
    SettingType,
    declared,
    extreme_input,
    known_values,
    made_inputs,
    opened,
    plain_input,
    read_inputs,
    read_value,
    run_values,
    takers,
    written_value,
)
from passgraph.commands.named import named_graphs
from passgraph.commands.options import SizeType, backends_option, complete_effect
from passgraph.commands.running import progress
from passgraph.commands.tables import marked, show_table
from passgraph.commands.verdicts import (
    most_ambiguous_option,
    most_seconds_option,
    say_equality,
    say_faults,
    say_non_finite,
)
from passgraph.errors import InputError, PassgraphError
from passgraph.language.parameter_limits import bounds
from passgraph.language.types import FLOAT, component_count, element_of
from passgraph.verify.kinds import first_other_kind
from passgraph.verify.oracle.pass_bounds import Passes
from passgraph.verify.oracle.time_limit import TimeLimit

if TYPE_CHECKING:
    from passgraph.commands.own_file import Graph
    from passgraph.language.ir import Parameter
    from passgraph.verify.conformance.case import Picture
    from passgraph.verify.report import Report


#: Most runs with a value at an end of its range, besides the one with defaults.
MOST_ENDS = 8
#: Default size of generated pictures in these runs: a quarter of the pixels of the first run.
SMALL_SIZE = (48, 32)


@dataclass(frozen=True)
class End:
    """A value of a run at an end of its range.

    Attributes
    ----------
    number : the end as text; for a vector or matrix, of each component
    value : the run value
    default : the default as text
    """

    name: str
    number: str
    value: object
    default: str

    def __str__(self) -> str:
        return f"{self.name} = {self.number}"


def range_ends(graph: Graph, settings: Mapping[str, str]) -> list[End]:
    """Return the ends of the ranges of a graph's run values that are not set, by value, the lower end first.

    An end that equals the default is left out, and so is an exclusive end of floats (``above``).
    """
    found = []
    for name, (handle, type_) in declared(graph).items():
        if type_ is not None and name not in settings:
            default = written_value(np.asarray(handle.default).tolist())
            ranged = [parameter for parameter in takers(graph, handle) if parameter.range is not None]
            for number in _numbers(ranged):
                if not _is(handle.default, number):
                    text = written_value(number)
                    value = read_value(" ".join([repr(number)] * component_count(type_)), type_, name, name)
                    found.append(End(name, text, value, default))
    return found


def _numbers(ranged: Sequence[Parameter]) -> list[float | int]:
    """Return the ends of the range that all parameters of a value allow, without those that one of them rejects."""
    if not ranged:
        return []
    limits = [_ends(parameter) for parameter in ranged]
    low, high = max(low for low, _ in limits), min(high for _, high in limits)
    ranges = [parameter.range for parameter in ranged if parameter.range is not None]
    if any(range_.odd for range_ in ranges):
        low = low if math.isinf(low) else 2 * (math.ceil(low) // 2) + 1
        high = high if math.isinf(high) else 2 * ((math.floor(high) - 1) // 2) + 1
    taken = [number for number in dict.fromkeys((low, high)) if all(number in range_ for range_ in ranges)]
    is_float = element_of(ranged[0].type) is FLOAT
    return [number if is_float else int(number) for number in taken if math.isfinite(number)]


def _ends(parameter: Parameter) -> tuple[float, float]:
    """Return the ends of a parameter's range as written; infinite for open ends."""
    limits, type_ = parameter.range, parameter.type
    assert limits is not None
    if element_of(type_) is not FLOAT:
        return bounds(limits, type_)
    # 0.3 is compared as float32, and printed as 0.3
    low = -math.inf if limits.low is None else float(limits.low)
    return low, math.inf if limits.high is None else float(limits.high)


def _is(default: object, number: float) -> bool:
    return default is not None and bool(np.all(np.asarray(default) == number))


class Tries:
    """Runs of graphs with values at the ends of their ranges, up to a limit for each graph."""

    def __init__(
        self,
        most: int,
        pictures: Mapping[str, Picture],
        settings: Mapping[str, str],
        size: tuple[int, int] | None,
        devices: Sequence[Any],
        most_ambiguous: float,
    ) -> None:
        self.most, self.pictures, self.settings, self.size = most, pictures, settings, size
        self.devices, self.most_ambiguous = devices, most_ambiguous

    def passed(self, name: str, graph: Graph, limit: TimeLimit, say: Callable[[str], None]) -> bool:
        """Run a graph with each value; print the values, and each fault with its value; return True if all pass."""
        ends = range_ends(graph, self.settings)
        if not ends or not self.most:
            return True
        well, tried = True, 0
        for end in ends[: self.most]:
            if limit.is_over:
                break
            say(f"{name}: {end}")
            well &= self._passes(f"{name} with {end}", graph, end, limit, say)
            tried += 1
        more = "--most-seconds N: more time" if limit.is_over else "--ends N: more runs"
        click.echo(f"{name}: tried {_ends_text(ends[:tried]) or 'nothing more'}{_left(ends[tried:], more)}")
        return well

    def _passes(self, title: str, graph: Graph, end: End, limit: TimeLimit, say: Callable[[str], None]) -> bool:
        from passgraph.verify.compare import compared

        size, inputs = made_inputs(graph, self.pictures, self.size, SMALL_SIZE)
        given = {**inputs, **run_values(title, graph, self.settings)}
        try:
            passes = Passes(graph, size, [{**given, end.name: end.value}], limit)
            passes.allowed()
        except PassgraphError as error:
            click.echo(f"{title}: {error}")
            return False
        report = compared(passes, self.devices, lambda what: say(f"{title}: {what}"), self.most_ambiguous)
        say_faults(report, title, [name for name in inputs if name not in self.pictures])
        lost = _lost(passes, lambda: Passes(graph, size, [given], limit))
        if lost:
            click.echo(f"{title}: {lost}")
        return report.passed and not lost


def _lost(passes: Passes, default: Callable[[], Passes]) -> str:
    """Describe the first target in which the reference has NaN, if it has none with the defaults; else return "".

    Backends are not judged then, since NaN is the right result.
    """
    expected, _ = passes.allowed()
    if not any(np.isnan(picture).any() for picture in expected.values()):
        return ""
    was_finite = {key for key, picture in default().allowed()[0].items() if not np.isnan(picture).any()}
    for key, picture in expected.items():
        lost: NDArray[np.bool_] = np.asarray(np.isnan(picture).any(axis=2))
        if key in was_finite and lost.any():
            step, resource = passes.plan.steps[key[1]], passes.plan.resources[key[2]]
            kind = first_other_kind(passes, key, lost, picture, expected, passes.watched(SNAPPED, [key[1]])[key[1]])
            return (
                f"pass {step.name}, target {resource.name}: NaN, in the reference too, at {kind.share:.3%} of pixels, "
                f"such as column {kind.pixel[0]}, row {kind.pixel[1]}{kind.given}; with its default there is none. "
                f"There {kind.cause}"
            )
    return ""


def _ends_text(ends: Sequence[End]) -> str:
    """List the tested numbers of each value.

    >>> _ends_text([End("radius", "0", 0, "2"), End("radius", "16", 16, "2"), End("gain", "1", 1.0, "0.5")])
    'radius = 2 (its default), 0, 16; gain = 0.5 (its default), 1'
    """
    numbers: dict[str, list[str]] = {}
    for end in ends:
        numbers.setdefault(end.name, [f"{end.default} (its default)"]).append(end.number)
    return "; ".join(f"{name} = {', '.join(numbers_text)}" for name, numbers_text in numbers.items())


def _left(ends: Sequence[End], more: str) -> str:
    return f"; not tried: {', '.join(map(str, ends))} ({more})" if ends else ""


@dataclass(frozen=True)
class Golden:
    """The folder of recorded pictures, True to write them, and the permitted difference in steps."""

    folder: Path
    record: bool
    steps: int


@click.command()
@click.argument("file", metavar="FILE[:NAME]|EFFECT", shell_complete=complete_effect)
@click.option(
    "--input", "-i", "inputs", multiple=True, type=InputType(), help="Picture of an input.  [default: a generated one]"
)
@click.option(
    "--set",
    "settings",
    multiple=True,
    type=SettingType(),
    help="Set a run value: a number, a vector (1,2,3), a matrix row by row (1,0;0,1), true or false.",
)
@click.option("--size", type=SizeType(), help=f"Size of generated pictures. [default: {MADE_SIZE[0]}x{MADE_SIZE[1]}]")
@backends_option
@most_ambiguous_option
@most_seconds_option
@click.option(
    "--ends", type=click.IntRange(0, 1 << 10), default=MOST_ENDS, show_default=True, metavar="N",
    help="Most further runs of a graph, each with one value at an end of its range.",
)  # fmt: skip
@click.option(
    "--stress", is_flag=True, help="Run again with extreme values in generated pictures; reported separately."
)
@click.option("--allow-nan", is_flag=True, help="Accept NaN and infinity if the reference computes them too.")
@click.option(
    "--golden", type=click.Path(path_type=Path), metavar="FOLDER", help="Compare with the recording in this folder."
)
@error_map_option
@click.option("--record", is_flag=True, help="With --golden: record inputs and outputs instead.")
@click.option(
    "--golden-steps", type=click.IntRange(0, 1 << 30), default=0, show_default=True, metavar="N",
    help="Allowed distance from the recording, in steps of the target's format (of floats: ulp).",
)  # fmt: skip
def check(
    file: str,
    inputs: tuple[tuple[str, str], ...],
    settings: tuple[tuple[str, str], ...],
    size: tuple[int, int] | None,
    backends: tuple[str, ...],
    most_ambiguous: float,
    most_seconds: float | None,
    ends: int,
    stress: bool,
    allow_nan: bool,
    golden: Path | None,
    error_map: Path | None,
    record: bool,
    golden_steps: int,
) -> int:
    """Compare every backend with the reference on your own kernels.

    FILE is a Python module (it is run), the text of a kernel (it is parsed and not run), or the name of a built-in
    effect. In a module, its ``outputs`` are checked (a target, several, or a mapping), else its targets, else its
    effects on pictures, else each of its kernels.

    The report says first if all backends give the same bits, then if each is within the bounds of rounding. NaN and
    infinity fail, unless --allow-nan accepts those of the reference. The verdict is undecided if rounding can change
    too many decisions, or if bounds are too wide. What passes is run again with values at the ends of their ranges.

    Exit status: 0 everything passes and equals its recording, 1 something differs or is undecided, 2 an error.
    """
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
        check_error_map(error_map, graphs)
        pictures = read_inputs(graphs, inputs)
        known_values(graphs, settings)
        with opened(backends) as devices:
            for name, graph in graphs.items():
                say(name)
                limit = TimeLimit(most_seconds, _named(say, f"{name}: bounds of"))
                run = _Run(name, graph, pictures, dict(settings), size, kept, limit)
                passed = run.checked(devices, say, most_ambiguous, allow_nan)
                if error_map is not None:
                    write_error_map(error_map, run.passes)
                if passed and kept is None:
                    tries = Tries(ends, pictures, run.settings, size, devices, most_ambiguous)
                    passed = tries.passed(name, graph, limit, say)
                if stress and kept is None:
                    title = f"{name}, stress"
                    extreme = _Run(title, graph, pictures, dict(settings), size, None, limit, extreme_input)
                    passed &= extreme.checked(devices, say, most_ambiguous, True)
                well &= passed
    return 0 if well else 1


class _Run:
    """A graph with its run inputs: given, recorded or generated."""

    def __init__(
        self, name: str, graph: Graph, pictures: Mapping[str, Picture], settings: Mapping[str, str],
        size: tuple[int, int] | None, golden: Golden | None, limit: TimeLimit,
        make: Callable[[tuple[int, int], int, str], Picture] = plain_input,
    ) -> None:  # fmt: skip
        from passgraph.commands.golden import recorded_run

        self.name, self.golden, self.settings = name, golden, settings
        self.made: list[str] = []
        if golden is not None and not golden.record:
            size, self.inputs, self.settings = recorded_run(golden.folder, name)
        else:
            size, self.inputs = made_inputs(graph, pictures, size, make_picture=make)
            self.made = [name for name in self.inputs if name not in pictures]
        values = run_values(name, graph, self.settings)
        self.settings = {name: text for name, text in self.settings.items() if name in values}
        self.passes = Passes(graph, size, [{**self.inputs, **values}], limit)

    def checked(
        self, backends: Sequence[Any], say: Callable[[str], None], most_ambiguous: float, allow_nan: bool
    ) -> bool:
        """Check and print the results; return True if every backend passes and equals its recording."""
        from passgraph.commands import golden as recorded
        from passgraph.verify.compare import compared

        self.passes.allowed()  # a graph that cannot run is an error, not a verdict
        report = compared(self.passes, backends, _named(say, f"{self.name}:"), most_ambiguous)
        say_equality(report, self.name)
        _show(self.name, report)
        say_faults(report, self.name, self.made)
        finite = say_non_finite(report, self.name, allow_nan)
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


def _named(say: Callable[..., None], name: str) -> Callable[..., None]:
    return lambda what, *amount: say(f"{name} {what}", *amount)


def _show(name: str, report: Report) -> None:
    """Print a table with a row for each target and a column for each backend."""
    targets = zip(*(backend.targets for backend in report.ran), strict=True)
    rows = [
        [row[0].step, row[0].target, *(marked(f"{t.verdict}, {t.figures}", t.passed) for t in row)] for row in targets
    ]
    if report.ran:
        show_table(name, ("pass", "target"), [backend.name for backend in report.ran], rows)
