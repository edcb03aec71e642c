"""Which types GLSL takes for which, without being asked: ints as uints and floats, uints as floats."""

from __future__ import annotations

from passgraph.language import ir
from passgraph.language.source import Span
from passgraph.language.types import FLOAT, INT, UINT, Scalar, Type, Vector, element_of, with_element
from passgraph.language.values import Part, TupleValue, coerce, convert, type_of

#: What becomes what, and at which cost where one of several functions is chosen.
_COSTS = {(INT, UINT): 1, (INT, FLOAT): 2, (UINT, FLOAT): 2}


def type_of_part(part: Part) -> Type | None:
    return None if isinstance(part, TupleValue) else type_of(part)


def cost_of(part: Part, type_: Type, passed: str) -> int | None:
    """0 for the type itself, more where numbers are converted, None where a parameter does not take a value."""
    given = type_of_part(part)
    if given == type_:
        return 0
    if passed == "in" and isinstance(given, (Scalar, Vector)) and isinstance(type_, (Scalar, Vector)):
        element = element_of(type_)
        return _COSTS.get((element_of(given), element)) if with_element(given, element) == type_ else None
    return None


def fitted(part: Part, type_: Type, span: Span, what: str) -> Part:
    """A value where a declared type is wanted."""
    if isinstance(type_, (Scalar, Vector)) and element_of(type_) is UINT:
        given = type_of_part(part)
        if isinstance(given, (Scalar, Vector)) and with_element(given, UINT) == type_ and element_of(given) is INT:
            part = convert(part, UINT, span)  # type: ignore[arg-type]
    return coerce(part, type_, span, what)


def whole_numbers_alike(left: ir.Expr, right: ir.Expr, span: Span) -> tuple[ir.Expr, ir.Expr]:
    """Both sides of an operator, the int one as uint where the other is."""
    elements = [_element(side) for side in (left, right)]
    if set(elements) != {INT, UINT}:
        return left, right
    return tuple(convert(side, UINT, span) for side in (left, right))  # type: ignore[return-value]


def _element(value: ir.Expr) -> Scalar | None:
    return element_of(value.type) if isinstance(value.type, (Scalar, Vector)) else None


def as_int(value: ir.Expr, span: Span) -> ir.Expr:
    """A uint as the int with the same bits: indices, and distances of shifts."""
    return convert(value, INT, span) if _element(value) is UINT else value
