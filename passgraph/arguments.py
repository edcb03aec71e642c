"""Checks of arguments: one function for each kind; each error names the argument, what was expected and what was given.

``what`` begins every message: the place and the argument's name, such as ``"target 'bloom': scale"``.  The functions
check types before they compare or call, so that arrays and unknown objects never raise errors of their own.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Container, Iterable
from difflib import get_close_matches
from fractions import Fraction
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import GraphError, InputError, PassgraphError

T = TypeVar("T")
#: Most characters of a value in a message.
MOST_SHOWN = 80
#: Larger float64 numbers become infinite as float32.
LARGEST_FLOAT = float(np.finfo(np.float32).max)


def shown(value: object) -> str:
    """Return a short description of any value for a message.

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
    except Exception:  # a foreign __repr__ may raise anything
        text = "x" * MOST_SHOWN
    if len(text) < MOST_SHOWN:
        return text
    size = f" of {len(value)}" if isinstance(value, (str, bytes, list, tuple, dict, set)) else ""
    return f"a {type(value).__name__}{size}"


def is_number(value: object) -> bool:
    """Return True for a real number of Python or NumPy; bools are not numbers."""
    return isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)


def string(value: object, what: str, error: type[PassgraphError] = InputError) -> str:
    """Return a string of any content: names in files may be empty."""
    if not isinstance(value, str):
        raise error(f"{what} must be a string, got {shown(value)}")
    return value


def near(name: str, known: Iterable[str]) -> str:
    """Return a hint with the most similar known name, or an empty string.

    >>> near("colour", ["color", "mask"])
    " (did you mean 'color'?)"
    """
    found = get_close_matches(name, list(known), n=1)
    return f" (did you mean {found[0]!r}?)" if found else ""


def among(value: object, names: Container[str]) -> bool:
    """Return True if the value is one of some names; unhashable values and ones with their own equality are not."""
    return isinstance(value, str) and value in names


def whole_number(value: object, what: str, low: int, high: int, error: type[PassgraphError] = GraphError) -> int:
    """Return a whole number from ``low`` to ``high``.

    >>> whole_number(np.int64(3), "levels", 1, 8)
    3
    """
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or not low <= value <= high:
        raise error(f"{what} must be a whole number from {low} to {high}, got {shown(value)}")
    return int(value)


def size_in_pixels(value: object, what: str, most: int) -> tuple[int, int]:
    """Return a width and a height from 1 to ``most``."""
    if not isinstance(value, (tuple, list)) or len(value) != 2:
        raise InputError(f"{what} must be (width, height) in pixels, got {shown(value)}")
    width, height = (whole_number(side, f"{what}: each side", 1, most, InputError) for side in value)
    return width, height


def real(
    value: object,
    what: str,
    low: float = -LARGEST_FLOAT,
    high: float = LARGEST_FLOAT,
    error: type[PassgraphError] = GraphError,
    *,
    above: bool = False,
) -> float:
    """Return a finite number from ``low`` (or above it) to ``high``."""
    number = as_float(value)
    if number is None or not (low < number if above else low <= number) or not number <= high:
        raise error(f"{what} must be {_range(low, high, above)}, got {shown(value)}")
    return number


def as_float(value: object) -> float | None:
    """Return a real number as a Python float; None if it is not a finite number."""
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
    """Return a bool; values that are only truthy or falsy are errors."""
    if not isinstance(value, (bool, np.bool_)):
        raise error(f"{what} must be True or False, got {shown(value)}")
    return bool(value)


def text(value: object, what: str, error: type[PassgraphError] = GraphError) -> str:
    """Return a name: a printable string that is not empty."""
    if not isinstance(value, str) or not value or not value.isprintable():
        raise error(f"{what} must be a name (a printable string, not empty), got {shown(value)}")
    return value


def one_of(value: object, what: str, allowed: Iterable[str], error: type[PassgraphError] = GraphError) -> str:
    """Return one of some words."""
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
    """Return an instance of a class; ``expected`` describes it in the message."""
    if not isinstance(value, classes):
        raise error(f"{what} must be {expected}, got {shown(value)}")
    return value


def function(value: object, what: str, error: type[PassgraphError] = GraphError) -> Callable[..., Any]:
    """Return a callable."""
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
    """Return a list or tuple whose elements are instances of a class."""
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
    """Return an array of bools, whole numbers or floats, without a copy or a change of dtype.

    Arrays of other libraries are read through the buffer protocol, ``__array__``, ``__array_interface__`` or DLPack.
    Errors: ragged nesting, objects, text, complex numbers, records, and masked arrays with masked elements, which have
    no value.  Whole numbers beyond 64 bits become float64.
    """
    # numpy.ma is imported already if the value is a masked array; importing it takes time.
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
    """Return a path; it need not exist."""
    try:
        return Path(value)  # type: ignore[arg-type]
    except TypeError:
        raise InputError(f"{what} must be a path (str or pathlib.Path), got {shown(value)}") from None


def parsed_fraction(text: str) -> Fraction:
    """Parse 25, 23.976 or 30000/1001; raises ValueError for other text.

    Powers of ten are left out: `Fraction` computes all digits of 1e999999999, which takes forever.

    >>> parsed_fraction("30000/1001"), parsed_fraction("23.976")
    (Fraction(30000, 1001), Fraction(2997, 125))
    """
    if len(text) > _MOST_DIGITS or "e" in text.lower():
        raise ValueError(f"{shown(text)} is no number such as 25, 23.976 or 30000/1001")
    try:
        return Fraction(text)
    except ZeroDivisionError as error:
        raise ValueError(f"{text} is divided by 0") from error


_MOST_DIGITS = 32
