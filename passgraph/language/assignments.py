"""Assignments: to names, to several names at once, and to parts of values."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

from passgraph.language import ir
from passgraph.language.signature import annotation_type
from passgraph.language.source import Span, fail
from passgraph.language.types import (
    INT,
    ImageType,
    Struct,
    TupleType,
    Type,
)
from passgraph.language.typing_rules import widen
from passgraph.language.values import (
    ImageValue,
    Part,
    StructValue,
    TupleValue,
    coerce,
    index_into,
    part_type,
    with_components,
)
from passgraph.language.variables import Variable, new_variable

if TYPE_CHECKING:
    from passgraph.language.frame import Frame


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
        if const or isinstance(type_, (ImageType, TupleType)):
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
        if holds_image(part):
            fail(span, "an Image cannot be given another name")
        variable = frame.variables.get(name)
        if variable is None:
            variable = new_variable(_type_of(part), frame.builder.fresh(name))
            frame.variables[name] = variable
        elif variable.loop_index:
            fail(span, f"{name!r} is a loop index and cannot be assigned to")
        frame.store(variable, part, span, repr(name))
        frame.assigned.add(name)

    def _part(self, target: ast.Attribute | ast.Subscript, part: Part, span: Span) -> None:
        """``v.xy = …``, ``m[1] = …``, ``s.normal.x = …``: the whole is rebuilt with one part replaced."""
        frame, base_node = self.frame, target.value
        variable = self._variable(target)
        if variable is not None:
            frame.store(variable, part, span, ast.unparse(target))
            return
        if isinstance(base_node, ast.Name) and base_node.id not in frame.variables:
            fail(span, f"{base_node.id!r} is not a variable of this kernel and cannot be changed")
        base = frame.expressions.part(base_node)
        if isinstance(base, StructValue):
            fail(span, f"{ast.unparse(target)} cannot be assigned to")
        if isinstance(base, (ImageValue, TupleValue)):
            fail(span, f"a kernel writes to its result, not to {part_type(base)}")
        if isinstance(part, (StructValue, ImageValue, TupleValue)):
            fail(span, f"cannot assign {part_type(part)} to a part of a value")
        if not isinstance(base_node, (ast.Name, ast.Attribute, ast.Subscript)):
            fail(span, "only variables can be assigned to")
        self.assign(base_node, self._replaced(target, base, part, span), span)

    def _variable(self, target: ast.expr) -> Variable | None:
        """The variable behind ``name.field.field``, where there is one."""
        if isinstance(target, ast.Name):
            known = target.id in self.frame.assigned
            return self.frame.variables.get(target.id) if known else None
        if isinstance(target, ast.Attribute):
            base = self._variable(target.value)
            if base is not None and isinstance(base.type, Struct):
                return base.fields.get(target.attr)
        return None

    def _replaced(self, target: ast.Attribute | ast.Subscript, base: ir.Expr, value: ir.Expr, span: Span) -> ir.Expr:
        frame = self.frame
        base = frame.name_it(base, span)
        if isinstance(target, ast.Attribute):
            return with_components(target.attr, base, value, span, frame.name_it)
        index = widen(frame.expressions.value(target.slice), INT, span, "an index")
        element = index_into(base, index, span)
        value = widen(value, element.type, span, ast.unparse(target))
        return ir.Insert(base.type, base, index, value, span)


def holds_image(part: Part) -> bool:
    return isinstance(part, ImageValue) or (isinstance(part, TupleValue) and any(map(holds_image, part.members)))


def _type_of(part: Part) -> Type:
    if isinstance(part, StructValue):
        return part.struct
    if isinstance(part, TupleValue):
        return TupleType(tuple(_type_of(member) for member in part.members))
    assert not isinstance(part, ImageValue)
    return part.type


def _as_load(target: ast.expr) -> ast.expr:
    """The same place, read instead of written."""
    if isinstance(target, ast.Name):
        return ast.copy_location(ast.Name(target.id, ast.Load()), target)
    if isinstance(target, ast.Attribute):
        return ast.copy_location(ast.Attribute(_as_load(target.value), target.attr, ast.Load()), target)
    if isinstance(target, ast.Subscript):
        return ast.copy_location(ast.Subscript(_as_load(target.value), target.slice, ast.Load()), target)
    return target
