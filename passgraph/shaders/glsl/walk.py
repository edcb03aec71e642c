"""What lies below a part of the syntax tree."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from passgraph.shaders.glsl import syntax as g


def walked(node: object) -> Iterator[object]:
    """A part of the tree and everything below it."""
    pending: list[object] = [node]
    while pending:
        one = pending.pop()
        if isinstance(one, tuple):
            pending += one
        elif hasattr(one, "__dataclass_fields__") and hasattr(one, "span"):
            yield one
            pending += [getattr(one, name) for name in one.__dataclass_fields__ if name != "span"]


def leaves_function(node: g.Statement, known: dict[g.Statement, bool]) -> bool:
    """Whether a return or discard is inside; ``known`` keeps answers, as statements ask again for those around them."""
    if node not in known:
        leaves = isinstance(node, g.Return) or (isinstance(node, g.Jump) and node.kind == "discard")
        known[node] = leaves or any(leaves_function(inner, known) for inner in _inner(node))
    return known[node]


def _inner(node: g.Statement) -> tuple[g.Statement, ...]:
    if isinstance(node, g.Block):
        return node.statements
    if isinstance(node, g.If):
        return (node.then,) if node.orelse is None else (node.then, node.orelse)
    if isinstance(node, g.Loop):
        return (node.body,)
    return sum((case.statements for case in node.cases), ()) if isinstance(node, g.Switch) else ()


def assigned_names(node: object, overloads: Callable[[str], Sequence[g.Function]]) -> frozenset[str]:
    """Names that a part of the tree may assign to, whatever they stand for; calls may where parameters are out."""
    found: set[str] = set()
    for one in walked(node):
        targets: list[g.Expr] = []
        if isinstance(one, (g.Assignment, g.Step)):
            targets = [one.target]
        elif isinstance(one, g.Call):
            for function in overloads(one.name):
                pairs = zip(one.arguments, function.parameters, strict=False)
                targets += [argument for argument, parameter in pairs if parameter.passed != "in"]
        for target in targets:
            while isinstance(target, (g.Member, g.Subscript)):
                target = target.base
            if isinstance(target, g.Name):
                found.add(target.name)
    return frozenset(found)
