"""Run values, which change from run to run, and sizes computed from the output's size."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import field, replace
from typing import Any, TypeAlias, get_origin

import numpy as np

from passgraph import arguments
from passgraph.errors import GraphError, InputError
from passgraph.ranges import Range
from passgraph.records import dataclass


@dataclass(frozen=True, slots=True)
class Limit:
    """The range that an effect gives a run value.

    Attributes
    ----------
    where : the effect and its parameter, such as "bloom: radius"
    range : the range of each number of the value
    """

    where: str
    range: Range

    def check(self, value: object) -> None:
        """Raise InputError for a number outside; what holds no numbers is left to the kernel's own check."""
        is_row = isinstance(value, (list, tuple, np.ndarray))
        numbers = np.asarray(value, object).ravel() if is_row else (value,)
        if any(arguments.is_number(number) and number not in self.range for number in numbers):
            raise InputError(f"{self.where} must be {self.range}, got {arguments.shown(value)}")


@dataclass(frozen=True)
class Value:
    """A number, vector, matrix or object that each run sets by name.

    ``static`` works as for inputs.  :meth:`map` derives another value from it on the host.

    >>> exposure = Value("exposure", float)
    >>> exposure.map(lambda stops: 2.0**stops).name
    'exposure'
    """

    name: str
    type: object = float
    static: bool = False
    default: object = None
    #: Ranges of the effects it was given to, which each run checks; effects add them.
    limits: tuple[Limit, ...] = field(default=(), compare=False, repr=False, kw_only=True)

    def __post_init__(self) -> None:
        where = f"value {arguments.text(self.name, 'the name of a value')!r}"
        if not isinstance(self.type, type) and get_origin(self.type) is None:
            raise GraphError(
                f"{where}: type must be a class, such as float or pg.vec3, got {arguments.shown(self.type)}"
            )
        arguments.flag(self.static, f"{where}: static")

    @property
    def sources(self) -> tuple[Value, ...]:
        """Return the values that runs set for it: itself."""
        return (self,)

    def limited(self, *limits: Limit) -> Value:
        """Return this value with further limits."""
        both = tuple(dict.fromkeys((*self.limits, *limits)))
        return self if FILLED_IN.get(self.name) is self or both == self.limits else replace(self, limits=both)

    def check(self, value: object) -> None:
        """Raise InputError for an object of another class, or a number outside of a limit."""
        check_object(self.name, self.type, value)
        for limit in self.limits:
            limit.check(value)

    def map(self, function: Callable[[Any], object]) -> Derived:
        """Return a value computed on the host from this one whenever it changes."""
        return Derived((self,), function)


@dataclass(frozen=True)
class Derived:
    """A value computed on the host from run values.

    ``by_value``: passes that depend on nothing else that changes run again when the derived value changes, not when its
    sources do.  Use it for a result that often stays the same while its sources change.
    """

    sources: tuple[Value, ...]
    function: Callable[..., object]
    by_value: bool = False

    def __post_init__(self) -> None:
        if not arguments.several(self.sources, Value, "what a value is computed from", "pg.Value handles"):
            raise GraphError("a value is computed from at least one pg.Value, got none")
        arguments.function(self.function, f"what computes a value from {self.name!r}")

    @property
    def name(self) -> str:
        return "+".join(source.name for source in self.sources)

    @property
    def static(self) -> bool:
        return self.by_value or all(source.static for source in self.sources)

    def map(self, function: Callable[[Any], object]) -> Derived:
        arguments.function(function, f"what computes a value from {self.name!r}")
        inner = self.function
        return Derived(self.sources, lambda *values: function(inner(*values)), self.by_value)

    def limited(self, *limits: Limit) -> Derived:
        """Return this value with limits for what its function returns."""
        return replace(self, function=_Limited(self.function, limits))


@dataclass(frozen=True)
class _Limited:
    """A function whose result is checked; equal ones make passes equal."""

    function: Callable[..., object]
    limits: tuple[Limit, ...]

    def __call__(self, *values: object) -> object:
        result = self.function(*values)
        for limit in self.limits:
            limit.check(result)
        return result


def combine(function: Callable[..., object], *values: Value, by_value: bool = False) -> Derived:
    """Return a value computed on the host from several run values; see `Derived`."""
    return Derived(values, function, by_value)


def sources_of(parameters: Mapping[Any, object]) -> Iterator[Value]:
    """Yield the run values behind parameters; plain numbers have none."""
    for parameter in parameters.values():
        if isinstance(parameter, (Value, Derived)):
            yield from parameter.sources


def values_by_name(parameters: Iterable[Mapping[Any, object]]) -> dict[str, Value]:
    """Return the run values behind the parameters of several passes, each with the limits of all its handles."""
    found: dict[str, Value] = {}
    for one in parameters:
        for value in sources_of(one):
            found[value.name] = found.get(value.name, value).limited(*value.limits)
    return found


def check_object(name: str, type_: object, value: object) -> None:
    """Raise InputError for a run value of a class, such as `Camera`, that is not of this class."""
    if is_object_type(type_) and not isinstance(value, type_):  # type: ignore[arg-type]
        raise InputError(f"value {name!r} must be a {type_.__name__}, got {type(value).__name__}")  # type: ignore[attr-defined]


def is_object_type(type_: object) -> bool:
    """Return True if a value's type is a class of its own, such as Camera; other types are checked when packed."""
    plain = type_ in (int, float, bool) or getattr(type_, "__module__", "") == "passgraph.language.symbols"
    return isinstance(type_, type) and not plain


#: (width, height) of the output in pixels as a value, set by the program: for effects that depend on the aspect ratio.
OUTPUT_SIZE = Value("output_size", tuple, static=True)
#: Number of earlier runs, from 0, as a value, set by the program: for animation and temporal effects.  A run may set
#: ``frame_index`` itself; `Program.reset` restarts the count.
FRAME_INDEX = Value("frame_index", int)
#: Values by name that programs set if runs do not.
FILLED_IN = {value.name: value for value in (OUTPUT_SIZE, FRAME_INDEX)}


def is_computed_from_size(parameters: Mapping[Any, object]) -> bool:
    """Return True if a Python function computes one of these values from the output's size."""
    computed = [parameter for parameter in parameters.values() if isinstance(parameter, Derived)]
    return any(source is OUTPUT_SIZE for value in computed for source in value.sources)


#: A number, "width" or "height" of the output in pixels, or one of :data:`OPERATIONS` applied to formulas.
Formula: TypeAlias = "float | str | tuple[Formula | str, ...]"
#: Largest nesting depth of formulas.
MAX_DEPTH = 32


def _divided(divide: Callable[[float, float], float]) -> Callable[[float, float], float]:
    def checked(a: float, b: float) -> float:
        if b == 0:
            raise GraphError("the formula of a size divides by zero")
        return divide(a, b)

    return checked


#: Name → number of operands, and function; comparisons return 1 or 0.
OPERATIONS: dict[str, tuple[int, Callable[..., float]]] = {
    "add": (2, lambda a, b: a + b), "sub": (2, lambda a, b: a - b), "mul": (2, lambda a, b: a * b),
    "div": (2, _divided(operator.truediv)), "min": (2, min), "max": (2, max),
    "floor": (1, math.floor), "ceil": (1, math.ceil), "neg": (1, lambda a: -a), "abs": (1, abs),
    "rest": (2, _divided(math.fmod)), "less": (2, lambda a, b: float(a < b)), "equal": (2, lambda a, b: float(a == b)),
}  # fmt: skip


def check_formula(formula: object, where: str, depth: int = 0) -> None:
    """Raise GraphError unless it is a valid formula."""
    if isinstance(formula, str) and formula in ("width", "height"):
        return
    if isinstance(formula, (int, float)) and not isinstance(formula, bool) and math.isfinite(formula):
        return
    if isinstance(formula, tuple) and formula and isinstance(formula[0], str) and depth < MAX_DEPTH:
        count, _ = OPERATIONS.get(formula[0], (-1, None))
        if len(formula) == count + 1:
            for part in formula[1:]:
                check_formula(part, where, depth + 1)
            return
    raise GraphError(
        f"{where}: the formula of a size is a number, 'width', 'height' or one of {', '.join(OPERATIONS)} with its "
        f"operands in a tuple, at most {MAX_DEPTH} deep"
    )


def evaluated(formula: Formula, size: tuple[int, int]) -> float:
    """Evaluate a formula for an output size.

    >>> evaluated(("max", ("floor", ("div", "width", 12.0)), 1.0), (100, 50))
    8
    """
    if isinstance(formula, str):
        return size[0] if formula == "width" else size[1]
    if not isinstance(formula, tuple):
        return formula
    _, meaning = OPERATIONS[str(formula[0])]
    return meaning(*(evaluated(part, size) for part in formula[1:]))


def computed_side(formula: Formula, size: tuple[int, int], where: str) -> int:
    """Return a side in whole pixels, at least one; the planner checks the upper limit."""
    value = evaluated(formula, size)
    if not math.isfinite(value) or abs(value) > 2**31:
        raise GraphError(f"{where}: the formula of a size comes to {value:g} pixels")
    return max(1, math.floor(value))
