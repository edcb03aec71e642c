"""Declarations, functions and statements of a shader: from tokens to the syntax tree."""

from __future__ import annotations

from typing import Literal

from passgraph.language.source import Span, fail
from passgraph.shaders.glsl import syntax as g
from passgraph.shaders.glsl.elsewhere import elsewhere, mending
from passgraph.shaders.glsl.parse_expressions import ExpressionParser
from passgraph.shaders.glsl.tokens import Token

_QUALIFIERS = frozenset(
    ["const", "in", "out", "inout", "uniform", "varying", "attribute", "invariant", "highp", "mediump", "lowp"]
)  # fmt: skip
#: Words that came later and are names in older shaders; as qualifiers they stand before a name.
_NEWER = frozenset(
    ["centroid", "flat", "smooth", "noperspective", "precise", "buffer", "shared", "coherent", "volatile", "restrict",
     "readonly", "writeonly", "patch", "sample"]
)  # fmt: skip


class Parser(ExpressionParser):
    """Reads a whole shader."""

    def shader(self) -> list[g.Outer]:
        """Everything outside of functions, in order."""
        found: list[g.Outer] = []
        while self.here.kind != "end":
            if self.skip(";"):
                continue
            if self.at("precision"):
                self._precision()
            else:
                found += self._outer()
        return found

    def _precision(self) -> None:
        """``precision mediump float;`` says nothing here: floats have 32 bits."""
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
        made: list[g.Outer] = []
        type_ = self._type(made)
        if self.skip(";"):
            return made
        if self.here.kind == "name" and self.ahead().text == "(":
            return [*made, self._function(start, type_)]
        return [*made, self._declaration(start, qualifiers, layout, type_)]

    def _qualifiers(self) -> tuple[frozenset[str], dict[str, int]]:
        found: set[str] = set()
        layout: dict[str, int] = {}
        while self._at_qualifier():
            if self.at("layout"):
                layout |= self._layout()
            else:
                self._check_stage()
                found.add(self.take().text)
        return frozenset(found), layout

    def _at_qualifier(self) -> bool:
        text, following = self.here.text, self.ahead()
        if text == "layout":
            return following.text == "("
        return text in _QUALIFIERS or (text in _NEWER and following.kind == "name")

    def _layout(self) -> dict[str, int]:
        self.take()
        self.expect("(")
        found: dict[str, int] = {}
        while not self.skip(")"):
            self._check_stage()
            name = self.name("the name of a layout").text
            found[name] = 0
            if self.skip("="):
                value = self.take()
                if not value.text.isdigit() or len(value.text) > 6:
                    fail(value.span, "a layout takes a whole number here")
                found[name] = int(value.text)
            if not self.at(")"):
                self.expect(",")
        return found

    def _check_stage(self) -> None:
        """Refuse a word of another stage."""
        reason = elsewhere(self.here.text)
        if reason is not None:
            fail(self.here.span, reason)

    def _type(self, structs: list[g.Outer]) -> g.TypeName:
        """A type; a struct that is declared on the way goes to ``structs``."""
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
            span, name = self.here.span, self.take().text
        else:
            name = f"struct {self.position}"
        fields = self._fields()
        self.types.add(name)
        return g.Struct(span, name, fields)

    def _fields(self) -> tuple[g.Variable, ...]:
        self.expect("{")
        found: list[g.Variable] = []
        while not self.skip("}"):
            start = self.here.span
            qualifiers, layout = self._qualifiers()
            inner: list[g.Outer] = []
            type_ = self._type(inner)
            if inner:
                fail(inner[0].span, "a struct within a struct is declared before it")
            found += self._declaration(start, qualifiers, layout, type_).variables
        return tuple(found)

    def _interface(self, start: Span, qualifiers: frozenset[str]) -> g.Interface:
        name = self.take().text
        fields = self._fields()
        instance = self.take().text if self.here.kind == "name" else ""
        self.lengths()
        self.expect(";")
        return g.Interface(start, qualifiers, name, fields, instance)

    # Functions

    def _function(self, start: Span, result: g.TypeName) -> g.Function:
        name = self.take()
        self.expect("(")
        parameters: list[g.Parameter] = []
        if self.at("void") and self.ahead().text == ")":
            self.take()
        while not self.skip(")"):
            parameters.append(self._parameter())
            if not self.at(")"):
                self.expect(",")
        body = None if self.skip(";") else self.block()
        return g.Function(name.span, name.text, result, tuple(parameters), body)

    def _parameter(self) -> g.Parameter:
        qualifiers, _ = self._qualifiers()
        if self.here.text not in self.types:
            self.unexpected("the type of a parameter")
        token = self.take()
        lengths = self.lengths()
        name = self.take() if self.here.kind == "name" else Token("name", "", token.span)
        type_ = g.TypeName(token.span, token.text, (*self.lengths(), *lengths))
        passed: Literal["in", "out", "inout"] = "in"
        if "inout" in qualifiers or {"in", "out"} <= qualifiers:
            passed = "inout"
        elif "out" in qualifiers:
            passed = "out"
        return g.Parameter(name.span, name.text, type_, passed)

    # Statements

    def block(self) -> g.Block:
        span = self.expect("{", "a block in braces").span
        self.enter()
        found: list[g.Statement] = []
        while not self.skip("}"):
            if self.here.kind == "end":
                fail(span, "this brace is not closed")
            found += self._statements()
        self.leave()
        return g.Block(span, tuple(found))

    def _statements(self) -> list[g.Statement]:
        """One statement; none for an empty one, two where a struct is declared on the way."""
        if self.skip(";"):
            return []
        if self.at("precision"):
            self._precision()
            return []
        if self._declares():
            start = self.here.span
            qualifiers, layout = self._qualifiers()
            structs: list[g.Outer] = []
            type_ = self._type(structs)
            made = [struct for struct in structs if isinstance(struct, g.Struct)]
            if made and self.skip(";"):
                return list(made)
            return [*made, self._declaration(start, qualifiers, layout, type_)]
        return [self._statement()]

    def _declares(self) -> bool:
        """Whether a declaration begins here, not a constructor's call."""
        if self._at_qualifier() or self.at("struct"):
            return True
        return self.here.text in self.types and (self.ahead().kind == "name" or self.ahead().text == "[")

    def _declaration(
        self, start: Span, qualifiers: frozenset[str], layout: dict[str, int], type_: g.TypeName
    ) -> g.Declaration:
        variables: list[g.Variable] = []
        while True:
            name = self.name("the name of a variable")
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
        return self.made(g.Braces, span, tuple(parts))

    def _inner(self) -> g.Statement:
        """The statement behind an if or a loop."""
        self.enter()
        span = self.here.span
        found = self._statements()
        self.leave()
        return found[0] if len(found) == 1 and isinstance(found[0], g.Block) else g.Block(span, tuple(found))

    def _statement(self) -> g.Statement:
        span = self.here.span
        if self.at("{"):
            return self.block()
        if self.skip("if"):
            self.expect("(")
            condition = self.expression()
            self.expect(")")
            then = self._inner()
            return g.If(span, condition, then, self._inner() if self.skip("else") else None)
        if self.skip("for"):
            return self._for(span)
        if self.skip("while"):
            self.expect("(")
            condition = self.expression()
            self.expect(")")
            return g.Loop(span, None, condition, None, self._inner())
        if self.skip("do"):
            body = self._inner()
            self.expect("while")
            self.expect("(")
            condition = self.expression()
            self.expect(")")
            self.expect(";")
            return g.Loop(span, None, condition, None, body, late=True)
        if self.skip("switch"):
            return self._switch(span)
        if self.skip("return"):
            value = None if self.at(";") else self.expression()
            self.expect(";")
            return g.Return(span, value)
        for kind in ("break", "continue", "discard"):
            if self.skip(kind):
                self.expect(";")
                return g.Jump(span, kind)
        value = self.expression()
        self.expect(";")
        return g.Evaluate(span, value)

    def _for(self, span: Span) -> g.Loop:
        self.expect("(")
        start = self._statements()
        condition = None if self.at(";") else self.expression()
        self.expect(";")
        update = None if self.at(")") else self.expression()
        self.expect(")")
        return g.Loop(span, start[0] if start else None, condition, update, self._inner())

    def _switch(self, span: Span) -> g.Switch:
        self.expect("(")
        value = self.expression()
        self.expect(")")
        self.expect("{")
        self.enter()
        cases: list[g.Case] = []
        while not self.skip("}"):
            label = self.here.span
            wanted = None
            if self.skip("case"):
                wanted = self.expression()
            else:
                self.expect("default", "case or default")
            self.expect(":")
            found: list[g.Statement] = []
            while not self.at("case", "default", "}"):
                if self.here.kind == "end":
                    fail(span, "the brace of this switch is not closed")
                found += self._statements()
            cases.append(g.Case(label, wanted, tuple(found)))
        self.leave()
        return g.Switch(span, value, tuple(cases))
