"""Powers as they are written, ``x**n``: whole exponents become multiplications, which hold for negative bases too."""

from __future__ import annotations

from passgraph.language import ir
from passgraph.language.source import Span, fail
from passgraph.language.types import BOOL, FLOAT, INT, Scalar, Vector, element_of
from passgraph.language.typing_rules import apply
from passgraph.language.values import Namer

#: Whole exponents up to this size are multiplied out.
_MAX_EXPANDED = 16


def written_power(base: ir.Expr, exponent: ir.Expr, span: Span, name: Namer) -> ir.Expr:
    """``base ** exponent``; ``name`` puts what is used twice behind a name."""
    literal, sign = exponent, 1
    if isinstance(literal, ir.Apply) and literal.operation == "neg":
        literal, sign = literal.arguments[0], -1
    if isinstance(literal, ir.Literal) and literal.type is INT:
        n = sign * int(literal.value)
        if abs(n) <= _MAX_EXPANDED:
            return _whole_power(base, n, span, name)
    return apply("pow", [base, exponent], span)


def _whole_power(base: ir.Expr, n: int, span: Span, name: Namer) -> ir.Expr:
    if not isinstance(base.type, (Scalar, Vector)) or element_of(base.type) is BOOL:
        fail(span, f"** does not take {base.type}")
    if n < 0:
        one = ir.Literal(FLOAT, 1.0, span)
        return apply("div", [one, _whole_power(base, -n, span, name)], span)
    if n == 0:
        ones = ir.Literal(element_of(base.type), 1.0 if element_of(base.type) is FLOAT else 1, span)
        return ones if isinstance(base.type, Scalar) else ir.Construct(base.type, (ones,) * base.type.size, span)
    base = name(base, span)
    result: ir.Expr | None = None
    square = base
    while n:
        if n & 1:
            result = square if result is None else apply("mul", [result, square], span)
        n >>= 1
        if n:
            square = name(apply("mul", [square, square], span), span)
    assert result is not None
    return result
