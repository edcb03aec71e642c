"""Arguments of effects held against what their signatures say, and against the ranges of the effects' table.

An effect is a plain function; ``@checked`` reads its annotations, so that a wrong argument is named with what was
expected, before any pass is made.
"""

from __future__ import annotations

import dataclasses
import functools
import inspect
from collections.abc import Callable, Mapping, Sequence
from types import NoneType, UnionType
from typing import Any, Literal, ParamSpec, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

import passgraph as pg
from passgraph.arguments import LARGEST_FLOAT, among, is_number, numbers, shown
from passgraph.effects.registry import EFFECTS, Parameter

P = ParamSpec("P")
R = TypeVar("R")
#: Effects come as a function that returns the picture and one that returns every target; both have one name in texts.
SUFFIXES = ("_passes", "_targets")
#: Limits up to this stand for "above 0" in the table.
NEARLY_ZERO = 1e-5


def checked(function: Callable[P, R]) -> Callable[P, R]:
    """A decorator: arguments must fit the function's annotations, and its ranges in the table of effects.

    >>> @checked
    ... def dimmed(color: pg.Target, share: float = 0.5) -> pg.Target:
    ...     return color
    >>> dimmed(pg.Input("frame"), "half")
    Traceback (most recent call last):
    passgraph.errors.GraphError: dimmed: share must be a finite number, got 'half'
    """
    signature = inspect.signature(function)
    effect = function.__name__
    for suffix in SUFFIXES:
        effect = effect.removesuffix(suffix)

    @functools.cache
    def rules() -> tuple[dict[str, Any], dict[str, Parameter]]:
        path = f"{function.__module__}:{effect}"
        ranges = [p for known in EFFECTS.values() if known.path == path for p in known.parameters]
        return get_type_hints(function), {parameter.name: parameter for parameter in ranges}

    @functools.wraps(function)
    def made(*args: P.args, **options: P.kwargs) -> R:
        hints, ranges = rules()
        for name, value in signature.bind(*args, **options).arguments.items():
            if value is signature.parameters[name].default:
                continue
            _check(value, hints.get(name, Any), f"{effect}: {name}")
            if name in ranges:
                _check_range(value, ranges[name], f"{effect}: {name}")
        return function(*args, **options)

    return made


def check_fields(made: object) -> None:
    """Raise where a field of a dataclass is not what its annotation says."""
    hints = get_type_hints(type(made))
    for field in dataclasses.fields(made):  # type: ignore[arg-type]
        _check(getattr(made, field.name), hints[field.name], f"{type(made).__name__}: {field.name}")


def _check(value: object, hint: Any, what: str) -> None:
    if fits(value, hint):
        return
    words = _words(hint)
    if isinstance(value, str) and words:
        raise pg.GraphError(f"{what} cannot be {shown(value)}; it is one of {', '.join(words)}")
    raise pg.GraphError(f"{what} must be {described(hint)}, got {shown(value)}")


def fits(value: object, hint: Any) -> bool:
    """Whether a value is one that an annotation allows; annotations that say nothing allow all.

    >>> fits(1, float), fits(True, float), fits(float("nan"), float), fits([1, 2, 3], tuple[float, float, float])
    (True, False, False, True)
    """
    origin, arguments = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        return any(fits(value, one) for one in arguments)
    if origin is Literal:
        return among(value, arguments)
    if origin is tuple and Ellipsis not in arguments:
        parts = _parts(value)
        return parts is not None and len(parts) == len(arguments) and all(map(fits, parts, arguments))
    if origin in (tuple, Sequence):
        parts = _parts(value)
        return parts is not None and all(fits(part, arguments[0]) for part in parts)
    if origin is Mapping:
        return isinstance(value, Mapping) and all(
            fits(key, arguments[0]) and fits(part, arguments[1]) for key, part in value.items()
        )
    if origin is np.ndarray:
        return _is_array(value)
    if origin is Callable or hint is Callable:
        return callable(value)
    return _fits_class(value, hint)


def _fits_class(value: object, hint: Any) -> bool:
    if hint is float:
        return is_number(value) and abs(value) <= LARGEST_FLOAT  # type: ignore[arg-type]  # NaN is not
    if hint is int:
        return is_number(value) and isinstance(value, (int, np.integer)) and abs(int(value)) < 2**31
    if hint is bool:
        return isinstance(value, (bool, np.bool_))
    if hint is str:
        return isinstance(value, str) and value.isprintable() and value != ""
    if hint is pg.Value:
        return isinstance(value, (pg.Value, pg.Derived))
    return not isinstance(hint, type) or isinstance(value, hint)


def _parts(value: object) -> Sequence[object] | None:
    if isinstance(value, np.ndarray) and value.ndim == 1:
        return list(value.tolist())
    return value if isinstance(value, (list, tuple)) else None


def _is_array(value: object) -> bool:
    try:
        numbers(value, "")
    except pg.InputError:
        return False
    return True


def _words(hint: Any) -> list[str]:
    """The words that an annotation allows."""
    if get_origin(hint) is Literal:
        return [str(word) for word in get_args(hint)]
    return [word for one in get_args(hint) for word in _words(one)] if get_origin(hint) in (Union, UnionType) else []


def described(hint: Any) -> str:
    """What an annotation allows, in words.

    >>> described(float | pg.Value | None), described(tuple[float, float, float])
    ('a finite number or a pg.Value or None', '3 finite numbers')
    """
    origin, arguments = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        return " or ".join(described(one) for one in arguments)
    if origin is Literal:
        return f"one of {', '.join(map(str, arguments))}"
    if origin is tuple and Ellipsis not in arguments:
        return f"{len(arguments)} {described(arguments[0]).partition(' ')[2]}s"
    if origin in (tuple, Sequence):
        return f"a list of {described(arguments[0])}"
    if origin is Mapping:
        return f"a mapping from {described(arguments[0])} to {described(arguments[1])}"
    if origin is np.ndarray:
        return "an array of numbers"
    if origin is Callable:
        return "a function"
    known = {
        float: "a finite number", int: "a whole number", bool: "True or False", str: "a name", NoneType: "None",
        pg.Target: "a target or pg.Input(...)", pg.TargetSpec: "a pg.target(...)",
    }  # fmt: skip
    name = getattr(hint, "__name__", str(hint))
    return known.get(hint, f"a {'pg.' if hasattr(pg, name) else ''}{name}")


def _check_range(value: object, parameter: Parameter, what: str) -> None:
    """The table's inclusive limits, for each number of a colour."""
    low, high = parameter.low, parameter.high
    for part in _parts(value) or (value,):
        if not is_number(part):
            continue
        above = low is not None and 0.0 < low < NEARLY_ZERO
        if (low is not None and not (part > 0.0 if above else part >= low)) or (high is not None and part > high):  # type: ignore[operator]
            least = "above 0" if above else f"{low:g}"
            limits = f"{least} to {high:g}" if high is not None else least if above else f"{least} or more"
            raise pg.GraphError(f"{what} must be {limits}, got {shown(value)}")
