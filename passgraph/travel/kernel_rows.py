"""How each part of the typed representation stands in a document: the kind of each of its fields."""

from __future__ import annotations

from typing import Any

from passgraph.language import ir
from passgraph.language.types import Array, Struct, Type

#: Class → field → what it holds: a ``type``, a ``number`` or ``numbers``, a ``text``, a ``flag``, ``places`` of
#: components, or by its number a ``row`` before this one, or ``rows``.  Each has a span beside.
ROWS: dict[type[Any], dict[str, str]] = {
    ir.Literal: {"type": "type", "value": "number"},
    ir.Table: {"type": "type", "values": "numbers"},
    ir.Uniform: {"type": "type", "name": "text", "const": "flag"},
    ir.Builtin: {"type": "type", "name": "text"},
    ir.Local: {"type": "type", "name": "text"},
    ir.Apply: {"type": "type", "operation": "text", "arguments": "rows"},
    ir.Select: {"type": "type", "condition": "row", "then": "row", "orelse": "row"},
    ir.Swizzle: {"type": "type", "value": "row", "components": "places"},
    ir.Construct: {"type": "type", "arguments": "rows"},
    ir.Index: {"type": "type", "value": "row", "index": "row"},
    ir.Insert: {"type": "type", "value": "row", "index": "row", "element": "row"},
    ir.Texel: {"type": "type", "image": "text", "x": "row", "y": "row", "relative": "flag"},
    ir.Filtered: {"type": "type", "image": "text", "x": "row", "y": "row", "value": "row", "slack": "row"},
    ir.Property: {"type": "type", "image": "text", "name": "text"},
    ir.Size: {"type": "type", "image": "text"},
    ir.Assign: {"name": "text", "value": "row"},
    ir.If: {"condition": "row", "then": "rows", "orelse": "rows"},
    ir.For: {"name": "text", "start": "row", "stop": "row", "step": "row", "body": "rows"},
    ir.Break: {},
    ir.Continue: {},
}
#: The same by the name that a row begins with.
CLASSES: dict[str, type[Any]] = {cls.__name__.lower(): cls for cls in ROWS}
STATEMENTS = (ir.Assign, ir.If, ir.For, ir.Break, ir.Continue)


def type_data(type_: Type) -> Any:
    """A type: its name, an array as [element, length], a struct with its fields.

    >>> from passgraph.language.types import VEC3
    >>> type_data(VEC3), type_data(Array(VEC3, 4))
    ('vec3', ['vec3', 4])
    """
    if isinstance(type_, Array):
        return [type_data(type_.element), type_.length]
    if isinstance(type_, Struct):
        return {"struct": type_.name, "fields": [[name, type_data(inner)] for name, inner in type_.fields]}
    return str(type_)


def parts_of(node: Any) -> list[Any]:
    """The rows that a row refers to, in the order of its fields."""
    found: list[Any] = []
    for name, kind in ROWS[type(node)].items():
        if kind == "row":
            found.append(getattr(node, name))
        elif kind == "rows":
            found += getattr(node, name)
    return found
