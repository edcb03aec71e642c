"""Values at the ends of their ranges: what ``check`` runs a graph with after its defaults, one value at a time.

A kernel that is right in the middle of its range may divide by zero at an end of it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import click
import numpy as np
from numpy.typing import NDArray

from passgraph.commands.given_values import declared, read_value, run_values, takers, written_value
from passgraph.commands.graph_inputs import made_inputs
from passgraph.commands.verdicts import console, say_faults
from passgraph.errors import PassgraphError
from passgraph.language.limits import bounds
from passgraph.language.types import FLOAT, component_count, element_of

if TYPE_CHECKING:
    from passgraph.commands.own_file import Graph
    from passgraph.language.ir import Parameter
    from passgraph.verify.conformance.case import Picture
    from passgraph.verify.oracle.pace import Pace
    from passgraph.verify.oracle.passes import Passes

#: Runs with a value at an end, beside the one with defaults.
MOST_ENDS = 8
#: Size of pictures that are made for these runs, where no size is given: a quarter of the pixels of the first.
SMALL_SIZE = (48, 32)


@dataclass(frozen=True)
class End:
    """A value of a run at an end of its range.

    Attributes
    ----------
    number : as text; each of the numbers of a vector or matrix is this
    value : what the run is given
    default : what it is elsewhere, as text
    """

    name: str
    number: str
    value: object
    default: str

    def __str__(self) -> str:
        return f"{self.name} = {self.number}"


def range_ends(graph: Graph, settings: Mapping[str, str]) -> list[End]:
    """The ends of the ranges of all values of a graph's runs that are not set, by value, the lower one first.

    An end that is the default is left out, and so is one of floats that the range itself leaves out (``above``).
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
    """The ends of what all of a value's parameters allow, but those that one of them refuses."""
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
    """The least and the largest number as they are written, infinite where there is none."""
    limits, type_ = parameter.range, parameter.type
    assert limits is not None
    if element_of(type_) is not FLOAT:
        return bounds(limits, type_)
    # 0.3 is looked at as the float32 that it becomes, and told as 0.3
    low = -math.inf if limits.low is None else float(limits.low)
    return low, math.inf if limits.high is None else float(limits.high)


def _is(default: object, number: float) -> bool:
    return default is not None and bool(np.all(np.asarray(default) == number))


class Tries:
    """Runs of graphs with values at the ends of their ranges, at most so many of each graph."""

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

    def passed(self, name: str, graph: Graph, pace: Pace, say: Callable[[str], None]) -> bool:
        """Whether a graph passes with each; what was tried is printed, and each fault with the value that brings it."""
        ends = range_ends(graph, self.settings)
        if not ends or not self.most:
            return True
        well, tried = True, 0
        for end in ends[: self.most]:
            if pace.over:
                break
            say(f"{name}: {end}")
            well &= self._passes(f"{name} with {end}", graph, end, pace, say)
            tried += 1
        more = "--most-seconds N: more time" if pace.over else "--ends N: more runs"
        click.echo(f"{name}: tried {_told(ends[:tried]) or 'nothing more'}{_left(ends[tried:], more)}")
        return well

    def _passes(self, title: str, graph: Graph, end: End, pace: Pace, say: Callable[[str], None]) -> bool:
        from passgraph.verify.compare import compared
        from passgraph.verify.oracle.passes import Passes

        size, inputs = made_inputs(graph, self.pictures, self.size, SMALL_SIZE)
        given = {**inputs, **run_values(title, graph, self.settings)}
        try:
            passes = Passes(graph, size, [{**given, end.name: end.value}], pace)
            passes.allowed(True)
        except PassgraphError as error:
            click.echo(f"{title}: {error}")
            return False
        report = compared(passes, self.devices, lambda what: say(f"{title}: {what}"), self.most_ambiguous)
        say_faults(console(), report, title, [name for name in inputs if name not in self.pictures])
        lost = _lost(passes, lambda: Passes(graph, size, [given], pace))
        if lost:
            click.echo(f"{title}: {lost}")
        return report.passed and not lost


def _lost(passes: Passes, default: Callable[[], Passes]) -> str:
    """The first target in which the reference itself makes NaN, though none with the defaults; empty where none does.

    Of backends nothing is to be said then: NaN is what they ought to make.
    """
    from passgraph.verify.kinds import told

    expected, _ = passes.allowed(True)
    if not any(np.isnan(picture).any() for picture in expected.values()):
        return ""
    whole = {key for key, picture in default().allowed(True)[0].items() if not np.isnan(picture).any()}
    for key, picture in expected.items():
        lost: NDArray[np.bool_] = np.asarray(np.isnan(picture).any(axis=2))
        if key in whole and lost.any():
            step, resource = passes.plan.steps[key[1]], passes.plan.resources[key[2]]
            kind = told(passes, key, lost, picture, expected, passes.watched(True, [key[1]])[key[1]])
            return (
                f"pass {step.name}, target {resource.name}: NaN, in the reference too, at {kind.share:.3%} of pixels, "
                f"such as column {kind.pixel[0]}, row {kind.pixel[1]}{kind.given}; with its default there is none. "
                f"There {kind.cause}"
            )
    return ""


def _told(ends: Sequence[End]) -> str:
    """Which numbers each value had.

    >>> _told([End("radius", "0", 0, "2"), End("radius", "16", 16, "2"), End("gain", "1", 1.0, "0.5")])
    'radius = 2 (its default), 0, 16; gain = 0.5 (its default), 1'
    """
    numbers: dict[str, list[str]] = {}
    for end in ends:
        numbers.setdefault(end.name, [f"{end.default} (its default)"]).append(end.number)
    return "; ".join(f"{name} = {', '.join(told)}" for name, told in numbers.items())


def _left(ends: Sequence[End], more: str) -> str:
    return f"; not tried: {', '.join(map(str, ends))} ({more})" if ends else ""
