"""Operators of GLSL between typed values, where they differ from those of kernels."""

from __future__ import annotations

from passgraph.language import ir
from passgraph.language.source import Span, fail
from passgraph.language.types import BOOL, FLOAT, INT, Array, Matrix, Scalar, Vector, element_of
from passgraph.language.typing_rules import apply, binary, unify
from passgraph.language.values import COMPOSITE, Namer, Part, StructValue, index_into, part_type

_ORDERED = {"<": "less", ">": "greater", "<=": "less_equal", ">=": "greater_equal"}


def arithmetic(sign: str, left: Part, right: Part, span: Span, named: Namer) -> ir.Expr:
    """Any operator but those that compute one side only where they need it."""
    if sign in ("==", "!="):
        same = equal(left, right, span, named)
        return same if sign == "==" else apply("logical_not", [same], span)
    one, other = (plain(side, span, f"an operand of {sign}") for side in (left, right))
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
    if isinstance(one.type, Matrix) or isinstance(other.type, Matrix):
        # Sums of matrices and products with scalars go by column and use both sides once for each.
        one, other = named(one, span), named(other, span)
    elif sign in ("/", "%") and _of_ints(one, other):
        return _whole_quotient(sign, named(one, span), named(other, span), span)
    elif sign == "%":
        fail(span, f"% takes ints, got {one.type} and {other.type}; use mod()")
    return binary(sign, one, other, span)


def plain(part: Part, span: Span, what: str) -> ir.Expr:
    """A part that is one value."""
    if isinstance(part, COMPOSITE):
        fail(span, f"{what} cannot be {part_type(part)}")
    return part


def _of_ints(left: ir.Expr, right: ir.Expr) -> bool:
    return all(isinstance(side.type, (Scalar, Vector)) and element_of(side.type) is INT for side in (left, right))


def _whole_quotient(sign: str, left: ir.Expr, right: ir.Expr, span: Span) -> ir.Expr:
    """Quotient and remainder of ints go toward zero."""
    size = apply("floor_divide", [apply("abs", [left], span), apply("abs", [right], span)], span)
    signs = apply("mul", [apply("sign", [left], span), apply("sign", [right], span)], span)
    quotient = apply("mul", [size, signs], span)
    if sign == "/":
        return quotient
    rest = apply("sub", [left, apply("mul", [quotient, right], span)], span)
    zero = ir.Literal(INT, 0, span)
    nothing = apply("equal", [right, zero], span)
    return apply("mul", [rest, apply("to_int", [apply("logical_not", [nothing], span)], span)], span)


def negated(sign: str, value: ir.Expr, span: Span, named: Namer) -> ir.Expr:
    """``-a +a !a ~a``."""
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
    """Whether all parts of two values are equal."""
    if isinstance(left, StructValue) and isinstance(right, StructValue) and left.struct == right.struct:
        links = [equal(left.fields[name], right.fields[name], span, named) for name in left.fields]
        return _all(links, span)
    one, other = unify(plain(left, span, "a side of =="), plain(right, span, "a side of =="), span, "both sides of ==")
    type_ = one.type
    if isinstance(type_, (Array, Matrix)):
        one, other = named(one, span), named(other, span)
        count = type_.length if isinstance(type_, Array) else type_.columns
        at = [ir.Literal(INT, i, span) for i in range(count)]
        links = [equal(index_into(one, i, span), index_into(other, i, span), span, named) for i in at]
        return _all(links, span)
    if element_of(type_) is BOOL:
        one, other = apply("to_int", [one], span), apply("to_int", [other], span)
    same = apply("equal", [one, other], span)
    return same if isinstance(type_, Scalar) else apply("all", [same], span)


def _all(links: list[ir.Expr], span: Span) -> ir.Expr:
    result = links[0]
    for link in links[1:]:
        result = apply("logical_and", [result, link], span)
    return result
