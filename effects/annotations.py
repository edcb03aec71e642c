"""Check values against annotations (classes, choices and ranges), as given in signatures and fields."""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np

from passgraph.arguments import LARGEST_FLOAT, among, as_float, is_number, numbers, shown
from passgraph.errors import GraphError, InputError
from passgraph.graph.run_values import Derived, Value
from passgraph.graph.targets import Target, TargetSpec
from passgraph.ranges import Range


def check(value: object, hint: Any, what: str) -> None:
    """Raise GraphError if an annotation does not allow a value; ``what`` begins the message.

    >>> import passgraph as pg
    >>> check(9, Annotated[int, pg.Range(1, 8)], "bloom: levels")
    Traceback (most recent call last):
    passgraph.errors.GraphError: bloom: levels must be 1 to 8, got 9
    """
    if not fits(value, hint):
        words = words_of(hint)
        if isinstance(value, str) and words:
            raise GraphError(f"{what} cannot be {shown(value)}; it is one of {', '.join(words)}")
        raise GraphError(f"{what} must be {described(hint)}, got {shown(value)}")
    if ranges_of(hint):  # long lists without one are not searched again
        _check_ranges(value, hint, what)


def fits(value: object, hint: Any) -> bool:
    """Return True if a value has the annotated kind, ignoring ranges; empty annotations allow all values.

    >>> fits(1, float), fits(True, float), fits(float("nan"), float), fits([1, 2, 3], tuple[float, float, float])
    (True, False, False, True)
    """
    origin, arguments = get_origin(hint), get_args(hint)
    if origin is Annotated:
        return fits(value, arguments[0])
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
        number = as_float(value)
        return number is not None and abs(number) <= LARGEST_FLOAT
    if hint is int:
        return is_number(value) and isinstance(value, (int, np.integer)) and abs(int(value)) < 2**31
    if hint is bool:
        return isinstance(value, (bool, np.bool_))
    if hint is str:
        return isinstance(value, str) and value.isprintable() and value != ""
    if hint is Value:
        return isinstance(value, (Value, Derived))
    return not isinstance(hint, type) or isinstance(value, hint)


def _parts(value: object) -> Sequence[object] | None:
    if isinstance(value, np.ndarray) and value.ndim == 1:
        return list(value.tolist())
    return value if isinstance(value, (list, tuple)) else None


def _is_array(value: object) -> bool:
    try:
        numbers(value, "")
    except InputError:
        return False
    return True


def words_of(hint: Any) -> list[str]:
    """Return the words that an annotation allows.

    >>> words_of(Literal["x", "y"] | None)
    ['x', 'y']
    """
    origin = get_origin(hint)
    if origin is Literal:
        return [str(word) for word in get_args(hint)]
    if origin is Annotated:
        return words_of(get_args(hint)[0])
    return [word for one in get_args(hint) for word in words_of(one)] if origin in (Union, UnionType) else []


def described(hint: Any) -> str:
    """Describe the values that an annotation allows, apart from ranges.

    >>> import passgraph as pg
    >>> described(float | pg.Value | None), described(tuple[float, float, float])
    ('a finite number or a pg.Value or None', '3 finite numbers')
    """
    origin, arguments = get_origin(hint), get_args(hint)
    if origin is Annotated:
        return described(arguments[0])
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
        Target: "a target or pg.Input(...)", TargetSpec: "a pg.target(...)",
    }  # fmt: skip
    name = getattr(hint, "__name__", str(hint))
    return known.get(hint, f"a {'pg.' if hasattr(sys.modules['passgraph'], name) else ''}{name}")


@cache
def ranges_of(hint: Any) -> tuple[Range, ...]:
    """Return the ranges in an annotation.

    >>> import passgraph as pg
    >>> [str(one) for one in ranges_of(Annotated[float, pg.Range(0, 1)] | pg.Value)]
    ['0 to 1']
    """
    if isinstance(hint, Range):
        return (hint,)
    parts = (*get_args(hint)[:1], *hint.__metadata__) if get_origin(hint) is Annotated else get_args(hint)
    return tuple(one for part in parts if not isinstance(part, list) for one in ranges_of(part))


def _check_ranges(value: object, hint: Any, what: str) -> None:
    """Check every number of a value against the ranges in its annotation."""
    origin, arguments = get_origin(hint), get_args(hint)
    if origin is Annotated:
        for limit in hint.__metadata__:
            for part in _parts(value) or (value,):
                if isinstance(limit, Range) and is_number(part) and part not in limit:
                    raise GraphError(f"{what} must be {limit}, got {shown(value)}")
        _check_ranges(value, arguments[0], what)
    elif origin in (Union, UnionType):
        for one in arguments:
            if fits(value, one):
                _check_ranges(value, one, what)
    elif origin is Mapping:
        assert isinstance(value, Mapping)
        for key, part in value.items():
            _check_ranges(part, arguments[1], f"{what} of {shown(key)}")
    elif origin in (tuple, Sequence):
        repeated = origin is Sequence or Ellipsis in arguments
        for number, part in enumerate(_parts(value) or ()):
            _check_ranges(part, arguments[0 if repeated else number], what)


def check_fields(instance: object) -> None:
    """Raise GraphError if a field of a dataclass does not fit its annotation."""
    hints = _field_hints(type(instance))  # type: ignore[arg-type]  # a class has a hash
    for field in dataclasses.fields(instance):  # type: ignore[arg-type]
        check(getattr(instance, field.name), hints[field.name], f"{type(instance).__name__}: {field.name}")


@cache
def _field_hints(class_: type[Any]) -> dict[str, Any]:
    return get_type_hints(class_, include_extras=True)
