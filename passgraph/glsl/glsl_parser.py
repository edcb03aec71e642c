"""Parse tokens to the syntax tree: expressions, declarations, functions and statements."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Literal, NoReturn, TypeVar

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
    ["void", "bool", "int", "uint", "float", "double", "sampler2D", "sampler2DRect", "sampler1D", "sampler3D",
     "samplerCube", "sampler2DShadow", "sampler2DArray", "isampler2D", "usampler2D", "samplerExternalOES"]
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
    """Parse expressions; :class:`Parser` adds declarations and statements.

    ``dialect`` : the version whose rules are checked; None for text that passgraph itself writes
    """

    def __init__(self, tokens: Sequence[Token], file: str, dialect: Dialect | None = None) -> None:
        last = tokens[-1].span if tokens else Span(file, 1, 0, 1)
        end = Span(last.file, last.line, last.end_column, last.end_column + 1, last.text)
        self.tokens = [*tokens, Token("end", "the end of the text", end)]
        self.position, self.nested = 0, 0
        self.types = set(TYPES)  # structs are added
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
        fail(word.span, f"there is no type {word.text!r}{mending(word.text, self.types) or '; declare it before'}")

    def unexpected(self, expected: str) -> NoReturn:
        got = self.here.text if self.here.kind == "end" else repr(self.here.text)
        fail(self.here.span, f"{expected} is expected here, got {got}")

    def name(self, what: str) -> Token:
        if self.here.kind != "name":
            self.unexpected(what)
        return self.take()

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
        if token.text in self.types:
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


_QUALIFIERS = frozenset(
    ["const", "in", "out", "inout", "uniform", "varying", "attribute", "invariant", "highp", "mediump", "lowp"]
)
#: Keywords of later versions that are names in older shaders; as qualifiers they precede a name.
_NEWER = frozenset(
    ["centroid", "flat", "smooth", "noperspective", "precise", "buffer", "shared", "coherent", "volatile", "restrict",
     "readonly", "writeonly", "patch", "sample"]
)  # fmt: skip


#: Qualifiers of declarations outside of functions, which a variable inside of one cannot have.
_OUTER = frozenset(["uniform", "varying", "attribute", "buffer", "shared"])
_PASSED = frozenset(["in", "out", "inout"])
_PRECISIONS = frozenset(["highp", "mediump", "lowp"])


class Parser(ExpressionParser):
    """Parse a whole shader."""

    loops = switches = 0  # that enclose the statement being parsed
    is_void = True  # the function being parsed

    def shader(self) -> list[g.Outer]:
        """Parse the declarations and functions of a shader, in order."""
        declarations: list[g.Outer] = []
        while self.here.kind != "end":
            if self.skip(";"):
                continue
            if self.at("precision"):
                self._precision()
            else:
                declarations += self._outer()
        return declarations

    def _precision(self) -> None:
        """Skip ``precision mediump float;``, since floats have 32 bits."""
        while not self.at(";") and self.here.kind == "name":
            self.take()
        self.expect(";")

    def _outer(self) -> list[g.Outer]:
        start = self.here.span
        qualifiers, layout = self._qualifiers()
        if self.skip(";"):  # layout(…) in;
            return []
        if self.here.kind == "name" and self.ahead().text == "{" and self.here.text != "struct":
            return [self._interface(start, qualifiers)]
        if "invariant" in qualifiers and self.here.text not in self.types and self.ahead().text == ";":
            self.take()
            self.take()
            return []
        structs: list[g.Outer] = []
        type_ = self._type(structs)
        if self.skip(";"):
            return structs
        if self.here.kind == "name" and self.ahead().text == "(":
            self._check_qualifiers(start, qualifiers, _OUTER | _PASSED, "the result of a function")
            if self.dialect is not None and "sampler" in type_.name:
                fail(type_.span, "a function cannot return a sampler; pass it as a parameter")
            return [*structs, self._function(start, type_)]
        return [*structs, self._declaration(start, qualifiers, layout, type_)]

    def _qualifiers(self) -> tuple[frozenset[str], dict[str, int]]:
        qualifiers: set[str] = set()
        layout: dict[str, int] = {}
        while self._at_qualifier():
            if self.at("layout"):
                layout |= self._layout()
            else:
                self._check_stage()
                qualifiers.add(self.take().text)
        return frozenset(qualifiers), layout

    def _check_qualifiers(self, span: Span, qualifiers: frozenset[str], forbidden: frozenset[str], what: str) -> None:
        """Raise KernelError for qualifiers that do not belong to ``what``."""
        if self.dialect is not None and qualifiers & forbidden:
            fail(span, f"{what} cannot be {' '.join(sorted(qualifiers & forbidden))}; leave that out")

    def _at_qualifier(self) -> bool:
        text, following = self.here.text, self.ahead()
        if text == "layout":
            return following.text == "("
        return text in _QUALIFIERS or (text in _NEWER and following.kind == "name")

    def _layout(self) -> dict[str, int]:
        self.take()
        self.expect("(")
        numbers: dict[str, int] = {}
        while not self.skip(")"):
            if not self.at("shared"):  # a layout of blocks, besides a qualifier of compute shaders
                self._check_stage()
            name = self.name("the name of a layout").text
            numbers[name] = 0
            if self.skip("="):
                value = self.take()
                if not value.text.isdigit() or len(value.text) > 6:
                    fail(value.span, "a layout takes a whole number here")
                numbers[name] = int(value.text)
            if not self.at(")"):
                self.expect(",")
        return numbers

    def _check_stage(self) -> None:
        """Raise KernelError for a word of another stage."""
        reason = elsewhere(self.here.text)
        if reason is not None:
            fail(self.here.span, reason)

    def _type(self, structs: list[g.Outer]) -> g.TypeName:
        """Parse a type; a struct that it declares is added to ``structs``."""
        if self.at("struct"):
            struct = self._struct()
            structs.append(struct)
            return g.TypeName(struct.span, struct.name, self.lengths())
        if self.here.text not in self.types:
            self._check_stage()
            if mending(self.here.text, self.types):
                self.no_type(self.here)
            self.unexpected("a type")
        token = self.take()
        return g.TypeName(token.span, token.text, self.lengths())

    def _struct(self) -> g.Struct:
        span = self.take().span
        if self.here.kind == "name":
            span, name = self.here.span, self.declared_name("the name of a struct").text
        else:
            name = f"struct {self.position}"
        fields = self._fields(_OUTER | _PASSED | {"const", "centroid", "smooth", "flat", "noperspective"})
        self.types.add(name)
        return g.Struct(span, name, fields)

    def _fields(self, forbidden: frozenset[str] = frozenset()) -> tuple[g.Variable, ...]:
        self.expect("{")
        fields: list[g.Variable] = []
        while not self.skip("}"):
            start = self.here.span
            qualifiers, layout = self._qualifiers()
            self._check_qualifiers(start, qualifiers, forbidden, "a field of a struct")
            inner: list[g.Outer] = []
            type_ = self._type(inner)
            if inner:
                fail(inner[0].span, "a struct within a struct is declared before it")
            fields += self._declaration(start, qualifiers, layout, type_).variables
        return tuple(fields)

    def _interface(self, start: Span, qualifiers: frozenset[str]) -> g.Interface:
        name = self.declared_name("the name of a block").text
        fields = self._fields()
        instance = self.declared_name("the name of a block").text if self.here.kind == "name" else ""
        lengths = self.lengths() if instance else ()
        self.expect(";")
        return g.Interface(start, qualifiers, name, fields, instance, lengths)

    # Functions

    def _function(self, start: Span, result: g.TypeName) -> g.Function:
        name = self.declared_name("the name of a function")
        if self.dialect is not None and name.text == "main" and (result.name != "void" or result.lengths):
            fail(result.span, "main returns nothing; write void main()")
        self.expect("(")
        parameters: list[g.Parameter] = []
        if self.at("void") and self.ahead().text == ")":
            self.take()
        while not self.skip(")"):
            parameters.append(self._parameter())
            if not self.at(")"):
                self.expect(",")
        self.is_void = result.name == "void" and not result.lengths
        body = None if self.skip(";") else self.block()
        return g.Function(name.span, name.text, result, tuple(parameters), body)

    def _parameter(self) -> g.Parameter:
        start = self.position
        qualifiers, _ = self._qualifiers()
        self._check_qualifiers(self.tokens[start].span, qualifiers, _OUTER, "a parameter")
        self._check_order(self.tokens[start : self.position])
        if self.here.text not in self.types:
            self.unexpected("the type of a parameter")
        token = self.take()
        lengths = self.lengths()
        is_named = self.here.kind == "name"
        name = self.declared_name("the name of a parameter") if is_named else Token("name", "", token.span)
        type_ = g.TypeName(token.span, token.text, (*self.lengths(), *lengths))
        passed: Literal["in", "out", "inout"] = "in"
        if "inout" in qualifiers or {"in", "out"} <= qualifiers:
            passed = "inout"
        elif "out" in qualifiers:
            passed = "out"
        if self.dialect is not None and passed != "in" and "sampler" in type_.name:
            fail(name.span, f"a sampler cannot be {passed}; leave that out")
        return g.Parameter(name.span, name.text, type_, passed, "const" in qualifiers)

    def _check_order(self, qualifiers: Sequence[Token]) -> None:
        """Raise KernelError for qualifiers of a parameter in another order than older versions allow."""
        if self.dialect is None or not self.dialect.has_ordered_qualifiers:
            return
        ranks = [0 if token.text == "const" else 1 if token.text in _PASSED else 2 for token in qualifiers]
        for token, rank, before in zip(qualifiers[1:], ranks[1:], ranks, strict=False):
            if rank < before:
                fail(token.span, f"{token.text} comes earlier: const, then in or out, then precision")

    # Statements

    def block(self) -> g.Block:
        span = self.expect("{", "a block in braces").span
        self.enter()
        statements: list[g.Statement] = []
        while not self.skip("}"):
            if self.here.kind == "end":
                fail(span, "this brace is not closed")
            statements += self._statements()
        self.leave()
        return g.Block(span, tuple(statements))

    def _statements(self) -> list[g.Statement]:
        """Parse a statement: none for an empty one, two if it also declares a struct."""
        if self.skip(";"):
            return []
        if self.at("precision"):
            self._precision()
            return []
        if self._declares():
            start = self.here.span
            qualifiers, layout = self._qualifiers()
            self._check_qualifiers(start, qualifiers, _OUTER | _PASSED, "a variable inside of a function")
            structs: list[g.Outer] = []
            type_ = self._type(structs)
            declared = [struct for struct in structs if isinstance(struct, g.Struct)]
            if declared and self.skip(";"):
                return list(declared)
            return [*declared, self._declaration(start, qualifiers, layout, type_)]
        return [self._statement()]

    def _declares(self) -> bool:
        """Return True if a declaration begins here, not a constructor call."""
        if self._at_qualifier() or self.at("struct"):
            return True
        return self.here.text in self.types and (self.ahead().kind == "name" or self.ahead().text == "[")

    def _declaration(
        self, start: Span, qualifiers: frozenset[str], layout: dict[str, int], type_: g.TypeName
    ) -> g.Declaration:
        variables: list[g.Variable] = []
        while True:
            name = self.declared_name("the name of a variable")
            own = g.TypeName(type_.span, type_.name, (*self.lengths(), *type_.lengths))
            value = self._initial() if self.skip("=") else None
            variables.append(g.Variable(name.span, name.text, own, value))
            if not self.skip(","):
                break
        self.expect(";")
        return g.Declaration(start, qualifiers, tuple(variables), layout)

    def _initial(self) -> g.Expr:
        if not self.at("{"):
            return self.assignment()
        self.enter()
        span = self.take().span
        parts: list[g.Expr] = []
        while not self.skip("}"):
            parts.append(self._initial())
            if not self.at("}"):
                self.expect(",")
        self.leave()
        return self.node(g.Braces, span, tuple(parts))

    def _inner(self) -> g.Statement:
        """Parse the statement of an if or a loop."""
        self.enter()
        span = self.here.span
        statements = self._statements()
        self.leave()
        return (
            statements[0]
            if len(statements) == 1 and isinstance(statements[0], g.Block)
            else g.Block(span, tuple(statements))
        )

    def _statement(self) -> g.Statement:
        span = self.here.span
        if self.at("{"):
            return self.block()
        if self.skip("if"):
            condition, then = self._parenthesized(), self._inner()
            return g.If(span, condition, then, self._inner() if self.skip("else") else None)
        if self.skip("for"):
            return self._for(span)
        if self.skip("while"):
            return self._while(span)
        if self.skip("do"):
            body = self._looped()
            self.expect("while")
            condition = self._parenthesized()
            self.expect(";")
            return g.Loop(span, None, condition, None, body, late=True)
        if self.skip("switch"):
            return self._switch(span)
        if self.skip("return"):
            value = None if self.at(";") else self.expression()
            if value is None and not self.is_void:
                fail(span, "a function that is not void returns a value; write it after return")
            self.expect(";")
            return g.Return(span, value)
        for kind in ("break", "continue", "discard"):
            if self.skip(kind):
                if kind != "discard" and not self.loops + (self.switches if kind == "break" else 0):
                    fail(span, f"{kind} belongs inside a loop")
                self.expect(";")
                return g.Jump(span, kind)
        value = self.expression()
        self.expect(";")
        return g.Evaluate(span, value)

    def _looped(self) -> g.Statement:
        """Parse the statement of a loop."""
        self.loops += 1
        statement = self._inner()
        self.loops -= 1
        return statement

    def _parenthesized(self) -> g.Expr:
        self.expect("(")
        inside = self.expression()
        self.expect(")")
        return inside

    def _while(self, span: Span) -> g.Loop:
        """Parse a loop; a variable that its condition declares is set before each iteration, and ends it if false."""
        self.expect("(")
        if not self._declares():
            condition = self.expression()
            self.expect(")")
            return g.Loop(span, None, condition, None, self._looped())
        start = self.here.span
        qualifiers, _ = self._qualifiers()
        type_ = self._type([])
        name = self.declared_name("the name of a variable")
        self.expect("=")
        declared = g.Variable(name.span, name.text, type_, self.assignment())
        self.expect(")")
        ends = self.node(g.Unary, name.span, "!", self.node(g.Name, name.span, name.text))
        body: tuple[g.Statement, ...] = (
            g.Declaration(start, qualifiers, (declared,), {}),
            g.If(name.span, ends, g.Jump(name.span, "break"), None),
            self._looped(),
        )
        return g.Loop(span, None, None, None, g.Block(span, body))

    def _for(self, span: Span) -> g.Loop:
        self.expect("(")
        start = self._statements()
        condition = None if self.at(";") else self.expression()
        self.expect(";")
        update = None if self.at(")") else self.expression()
        self.expect(")")
        return g.Loop(span, start[0] if start else None, condition, update, self._looped())

    def _switch(self, span: Span) -> g.Switch:
        value = self._parenthesized()
        self.expect("{")
        self.enter()
        self.switches += 1
        cases: list[g.Case] = []
        while not self.skip("}"):
            label = self.here.span
            case_label = None
            if self.skip("case"):
                case_label = self.expression()
            else:
                self.expect("default", "case or default")
            self.expect(":")
            statements: list[g.Statement] = []
            while not self.at("case", "default", "}"):
                if self.here.kind == "end":
                    fail(span, "the brace of this switch is not closed")
                statements += self._statements()
            cases.append(g.Case(label, case_label, tuple(statements)))
        self.switches -= 1
        self.leave()
        return g.Switch(span, value, tuple(cases))
