"""A function body being lowered: its names, variables, calls and exit."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from functools import partial
from itertools import chain

from passgraph.errors import KernelError, KernelLengthError, UnsupportedGlslError
from passgraph.glsl import syntax as g
from passgraph.glsl.builtins import overloads
from passgraph.glsl.elsewhere import elsewhere, mending
from passgraph.glsl.glsl_expressions import Expressions
from passgraph.glsl.glsl_statements import Statements
from passgraph.glsl.operators import fitted
from passgraph.glsl.places import Place, read_place, write_place
from passgraph.glsl.stage_values import STAGE
from passgraph.glsl.unit import BEFORE, END, Binding, Known, Slot, Unit, holds_pictures
from passgraph.glsl.walk import assigned_names, is_open, leaves_function, sides_written
from passgraph.language import ir
from passgraph.language.assignments import new_variable, read_variable
from passgraph.language.composites import mapped
from passgraph.language.function_body import MAX_CALL_DEPTH
from passgraph.language.long_arrays import check_local
from passgraph.language.signature import checked_struct
from passgraph.language.source import Span, fail
from passgraph.language.statements import Exit
from passgraph.language.types import INT, Struct, Type, part_count, sides_of
from passgraph.language.values import ArrayValue, Part, StructValue, TupleValue, constant, folded, type_of

#: Length of ``gl_FragData``.
_MAX_OUTPUTS = 8


class Body:
    """A function being lowered, or the declarations outside of functions."""

    def __init__(self, unit: Unit, name: str = "shader", result: Type | None = None, place: int = END) -> None:
        self.unit, self.builder, self.name, self.result_type = unit, unit.builder, name, result
        #: The place among the declarations of the shader, up to which names are visible.
        self.place = place
        self.scopes: list[dict[str, Binding]] = []
        #: Depths of scopes in the head of a function or loop, which its block shares.
        self.heads: set[int] = set()
        self.expressions, self.statements = Expressions(self), Statements(self)
        self.result = None if result is None else new_variable(result, self.builder.fresh(f"{name}.result"))
        self.exit = Exit(self.builder, name)

    # Names

    def find(self, name: str) -> Binding | None:
        for scope in reversed(self.scopes):
            if name in scope:
                return scope[name]
        for place, binding in reversed(self.unit.bound_at.get(name, ())):
            if place <= self.place:
                self.unit.used.add(name)
                return binding
        return None

    def lookup(self, name: str, span: Span) -> Slot | Known:
        """Return the value of a name."""
        value = self.find(name)
        assert not isinstance(value, Struct)  # the parser reads a struct's name as a type
        if value is None and name in self.unit.values:
            value = Known(Body(self.unit).expressions.part(self.unit.values[name]), "a value of the host")
        if value is None and name in STAGE:
            value = Known(STAGE[name](self.unit, span), "a value of the stage")
        if value is None and name in self.unit.missing:
            fail(span, self.unit.missing[name], UnsupportedGlslError)
        if value is None:
            if name in self.unit.functions:
                fail(span, f"{name!r} is not defined here; it is a function; call it")
            if name in self.unit.names:
                fail(span, f"{name!r} is used before its declaration; declare it before")
            suggestion = mending(name, (*chain(*self.scopes), *self.unit.names, *self.unit.values, *STAGE))
            reason = elsewhere(name)
            is_valid = reason is not None or name.startswith("gl_")
            reason = reason or f"{name!r} is not defined here{suggestion or '; declare it before'}"
            fail(span, reason, UnsupportedGlslError if is_valid else KernelError)
        return value

    def bind(self, name: str, binding: Binding) -> None:
        (self.scopes[-1] if self.scopes else self.unit.names)[name] = binding
        if not self.scopes:
            self.unit.bound_at.setdefault(name, []).append((self.place, binding))

    def read(self, name: str, span: Span) -> Part:
        binding = self.lookup(name, span)
        if isinstance(binding, Known):
            return binding.part
        if not binding.written:
            self.unit.note(span, f"{name} has no value here; it is 0, and drivers may give anything")
        self.builder.count_expression(span, part_count(binding.variable.type) - 1)
        return read_variable(binding.variable, span)

    def output_element(self, node: g.Subscript) -> Slot | None:
        """Return the variable of ``gl_FragData[0]``."""
        if not isinstance(node.base, g.Name) or node.base.name != "gl_FragData" or self.find("gl_FragData"):
            return None
        at = self.known_int(node.index, "the index of gl_FragData")
        if not 0 <= at < _MAX_OUTPUTS:
            fail(node.span, f"gl_FragData has {_MAX_OUTPUTS} elements")
        self.unit.used.add(f"gl_FragData[{at}]")
        slot = self.unit.names[f"gl_FragData[{at}]"]
        assert isinstance(slot, Slot)
        return slot

    def _check_new(self, name: str, span: Span) -> None:
        """Raise KernelError for a name that its scope has already; a block's scope includes parameters and counters."""
        head = self.scopes[-2] if len(self.scopes) - 1 in self.heads else {}
        before = self.scopes[-1].get(name, head.get(name)) if self.scopes else None
        if before is not None and not (isinstance(before, Slot) and before.is_open):
            fail(span, f"{name} is declared already in this scope; give it another name, or assign to it")

    # Types

    def type_of(self, written: g.TypeName, span: Span, sides: Sequence[int] = ()) -> Type:
        """Return a declared type; ``sides`` are the lengths of the initial value, for open ones."""
        struct = self.find(written.name)
        plain = struct if isinstance(struct, Struct) else self.unit.plain_type(written.name, span)
        return self.array_of(plain, written.lengths, span, sides)

    def array_of(self, type_: Type, lengths: Sequence[g.Expr | None], span: Span, sides: Sequence[int] = ()) -> Type:
        """Return an array of a type, or the type itself without lengths."""
        for level, length in reversed(list(enumerate(lengths))):
            if length is not None:
                count: int | None = self.known_int(length, "the length of an array")
            else:
                count = sides[level] if level < len(sides) else None
            type_ = self.unit.array_type(type_, count, span)
        return type_

    def _initialized(self, variable: g.Variable) -> tuple[Type, Part | None]:
        """Return the type of a declared variable and its initial value, from which open lengths are taken."""
        written, value = variable.type, variable.value
        if value is None or isinstance(value, g.Braces) or None not in written.lengths:
            sides = self.unit.open_length(variable) if value is None else sides_written(value)
            type_ = self.type_of(written, written.span, sides)
            return type_, None if value is None else self.expressions.initial(value, type_)
        part = self.expressions.part(value)
        return self.type_of(
            written, written.span, () if isinstance(part, TupleValue) else sides_of(type_of(part))
        ), part

    def known_int(self, node: g.Expr, what: str) -> int:
        value = self.expressions.value(node)
        numbers = folded(value)
        if numbers is None or value.type != INT:
            fail(node.span, f"{what} must be a whole number that is known here")
        return int(numbers[0])

    def declare_struct(self, node: g.Struct) -> None:
        """Declare a struct; its name is visible from here on."""
        for field in node.fields:
            if field.type.name in ("sampler1D", "sampler2DRect"):
                fail(field.type.span, f"a {field.type.name} is a uniform or a parameter here, no field")
        fields = tuple((v.name, self.type_of(v.type, v.type.span)) for v in node.fields)
        self._check_new(node.name, node.span)
        self.bind(node.name, checked_struct(Struct(node.name, fields), node.span))

    # Variables

    def declare(self, node: g.Declaration, written: Collection[str] | None = None) -> None:
        """Declare variables of a function, or constants and variables outside.

        If the set of all ``written`` names is given, others with known values become constants.
        """
        for variable in node.variables:
            span = variable.span
            self._check_new(variable.name, span)
            type_, part = self._initialized(variable)
            if holds_pictures(type_):
                fail(span, "a sampler is a uniform or a parameter")
            check_local(type_, variable.name, span)
            if part is not None:
                part = fitted(part, type_, span, variable.name)
            fixed = written is not None and variable.name not in written
            is_constant = fixed and isinstance(part, ir.Expr) and folded(part) is not None
            if "const" in node.qualifiers or is_constant:
                if part is None:
                    fail(span, f"const {variable.name} needs a value")
                self.bind(variable.name, Known(self._kept(part, span), "const"))
                continue
            slot = self.new_slot(variable.name, type_, written=part is not None)
            slot.is_open = is_open(variable)
            if part is None:
                self.builder.clear(slot.variable)
            else:
                self.builder.store(slot.variable, part, span, variable.name)
            self.bind(variable.name, slot)

    def new_slot(self, name: str, type_: Type, *, written: bool) -> Slot:
        return self.unit.slot(new_variable(type_, self.builder.fresh(name)), written=written)

    def _kept(self, part: Part, span: Span) -> Part:
        """Name a value that does not change; known numbers stay, since lengths of arrays and labels depend on them."""
        if isinstance(part, ir.Local):
            return self.builder.name_it(part, span, keep_locals=False)
        if isinstance(part, StructValue):
            return StructValue(part.struct, {name: self._kept(value, span) for name, value in part.fields.items()})
        if isinstance(part, ArrayValue):
            part = ArrayValue(part.type, mapped(part.parts, constant), part.first)
        elif isinstance(part, ir.Expr) and (known := constant(part)) is not part:
            return known
        return self.builder.name_part(part, span, keep_locals=False)

    # Calls

    def inline(self, function: g.Function, arguments: list[Part | Place], span: Span) -> Part | None:
        """Inline a call of a function and return its value; None for a void one."""
        if function.body is None:
            fail(span, f"{function.name} is declared but has no body")
        calls = self.builder.calls
        if function in calls:
            fail(span, f"{function.name} calls itself; GLSL has no recursion")
        if len(calls) >= MAX_CALL_DEPTH:
            fail(span, f"calls nest deeper than {MAX_CALL_DEPTH}", KernelLengthError)
        calls.append(function)
        self.unit.inlined.add(function)
        void = function.result.name == "void" and not function.result.lengths
        place = self.unit.defined_at.get(function, BEFORE)
        result = None if void else Body(self.unit, place=place).type_of(function.result, function.result.span)
        if result is not None:
            check_local(result, f"the result of {function.name}", function.result.span)
            if holds_pictures(result):
                fail(function.result.span, f"a function cannot return a sampler, got {result}; pass it as a parameter")
        inner = Body(self.unit, function.name, result, place)
        # In GLSL ES 1.00 the body is a scope of its own, whose names may hide parameters. glslang and the Khronos suite
        # read it so; WebGL and Mesa refuse it.
        inner.scopes, inner.heads = [{}], set() if self.unit.dialect.version == 100 else {1}
        written = assigned_names(function.body, partial(overloads, self.unit))
        types = self.signature(function)
        for parameter, argument, type_ in zip(function.parameters, arguments, types, strict=True):
            inner.take(parameter, type_, argument, span, fixed=parameter.is_const or parameter.name not in written)
        part = inner.run(function.body, span)
        calls.pop()
        for parameter, argument in zip(function.parameters, arguments, strict=True):
            if isinstance(argument, Place):
                slot = inner.scopes[0][parameter.name]
                assert isinstance(slot, Slot)
                write_place(self, argument, read_variable(slot.variable, span), parameter.name)
        return part

    def signature(self, function: g.Function) -> tuple[Type, ...]:
        """Return the types of a function's parameters, as names are where it is declared."""
        known = self.unit.signatures
        if function not in known:
            outside = Body(self.unit, place=self.unit.defined_at.get(function, BEFORE))
            known[function] = tuple(outside.type_of(one.type, one.type.span) for one in function.parameters)
        return known[function]

    def take(self, parameter: g.Parameter, type_: Type, argument: Part | Place, span: Span, *, fixed: bool) -> None:
        """Bind a parameter: copied in, and copied out at the end."""
        what = f"{self.name}({parameter.name})"
        if holds_pictures(type_):
            if parameter.passed != "in":
                fail(parameter.span, f"{what} holds a sampler, which cannot be {parameter.passed}; leave that out")
            self.bind(parameter.name, Known(fitted(argument, type_, span, what), "a sampler"))  # type: ignore[arg-type]
            return
        if not fixed or parameter.passed != "in":
            check_local(type_, what, span)
        if parameter.passed == "out":
            slot = self.new_slot(parameter.name, type_, written=False)
            self.builder.clear(slot.variable)
            self.bind(parameter.name, slot)
            return
        part = read_place(self, argument) if isinstance(argument, Place) else argument
        part = fitted(part, type_, span, what)
        if fixed and parameter.passed == "in":
            self.bind(parameter.name, Known(self._kept(part, span), "a parameter"))
            return
        slot = self.new_slot(parameter.name, type_, written=True)
        self.builder.store(slot.variable, part, span, what)
        self.bind(parameter.name, slot)

    def _value_at_end(self, block: g.Block) -> Part:
        """Return the value of a function whose only return is its last statement."""
        last = block.statements[-1]
        assert isinstance(last, g.Return)
        assert last.value is not None
        assert self.result_type is not None
        self.scopes.append({})
        self.statements.run(block.statements[:-1])
        part = fitted(self.expressions.part(last.value), self.result_type, last.span, f"the result of {self.name}")
        # Named where it is computed, since its operands may change before it is used.
        return self.builder.name_part(part, last.span, keep_locals=False)

    def run(self, block: g.Block, span: Span) -> Part | None:
        """Lower the statements of a function, and return its value."""
        if self.result is not None and self._ends_once(block):
            return self._value_at_end(block)
        self.exit.open(span)
        if self.result is not None:
            self.builder.clear(self.result)
        returned = self.statements.block(block.statements)
        if self.result is None:
            return None
        if not returned:
            self.unit.note(
                block.span, f"{self.name} may end without a value; it is 0 then, and drivers may give anything"
            )
        return read_variable(self.result, span)

    def _ends_once(self, block: g.Block) -> bool:
        """Return True if a function's only return is its last statement."""
        if not block.statements:
            return False
        *before, last = block.statements
        leaves = any(leaves_function(node, self.unit.leaving) for node in before)
        return isinstance(last, g.Return) and last.value is not None and not leaves
