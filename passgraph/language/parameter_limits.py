"""Ranges of parameters, ``Annotated[T, pg.Range(...)]`` in a signature: parsing, checks and bounds."""

from __future__ import annotations

import ast
import math
from collections.abc import Callable
from functools import cache
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import GraphError, InputError
from passgraph.language.meanings import INT_MAX, INT_MIN
from passgraph.language.source import Source, Span, fail
from passgraph.language.symbols import UINT_MAX
from passgraph.language.types import (
    BOOL,
    FLOAT,
    MAX_ARRAY_LENGTH,
    UINT,
    Array,
    Matrix,
    Scalar,
    Type,
    Vector,
    element_of,
    innermost,
    longest,
)
from passgraph.ranges import Range

#: Resolves a name, dotted or not.
Resolve = Callable[[ast.expr], object]

_NAMES = ("low", "high", "unit", "above", "odd")


def taken_apart(node: ast.expr, resolve: Resolve, source: Source) -> tuple[ast.expr, Range | None]:
    """Split an annotation into the type and the range."""
    if not isinstance(node, ast.Subscript) or not isinstance(node.value, (ast.Name, ast.Attribute)):
        return node, None
    if resolve(node.value) is not Annotated:
        return node, None
    parts = node.slice.elts if isinstance(node.slice, ast.Tuple) else []
    if len(parts) != 2:
        fail(source.span(node), "a range is written Annotated[type, pg.Range(low, high)]")
    return parts[0], read_range(parts[1], resolve, source)


def read_range(node: ast.expr, resolve: Resolve, source: Source) -> Range:
    """Return a range from a call in the source, or from a name that refers to one."""
    span = source.span(node)
    meaning = resolve(node.func if isinstance(node, ast.Call) else node)
    if isinstance(meaning, Range) and not isinstance(node, ast.Call):
        return meaning
    if meaning is not Range or not isinstance(node, ast.Call):
        fail(span, "Annotated takes a type and a pg.Range(low, high), and nothing else")
    arguments = dict(zip(_NAMES, node.args, strict=False))
    arguments |= {keyword.arg: keyword.value for keyword in node.keywords if keyword.arg is not None}
    if len(arguments) < len(node.args) + len(node.keywords) or not arguments.keys() <= set(_NAMES):
        fail(span, f"pg.Range takes {', '.join(_NAMES)}, each once")
    values = {name: _constant(value, source) for name, value in arguments.items()}
    try:
        return Range(**values)  # type: ignore[arg-type]
    except GraphError as error:
        fail(span, str(error))


def _constant(node: ast.expr, source: Source) -> object:
    """Return a number, text, or True, False, None."""
    negative = isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub)
    inner = node.operand if isinstance(node, ast.UnaryOp) and negative else node
    if not isinstance(inner, ast.Constant) or (negative and type(inner.value) not in (int, float)):
        fail(source.span(node), "a range takes literal numbers and text")
    return -inner.value if negative else inner.value  # type: ignore[operator]


def check_type(limits: Range, type_: Type, name: str, span: Span) -> None:
    """Check that a range is declared for numbers."""
    number_type = innermost(type_)
    if not isinstance(number_type, (Scalar, Vector, Matrix)) or element_of(number_type) is BOOL:
        fail(span, f"parameter {name!r} is {type_}; a range is of numbers, vectors and matrices of them, and arrays")
    if isinstance(type_, Array) and longest(type_) > MAX_ARRAY_LENGTH:
        fail(span, f"parameter {name!r} is {type_}; entries of so long an array are not checked one by one")
    low, high = ends(limits, type_)
    if low > high:
        fail(span, f"parameter {name!r} is {type_}, of which no number is {limits}")


def check_numbers(limits: Range, numbers: NDArray[np.float64], type_: Type, name: str) -> None:
    """Raise InputError for a value outside of a range.

    ``numbers`` are components from :func:`~.uniform_layout.components`.  Floats and limits are compared as float32.

    Raises
    ------
    InputError
        With the parameter, its range and the first number outside.
    """
    low, high = ends(limits, type_)
    if element_of(type_) is FLOAT:
        with np.errstate(over="ignore"):
            stored: NDArray[np.float64] = numbers.astype(np.float32).astype(np.float64)
    else:
        stored = np.where(numbers < 0, numbers + 2.0**32, numbers) if element_of(type_) is UINT else numbers
    inside = (stored >= low) & (stored <= high)
    if limits.above and limits.low is not None and element_of(type_) is FLOAT:
        inside &= stored > low
    if limits.odd:
        inside &= stored % 2 == 1
    if not inside.all():
        unit = f" {limits.unit}" if limits.unit else ""
        outside = float(stored[~inside][0])
        got = f"{outside:.0f}" if element_of(type_) is not FLOAT and math.isfinite(outside) else f"{outside:.9g}"
        raise InputError(f"{name} must be {limits}{unit}, got {got}")


def bounds(limits: Range, type_: Type) -> tuple[float, float]:
    """Return :func:`ends`, infinite if there is no limit: a bound from the type alone does not count."""
    low, high = ends(limits, type_)
    return -math.inf if limits.low is None else low, math.inf if limits.high is None else high


@cache
def ends(limits: Range, type_: Type) -> tuple[float, float]:
    """Return the least and the largest value of a component: integers for integer types, float32 for floats."""
    low = -math.inf if limits.low is None else float(limits.low)
    high = math.inf if limits.high is None else float(limits.high)
    if element_of(type_) is FLOAT:
        with np.errstate(over="ignore"):
            return float(np.float32(low)), float(np.float32(high))
    least, most = (0, UINT_MAX) if element_of(type_) is UINT else (INT_MIN, INT_MAX)
    first = low if not math.isfinite(low) else math.floor(low) + 1 if limits.above else math.ceil(low)
    return max(first, least), min(high if not math.isfinite(high) else math.floor(high), most)
