"""Loops whose block has the step of a counter in it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from passgraph.shaders.glsl import syntax as g
from passgraph.shaders.glsl.walk import walked

#: Steps of one loop that may be its counter's: each is looked at beside the whole block.
MOST_STEPS = 4


def with_step(node: g.Loop) -> Iterator[g.Loop]:
    """``for (; c; i++) { … }`` for each step ``i++`` of ``while (c) { … i++; … }``, or of ``do``: loops that make as
    many trips, if the rest of the block leaves the counter alone.

    A step is none where a trip may be over before it, where it hangs on variables of the block, or where the condition
    does not ask for what it changes.  Of more than `MOST_STEPS` the first are looked at.
    """
    if node.update is not None or not isinstance(node.body, g.Block):
        return
    asked, own, left = _names(node.condition), set[str](), MOST_STEPS
    statements = node.body.statements
    for i, statement in enumerate(statements):
        if not left or _continues(statement):
            return
        if isinstance(statement, g.Declaration):
            own |= {variable.name for variable in statement.variables}
        if not isinstance(statement, g.Evaluate) or not isinstance(statement.value, (g.Assignment, g.Step)):
            continue
        if own.isdisjoint(_names(statement)) and not asked.isdisjoint(_names(statement.value.target)):
            left -= 1
            rest = replace(node.body, statements=(*statements[:i], *statements[i + 1 :]))
            yield replace(node, update=statement.value, body=rest)


def _names(node: object) -> frozenset[str]:
    return frozenset(one.name for one in walked(node) if isinstance(one, g.Name))


def _continues(statement: g.Statement) -> bool:
    """Whether it may go on with the next trip of the loop that it stands in."""
    if isinstance(statement, g.Jump):
        return statement.kind == "continue"
    if isinstance(statement, g.Block):
        return any(map(_continues, statement.statements))
    if isinstance(statement, g.If):
        return any(_continues(one) for one in (statement.then, statement.orelse) if one is not None)
    cases = statement.cases if isinstance(statement, g.Switch) else ()
    return any(_continues(one) for case in cases for one in case.statements)
