"""Values that are known while a text is read: lengths of arrays, labels, ends of loops, branches that never run."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from passgraph.language import ir
from passgraph.language.operations import OPERATIONS
from passgraph.language.types import FLOAT, Array, Matrix, Scalar, Type, Vector, component_count
from passgraph.language.values import Part

Numbers: TypeAlias = tuple[ir.Number, ...]
_DTYPES = {"float": np.float64, "int": np.int64, "uint": np.uint32, "bool": np.bool_}


def folded(value: ir.Expr) -> Numbers | None:
    """The numbers of a value in the order of its components, or None where it is not known.

    Floats are rounded to float32 after each operation.
    """
    if isinstance(value, ir.Literal):
        return (value.value,)
    if isinstance(value, ir.Table):
        return value.values
    if isinstance(value, ir.Construct):
        parts = [folded(part) for part in value.arguments]
        return None if None in parts else tuple(number for part in parts if part is not None for number in part)
    if isinstance(value, ir.Swizzle):
        whole = folded(value.value)
        return None if whole is None else tuple(whole[i] for i in value.components)
    if isinstance(value, ir.Index):
        whole, at = folded(value.value), folded(value.index)
        if whole is None or at is None:
            return None
        width = component_count(value.type)
        start = min(max(int(at[0]) * width, 0), len(whole) - width)
        return whole[start : start + width]
    if isinstance(value, ir.Select):
        condition = folded(value.condition)
        return None if condition is None else folded(value.then if condition[0] else value.orelse)
    return _applied(value) if isinstance(value, ir.Apply) else None


def _applied(value: ir.Apply) -> Numbers | None:
    row = OPERATIONS[value.operation]
    if isinstance(value.type, Matrix) or any(isinstance(part.type, (Matrix, Array)) for part in value.arguments):
        return None
    arguments = [folded(part) for part in value.arguments]
    arrays: list[NDArray[Any]] = []
    for part, numbers in zip(value.arguments, arguments, strict=True):
        if numbers is None:
            return None
        array: NDArray[Any] = np.array(numbers, _DTYPES[_element(part.type)])
        if array.dtype.kind == "f":
            array = array.astype(np.float32).astype(np.float64)
        # References of vectors take a batch on the first axis; a scalar is a batch of one.
        arrays.append(array[None] if row.kind == "expanded" and isinstance(part.type, Vector) else array)
    with np.errstate(all="ignore"):
        result = np.asarray(row.reference(*arrays)).ravel()
        if _element(value.type) == "float":
            result = result.astype(np.float32)
    return tuple(result.tolist())


def _element(type_: Type) -> str:
    return type_.name if isinstance(type_, Scalar) else type_.element.name if isinstance(type_, Vector) else FLOAT.name


def settled(part: Part) -> Part:
    """Whole numbers and bools written out where they are known: lengths of arrays are made of them.

    Floats stay as they are, since what computes them rounds as it runs.
    """
    return constant(part) if isinstance(part, ir.Apply) and _element(part.type) != FLOAT.name else part


def decided(condition: ir.Expr) -> ir.Expr:
    """A condition written out where whole numbers and bools alone decide it: what it rules out need not be read."""
    parts = ir.expressions(condition)
    is_whole = all(isinstance(p.type, (Scalar, Vector)) and _element(p.type) != FLOAT.name for p in parts)
    return constant(condition) if is_whole else condition


def constant(value: ir.Expr) -> ir.Expr:
    """The same value, written out where it is known."""
    numbers = None if isinstance(value, (ir.Literal, ir.Table)) else folded(value)
    if numbers is None:
        return value
    if isinstance(value.type, Scalar):
        return ir.Literal(value.type, numbers[0], value.span)
    if isinstance(value.type, Array):
        return ir.Table(value.type, numbers, value.span)
    element = value.type.element if isinstance(value.type, Vector) else FLOAT
    return ir.Construct(value.type, tuple(ir.Literal(element, n, value.span) for n in numbers), value.span)
