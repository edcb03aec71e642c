"""Lower expressions of the syntax tree to typed expressions; side effects become statements, in order."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from passgraph.glsl import syntax as g
from passgraph.glsl.function_calls import Calls
from passgraph.glsl.operators import arithmetic, as_int, negated, plain, whole_numbers_alike
from passgraph.glsl.places import part_at, perhaps, place_of, read_place, write_place
from passgraph.glsl.unit import Slot
from passgraph.language import ir
from passgraph.language.assignments import Variable, new_variable, read_variable
from passgraph.language.source import fail
from passgraph.language.types import (
    BOOL,
    FLOAT,
    INT,
    UINT,
    Array,
    Matrix,
    Scalar,
    Struct,
    Type,
    Vector,
    element_of,
    shape_of,
)
from passgraph.language.typing_rules import apply, unify, widen
from passgraph.language.values import COMPOSITE, ImageValue, Part, TupleValue, choose, constant, part_type, type_of

if TYPE_CHECKING:
    from passgraph.glsl.glsl_body import Body


class Expressions:
    """Lower the expressions of a function."""

    def __init__(self, body: Body) -> None:
        self.body, self.calls = body, Calls(body)
        self._by_kind: dict[type[g.Node], Callable[[Any], Part | None]] = {
            g.Number: self._number, g.Name: self._name, g.Unary: self._unary, g.Step: self._step,
            g.Binary: self._binary, g.Choice: self._choice, g.Assignment: self._assignment, g.Call: self.calls.call,
            g.Member: self._member, g.Subscript: self._subscript, g.Sequence: self._sequence,
        }  # fmt: skip

    def part(self, node: g.Expr) -> Part:
        """Return the value of an expression; raise KernelError for a void one."""
        value = self.evaluate(node)
        if value is None:
            fail(node.span, "a void function gives no value")
        return value

    def evaluate(self, node: g.Expr) -> Part | None:
        """Return the value of an expression; None for a void call."""
        self.body.builder.count_expression(node.span)
        if isinstance(node, g.Braces):
            fail(node.span, "a list in braces stands behind a declaration only")
        return self._by_kind[type(node)](node)

    def effect(self, node: g.Expr) -> None:
        """Evaluate an expression for its side effects."""
        if isinstance(node, g.Sequence):
            for part in node.parts:
                self.effect(part)
        elif isinstance(node, g.Step):
            self._step(replace(node, before=True))
        else:
            self.evaluate(node)

    def value(self, node: g.Expr) -> ir.Expr:
        return plain(self.part(node), node.span, "a value here")

    def condition(self, node: g.Expr) -> ir.Expr:
        value = self.value(node)
        if value.type != BOOL:
            fail(node.span, f"a condition must be bool, got {value.type}; compare it with something")
        return constant(value)

    def index(self, node: g.Expr) -> ir.Expr:
        return widen(as_int(self.value(node), node.span), INT, node.span, "an index")

    def initial(self, node: g.Expr, type_: Type) -> Part:
        """Return the initial value of a declaration: an expression, or a list in braces."""
        if not isinstance(node, g.Braces):
            return self.part(node)
        if isinstance(type_, Struct):
            types = [t for _, t in type_.fields]
        elif isinstance(type_, Array):
            types = [type_.element] * type_.length
        elif isinstance(type_, Vector):
            types = [type_.element] * type_.size
        elif isinstance(type_, Matrix):
            types = [type_.column] * type_.columns
        else:
            fail(node.span, f"{type_} has no list in braces")
        if len(types) != len(node.parts):
            fail(node.span, f"{type_} takes {len(types)} values, got {len(node.parts)}")
        pairs = zip(node.parts, types, strict=True)
        parts = self.body.unit.ordered([partial(self.initial, part, type_) for part, type_ in pairs], node.span)
        return self.calls.composed(type_, parts, node.span)

    # Names and numbers

    def _number(self, node: g.Number) -> Part:
        type_ = {"int": INT, "uint": UINT, "float": FLOAT, "bool": BOOL}[node.type]
        return ir.Literal(type_, node.value, node.span, bits=node.type == "int" and node.value < 0)

    def _name(self, node: g.Name) -> Part:
        return self.body.read(node.name, node.span)

    def _member(self, node: g.Member) -> Part:
        if node.name == "length()":
            part = self.part(node.base)
            type_ = None if isinstance(part, TupleValue) else type_of(part)
            if not isinstance(type_, (Array, Vector, Matrix)):
                fail(node.span, f"{part_type(part)} has no length()")
            count = type_.length if isinstance(type_, Array) else shape_of(type_)[0]
            return ir.Literal(INT, count, node.span)
        variable = self._struct_variable(node.base)
        if variable is not None and node.name in variable.fields:
            return read_variable(variable.fields[node.name], node.span)
        return part_at(self.part(node.base), node.name, node.span, self.body.builder.name_it)

    def _struct_variable(self, node: g.Expr) -> Variable | None:
        """Return the variable of a struct, or of one in it, of which one field is read: the others are left alone."""
        variable = None
        if isinstance(node, g.Name):
            binding = self.body.find(node.name)
            variable = binding.variable if isinstance(binding, Slot) and binding.written else None
        elif isinstance(node, g.Member) and (outer := self._struct_variable(node.base)) is not None:
            variable = outer.fields.get(node.name)
        return variable if variable is not None and isinstance(variable.type, Struct) else None

    def _subscript(self, node: g.Subscript) -> Part:
        output = self.body.output_element(node)
        if output is not None:
            return read_variable(output.variable, node.span)
        base, index = self.body.unit.ordered([lambda: self.part(node.base), lambda: self.index(node.index)], node.span)
        index = perhaps(self.body, plain(index, node.span, "an index"), node.index, type_of(base))
        return part_at(base, index, node.span, self.body.builder.name_it)

    # Operators

    def _unary(self, node: g.Unary) -> Part:
        return negated(node.sign, self.value(node.operand), node.span, self.body.builder.name_it)

    def _binary(self, node: g.Binary) -> Part:
        if node.sign in ("&&", "||"):
            return self._link(node)
        left, right = self.body.unit.ordered([lambda: self.part(node.left), lambda: self.part(node.right)], node.span)
        return arithmetic(node.sign, left, right, node.span, self.body.builder.name_it)

    def _link(self, node: g.Binary) -> Part:
        """Evaluate ``&&`` or ``||``; a right side with statements runs only if the left one does not decide."""
        span, unit, builder = node.span, self.body.unit, self.body.builder
        left = self.condition(node.left)
        block, right = unit.captured(lambda: self.condition(node.right), span)
        if not block:
            return arithmetic(node.sign, left, right, span, builder.name_it)
        name = builder.fresh("t")
        builder.emit(ir.Assign(name, left, span))
        result = ir.Local(BOOL, name, span)
        needed = result if node.sign == "&&" else apply("logical_not", [result], span)
        builder.emit(ir.If(needed, (*block, ir.Assign(name, right, span)), (), span))
        return result

    def _choice(self, node: g.Choice) -> Part | None:
        span, unit, builder = node.span, self.body.unit, self.body.builder
        condition = self.condition(node.condition)
        if isinstance(condition, ir.Literal):
            return self._chosen(node.then, node.orelse) if condition.value else self._chosen(node.orelse, node.then)
        condition = builder.name_it(condition, span, keep_locals=False)
        then_block, then = unit.captured(lambda: self.evaluate(node.then), span)
        else_block, orelse = unit.captured(lambda: self.evaluate(node.orelse), span)
        if then is None and orelse is None:
            builder.emit(ir.If(condition, then_block, else_block, span))
            return None
        if then is None or orelse is None:
            fail(span, "both sides of ? : must have one type, got a void function on one of them")
        if not isinstance(then, COMPOSITE) and not isinstance(orelse, COMPOSITE):
            then, orelse = whole_numbers_alike([then, orelse], span)
            then, orelse = unify(then, orelse, span, "both sides of ? :")
        arrays = not isinstance(then, COMPOSITE) and isinstance(then.type, Array)
        if not (then_block or else_block or arrays):
            return choose(condition, then, orelse, span)
        if isinstance(then, (ImageValue, TupleValue)) or part_type(then) != part_type(orelse):
            fail(span, f"both sides of ? : must have one type, got {part_type(then)} and {part_type(orelse)}")
        type_ = type_of(then)
        result = new_variable(type_, builder.fresh("t"))
        stores = [
            builder.captured(partial(builder.store, result, part, span, "a side of ? :"), span)
            for part in (then, orelse)
        ]
        builder.emit(ir.If(condition, then_block + stores[0], else_block + stores[1], span))
        return read_variable(result, span)

    def _chosen(self, node: g.Expr, other: g.Expr) -> Part | None:
        """Return the side of ``? :`` that a constant selects.

        The other side is lowered only for its type, since shaders select between large variants.
        """
        switched = self.evaluate(node)
        if switched is None or isinstance(switched, COMPOSITE) or not isinstance(switched.type, (Scalar, Vector)):
            return switched
        if element_of(switched.type) not in (INT, UINT):
            return switched  # the other side cannot change its type
        _, unused = self.body.unit.captured(lambda: self.value(other), node.span)
        switched, unused = whole_numbers_alike([switched, unused], node.span)
        return unify(switched, unused, node.span, "both sides of ? :")[0]

    def _sequence(self, node: g.Sequence) -> Part | None:
        last: Part | None = None
        for part in node.parts:
            last = self.evaluate(part)
        return last

    # Assignments

    def _assignment(self, node: g.Assignment) -> Part:
        body, span = self.body, node.span
        place = place_of(body, node.target)
        if node.sign:
            before, value = body.unit.ordered([lambda: read_place(body, place), lambda: self.part(node.value)], span)
            part: Part = arithmetic(node.sign, before, value, span, body.builder.name_it)
        else:
            part = self.part(node.value)
        write_place(body, place, part, "what is assigned")
        return read_place(body, place)

    def _step(self, node: g.Step) -> Part:
        body, span = self.body, node.span
        place = place_of(body, node.target)
        before = plain(read_place(body, place), span, "what ++ counts")
        if not node.before:
            before = body.builder.name_it(before, span, keep_locals=False)
        if isinstance(before.type, Array) or element_of(before.type) is BOOL:
            fail(span, f"{node.sign}{node.sign} counts numbers, got {before.type}")
        one = ir.Literal(FLOAT, 1.0, span) if element_of(before.type) is FLOAT else ir.Literal(INT, 1, span)
        write_place(body, place, arithmetic(node.sign, before, one, span, body.builder.name_it), "it")
        return read_place(body, place) if node.before else before
