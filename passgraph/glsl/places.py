"""Assignable places: a variable and the path to a part of it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from passgraph.glsl import syntax as g
from passgraph.glsl.operators import plain
from passgraph.glsl.unit import Slot
from passgraph.glsl.walk import walked
from passgraph.language import assignments, ir
from passgraph.language.assignments import read_variable
from passgraph.language.composites import entry
from passgraph.language.source import Span, fail
from passgraph.language.types import INT, Array, Matrix, Scalar, Struct, Type, Vector, is_plain
from passgraph.language.typing_rules import widen
from passgraph.language.values import (
    COMPOSITE,
    ArrayValue,
    Namer,
    Part,
    StructValue,
    check_index,
    index_into,
    part_type,
    swizzle,
    with_components,
)

if TYPE_CHECKING:
    from passgraph.glsl.glsl_body import Body

#: A path: fields and swizzles by name, elements by index.
Way: TypeAlias = tuple[str | ir.Expr, ...]


@dataclass(frozen=True, eq=False)
class Place:
    slot: Slot
    way: Way
    span: Span


def place_of(body: Body, node: g.Expr) -> Place:
    """Return the place of an assigned expression; indices in it are computed here, once."""
    if isinstance(node, g.Name):
        binding = body.lookup(node.name, node.span)
        if isinstance(binding, Slot):
            return Place(binding, (), node.span)
        fail(node.span, f"{node.name} is {binding.what} and cannot be assigned to")
    if isinstance(node, g.Member) and node.name != "length()":
        base = place_of(body, node.base)
        return Place(base.slot, (*base.way, node.name), node.span)
    if isinstance(node, g.Subscript):
        output = body.output_element(node)
        if output is not None:
            return Place(output, (), node.span)
        base = place_of(body, node.base)
        index = perhaps(body, body.expressions.index(node.index), node.index, _type_at(base))
        return Place(base.slot, (*base.way, body.builder.name_it(index, node.span, keep_locals=False)), node.span)
    fail(node.span, "this cannot be assigned to")


def _type_at(place: Place) -> Type | None:
    """Return the type of a place; None for an invalid path."""
    type_: Type | None = place.slot.variable.type
    for step in place.way:
        if isinstance(step, str):
            if isinstance(type_, Vector):
                type_ = Vector(type_.element, len(step)) if len(step) > 1 else None
            else:
                type_ = dict(type_.fields).get(step) if isinstance(type_, Struct) else None
        else:
            type_ = _elements(type_)[1]
    return type_


def _elements(type_: Type | None) -> tuple[int, Type | None]:
    """Return the number of elements that [] chooses from, and their type."""
    if isinstance(type_, Array):
        return type_.length, type_.element
    if isinstance(type_, Matrix):
        return type_.columns, type_.column
    return (type_.size, type_.element) if isinstance(type_, Vector) else (0, None)


def perhaps(body: Body, index: ir.Expr, node: g.Expr, type_: Type | None) -> ir.Expr:
    """Return a constant index out of range as one of unknown value, so that it is no error.

    Only for an index through names, such as an inlined call's parameters: a condition may rule it out at run time, and
    drivers accept such code.
    """
    builder, (count, _) = body.builder, _elements(type_)
    if not isinstance(index, ir.Literal) or 0 <= index.value < count or len(builder.blocks) == 1:
        return index
    if not any(isinstance(part, g.Name) for part in walked(node)):
        return index
    name = builder.fresh("i")
    builder.emit(ir.Assign(name, index, node.span))
    return ir.Local(INT, name, node.span)


def read_place(body: Body, place: Place) -> Part:
    """Read a place."""
    part = read_variable(place.slot.variable, place.span)
    for step in place.way:
        part = part_at(part, step, place.span, body.builder.name_it)
    return part


def part_at(part: Part, step: str | ir.Expr, span: Span, named: Namer) -> Part:
    """Return a field, swizzle or element of a value."""
    if isinstance(step, str):
        if isinstance(part, StructValue):
            if step not in part.fields:
                fail(span, f"{part.struct.name} has no field {step!r}; it has {', '.join(part.fields)}")
            return part.fields[step]
        base = plain(part, span, f"what .{step} is read from")
        if isinstance(base.type, Vector):
            return swizzle(base, step, span)
        if isinstance(base.type, Scalar) and re.fullmatch("x{1,4}|r{1,4}|s{1,4}", step):
            components = (named(base, span),) * len(step)
            return components[0] if len(step) == 1 else ir.Construct(Vector(base.type, len(step)), components, span)
        fail(span, f"{part_type(part)} has no field {step!r}")
    if isinstance(part, ArrayValue):
        return entry(part, step, span, named)
    return index_into(plain(part, span, "what [] is read from"), step, span)


def write_place(body: Body, place: Place, value: Part, what: str) -> None:
    """Assign to a place; for a part of a value, the whole value is replaced."""
    here, way, span = assignments.Place(place.slot.variable, place.slot.variable.type), place.way, place.span
    value_before = read_variable(here.variable, span)
    while way and (following := _entered(here, way[0], span)) is not None:
        value_before = part_at(value_before, way[0], span, body.builder.name_it)
        here, way = following, way[1:]
    if way and isinstance(value_before, COMPOSITE):
        part_at(value_before, way[0], span, body.builder.name_it)  # raises the error
    if way:
        value = _replaced(
            body, plain(value_before, span, "what is assigned to"), way, plain(value, span, "what is assigned"), span
        )
    body.unit.store_at(place.slot, here, value, span, what)


def _entered(place: assignments.Place, step: str | ir.Expr, span: Span) -> assignments.Place | None:
    """Return a field or entry that is a separate variable, or inside one; None for parts of plain values."""
    if isinstance(step, str):
        return place.field(step)
    if not isinstance(place.type, Array) or (place.indices == () and is_plain(place.type)):
        return None
    check_index(step, place.type.length, place.type, span)
    return place.entry(step)


def _replaced(body: Body, container: ir.Expr, way: Way, value: ir.Expr, span: Span) -> ir.Expr:
    """Return ``container`` with the part at the end of ``way`` replaced."""
    step, named = way[0], body.builder.name_it
    container = named(container, span)
    if len(way) > 1:
        inner = plain(part_at(container, step, span, named), span, "what is assigned to")
        value = _replaced(body, inner, way[1:], value, span)
    if isinstance(step, str):
        return with_components(step, container, value, span, named)
    element = index_into(container, step, span)
    return ir.Insert(
        container.type, container, widen(step, INT, span, "an index"), widen(value, element.type, span, "it"), span
    )
