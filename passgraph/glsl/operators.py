"""Implicit conversions and operators of GLSL between typed values."""

from __future__ import annotations

from passgraph.language import ir
from passgraph.language.composites import entry, plain_value
from passgraph.language.long_arrays import check_local
from passgraph.language.source import Span, fail
from passgraph.language.types import (
    BOOL,
    FLOAT,
    INT,
    UINT,
    Array,
    Matrix,
    Scalar,
    Type,
    Vector,
    element_of,
    with_element,
)
from passgraph.language.typing_rules import apply, binary, unify
from passgraph.language.values import (
    COMPOSITE,
    ArrayValue,
    Namer,
    Part,
    StructValue,
    TupleValue,
    coerce,
    convert,
    index_into,
    part_type,
    type_of,
)

#: Implicit conversions, with their costs in overload resolution.
_COSTS = {(INT, UINT): 1, (INT, FLOAT): 2, (UINT, FLOAT): 2}


def type_of_part(part: Part) -> Type | None:
    return None if isinstance(part, TupleValue) else type_of(part)


def cost_of(part: Part, type_: Type, passed: str) -> int | None:
    """Return the cost of passing a value to a parameter: 0 for the same type; None if it cannot be converted.

    An ``out`` parameter is converted when it is copied out (GLSL 3.30, section 6.1).
    """
    given, taken = type_of_part(part), type_
    if given == taken:
        return 0
    if passed == "out" and given is not None:
        given, taken = taken, given
    if passed == "inout" or not isinstance(given, (Scalar, Vector)) or not isinstance(taken, (Scalar, Vector)):
        return None
    is_alike = with_element(given, element_of(taken)) == taken
    return _COSTS.get((element_of(given), element_of(taken))) if is_alike else None


def fitted(part: Part, type_: Type, span: Span, what: str) -> Part:
    """Convert a value implicitly to a declared type."""
    if isinstance(type_, (Scalar, Vector)) and element_of(type_) is UINT:
        part_type = type_of_part(part)
        if (
            isinstance(part_type, (Scalar, Vector))
            and with_element(part_type, UINT) == type_
            and element_of(part_type) is INT
        ):
            part = convert(part, UINT, span)  # type: ignore[arg-type]
    return coerce(part, type_, span, what)


def whole_numbers_alike(values: list[ir.Expr], span: Span) -> list[ir.Expr]:
    """Convert ints to uints if one of the values is a uint, as in ``max(i, 2u)``."""
    if {_element(value) for value in values} != {INT, UINT}:
        return values
    return [convert(value, UINT, span) for value in values]


def _element(value: ir.Expr) -> Scalar | None:
    return element_of(value.type) if isinstance(value.type, (Scalar, Vector)) else None


def as_int(value: ir.Expr, span: Span) -> ir.Expr:
    """Convert a uint to the int with the same bits, for indices and shift distances."""
    return convert(value, INT, span) if _element(value) is UINT else value


_ORDERED = {"<": "less", ">": "greater", "<=": "less_equal", ">=": "greater_equal"}


def arithmetic(sign: str, left: Part, right: Part, span: Span, named: Namer) -> ir.Expr:
    """Apply any binary operator except ``&&`` and ``||``, which evaluate one side conditionally."""
    if sign in ("==", "!="):
        is_equal = equal(left, right, span, named)
        return is_equal if sign == "==" else apply("logical_not", [is_equal], span)
    one, other = (plain(side, span, f"an operand of {sign}") for side in (left, right))
    if sign not in ("<<", ">>"):
        one, other = whole_numbers_alike([one, other], span)
    if sign in _ORDERED:
        if not (isinstance(one.type, Scalar) and isinstance(other.type, Scalar)):
            fail(span, f"{sign} compares scalars, got {one.type} and {other.type}; use lessThan() and its like")
        return apply(_ORDERED[sign], [one, other], span)
    if sign in ("&&", "||", "^^"):
        if one.type != BOOL or other.type != BOOL:
            fail(span, f"{sign} takes bools, got {one.type} and {other.type}")
        if sign == "^^":
            return apply("not_equal", [apply("to_int", [side], span) for side in (one, other)], span)
        return apply("logical_and" if sign == "&&" else "logical_or", [one, other], span)
    if sign in ("<<", ">>"):
        return binary(
            sign, one, convert(as_int(other, span), _integer_type(one), span) if _is_whole(other) else other, span
        )
    if isinstance(one.type, Matrix) or isinstance(other.type, Matrix):
        # Sums of matrices and products with scalars are computed by column, which uses both operands repeatedly.
        one, other = named(one, span), named(other, span)
    elif sign in ("/", "%") and _is_whole(one) and _is_whole(other):
        return apply("quotient" if sign == "/" else "remainder", [one, other], span)
    elif sign == "%":
        fail(span, f"% takes whole numbers, got {one.type} and {other.type}; use mod()")
    return binary(sign, one, other, span)


def plain(part: Part, span: Span, what: str) -> ir.Expr:
    """Return a part that is a single value; raise KernelError for others."""
    part = plain_value(part, span)
    if isinstance(part, COMPOSITE):
        fail(span, f"{what} cannot be {part_type(part)}")
    return part


def _is_whole(value: ir.Expr) -> bool:
    return isinstance(value.type, (Scalar, Vector)) and element_of(value.type) in (INT, UINT)


def _integer_type(value: ir.Expr) -> Scalar:
    """Return the integer type of a shifted value."""
    return UINT if _is_whole(value) and element_of(value.type) is UINT else INT


def negated(sign: str, value: ir.Expr, span: Span, named: Namer) -> ir.Expr:
    """Apply a unary operator: ``-a +a !a ~a``."""
    if sign == "+":
        return value
    if sign == "!":
        if value.type != BOOL:
            fail(span, f"! takes a bool, got {value.type}; not() takes vectors")
        return apply("logical_not", [value], span)
    if sign == "~":
        return apply("bit_not", [value], span)
    if isinstance(value.type, Matrix):
        return binary("*", ir.Literal(FLOAT, -1.0, span), named(value, span), span)
    if isinstance(value, ir.Literal) and value.type in (INT, FLOAT):
        number = -value.value
        return ir.Literal(value.type, -(2**31) if number == 2**31 else number, span)
    return apply("neg", [value], span)


def equal(left: Part, right: Part, span: Span, named: Namer) -> ir.Expr:
    """Compare all parts of two values for equality."""
    check_local(type_of(left), "a side of ==", span)
    if isinstance(left, StructValue) and isinstance(right, StructValue) and left.struct == right.struct:
        links = [equal(left.fields[name], right.fields[name], span, named) for name in left.fields]
        return _all(links, span)
    if isinstance(left, ArrayValue) and isinstance(right, ArrayValue) and left.type == right.type:
        at = [ir.Literal(INT, i, span) for i in range(left.type.length)]
        return _all([equal(entry(left, i, span, named), entry(right, i, span, named), span, named) for i in at], span)
    one, other = (plain(side, span, "a side of ==") for side in (left, right))
    one, other = whole_numbers_alike([one, other], span)
    one, other = unify(one, other, span, "both sides of ==")
    type_ = one.type
    if isinstance(type_, (Array, Matrix)):
        one, other = named(one, span), named(other, span)
        count = type_.length if isinstance(type_, Array) else type_.columns
        at = [ir.Literal(INT, i, span) for i in range(count)]
        links = [equal(index_into(one, i, span), index_into(other, i, span), span, named) for i in at]
        return _all(links, span)
    if element_of(type_) is BOOL:
        one, other = apply("to_int", [one], span), apply("to_int", [other], span)
    is_equal = apply("equal", [one, other], span)
    return is_equal if isinstance(type_, Scalar) else apply("all", [is_equal], span)


def _all(links: list[ir.Expr], span: Span) -> ir.Expr:
    result = links[0]
    for link in links[1:]:
        result = apply("logical_and", [result, link], span)
    return result
