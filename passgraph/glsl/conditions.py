"""Conditions of ``#if`` and ``#elif``."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from passgraph.glsl.tokens import Token
from passgraph.language.source import Span, fail

#: Most nested parentheses and signs.
MAX_DEPTH = 40

_BINARY: tuple[dict[str, Callable[[int, int], int]], ...] = (
    {"||": lambda a, b: int(bool(a) or bool(b))},
    {"&&": lambda a, b: int(bool(a) and bool(b))},
    {"|": lambda a, b: a | b},
    {"^": lambda a, b: a ^ b},
    {"&": lambda a, b: a & b},
    {"==": lambda a, b: int(a == b), "!=": lambda a, b: int(a != b)},
    {"<": lambda a, b: int(a < b), ">": lambda a, b: int(a > b), "<=": lambda a, b: int(a <= b),
     ">=": lambda a, b: int(a >= b)},
    {"<<": lambda a, b: a << (b & 63), ">>": lambda a, b: a >> (b & 63)},
    {"+": lambda a, b: a + b, "-": lambda a, b: a - b},
    {"*": lambda a, b: a * b, "/": lambda a, b: _quotient(a, b), "%": lambda a, b: a - b * _quotient(a, b)},
)  # fmt: skip
_UNARY: dict[str, Callable[[int], int]] = {
    "!": lambda a: int(not a),
    "-": lambda a: -a,
    "+": lambda a: a,
    "~": lambda a: ~a,
}


def _quotient(a: int, b: int) -> int:
    """Divide, rounding toward zero; x / 0 is 0, since both sides of ``defined(A) && 1 / A`` are evaluated."""
    if not b:
        return 0
    return abs(a) // abs(b) * (1 if (a < 0) == (b < 0) else -1)


def holds(tokens: Sequence[Token], span: Span, *, knows_names: bool = False) -> bool:
    """Return the value of a condition with macros expanded.

    Remaining names are 0; if ``knows_names``, as in GLSL ES, they are an error unless && or || leaves them out.
    """
    reader = _Reader(tokens, span, knows_names)
    value = reader.binary(0)
    if reader.position < len(tokens):
        fail(tokens[reader.position].span, f"{tokens[reader.position].text!r} is not expected in a condition")
    return value != 0


class _Reader:
    def __init__(self, tokens: Sequence[Token], span: Span, knows_names: bool) -> None:
        self.tokens, self.span, self.position, self.depth = tokens, span, 0, 0
        self.knows_names = knows_names
        self.unneeded = 0  # operands of && and || around, which the left side makes unneeded

    def _text(self) -> str:
        return self.tokens[self.position].text if self.position < len(self.tokens) else ""

    def binary(self, level: int) -> int:
        if level == len(_BINARY):
            return self._unary()
        value = self.binary(level + 1)
        while (sign := self._text()) in _BINARY[level]:
            self.position += 1
            decided = (sign == "&&" and not value) or (sign == "||" and value != 0)
            self.unneeded += decided
            value = _wrapped(_BINARY[level][sign](value, self.binary(level + 1)))
            self.unneeded -= decided
        return value

    def _unary(self) -> int:
        if self.position == len(self.tokens):
            fail(self.span, "the condition ends too early")
        token = self.tokens[self.position]
        self.position += 1
        self.depth += 1
        if self.depth > MAX_DEPTH:
            fail(token.span, f"the condition nests deeper than {MAX_DEPTH}")
        if token.text in _UNARY:
            value = _wrapped(_UNARY[token.text](self._unary()))
        elif token.text == "(":
            value = self.binary(0)
            if self._text() != ")":
                fail(token.span, "this parenthesis is not closed")
            self.position += 1
        elif token.kind == "name":
            if self.knows_names and not self.unneeded:
                fail(
                    token.span, f"{token.text} is not defined, which is an error in GLSL ES; ask defined({token.text})"
                )
            value = 0
        else:
            value = _number(token)
        self.depth -= 1
        return value


def _number(token: Token) -> int:
    digits = token.text.rstrip("uU")
    if token.kind != "number" or not (digits.isdigit() or digits[:2] in ("0x", "0X")) or len(digits) > 24:
        fail(token.span, f"{token.text!r} is not a whole number")
    octal = digits.isdigit() and digits.startswith("0") and all(d in "01234567" for d in digits)
    return _wrapped(int(digits, 8 if octal else 10 if digits.isdigit() else 16))


def _wrapped(value: int) -> int:
    return (value + 2**63) % 2**64 - 2**63
