"""Order passes: producers first, readers before their content is drawn over, and little memory alive at once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeAlias

from passgraph.graph.targets import Pass, Target, TargetSpec
from passgraph.plan.data import Memory
from passgraph.plan.dependencies import topological_order
from passgraph.plan.draft import Draft

#: Contents that a draw must not overwrite, each with the draw that takes a copy.
Copies: TypeAlias = set[tuple[Target, Pass]]
#: Each pass with those that must run before it, as dictionary keys: a set that keeps its order.
Waits: TypeAlias = dict[Pass, dict[Pass, None]]


def order(draft: Draft) -> tuple[list[Pass], Copies]:
    """Return the sequence of passes and the contents to copy first."""
    waits, copies = dependencies(draft)
    as_written = topological_order(waits, _ranks(draft))
    return (_least_memory(as_written, waits, draft) if draft.options.order else as_written), copies


def dependencies(draft: Draft) -> tuple[Waits, Copies]:
    """Return the dependencies of passes, and the contents to copy because a later pass still reads them.

    A draw over existing content writes in place.  Other readers of that content must come before; where that is
    impossible (the reader depends on the draw, the content is a result, or two draws start from it) a copy is made.
    """
    waits: Waits = {node: {} for node in draft.passes}
    readers: dict[Target, list[Pass]] = {}
    for node, lowered in draft.passes.items():
        for target in lowered.awaits:
            readers.setdefault(target, []).append(node)
            if target.made_by is not None and target.made_by in draft.passes:
                waits[node][target.made_by] = None
    root_contents = {t.content for t in draft.roots()}
    copies: Copies = set()
    before: list[tuple[Target, Pass, list[Pass]]] = []
    for draw, lowered in draft.passes.items():
        for content in lowered.done.drawn_over:
            other_readers = [r for r in readers.get(content, []) if r is not draw]
            if content in root_contents or any(content in draft.passes[r].done.drawn_over for r in other_readers):
                copies.add((content, draw))
            else:
                before.append((content, draw, other_readers))
    in_place = {node: {**other_readers} for node, other_readers in waits.items()}
    for _, draw, other_readers in before:
        in_place[draw] |= dict.fromkeys(other_readers)
    if len(topological_order(in_place, _ranks(draft))) == len(draft.passes):
        return in_place, copies
    return _with_copies(waits, before, copies), copies


def _with_copies(waits: Waits, before: list[tuple[Target, Pass, list[Pass]]], copies: Copies) -> Waits:
    """Resolve cyclic waits of readers and draws by copies: search the draw to copy for, draw by draw."""
    import networkx as nx

    graph = nx.DiGraph((one, node) for node, waits_for in waits.items() for one in waits_for)
    graph.add_nodes_from(waits)
    for content, draw, waits_for in before:
        if any(nx.has_path(graph, draw, r) for r in waits_for):
            copies.add((content, draw))
        else:
            graph.add_edges_from((r, draw) for r in waits_for)
    return {node: dict.fromkeys(graph.predecessors(node)) for node in waits}


def _ranks(draft: Draft) -> dict[Pass, int]:
    return {node: lowered.index for node, lowered in draft.passes.items()}


def _least_memory(as_written: list[Pass], waits: Mapping[Pass, Mapping[Pass, None]], draft: Draft) -> list[Pass]:
    """Order passes for least memory: backwards from the results, largest (peak memory - size of the results) first.

    Optimal if every pass has one reader; elsewhere a heuristic.
    Source: R. Sethi and J. D. Ullman, "The Generation of Optimal Code for Arithmetic Expressions", 1970.
    """
    place = {node: number for number, node in enumerate(as_written)}
    passes = {node: draft.passes[node].done for node in as_written}
    left = {node: sum(bytes_of(spec, draft) for spec in passes[node].writes) for node in as_written}
    needed: dict[Pass, int] = {}
    first: dict[Pass, list[Pass]] = {}
    for node in as_written:
        first[node] = sorted(waits[node], key=lambda one: (left[one] - needed[one], place[one]))
        kept_bytes = most = 0
        for one in first[node]:
            most = max(most, kept_bytes + needed[one])
            kept_bytes += left[one]
        over = {target.spec for target in passes[node].drawn_over}
        needed[node] = max(
            most, kept_bytes + sum(bytes_of(spec, draft) for spec in passes[node].writes if spec not in over)
        )
    sequence: dict[Pass, None] = {}
    results = [target.made_by for target in draft.roots() if target.made_by in place]
    pending = [*reversed(as_written), *reversed(results)]
    while pending:
        missing = [one for one in first[pending[-1]] if one not in sequence]
        if missing:
            pending += reversed(missing)
        else:
            sequence[pending.pop()] = None
    return list(sequence)


def bytes_of(spec: TargetSpec, draft: Draft) -> int:
    return Memory(spec.format, draft.sizes[spec]).bytes
