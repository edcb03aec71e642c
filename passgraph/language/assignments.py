"""Variables of a function, and assignments to them, to several at once and to parts of values."""

from __future__ import annotations

import ast
from dataclasses import field
from typing import TYPE_CHECKING, cast

from passgraph.language import ir
from passgraph.language.composites import array_part, nth, reads_plainly
from passgraph.language.signature import annotation_type
from passgraph.language.source import Span, fail
from passgraph.language.types import (
    INT,
    Array,
    Matrix,
    Scalar,
    Struct,
    TupleType,
    Type,
    Value,
    Vector,
    component_count,
    element_of,
    flat_type,
    image_names,
    is_plain,
)
from passgraph.language.typing_rules import apply, widen
from passgraph.language.values import (
    COMPOSITE,
    ArrayValue,
    Part,
    StructValue,
    TupleValue,
    check_index,
    coerce,
    index_into,
    part_type,
    type_of,
    with_components,
)
from passgraph.records import dataclass

if TYPE_CHECKING:
    from passgraph.language.function_body import Frame


@dataclass
class Variable:
    """A local variable: one IR name, or one variable per field for structs and arrays of structs."""

    type: Type
    name: str = ""
    fields: dict[str, Variable] = field(default_factory=dict)
    loop_index: bool = False


@dataclass(frozen=True)
class Place:
    """A variable, or an entry in its flat arrays, given by the indices of the enclosing arrays, outermost first."""

    variable: Variable
    type: Type
    #: Each with the length of its array.
    indices: tuple[tuple[ir.Expr, int], ...] = ()

    def field(self, name: str) -> Place | None:
        type_ = self.type.field_type(name) if isinstance(self.type, Struct) else None
        return None if type_ is None else Place(self.variable.fields[name], type_, self.indices)

    def entry(self, index: ir.Expr) -> Place:
        assert isinstance(self.type, Array)
        return Place(self.variable, self.type.element, (*self.indices, (index, self.type.length)))

    def index(self, span: Span) -> ir.Expr:
        """Return the index in a flat array; -1, which writes nothing, if one of the indices is out of range."""
        first, *more_indices = self.indices
        if not more_indices and (isinstance(first[0], ir.Literal) or reads_plainly(self.type)):
            return first[0]
        place, inside = first[0], _inside(*first, span)
        for index, length in more_indices:
            place = apply("add", [nth(place, length, 0, span), index], span)
            inside = apply("logical_and", [inside, _inside(index, length, span)], span)
        return ir.Select(INT, inside, place, _int(-1, span), span)


def _int(number: int, span: Span) -> ir.Expr:
    return ir.Literal(INT, number, span)


def _inside(index: ir.Expr, length: int, span: Span) -> ir.Expr:
    above = apply("greater_equal", [index, _int(0, span)], span)
    return apply("logical_and", [above, apply("less", [index, _int(length, span)], span)], span)


def new_variable(type_: Type, name: str) -> Variable:
    """Return a variable with one IR name for each plain part of its type."""
    if isinstance(type_, Struct):
        return Variable(type_, name, {n: new_variable(t, f"{name}.{n}") for n, t in type_.fields})
    if isinstance(type_, TupleType):
        members = {str(i): new_variable(t, f"{name}.{i}") for i, t in enumerate(type_.members)}
        return Variable(type_, name, members)
    if isinstance(type_, Array) and isinstance((flat := flat_type(type_)).element, Struct):
        fields = flat.element.fields
        entries = {n: new_variable(Array(cast("Value", t), flat.length), f"{name}.{n}") for n, t in fields}
        return Variable(type_, name, entries)
    return Variable(type_, name)


def read_variable(variable: Variable, span: Span) -> Part:
    if isinstance(variable.type, Struct):
        fields = {name: read_variable(part, span) for name, part in variable.fields.items()}
        return StructValue(variable.type, fields)
    if isinstance(variable.type, TupleType):
        return TupleValue(tuple(read_variable(part, span) for part in variable.fields.values()))
    if isinstance(variable.type, Array):
        return array_part(variable.type, lambda name, flat: ir.Local(flat, name, span), variable.name)
    return ir.Local(cast("Value", variable.type), variable.name, span)


def zero_of(type_: Type) -> ir.Expr:
    if isinstance(type_, Scalar):
        return ir.Literal(type_, {"bool": False, "int": 0, "uint": 0, "float": 0.0}[type_.name])
    if isinstance(type_, Array):
        type_ = flat_type(type_)
    assert isinstance(type_, (Vector, Matrix, Array))
    zero = zero_of(element_of(type_))
    return ir.Construct(type_, (zero,) * component_count(type_))


class Assignments:
    """Parses the assignments of one function body."""

    def __init__(self, frame: Frame) -> None:
        self.frame = frame

    def statement(self, node: ast.Assign | ast.AugAssign | ast.AnnAssign, span: Span) -> None:
        expressions = self.frame.expressions
        if isinstance(node, ast.AnnAssign):
            self._annotated(node, span)
        elif isinstance(node, ast.AugAssign):
            load = ast.copy_location(ast.BinOp(_as_load(node.target), node.op, node.value), node)
            self.assign(node.target, expressions.part(load), span)
        else:
            if len(node.targets) != 1:
                fail(span, "one assignment a line: a = b = c is not in the kernel language")
            self.assign(node.targets[0], expressions.part(node.value), span)

    def _annotated(self, node: ast.AnnAssign, span: Span) -> None:
        frame = self.frame
        type_, const = annotation_type(node.annotation, frame.scope, frame.source)
        if const or isinstance(type_, TupleType) or image_names(type_, ""):
            fail(span, "a variable is a scalar, vector, matrix, array or struct")
        if not isinstance(node.target, ast.Name) or node.value is None:
            fail(span, "a typed variable is written name: type = value")
        value = coerce(frame.expressions.part(node.value), type_, span, node.target.id)
        self.assign(node.target, value, span)

    def assign(self, target: ast.expr, part: Part, span: Span) -> None:
        if isinstance(target, ast.Name):
            self._name(target.id, part, span)
        elif isinstance(target, (ast.Tuple, ast.List)):
            if not isinstance(part, TupleValue) or len(part.members) != len(target.elts):
                fail(span, f"cannot unpack {part_type(part)} into {len(target.elts)} names")
            # All right-hand sides are computed before the first name changes.
            parts = [self.frame.name_part(m, span, keep_locals=False) for m in part.members]
            for element, member in zip(target.elts, parts, strict=True):
                self.assign(element, member, span)
        elif isinstance(target, (ast.Attribute, ast.Subscript)):
            self._part(target, part, span)
        else:
            fail(span, "this cannot be assigned to")

    def _name(self, name: str, part: Part, span: Span) -> None:
        frame = self.frame
        type_ = type_of(part)
        if image_names(type_, name):
            fail(span, "an Image cannot be given another name")
        variable = frame.variables.get(name)
        if variable is None:
            variable = new_variable(type_, frame.builder.fresh(name))
            frame.variables[name] = variable
        elif variable.loop_index:
            fail(span, f"{name!r} is a loop index and cannot be assigned to")
        frame.store(variable, part, span, repr(name))
        frame.assigned.add(name)

    def _part(self, target: ast.Attribute | ast.Subscript, part: Part, span: Span) -> None:
        """Assign to a part (``v.xy = …``, ``m[1] = …``, ``s.normal.x = …``): rebuild the whole with one part
        replaced."""
        frame, base_node = self.frame, target.value
        place = self._place(target)
        if place is not None:
            frame.store_at(place, part, span, ast.unparse(target))
            return
        if isinstance(base_node, ast.Name) and base_node.id not in frame.variables:
            fail(span, f"{base_node.id!r} is not a variable of this kernel and cannot be changed")
        base = frame.expressions.part(base_node)
        if isinstance(base, (StructValue, ArrayValue)):
            fail(span, f"{ast.unparse(target)} cannot be assigned to")
        if isinstance(base, COMPOSITE):
            fail(span, f"a kernel writes to its result, not to {part_type(base)}")
        if isinstance(part, COMPOSITE):
            fail(span, f"cannot assign {part_type(part)} to a part of a value")
        if not isinstance(base_node, (ast.Name, ast.Attribute, ast.Subscript)):
            fail(span, "only variables can be assigned to")
        self.assign(base_node, self._replaced(target, base, part, span), span)

    def _place(self, target: ast.expr) -> Place | None:
        """Return the place of ``name.field[index].field`` if that is a whole variable or an entry of a composite
        one."""
        if isinstance(target, ast.Name):
            variable = self.frame.variables.get(target.id) if target.id in self.frame.assigned else None
            return None if variable is None else Place(variable, variable.type)
        if not isinstance(target, (ast.Attribute, ast.Subscript)):
            return None
        base = self._place(target.value)
        if base is None:
            return None
        if isinstance(target, ast.Attribute):
            return base.field(target.attr)
        if not isinstance(base.type, Array) or (base.indices == () and is_plain(base.type)):
            return None
        span = self.frame.source.span(target)
        index = widen(self.frame.expressions.value(target.slice), INT, span, "an index")
        check_index(index, base.type.length, base.type, span)
        return base.entry(self.frame.name_it(index, span))

    def _replaced(self, target: ast.Attribute | ast.Subscript, base: ir.Expr, value: ir.Expr, span: Span) -> ir.Expr:
        frame = self.frame
        base = frame.name_it(base, span)
        if isinstance(target, ast.Attribute):
            return with_components(target.attr, base, value, span, frame.name_it)
        index = widen(frame.expressions.value(target.slice), INT, span, "an index")
        element = index_into(base, index, span)
        value = widen(value, element.type, span, ast.unparse(target))
        return ir.Insert(base.type, base, index, value, span)


def _as_load(target: ast.expr) -> ast.expr:
    """Return the same target as an expression to read."""
    if isinstance(target, ast.Name):
        return ast.copy_location(ast.Name(target.id, ast.Load()), target)
    if isinstance(target, ast.Attribute):
        return ast.copy_location(ast.Attribute(_as_load(target.value), target.attr, ast.Load()), target)
    if isinstance(target, ast.Subscript):
        return ast.copy_location(ast.Subscript(_as_load(target.value), target.slice, ast.Load()), target)
    return target
