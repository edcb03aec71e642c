"""Parse tokens to the syntax tree: declarations, functions and statements."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Literal

from passgraph.glsl import syntax as g
from passgraph.glsl.elsewhere import elsewhere, mending
from passgraph.glsl.expression_parser import ExpressionParser
from passgraph.glsl.tokens import Token
from passgraph.language.source import Span, fail

_QUALIFIERS = frozenset(
    ["const", "in", "out", "inout", "uniform", "varying", "attribute", "invariant", "highp", "mediump", "lowp"]
)
#: Keywords of later versions that are names in older shaders; as qualifiers they precede a name.
_NEWER = frozenset(
    ["centroid", "flat", "smooth", "noperspective", "precise", "buffer", "shared", "coherent", "volatile", "restrict",
     "readonly", "writeonly", "patch", "sample"]
)  # fmt: skip


_INTERPOLATED = frozenset(["centroid", "smooth", "flat", "noperspective"])
#: What layout(…) may say in a fragment shader, here or on some driver (GLSL 4.60, section 4.4).
_LAYOUTS = frozenset(
    ["location", "index", "component", "binding", "set", "offset", "align", "std140", "std430", "shared", "packed",
     "scalar", "row_major", "column_major", "push_constant", "constant_id", "input_attachment_index",
     "origin_upper_left", "pixel_center_integer", "early_fragment_tests", "depth_any", "depth_greater", "depth_less",
     "depth_unchanged", "bindless_sampler", "bound_sampler", "xfb_buffer", "xfb_offset", "xfb_stride"]
)  # fmt: skip
#: Formats of images, and equations of advanced blending.
_FORMATS = re.compile(r"r(g(ba)?)?(8|16|32|64)\w*|r11f_g11f_b10f|rgb10_a2(ui)?|blend_support_\w+")
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
        if "invariant" in qualifiers and not self.is_type(self.here.text) and self.ahead().text == ";":
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
            word = self.name("the name of a layout")
            name = word.text
            if self.dialect is not None and name not in _LAYOUTS and not _FORMATS.fullmatch(name):
                fail(word.span, f"there is no layout {name!r}{mending(name, _LAYOUTS) or '; leave it out'}")
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
            return self._array(struct.span, struct.name, self.lengths())
        if not self.is_type(self.here.text):
            self._check_stage()
            if mending(self.here.text, self._types()):
                self.no_type(self.here)
            self.unexpected("a type")
        token = self.take()
        return self._array(token.span, token.text, self.lengths())

    def _array(self, span: Span, name: str, lengths: tuple[g.Expr | None, ...]) -> g.TypeName:
        """Return a type; raise KernelError for an array of arrays in a version without them."""
        if len(lengths) > 1 and self.dialect is not None and not self.dialect.has_arrays_of_arrays:
            fail(span, f"{self.dialect.name} has no arrays of arrays; begin with a newer #version")
        return g.TypeName(span, name, lengths)

    def _struct(self) -> g.Struct:
        span = self.take().span
        if self.here.kind == "name":
            span, name = self.here.span, self.declared_name("the name of a struct").text
        else:
            name = f"struct {self.position}"
        fields = self._fields(_OUTER | _PASSED | _INTERPOLATED | {"const"}, "a field of a struct")
        if not fields:
            fail(span, f"struct {name} has no fields; give it one")
        self.scopes[-1][name] = True
        return g.Struct(span, name, fields)

    def _fields(self, forbidden: frozenset[str], what: str) -> tuple[g.Variable, ...]:
        self.expect("{")
        self.scopes.append({})  # names of fields hide no struct, not even in the fields behind them
        fields: list[g.Variable] = []
        while not self.skip("}"):
            start = self.here.span
            qualifiers, layout = self._qualifiers()
            self._check_qualifiers(start, qualifiers, forbidden, what)
            inner: list[g.Outer] = []
            type_ = self._type(inner)
            if inner:
                fail(inner[0].span, "a struct within a struct is declared before it")
            fields += self._declaration(start, qualifiers, layout, type_).variables
            self.scopes[-1].clear()
        self.scopes.pop()
        return tuple(fields)

    def _interface(self, start: Span, qualifiers: frozenset[str]) -> g.Interface:
        name = self.declared_name("the name of a block").text
        of_uniforms = bool(qualifiers & {"uniform", "buffer"})
        forbidden = _PASSED | _INTERPOLATED | {"const", "invariant"} if of_uniforms else frozenset[str]()
        self._check_qualifiers(start, qualifiers, forbidden, "a block of uniforms")
        fields = self._fields(forbidden, "a member of a block of uniforms")
        instance = self.declared_name("the name of a block").text if self.here.kind == "name" else ""
        lengths = self.lengths() if instance else ()
        if len(lengths) > 1 and self.dialect is not None and self.dialect.es:
            fail(start, f"{self.dialect.name} has no arrays of arrays of blocks, got {name}{'[]' * len(lengths)}")
        self.expect(";")
        return g.Interface(start, qualifiers, name, fields, instance, lengths)

    # Functions

    def _function(self, start: Span, result: g.TypeName) -> g.Function:
        name = self.declared_name("the name of a function")
        if self.dialect is not None and name.text == "main" and (result.name != "void" or result.lengths):
            fail(result.span, "main returns nothing; write void main()")
        self.expect("(")
        self.scopes.append({})
        parameters: list[g.Parameter] = []
        if self.at("void") and self.ahead().text == ")":
            self.take()
        while not self.skip(")"):
            parameters.append(self._parameter())
            if not self.at(")"):
                self.expect(",")
        self.is_void = result.name == "void" and not result.lengths
        body = None if self.skip(";") else self.block()
        self.scopes.pop()
        return g.Function(name.span, name.text, result, tuple(parameters), body)

    def _parameter(self) -> g.Parameter:
        start = self.position
        qualifiers, _ = self._qualifiers()
        self._check_qualifiers(self.tokens[start].span, qualifiers, _OUTER, "a parameter")
        self._check_order(self.tokens[start : self.position])
        if not self.is_type(self.here.text):
            self.unexpected("the type of a parameter")
        token = self.take()
        lengths = self.lengths()
        is_named = self.here.kind == "name"
        name = self.declared_name("the name of a parameter") if is_named else Token("name", "", token.span)
        type_ = self._array(token.span, token.text, (*self.lengths(), *lengths))
        passed: Literal["in", "out", "inout"] = "in"
        if "inout" in qualifiers or {"in", "out"} <= qualifiers:
            passed = "inout"
        elif "out" in qualifiers:
            passed = "out"
        if self.dialect is not None and passed != "in" and "sampler" in type_.name:
            fail(name.span, f"a sampler cannot be {passed}; leave that out")
        self.scopes[-1][name.text] = False
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
        self.scopes.append({})
        statements: list[g.Statement] = []
        while not self.skip("}"):
            if self.here.kind == "end":
                fail(span, "this brace is not closed")
            statements += self._statements()
        self.scopes.pop()
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
        return self.is_type(self.here.text) and (self.ahead().kind == "name" or self.ahead().text == "[")

    def _declaration(
        self, start: Span, qualifiers: frozenset[str], layout: dict[str, int], type_: g.TypeName
    ) -> g.Declaration:
        variables: list[g.Variable] = []
        while True:
            name = self.declared_name("the name of a variable")
            own = self._array(type_.span, type_.name, (*self.lengths(), *type_.lengths))
            value = self._initial() if self.skip("=") else None
            variables.append(g.Variable(name.span, name.text, own, value))
            self.scopes[-1][name.text] = False  # from here on, so that S S = S(1.0) calls the constructor
            if not self.skip(","):
                break
        self.expect(";")
        return g.Declaration(start, qualifiers, tuple(variables), layout)

    def _initial(self) -> g.Expr:
        if not self.at("{"):
            return self.assignment()
        if self.dialect is not None and not self.dialect.has_braces:
            fail(self.here.span, f"{self.dialect.name} has no lists in braces; write the array's constructor")
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
        self.scopes.append({})
        span = self.here.span
        statements = self._statements()
        self.scopes.pop()
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
        if (self.at("case") and self.ahead().kind in ("name", "number")) or (
            self.at("default") and self.ahead().text == ":"
        ):
            fail(span, f"a label stands in the block of a switch, got {self.here.text}; move it there")
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
        self.scopes.append({name.text: False})
        self.expect(")")
        ends = self.node(g.Unary, name.span, "!", self.node(g.Name, name.span, name.text))
        body: tuple[g.Statement, ...] = (
            g.Declaration(start, qualifiers, (declared,), {}),
            g.If(name.span, ends, g.Jump(name.span, "break"), None),
            self._looped(),
        )
        self.scopes.pop()
        return g.Loop(span, None, None, None, g.Block(span, body))

    def _for(self, span: Span) -> g.Loop:
        self.expect("(")
        self.scopes.append({})
        start = self._statements()
        condition = None if self.at(";") else self.expression()
        self.expect(";")
        update = None if self.at(")") else self.expression()
        self.expect(")")
        body = self._looped()
        self.scopes.pop()
        return g.Loop(span, start[0] if start else None, condition, update, body)

    def _switch(self, span: Span) -> g.Switch:
        value = self._parenthesized()
        self.expect("{")
        self.enter()
        self.switches += 1
        self.scopes.append({})
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
            if self.dialect is not None and self.at("}") and self.tokens[self.position - 1].text == ":":
                fail(label, "a switch ends with a statement, got a label; write break; behind it")
            cases.append(g.Case(label, case_label, tuple(statements)))
        self.switches -= 1
        self.scopes.pop()
        self.leave()
        return g.Switch(span, value, tuple(cases))
