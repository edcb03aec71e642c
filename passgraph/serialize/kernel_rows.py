"""How each part of the typed representation stands in a document, and how large a kernel in one may be."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields
from typing import Any

from passgraph.language import ir
from passgraph.language.types import Array, Struct, Type

#: Expressions and statements, what stands in several places counted at each: phases go through them so.
MOST_NODES = 1 << 20
#: Expressions within expressions, and statements within statements; phases go through both by recursion.
MOST_DEEP = 400


def grown(parts: Iterable[tuple[int, int]]) -> tuple[int, int]:
    """(nodes, depth) of what holds parts of so many and so deep."""
    nodes, depth = 1, 0
    for inner, deep in parts:
        nodes, depth = nodes + inner, max(depth, deep)
    return nodes, depth + 1


def excess(size: tuple[int, int]) -> str:
    """What is too large, in words; empty where nothing is."""
    nodes, depth = size
    if nodes > MOST_NODES:
        return f"it has more than {MOST_NODES} expressions and statements, each counted where it is used"
    return f"expressions or blocks nest deeper than {MOST_DEEP}" if depth > MOST_DEEP else ""


#: How a field is annotated → what it holds: a ``type``, a ``number`` or ``numbers``, a ``text``, a ``flag``, ``places``
#: of components, or by its number a ``row`` before this one, or ``rows``.
_KINDS = {
    "Value": "type",
    "Scalar": "type",
    "Array": "type",
    "Value | Array": "type",
    "Number": "number",
    "tuple[Number, ...]": "numbers",
    "str": "text",
    "bool": "flag",
    "tuple[int, ...]": "places",
    "Expr": "row",
    "tuple[Expr, ...]": "rows",
    "tuple[Stmt, ...]": "rows",
}
#: Class → field → what it holds, for all that tells a node from another.  Each row has a span beside.
ROWS: dict[type[Any], dict[str, str]] = {
    cls: {field.name: _KINDS[str(field.type)] for field in fields(cls) if field.compare}
    for cls in (*ir.EXPRESSIONS, *ir.STATEMENTS)
}
#: The same by the name that a row begins with.
CLASSES: dict[str, type[Any]] = {cls.__name__.lower(): cls for cls in ROWS}


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
