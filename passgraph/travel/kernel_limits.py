"""How large a kernel may be that travels: one that came from text is smaller."""

from __future__ import annotations

from collections.abc import Iterable

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
