"""The subject of a live view: a graph that is rebuilt when values of its controls or its files change."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from passgraph.graph.run_values import Value
from passgraph.graph.targets import Target
from passgraph.language import symbols

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from passgraph.effects.parameters import Parameter


@dataclass(frozen=True)
class Control:
    """The control of a parameter.

    Attributes
    ----------
    name : the parameter's name
    kind : "float", "int", "bool", "choice", "color" (three floats), "vector" (several numbers), "text", or "stack": the
        names of ``choices`` in an order, with commas between them, and "-" before one that is switched off
    default : the default; None if the effect chooses
    low, high : the range; None for an open end
    unit, help : texts, perhaps empty
    choices : the values of a "choice", the names of a "stack"
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
        """Return the control of an effect's parameter; None for pictures and types without a control.

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
            parameter.name,
            kind,
            default,
            None if low is None else float(low),
            None if high is None else float(high),
            parameter.range.unit or "",
            parameter.help,
            parameter.choices,
        )


def _numbers(value: object) -> list[float] | None:
    """Return a vector of two to four numbers as a list; None for other values."""
    try:
        numbers = [float(number) for number in value]  # type: ignore[attr-defined]
    except (TypeError, ValueError):
        return None
    return numbers if 1 < len(numbers) <= 4 else None


@dataclass(frozen=True)
class Drawing:
    """A graph, the size of its output, and the inputs of each run.

    Attributes
    ----------
    outputs : the outputs by name; the first one is shown
    size : (width, height)
    run_inputs : pictures and run values by name
    """

    outputs: dict[str, Target]
    size: tuple[int, int]
    run_inputs: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Loaded:
    """The content of a subject's files.

    Attributes
    ----------
    controls : controls of the effect's parameters
    draw : builds the graph from values of parameters by name; a `passgraph.Value` may replace a number
    is_light : True if the result is linear light, which the page encodes as sRGB
    """

    controls: tuple[Control, ...]
    draw: Callable[[Mapping[str, Any]], Drawing]
    is_light: bool = False


class Subject(Protocol):
    """The subject of a session."""

    @property
    def name(self) -> str:
        """The subject's name on the page."""

    @property
    def files(self) -> Sequence[Path]:
        """The subject's files; they are read again when they change."""

    def load(self) -> Loaded:
        """Read the files; raises PassgraphError for errors in them."""

    def replace_input(self, path: Path) -> None:
        """Replace the first input by another picture, sequence or video."""

    def frame_count(self) -> int | None:
        """Return the number of frames of the input; None for one picture or none."""

    def frame(self, number: int) -> Mapping[str, Any]:
        """Return the inputs of a frame, counted from 0."""

    def audio(self, number: int, values: Mapping[str, Any]) -> NDArray[Any] | None:
        """Return the picture of the sound at a frame, counted from 0; None without sound."""

    def command(self, values: Mapping[str, Any]) -> str:
        """Return the command line that computes the picture; empty if there is none."""


def run_values_of(loaded: Loaded, values: Mapping[str, Any]) -> dict[str, Value]:
    """Return run values for the parameters that accept them, so that changing these compiles nothing.

    An effect raises for a parameter that cannot be a `passgraph.Value`, so each is tried.
    """
    numeric = [c for c in loaded.controls if c.kind in ("float", "color", "vector") and values.get(c.name) is not None]
    handles = {c.name: _handle(c, values[c.name]) for c in numeric}
    if _draws(loaded, {**values, **handles}):
        return handles
    accepted: dict[str, Value] = {}
    for name, handle in handles.items():
        if _draws(loaded, {**values, **accepted, name: handle}):
            accepted[name] = handle
    return accepted


def _handle(control: Control, value: Any) -> Value:
    if control.kind == "float":
        return Value(control.name, default=float(value))
    numbers = tuple(float(number) for number in value)
    return Value(control.name, getattr(symbols, f"vec{len(numbers)}"), default=numbers)


def _draws(loaded: Loaded, values: Mapping[str, Any]) -> bool:
    try:
        loaded.draw(values)
    except Exception:  # effects raise errors of any type for values that they do not accept
        return False
    return True
