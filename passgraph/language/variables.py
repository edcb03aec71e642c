"""Locals of a function: one name of the intermediate representation for each plain part."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import cast

from passgraph.language import ir
from passgraph.language.source import Span
from passgraph.language.types import (
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
)
from passgraph.language.values import Part, StructValue, TupleValue


@dataclass
class Variable:
    """A local: one IR name, or one variable a field for structs."""

    type: Type
    name: str = ""
    fields: dict[str, Variable] = field(default_factory=dict)
    loop_index: bool = False


def new_variable(type_: Type, name: str) -> Variable:
    """A variable with one IR name for each plain part of its type."""
    if isinstance(type_, Struct):
        return Variable(type_, name, {n: new_variable(t, f"{name}.{n}") for n, t in type_.fields})
    if isinstance(type_, TupleType):
        members = {str(i): new_variable(t, f"{name}.{i}") for i, t in enumerate(type_.members)}
        return Variable(type_, name, members)
    return Variable(type_, name)


def read_variable(variable: Variable, span: Span) -> Part:
    if isinstance(variable.type, Struct):
        fields = {name: read_variable(part, span) for name, part in variable.fields.items()}
        return StructValue(variable.type, fields)
    if isinstance(variable.type, TupleType):
        return TupleValue(tuple(read_variable(part, span) for part in variable.fields.values()))
    return ir.Local(cast("Value | Array", variable.type), variable.name, span)


def zero_of(type_: Type) -> ir.Expr:
    if isinstance(type_, Scalar):
        return ir.Literal(type_, {"bool": False, "int": 0, "uint": 0, "float": 0.0}[type_.name])
    assert isinstance(type_, (Vector, Matrix, Array))
    zero = zero_of(element_of(type_))
    return ir.Construct(type_, (zero,) * component_count(type_))
