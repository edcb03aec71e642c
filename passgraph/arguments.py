"""Checks of what callers hand in: one function for each kind of argument, each error with what, expected and got.

``what`` begins every message: where it is and what it is called, such as ``"target 'bloom': scale"``.  The functions
look at types before they compare or call, so that arrays and strangers' objects never raise errors of their own.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Container, Iterable
from difflib import get_close_matches
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import GraphError, InputError, PassgraphError

T = TypeVar("T")
#: Messages show at most so much of a value.
MOST_SHOWN = 80
#: Beyond this a float64 becomes infinite as a float32.
LARGEST_FLOAT = float(np.finfo(np.float32).max)


def shown(value: object) -> str:
    """A value as messages show it: short, whatever it is.

    >>> shown(np.zeros((4, 8, 3), np.float32)), shown("x" * 99)[:6], shown("red")
    ('an array of shape (4, 8, 3), float32', 'a str ', "'red'")
    """
    if isinstance(value, np.ndarray) and value.ndim:
        return f"an array of shape {value.shape}, {value.dtype}"
    if isinstance(value, (np.generic, np.ndarray)):
        value = value.item()
    if isinstance(value, int) and not isinstance(value, bool) and value.bit_length() > 200:
        return f"a whole number of {value.bit_length()} bits"
    try:
        text = " ".join(repr(value).split())
    except Exception:  # a stranger's __repr__ may do anything
        text = "x" * MOST_SHOWN
    if len(text) < MOST_SHOWN:
        return text
    size = f" of {len(value)}" if isinstance(value, (str, bytes, list, tuple, dict, set)) else ""
    return f"a {type(value).__name__}{size}"


def is_number(value: object) -> bool:
    """Whether it is a real number of Python or NumPy; bools are not."""
    return isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)


def string(value: object, what: str, error: type[PassgraphError] = InputError) -> str:
    """Any text: names in files may be empty and hold anything."""
    if not isinstance(value, str):
        raise error(f"{what} must be a string, got {shown(value)}")
    return value


def near(name: str, known: Iterable[str]) -> str:
    """A hint for messages: the known name that is meant, perhaps.

    >>> near("colour", ["color", "mask"])
    " (did you mean 'color'?)"
    """
    found = get_close_matches(name, list(known), n=1)
    return f" (did you mean {found[0]!r}?)" if found else ""


def among(value: object, names: Container[str]) -> bool:
    """Whether it is a name, and one of these; what has no hash or compares oddly is not."""
    return isinstance(value, str) and value in names


def whole_number(value: object, what: str, low: int, high: int, error: type[PassgraphError] = GraphError) -> int:
    """A whole number from ``low`` to ``high``.

    >>> whole_number(np.int64(3), "levels", 1, 8)
    3
    """
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or not low <= value <= high:
        raise error(f"{what} must be a whole number from {low} to {high}, got {shown(value)}")
    return int(value)


def real(
    value: object,
    what: str,
    low: float = -LARGEST_FLOAT,
    high: float = LARGEST_FLOAT,
    error: type[PassgraphError] = GraphError,
    *,
    above: bool = False,
) -> float:
    """A finite number from ``low`` (or above it) to ``high``."""
    number = as_float(value)
    if number is None or not (low < number if above else low <= number) or not number <= high:
        raise error(f"{what} must be {_range(low, high, above)}, got {shown(value)}")
    return number


def as_float(value: object) -> float | None:
    """A real number as Python's; None for what is none or not finite."""
    if not is_number(value):
        return None
    try:
        number = float(value)  # type: ignore[arg-type]
    except OverflowError:
        return None
    return number if math.isfinite(number) else None


def _range(low: float, high: float, above: bool) -> str:
    least = f"above {low:g}" if above else f"{low:g} or more"
    if high >= LARGEST_FLOAT:
        return "a finite number within float32 (3.4e38)" if low <= -LARGEST_FLOAT else f"a finite number, {least}"
    if low <= -LARGEST_FLOAT:
        return f"a finite number, at most {high:g}"
    return f"a number above {low:g} and at most {high:g}" if above else f"a number from {low:g} to {high:g}"


def flag(value: object, what: str, error: type[PassgraphError] = GraphError) -> bool:
    """True or False, nothing that merely counts as one."""
    if not isinstance(value, (bool, np.bool_)):
        raise error(f"{what} must be True or False, got {shown(value)}")
    return bool(value)


def text(value: object, what: str, error: type[PassgraphError] = GraphError) -> str:
    """A name: a string that is not empty and can be written down."""
    if not isinstance(value, str) or not value or not value.isprintable():
        raise error(f"{what} must be a name (a printable string, not empty), got {shown(value)}")
    return value


def one_of(value: object, what: str, allowed: Iterable[str], error: type[PassgraphError] = GraphError) -> str:
    """One of some words."""
    words = tuple(allowed)
    if not among(value, words):
        raise error(f"{what} cannot be {shown(value)}; it is one of {', '.join(words)}")
    return str(value)


def instance(
    value: object,
    classes: type[T] | tuple[type[T], ...],
    what: str,
    expected: str,
    error: type[PassgraphError] = GraphError,
) -> T:
    """A value of a class; ``expected`` says in words how one is made."""
    if not isinstance(value, classes):
        raise error(f"{what} must be {expected}, got {shown(value)}")
    return value


def function(value: object, what: str, error: type[PassgraphError] = GraphError) -> Callable[..., Any]:
    """Something that can be called."""
    if not callable(value):
        raise error(f"{what} must be a function, got {shown(value)}")
    return value


def several(
    value: object,
    classes: type[T] | tuple[type[T], ...],
    what: str,
    expected: str,
    error: type[PassgraphError] = GraphError,
) -> tuple[T, ...]:
    """A list or tuple of values of a class."""
    if not isinstance(value, (list, tuple)):
        raise error(f"{what} must be a list or tuple of {expected}, got {shown(value)}")
    for number, part in enumerate(value):
        if not isinstance(part, classes):
            raise error(f"{what} must be a list or tuple of {expected}; number {number} is {shown(part)}")
    return tuple(value)


def iterable(value: object, what: str, expected: str, error: type[PassgraphError] = GraphError) -> Iterable[Any]:
    """Return an iterable argument; text and arrays of numbers are errors."""
    if isinstance(value, (str, bytes, np.ndarray)) or not isinstance(value, Iterable):
        raise error(f"{what} must be {expected}, got {shown(value)}")
    return value


def numbers(
    value: object, what: str, expected: str = "be an array of numbers", error: type[PassgraphError] = InputError
) -> NDArray[Any]:
    """An array of bools, whole numbers or floats as it is given: no copy, no other dtype.

    Arrays of other libraries in the host's memory come through the buffer protocol, ``__array__``,
    ``__array_interface__`` or DLPack.
    Refused are ragged nesting, objects, text, complex numbers, records, and masked arrays with something masked:
    what is behind a mask has no value.  Whole numbers beyond 64 bits become float64.
    """
    # Whoever has a masked array has loaded numpy.ma, which takes its time.
    if "numpy.ma" in sys.modules and isinstance(value, np.ma.MaskedArray) and np.ma.getmaskarray(value).any():
        raise error(f"{what} must {expected}, got {shown(value)} with masked values; fill them first: .filled(0)")
    try:
        array = np.asarray(value) if hasattr(value, "__array__") else _exchanged(value)
        if array.dtype.kind == "O" and array is not value and array.size and all(type(v) is int for v in array.ravel()):
            array = array.astype(np.float64)
    except Exception:  # ragged, too deep, too large, or an __array__ that fails
        array = np.array(None)
    if array.dtype.kind not in "biuf":
        raise error(f"{what} must {expected}, got {shown(value)}")
    return array


def _exchanged(value: Any) -> NDArray[Any]:
    return np.from_dlpack(value) if hasattr(value, "__dlpack__") else np.asarray(value)


def path(value: object, what: str) -> Path:
    """A path of the file system; what is there is for the caller to find out."""
    try:
        return Path(value)  # type: ignore[arg-type]
    except TypeError:
        raise InputError(f"{what} must be a path (str or pathlib.Path), got {shown(value)}") from None
