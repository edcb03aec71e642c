"""Packs parameters into the blocks of floats and ints that passes read."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import InputError
from passgraph.language.scope import as_array, describe
from passgraph.language.types import Array, Matrix, Type, component_count, element_of

if TYPE_CHECKING:
    from passgraph.language.scalar import ScalarProgram


def components(value: object, type_: Type, name: str) -> NDArray[np.float64]:
    """A host value in component order (matrices ``m[row][column]`` on the host become columns).

    Raises
    ------
    InputError
        When shape or kind do not fit, naming the parameter.
    """
    array = as_array(value)
    if array.dtype.kind not in "biuf":
        raise InputError(f"{name} must be {type_} ({component_count(type_)} numbers), got {describe(value)}")
    if isinstance(type_, Matrix) and array.shape == (type_.size, type_.size):
        array = array.T
    if isinstance(type_, Array) and isinstance(type_.element, Matrix) and array.ndim == 3:
        array = np.swapaxes(array, 1, 2)
    if array.size != component_count(type_):
        raise InputError(f"{name} must be {type_} ({component_count(type_)} numbers), got {describe(value)}")
    if element_of(type_).name != "float" and array.dtype.kind == "f":
        raise InputError(f"{name} must be {type_}, got floats ({describe(value)}); convert them first")
    return array.ravel().astype(np.float64)


def pack(program: ScalarProgram, values: Mapping[str, object]) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """The two blocks of a pass from values by slot name."""
    floats = np.zeros(max(1, program.float_count), np.float32)
    ints = np.zeros(max(1, program.int_count), np.int32)
    for slot in program.uniforms:
        block = floats if slot.block == "float" else ints
        block[slot.offset : slot.offset + slot.count] = components(values[slot.name], slot.type, slot.name)  # type: ignore[arg-type]
    return floats, ints
