"""Traversal of the syntax tree."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TypeAlias

from passgraph.glsl import syntax as g


def walked(node: object) -> Iterator[object]:
    """Yield a part of the tree and everything below it."""
    pending: list[object] = [node]
    while pending:
        one = pending.pop()
        if isinstance(one, tuple):
            pending += one
        elif hasattr(one, "__dataclass_fields__") and hasattr(one, "span"):
            yield one
            pending += [getattr(one, name) for name in one.__dataclass_fields__ if name != "span"]


def sides_written(value: g.Expr | None) -> tuple[int, ...]:
    """Return the lengths of a list in braces or of an array's constructor, and of its first element, as written."""
    sides: list[int] = []
    while isinstance(value, g.Braces) or (isinstance(value, g.Call) and value.type and value.type.lengths):
        parts = value.parts if isinstance(value, g.Braces) else value.arguments
        sides.append(len(parts))
        value = parts[0] if parts else None
    return tuple(sides)


def largest_indices(node: object) -> dict[str, int]:
    """Return the largest literal index of each name in a part of the tree."""
    largest: dict[str, int] = {}
    for one in walked(node):
        if isinstance(one, g.Subscript) and isinstance(one.base, g.Name) and isinstance(one.index, g.Number):
            largest[one.base.name] = max(largest.get(one.base.name, 0), int(one.index.value))
    return largest


def is_open(variable: g.Variable) -> bool:
    """Return True for an array without length and value, which another declaration may give a length."""
    return variable.type.lengths[:1] == (None,) and variable.value is None


def leaves_function(node: g.Statement, answers: dict[g.Statement, bool]) -> bool:
    """Return True if a statement contains a return or discard; ``answers`` caches results of nested statements."""
    if node not in answers:
        leaves = isinstance(node, g.Return) or (isinstance(node, g.Jump) and node.kind == "discard")
        answers[node] = leaves or any(leaves_function(inner, answers) for inner in _inner(node))
    return answers[node]


def _inner(node: g.Statement) -> tuple[g.Statement, ...]:
    if isinstance(node, g.Block):
        return node.statements
    if isinstance(node, g.If):
        return (node.then,) if node.orelse is None else (node.then, node.orelse)
    if isinstance(node, g.Loop):
        return (node.body,)
    return sum((case.statements for case in node.cases), ()) if isinstance(node, g.Switch) else ()


def assigned_name(node: g.Assignment | g.Step) -> str:
    """Return the name of the variable that is assigned to, as a whole or in part; empty if it is none."""
    target = node.target
    while isinstance(target, (g.Member, g.Subscript)):
        target = target.base
    return target.name if isinstance(target, g.Name) else ""


#: A name and a component of it; None for all.
NamePart: TypeAlias = tuple[str, int | None]
_LETTERS = {letter: i for letters in ("xyzw", "rgba", "stpq") for i, letter in enumerate(letters)}


def assigned_names(node: object, overloads: Callable[[str], Sequence[g.Function]]) -> frozenset[str]:
    """Return the names that a part of the tree may assign to, also by out parameters of calls."""
    return frozenset(name for name, _ in assigned_parts(node, overloads))


def assigned_parts(node: object, overloads: Callable[[str], Sequence[g.Function]]) -> frozenset[NamePart]:
    """Return the names that a part of the tree may assign to, with the component if only one is written."""
    parts: set[NamePart] = set()
    for one in walked(node):
        targets: list[g.Expr] = []
        if isinstance(one, (g.Assignment, g.Step)):
            targets = [one.target]
        elif isinstance(one, g.Call):
            for function in overloads(one.name):
                pairs = zip(one.arguments, function.parameters, strict=False)
                targets += [argument for argument, parameter in pairs if parameter.passed != "in"]
        for target in targets:
            components: set[int | None] = {None}
            while isinstance(target, (g.Member, g.Subscript)):
                # A field with a name like components counts as components of its struct.
                components = {_LETTERS.get(c) for c in target.name} if isinstance(target, g.Member) else {None}
                target = target.base
            if isinstance(target, g.Name):
                parts |= {(target.name, one) for one in components}
    return frozenset(parts)


def overlap(these: frozenset[NamePart], those: frozenset[NamePart]) -> bool:
    """Return True if two sets of parts overlap."""
    return any(a == b and (i is None or j is None or i == j) for a, i in these for b, j in those)
