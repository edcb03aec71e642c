"""Packs parameters into the blocks of floats and ints that passes read."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from passgraph.arguments import LARGEST_FLOAT, numbers, shown
from passgraph.errors import InputError
from passgraph.language.operations import INT_MAX, INT_MIN, UINT_MAX
from passgraph.language.types import Array, Matrix, Type, component_count, element_of

if TYPE_CHECKING:
    from passgraph.language.scalar import ScalarProgram


def components(value: object, type_: Type, name: str) -> NDArray[np.float64]:
    """A host value in component order (matrices ``m[row][column]`` on the host become columns).

    Ints from 2147483648 to 4294967295 are bit patterns, as in kernels: they mean the int with these bits.

    Raises
    ------
    InputError
        When shape, kind or range do not fit, naming the parameter.
    """
    expected = f"be {type_} ({component_count(type_)} numbers)"
    array = numbers(value, name, expected)
    if isinstance(type_, Matrix) and array.shape == (type_.size, type_.size):
        array = array.T
    if isinstance(type_, Array) and isinstance(type_.element, Matrix) and array.ndim == 3:
        array = np.swapaxes(array, 1, 2)
    if array.size != component_count(type_):
        raise InputError(f"{name} must {expected}, got {shown(value)}")
    return in_range(array.ravel(), type_, name, value)


def in_range(array: NDArray[Any], type_: Type, name: str, given: object) -> NDArray[np.float64]:
    """Numbers that fit their component type, as float64; NaN and infinity are floats."""
    element = element_of(type_).name
    wide = array.astype(np.float64)
    if element == "float":
        with np.errstate(over="ignore"):
            bad = np.isinf(wide.astype(np.float32)) & ~np.isinf(array)
        limits = f"finite floats reach from -{LARGEST_FLOAT:.8g} to {LARGEST_FLOAT:.8g}"
    elif array.dtype.kind == "f" and not (np.abs(wide) >= 2.0**63).all():
        raise InputError(f"{name} must be {type_}, got floats ({shown(given)}); convert them first")
    elif element == "bool":
        bad, limits = (wide != 0.0) & (wide != 1.0), "a bool is True or False (1 or 0)"
    else:
        bad = (wide < INT_MIN) | (wide > UINT_MAX)
        limits = f"ints reach from {INT_MIN} to {INT_MAX}, and as bit patterns to 0xFFFFFFFF"
        wide = np.where(wide > INT_MAX, wide - 2.0**32, wide)
    if bad.any():
        raise InputError(f"{name} must be {type_}, got {shown(array[bad][0])}; {limits}")
    return wide


def pack(program: ScalarProgram, values: Mapping[str, object]) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """The two blocks of a pass from values by slot name."""
    floats = np.zeros(max(1, program.float_count), np.float32)
    ints = np.zeros(max(1, program.int_count), np.int32)
    for slot in program.uniforms:
        block = floats if slot.block == "float" else ints
        block[slot.offset : slot.offset + slot.count] = components(values[slot.name], slot.type, slot.name)  # type: ignore[arg-type]
    return floats, ints
