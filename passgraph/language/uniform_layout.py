"""Check parameters, and put their numbers into the order in which passes read them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from passgraph.arguments import LARGEST_FLOAT, numbers, shown
from passgraph.errors import InputError
from passgraph.language.meanings import INT_MAX, INT_MIN
from passgraph.language.parameter_limits import check_numbers
from passgraph.language.symbols import CONSTANTS, UINT_MAX
from passgraph.language.types import Matrix, Type, component_count, element_of, innermost, shape_of

if TYPE_CHECKING:
    from passgraph.ranges import Range


#: The least and the largest number that a component can hold unchanged; others need a closer check.
LIMITS = {"float": (-LARGEST_FLOAT, LARGEST_FLOAT), "int": (INT_MIN, INT_MAX), "uint": (0, INT_MAX), "bool": (0, 1)}
#: Larger float64 numbers round to infinity as float32: half a step above the largest.
FLOAT_END = LARGEST_FLOAT + 2.0**103
#: NumPy type letters of arrays whose numbers all fit a component: they are not checked.
HELD = {"float": "?bBhHiIlLqQef", "int": "?bBhHi", "uint": "?BH", "bool": "?"}
#: NumPy type letters of arrays whose numbers are checked quickly; others get the full check.
LOOKED_AT = {"float": "d", "int": "IlLqQ", "uint": "ILQ", "bool": ""}
#: Plain Python types: compared directly, so that no foreign method runs.
_NUMBERS = frozenset((float, int, bool))
_WHOLE = frozenset((int, bool))
_SCALARS = frozenset(np.dtype(letter).type for letter in HELD["float"] + "d")
_ROWS = frozenset((tuple, list, *CONSTANTS))
#: Up to this many numbers Python's functions are faster than NumPy's.
FEW = 16


def components(value: object, type_: Type, name: str) -> NDArray[np.float64]:
    """Return a host value in component order (matrices ``m[row][column]`` on the host become columns).

    The result may share the value's memory: read it at once. Ints from 2147483648 to 4294967295 are bit patterns, as in
    kernels: they mean the int with these bits.  A block of ints also stores uints, by their bits, so such a uint is
    that int here.

    Raises
    ------
    InputError
        If shape, kind or range do not fit, with the parameter's name.
    """
    # Every run packs its values: plain values must cost little.
    kind = type(value)
    numbers = None
    if kind is np.ndarray:
        numbers = _from_array(value, type_)  # type: ignore[arg-type]
    elif kind in _NUMBERS:
        numbers = _from_numbers((value,), type_)
    elif kind in _SCALARS:
        numbers = _from_numbers((value.item(),), type_)  # type: ignore[attr-defined]
    elif kind in _ROWS:
        if len(value) <= FEW:  # type: ignore[arg-type]
            numbers = _from_numbers(value, type_)  # type: ignore[arg-type]
        if numbers is None:
            numbers = _from_rows(value, type_)
    return _fully_checked(value, type_, name) if numbers is None else numbers


def _from_numbers(numbers: Sequence[Any], type_: Type) -> NDArray[np.float64] | None:
    """Return Python numbers as components; None if any is something else or out of range."""
    if len(numbers) != component_count(type_):
        return None
    element = element_of(type_).name
    low, high = LIMITS[element]
    kinds = _NUMBERS if element == "float" else _WHOLE
    for number in numbers:
        if type(number) not in kinds or not low <= number <= high:
            return None
    return np.array(numbers, np.float64)


def _from_rows(rows: object, type_: Type) -> NDArray[np.float64] | None:
    """Return many numbers, nested rows of numbers, or sequences of NumPy numbers as components."""
    try:
        array = np.asarray(rows)
    except (ValueError, OverflowError):
        return None
    return _from_array(array, type_)


def _from_array(array: NDArray[Any], type_: Type) -> NDArray[np.float64] | None:
    """Return an array's numbers as components; None for other content, a wrong count or numbers out of range."""
    element, kind = element_of(type_).name, array.dtype.char
    is_exact = kind in HELD[element]
    if not is_exact and kind not in LOOKED_AT[element]:
        return None
    wide = _wide(array, type_)
    return wide if is_exact or (wide is not None and _fits(wide, element)) else None


def in_order(array: NDArray[Any], type_: Type) -> NDArray[Any] | None:
    """Return a host value's numbers in component order, flat; None if their count or the sides of matrices do not fit.

    Host matrices are written as in mathematics, ``m[row][column]``; components are stored by columns.
    """
    if array.size != component_count(type_):
        return None
    if array.ndim > 1 and isinstance(matrix := innermost(type_), Matrix) and array.ndim >= len(shape_of(type_)):
        if array.shape[-2:] == (matrix.rows, matrix.columns):
            array = np.swapaxes(array, -1, -2)
        elif matrix.rows != matrix.columns:
            return None  # ambiguous: by rows or by columns
    return array.ravel()


def described(type_: Type) -> str:
    """Describe the number of elements of a host value of this type, for errors; for non-square matrices, also the
    rows."""
    count, matrix = component_count(type_), innermost(type_)
    if isinstance(matrix, Matrix) and matrix.rows != matrix.columns:
        return f"{count} numbers; {matrix.rows} rows of {matrix.columns} each"
    return "a number" if count == 1 else f"{count} numbers"


def _wide(array: NDArray[Any], type_: Type) -> NDArray[np.float64] | None:
    """Return :func:`in_order`, as float64."""
    flat = in_order(array, type_)
    return None if flat is None else flat.astype(np.float64, copy=False)


def _fits(wide: NDArray[np.float64], element: str) -> bool:
    low, high = LIMITS[element]
    # No number is farther from 0 than the norm; comparisons with NaN are false.  Unlike dot, vdot does not warn of
    # overflow.
    far = math.hypot(*wide.tolist()) if wide.size <= FEW else math.sqrt(np.vdot(wide, wide))
    return far <= high or bool(low <= wide.min() and wide.max() <= high)


def _fully_checked(value: object, type_: Type, name: str) -> NDArray[np.float64]:
    """Return `components` of unusual or wrong values: NaN and infinity are floats, and ints may be bit patterns."""
    expected = f"be {type_} ({described(type_)})"
    array = numbers(value, name, expected)
    wide = _wide(array, type_)
    if wide is None:
        raise InputError(f"{name} must {expected}, got {shown(value)}")
    element = element_of(type_).name
    if element == "float":
        bad = (np.abs(wide) >= FLOAT_END) & np.isfinite(wide)
        limits = f"finite floats reach from -{LARGEST_FLOAT:.8g} to {LARGEST_FLOAT:.8g}"
    elif array.dtype.kind == "f" and not (np.abs(wide) >= 2.0**63).all():
        raise InputError(f"{name} must be {type_}, got floats ({shown(value)}); convert them first")
    elif element == "bool":
        bad, limits = (wide != 0.0) & (wide != 1.0), "a bool is True or False (1 or 0)"
    elif element == "uint":
        bad, limits = (wide < 0) | (wide > UINT_MAX), f"uints reach from 0 to {UINT_MAX}"
    else:
        bad = (wide < INT_MIN) | (wide > UINT_MAX)
        limits = f"ints reach from {INT_MIN} to {INT_MAX}, and as bit patterns to 0xFFFFFFFF"
    if bad.any():
        first = wide[bad][0]
        got = shown(value) if wide.size == 1 else f"{first:g}" if element == "float" else f"{first:.0f}"
        raise InputError(f"{name} must be {type_}, got {got}; {limits}")
    return np.where(wide > INT_MAX, wide - 2.0**32, wide) if element in ("int", "uint") else wide


def in_range(value: object, type_: Type, limits: Range | None, name: str) -> NDArray[np.float64]:
    """Return the components of a parameter's value; InputError if one is out of its range."""
    numbers = components(value, type_, name)
    if limits is not None:
        check_numbers(limits, numbers, type_, name)
    return numbers
