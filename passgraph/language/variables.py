"""Locals of a function: one name of the intermediate representation for each plain part."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import cast

from passgraph.language import ir
from passgraph.language.composites import array_part, nth, reads_plainly
from passgraph.language.source import Span
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
)
from passgraph.language.typing_rules import apply
from passgraph.language.values import Part, StructValue, TupleValue


@dataclass
class Variable:
    """A local: one IR name, or one variable a field for structs and arrays of structs."""

    type: Type
    name: str = ""
    fields: dict[str, Variable] = field(default_factory=dict)
    loop_index: bool = False


@dataclass(frozen=True)
class Place:
    """A variable, or an entry in its flat arrays: under the indices of the arrays around, outermost first."""

    variable: Variable
    type: Type
    #: Each with how many entries its array has.
    indices: tuple[tuple[ir.Expr, int], ...] = ()

    def field(self, name: str) -> Place | None:
        type_ = self.type.field_type(name) if isinstance(self.type, Struct) else None
        return None if type_ is None else Place(self.variable.fields[name], type_, self.indices)

    def entry(self, index: ir.Expr) -> Place:
        assert isinstance(self.type, Array)
        return Place(self.variable, self.type.element, (*self.indices, (index, self.type.length)))

    def index(self, span: Span) -> ir.Expr:
        """In a flat array; -1, where nothing is written, if one of the indices is out of its range."""
        first, *others = self.indices
        if not others and (isinstance(first[0], ir.Literal) or reads_plainly(self.type)):
            return first[0]
        place, inside = first[0], _inside(*first, span)
        for index, length in others:
            place = apply("add", [nth(place, length, 0, span), index], span)
            inside = apply("logical_and", [inside, _inside(index, length, span)], span)
        return ir.Select(INT, inside, place, _int(-1, span), span)


def _int(number: int, span: Span) -> ir.Expr:
    return ir.Literal(INT, number, span)


def _inside(index: ir.Expr, length: int, span: Span) -> ir.Expr:
    above = apply("greater_equal", [index, _int(0, span)], span)
    return apply("logical_and", [above, apply("less", [index, _int(length, span)], span)], span)


def new_variable(type_: Type, name: str) -> Variable:
    """A variable with one IR name for each plain part of its type."""
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
