"""What is viewed: a graph that is made anew from the values of its controls, and from files that may change."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from passgraph.graph.run_values import Value
from passgraph.graph.targets import Target
from passgraph.language import symbols

if TYPE_CHECKING:
    from passgraph.effects.parameters import Parameter


@dataclass(frozen=True)
class Control:
    """One parameter as the page shows it.

    Attributes
    ----------
    name : of the parameter
    kind : "float", "int", "bool", "choice", "color" (three floats), "vector" (several numbers) or "text"
    default : None where the effect chooses
    low, high : the range; None where it is open
    unit, help : in words, or empty
    choices : of "choice"
    """

    name: str
    kind: str
    default: Any
    low: float | None = None
    high: float | None = None
    unit: str = ""
    help: str = ""
    choices: tuple[str, ...] = ()

    @staticmethod
    def of(parameter: Parameter) -> Control | None:
        """Return the control of an effect's parameter; None for pictures and what no page can say.

        >>> from passgraph.effects.effect_table import EFFECTS
        >>> Control.of(EFFECTS["vignette"].parameter("strength")).low
        0.0
        """
        kinds = {"rgb": "color", "value": "vector"}
        kind, default = kinds.get(parameter.type, parameter.type), parameter.default
        if kind == "picture":
            return None
        if kind == "vector":
            default = _numbers(default)
            if default is None:
                return None
        if kind == "color" and default is not None:
            default = [float(number) for number in default]  # type: ignore[attr-defined]
        low, high = parameter.range.low, parameter.range.high
        return Control(
            parameter.name, kind, default, None if low is None else float(low), None if high is None else float(high),
            parameter.range.unit or "", parameter.help, parameter.choices,
        )  # fmt: skip


def _numbers(value: object) -> list[float] | None:
    """A short list of numbers, as vectors of kernels and colors of shaders are."""
    try:
        numbers = [float(number) for number in value]  # type: ignore[attr-defined]
    except (TypeError, ValueError):
        return None
    return numbers if 1 < len(numbers) <= 4 else None


@dataclass(frozen=True)
class Drawing:
    """A graph, the size of its output, and what each run is given.

    Attributes
    ----------
    outputs : by name; the first one is shown
    size : (width, height)
    given : inputs and values by name
    """

    outputs: dict[str, Target]
    size: tuple[int, int]
    given: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Loaded:
    """What a subject's files hold now.

    Attributes
    ----------
    controls : of the effect's parameters
    draw : makes the graph from values of parameters by name; a `passgraph.Value` may stand for a number
    is_light : the result is linear light, which the page encodes as sRGB
    """

    controls: tuple[Control, ...]
    draw: Callable[[Mapping[str, Any]], Drawing]
    is_light: bool = False


class Subject(Protocol):
    """What a session shows."""

    @property
    def name(self) -> str:
        """What the page calls it."""

    @property
    def files(self) -> Sequence[Path]:
        """The files that it is made of: they are read again when they change."""

    def load(self) -> Loaded:
        """Read the files; raises PassgraphError for what is wrong in them."""

    def replace_input(self, path: Path) -> None:
        """Show another picture, sequence or video in the place of the first input."""

    def frame_count(self) -> int | None:
        """How many frames the input has; None where it is one picture or none."""

    def frame(self, number: int) -> Mapping[str, Any]:
        """Inputs of one frame, counted from 0."""

    def command(self, values: Mapping[str, Any]) -> str:
        """The command line that makes the picture; empty where there is none."""


def run_values_of(loaded: Loaded, values: Mapping[str, Any]) -> dict[str, Value]:
    """The numbers that runs may bring, so that moving them compiles nothing: found by trying.

    Effects say in their annotations what may be a `passgraph.Value`; where it may not, they raise.
    """
    moving = [c for c in loaded.controls if c.kind in ("float", "color", "vector") and values.get(c.name) is not None]
    handles = {c.name: _handle(c, values[c.name]) for c in moving}
    if _draws(loaded, {**values, **handles}):
        return handles
    found: dict[str, Value] = {}
    for name, handle in handles.items():
        if _draws(loaded, {**values, **found, name: handle}):
            found[name] = handle
    return found


def _handle(control: Control, value: Any) -> Value:
    if control.kind == "float":
        return Value(control.name, default=float(value))
    numbers = tuple(float(number) for number in value)
    return Value(control.name, getattr(symbols, f"vec{len(numbers)}"), default=numbers)


def _draws(loaded: Loaded, values: Mapping[str, Any]) -> bool:
    try:
        loaded.draw(values)
    except Exception:  # what an effect does with a value that it does not expect is its own affair
        return False
    return True
