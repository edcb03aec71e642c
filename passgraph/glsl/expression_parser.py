"""Parse tokens to the syntax tree: expressions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NoReturn, TypeVar

import numpy as np

from passgraph.glsl import syntax as g
from passgraph.glsl.dialect import REDECLARED, Dialect
from passgraph.glsl.elsewhere import elsewhere, mending
from passgraph.glsl.tokens import Token
from passgraph.language.meanings import int_of_bits
from passgraph.language.source import MAX_NESTING, Span, fail

E = TypeVar("E", bound=g.Node)

#: Built-in types. Samplers are pictures; unsupported ones raise an error where they are used.
TYPES = frozenset(
    ["void", "bool", "int", "uint", "float", "double", "samplerExternalOES", "gl_DepthRangeParameters"]
    + [f"{p}sampler{kind}" for p in ("", "i", "u") for kind in
       ("1D", "2D", "3D", "Cube", "2DRect", "1DArray", "2DArray", "CubeArray", "Buffer", "2DMS", "2DMSArray")]
    + [f"sampler{kind}Shadow" for kind in ("1D", "2D", "Cube", "2DRect", "1DArray", "2DArray", "CubeArray")]
    + [f"{p}vec{n}" for p in ("", "b", "i", "u", "d") for n in (2, 3, 4)]
    + [f"{p}mat{n}" for p in ("", "d") for n in (2, 3, 4)]
    + [f"{p}mat{n}x{m}" for p in ("", "d") for n in (2, 3, 4) for m in (2, 3, 4)]
)  # fmt: skip

_ASSIGNMENTS = frozenset(["=", "+=", "-=", "*=", "/=", "%=", "&=", "|=", "^=", "<<=", ">>="])
#: Operators from the loosest to the tightest.
_LEVELS = (("||",), ("^^",), ("&&",), ("|",), ("^",), ("&",), ("==", "!="), ("<", ">", "<=", ">="), ("<<", ">>"),
           ("+", "-"), ("*", "/", "%"))  # fmt: skip
_TIGHTNESS = {sign: level for level, signs in enumerate(_LEVELS) for sign in signs}


class ExpressionParser:
    """Parse expressions; `passgraph.glsl.glsl_parser.Parser` adds declarations and statements.

    ``dialect`` : the version whose rules are checked; None for text that passgraph itself writes
    """

    def __init__(self, tokens: Sequence[Token], file: str, dialect: Dialect | None = None) -> None:
        last = tokens[-1].span if tokens else Span(file, 1, 0, 1)
        end = Span(last.file, last.line, last.end_column, last.end_column + 1, last.text)
        self.tokens = [*tokens, Token("end", "the end of the text", end)]
        self.position, self.nested = 0, 0
        #: The names declared in each scope, innermost last: True for a struct, False for what hides one.
        self.scopes: list[dict[str, bool]] = [dict.fromkeys(TYPES, True)]
        self.dialect = dialect

    # Tokens

    @property
    def here(self) -> Token:
        return self.tokens[self.position]

    def ahead(self, count: int = 1) -> Token:
        return self.tokens[min(self.position + count, len(self.tokens) - 1)]

    def take(self) -> Token:
        token = self.here
        if token.kind != "end":
            self.position += 1
        return token

    def at(self, *texts: str) -> bool:
        return self.here.text in texts

    def skip(self, text: str) -> bool:
        if self.here.text == text:
            self.position += 1
            return True
        return False

    def expect(self, text: str, what: str = "") -> Token:
        if self.here.text != text:
            if text == ";":
                self._check_statement()
            self.unexpected(what or repr(text))
        return self.take()

    def _check_statement(self) -> None:
        """Raise if a statement begins with two names: the first is an unknown type."""
        before = [token.text for token in self.tokens[max(self.position - 2, 0) : self.position]]
        first = self.tokens[self.position - 1]
        if self.here.kind == first.kind == "name" and (len(before) < 2 or before[0] in (";", "{", "}", "(", ")")):
            self.no_type(first)

    def no_type(self, word: Token) -> NoReturn:
        near = mending(word.text, self._types()) or "; declare it before"
        fail(word.span, elsewhere(word.text) or f"there is no type {word.text!r}{near}")

    def unexpected(self, expected: str) -> NoReturn:
        got = self.here.text if self.here.kind == "end" else repr(self.here.text)
        fail(self.here.span, f"{expected} is expected here, got {got}")

    def name(self, what: str) -> Token:
        if self.here.kind != "name":
            self.unexpected(what)
        return self.take()

    def is_type(self, name: str) -> bool:
        """Return True for a built-in type, and for a struct that no variable hides."""
        return next((scope[name] for scope in reversed(self.scopes) if name in scope), False)

    def _types(self) -> list[str]:
        return [name for name in {name for scope in self.scopes for name in scope} if self.is_type(name)]

    def declared_name(self, what: str) -> Token:
        """Take a name that the text declares."""
        token = self.name(what)
        if self.dialect is None:
            return token
        if token.text in self.dialect.reserved:
            fail(token.span, f"{token.text!r} is a reserved word of {self.dialect.name}; choose another name")
        if token.text.startswith("gl_") and token.text not in REDECLARED:
            fail(token.span, f"{token.text!r}: names that begin with gl_ belong to GLSL; choose another name")
        return token

    def node(self, kind: type[E], span: Span, *parts: Any) -> E:
        """Create a node, one level deeper than the deepest expression in it."""
        depth = 0
        for part in parts:
            for node in part if isinstance(part, tuple) else (part,):
                depth = max(depth, getattr(node, "depth", 0))
        if depth >= MAX_NESTING:
            fail(span, f"expressions nest deeper than {MAX_NESTING}; give parts of this one names")
        return kind(span, depth + 1, *parts)

    def enter(self) -> None:
        self.nested += 1
        if self.nested > MAX_NESTING:
            fail(self.here.span, f"this nests deeper than {MAX_NESTING}")

    def leave(self) -> None:
        self.nested -= 1

    # Expressions

    def expression(self) -> g.Expr:
        """Parse an expression, with commas."""
        first = self.assignment()
        if not self.at(","):
            return first
        parts = [first]
        while self.skip(","):
            parts.append(self.assignment())
        return self.node(g.Sequence, _around(parts[0], parts[-1]), tuple(parts))

    def assignment(self) -> g.Expr:
        self.enter()
        target = self._choice()
        if self.here.text in _ASSIGNMENTS:
            sign = self._operator().text[:-1]
            value = self.assignment()
            target = self.node(g.Assignment, _around(target, value), sign, target, value)
        self.leave()
        return target

    def _choice(self) -> g.Expr:
        condition = self._binary(0)
        if not self.skip("?"):
            return condition
        self.enter()
        then = self.expression()
        self.expect(":")
        orelse = self.assignment()
        self.leave()
        return self.node(g.Choice, _around(condition, orelse), condition, then, orelse)

    def _binary(self, level: int) -> g.Expr:
        """Parse operators from a level on, by precedence climbing."""
        left = self._unary()
        while (tightness := _TIGHTNESS.get(self.here.text, -1)) >= level:
            sign = self._operator().text
            right = self._binary(tightness + 1)
            left = self.node(g.Binary, _around(left, right), sign, left, right)
        return left

    def _unary(self) -> g.Expr:
        token = self.here
        if token.text not in ("-", "+", "!", "~", "++", "--"):
            return self._postfix(self._primary())
        self.enter()
        self._operator()
        operand = self._unary()
        self.leave()
        span = _between(token.span, operand.span)
        if token.text in ("++", "--"):
            return self.node(g.Step, span, token.text[0], True, operand)
        return self.node(g.Unary, span, token.text, operand)

    def _operator(self) -> Token:
        token = self.take()
        if self.dialect is not None and self.dialect.lacks(token.text):
            fail(token.span, f"{self.dialect.name} has no operator {token.text}; begin with a newer #version")
        return token

    def _postfix(self, base: g.Expr) -> g.Expr:
        while self.at(".", "[", "++", "--"):
            token = self.take()
            if token.text == ".":
                name = self.name("a field or a swizzle")
                called = name.text == "length" and self.at("(") and self.ahead().text == ")"
                if called:
                    self.take()
                    self.take()
                span = _between(base.span, name.span)
                base = self.node(g.Member, span, base, "length()" if called else name.text)
            elif token.text == "[":
                index = self.expression()
                span = _between(base.span, self.expect("]").span)
                base = self.node(g.Subscript, span, base, index)
            else:
                base = self.node(g.Step, _between(base.span, token.span), token.text[0], False, base)
        return base

    def _primary(self) -> g.Expr:
        token = self.take()
        if token.kind == "number":
            return self._number(token)
        if token.text in ("true", "false"):
            return self.node(g.Number, token.span, "bool", token.text == "true")
        if token.text == "(":
            self.enter()
            inside = self.expression()
            self.leave()
            self.expect(")")
            return inside
        if token.kind != "name":
            self.position -= token.kind != "end"
            self.unexpected("an expression")
        if self.is_type(token.text):
            lengths = self.lengths()
            arguments, span = self.arguments(token)
            return self.node(g.Call, span, token.text, arguments, g.TypeName(token.span, token.text, lengths))
        if self.at("("):
            arguments, span = self.arguments(token)
            return self.node(g.Call, span, token.text, arguments, None)
        return self.node(g.Name, token.span, token.text)

    def arguments(self, name: Token) -> tuple[tuple[g.Expr, ...], Span]:
        """Parse the arguments of a call; return them and the span of the call."""
        self.expect("(")
        expressions: list[g.Expr] = []
        if self.at("void") and self.ahead().text == ")":
            self.take()
        if not self.at(")"):
            expressions.append(self.assignment())
            while self.skip(","):
                expressions.append(self.assignment())
        return tuple(expressions), _between(name.span, self.expect(")").span)

    def lengths(self) -> tuple[g.Expr | None, ...]:
        """Parse ``[3][]`` after a type or a name."""
        sizes: list[g.Expr | None] = []
        while self.skip("["):
            sizes.append(None if self.at("]") else self.expression())
            self.expect("]")
        return tuple(sizes)

    def _number(self, token: Token) -> g.Number:
        text = token.text.lower()
        if text.startswith("0x") or text.rstrip("u").isdigit():
            digits = text.rstrip("u")
            octal = digits.startswith("0") and digits.isdigit() and len(digits) > 1
            if octal and any(d in "89" for d in digits):
                fail(token.span, f"{token.text} begins with 0 and so is octal, which has no 8 and 9")
            base = 16 if digits.startswith("0x") else 8 if octal else 10
            value = int(digits, base) if len(digits) < 40 else 1 << 40
            if value >= 1 << 32:
                fail(token.span, f"{token.text} does not fit 32 bits")
            if text.endswith("u"):
                return self.node(g.Number, token.span, "uint", value)
            return self.node(g.Number, token.span, "int", int_of_bits(value))
        if text.rstrip("f").isdigit() and self.dialect is not None and not self.dialect.suffixes_whole_numbers:
            fail(token.span, f"{token.text} is no number of {self.dialect.name}; write {text.rstrip('f')}.0")
        with np.errstate(over="ignore"):
            single = float(np.float32(text.rstrip("lf")))
        if math.isinf(single):
            fail(token.span, f"{token.text} does not fit float32 (largest is 3.4e38)")
        return self.node(g.Number, token.span, "float", single)


def _between(start: Span, end: Span) -> Span:
    """Return the span from one span to another, or to the end of the first line."""
    if (start.file, start.line) != (end.file, end.line):
        return Span(start.file, start.line, start.column, max(len(start.text.rstrip()), start.end_column), start.text)
    return Span(start.file, start.line, start.column, max(end.end_column, start.end_column), start.text)


def _around(left: g.Expr, right: g.Expr) -> Span:
    return _between(left.span, right.span)
