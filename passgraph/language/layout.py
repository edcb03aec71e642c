"""Packs parameters into the blocks of floats and ints that passes read."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from passgraph.arguments import LARGEST_FLOAT, numbers, shown
from passgraph.errors import InputError
from passgraph.language.operations import INT_MAX, INT_MIN, UINT_MAX
from passgraph.language.types import FLOAT, Array, Matrix, Type, component_count, element_of

if TYPE_CHECKING:
    from passgraph.language.scalar import ScalarProgram


#: The least and the largest number that a component holds as it is; what lies outside gets a second look.
LIMITS = {"float": (-LARGEST_FLOAT, LARGEST_FLOAT), "int": (INT_MIN, INT_MAX), "bool": (0, 1)}
#: From here on a float64 rounds to infinity as a float32: half a step above the largest.
FLOAT_END = LARGEST_FLOAT + 2.0**103
#: Up to so many numbers a loop of Python's is quicker than NumPy's functions.
FEW = 4


def components(value: object, type_: Type, name: str) -> NDArray[np.float64]:
    """A host value in component order (matrices ``m[row][column]`` on the host become columns).

    Ints from 2147483648 to 4294967295 are bit patterns, as in kernels: they mean the int with these bits.

    Raises
    ------
    InputError
        When shape, kind or range do not fit, naming the parameter.
    """
    # Every run packs its values: what is plainly right must cost little.
    if type_ is FLOAT and type(value) is float and -LARGEST_FLOAT <= value <= LARGEST_FLOAT:
        return np.array((value,))
    try:
        array = np.asarray(value) if type(value) in _PLAIN else None
    except (ValueError, OverflowError):
        array = None
    if array is not None and array.dtype.kind in "biuf":
        found = _in_order(array, type_)
        if found is not None and _fits(found, array.dtype.kind, type_):
            return found
    return _looked_through(value, type_, name)


_PLAIN = frozenset((float, int, bool, tuple, list, np.ndarray))


def _in_order(array: NDArray[Any], type_: Type) -> NDArray[np.float64] | None:
    """The components, flat, as float64; None where their number is another one."""
    if isinstance(type_, Matrix) and array.shape == (type_.size, type_.size):
        array = array.T
    if isinstance(type_, Array) and isinstance(type_.element, Matrix) and array.ndim == 3:
        array = np.swapaxes(array, 1, 2)
    return array.ravel().astype(np.float64) if array.size == component_count(type_) else None


def _fits(wide: NDArray[np.float64], kind: str, type_: Type) -> bool:
    element = element_of(type_).name
    if kind == "f" and element != "float":
        return False
    low, high = LIMITS[element]
    if wide.size > FEW and element == "float":
        # No square is above the sum of all; NaN is below nothing.  Unlike dot, vdot warns of no overflow.
        return bool(np.vdot(wide, wide) <= high**2)
    if wide.size > FEW:
        return bool(low <= wide.min() and wide.max() <= high)
    for number in wide.tolist():  # noqa: SIM110 (a generator takes twice as long)
        if not low <= number <= high:
            return False
    return True


def _looked_through(value: object, type_: Type, name: str) -> NDArray[np.float64]:
    """`components` of what is unusual or wrong: NaN and infinity are floats, and ints may be bit patterns."""
    expected = f"be {type_} ({component_count(type_)} numbers)"
    array = numbers(value, name, expected)
    wide = _in_order(array, type_)
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
    else:
        bad = (wide < INT_MIN) | (wide > UINT_MAX)
        limits = f"ints reach from {INT_MIN} to {INT_MAX}, and as bit patterns to 0xFFFFFFFF"
    if bad.any():
        first = wide[bad][0]
        got = shown(value) if wide.size == 1 else f"{first:g}" if element == "float" else f"{first:.0f}"
        raise InputError(f"{name} must be {type_}, got {got}; {limits}")
    return np.where(wide > INT_MAX, wide - 2.0**32, wide) if element == "int" else wide


def pack(program: ScalarProgram, values: Mapping[str, object]) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """The two blocks of a pass from values by slot name."""
    floats = np.zeros(max(1, program.float_count), np.float32)
    ints = np.zeros(max(1, program.int_count), np.int32)
    for slot in program.uniforms:
        block = floats if slot.block == "float" else ints
        block[slot.offset : slot.offset + slot.count] = components(values[slot.name], slot.type, slot.name)  # type: ignore[arg-type]
    return floats, ints
