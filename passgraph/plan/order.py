"""Order passes: producers first, readers before their content is drawn over, and little memory alive at once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeAlias

from passgraph.graph.targets import Pass, Target, TargetSpec
from passgraph.plan.data import Memory
from passgraph.plan.dependencies import topological_order
from passgraph.plan.work import Work

#: Contents that a draw must not overwrite, each with the draw that takes a copy.
Copies: TypeAlias = set[tuple[Target, Pass]]
#: Each pass with those that must run before it, as dictionary keys: a set that keeps its order.
Waits: TypeAlias = dict[Pass, dict[Pass, None]]


def order(work: Work) -> tuple[list[Pass], Copies]:
    """Return the sequence of passes and the contents to copy first."""
    waits, copies = dependencies(work)
    for node, lowered in work.passes.items():
        for content in lowered.done.drawn_over:
            if (content, node) in copies:
                work.notes.append(
                    f"copied {content.name} before {lowered.name} draws over it: its content is still needed"
                )
    as_written = topological_order(waits, _ranks(work))
    return (_least_memory(as_written, waits, work) if work.options.order else as_written), copies


def dependencies(work: Work) -> tuple[Waits, Copies]:
    """Return the dependencies of passes, and the contents to copy because a later pass still reads them.

    A draw over existing content writes in place.  Other readers of that content must come before; where that is
    impossible (the reader depends on the draw, the content is a result, or two draws start from it) a copy is made.
    """
    waits: Waits = {node: {} for node in work.passes}
    readers: dict[Target, list[Pass]] = {}
    for node, lowered in work.passes.items():
        for target in lowered.awaits:
            readers.setdefault(target, []).append(node)
            if target.made_by in work.passes:
                waits[node][target.made_by] = None
    root_contents = {t.content for t in work.roots()}
    copies: Copies = set()
    before: list[tuple[Target, Pass, list[Pass]]] = []
    for draw, lowered in work.passes.items():
        for content in lowered.done.drawn_over:
            other_readers = [r for r in readers.get(content, []) if r is not draw]
            if content in root_contents or any(content in work.passes[r].done.drawn_over for r in other_readers):
                copies.add((content, draw))
            else:
                before.append((content, draw, other_readers))
    in_place = {node: {**other_readers} for node, other_readers in waits.items()}
    for _, draw, other_readers in before:
        in_place[draw] |= dict.fromkeys(other_readers)
    if len(topological_order(in_place, _ranks(work))) == len(work.passes):
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


def _ranks(work: Work) -> dict[Pass, int]:
    return {node: lowered.index for node, lowered in work.passes.items()}


def _least_memory(as_written: list[Pass], waits: Mapping[Pass, Mapping[Pass, None]], work: Work) -> list[Pass]:
    """Order passes for least memory: backwards from the results, largest (peak memory - size of the results) first.

    Optimal if every pass has one reader; elsewhere a heuristic.
    Source: R. Sethi and J. D. Ullman, "The Generation of Optimal Code for Arithmetic Expressions", 1970.
    """
    place = {node: number for number, node in enumerate(as_written)}
    passes = {node: work.passes[node].done for node in as_written}
    left = {node: sum(bytes_of(spec, work) for spec in passes[node].writes) for node in as_written}
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
            most, kept_bytes + sum(bytes_of(spec, work) for spec in passes[node].writes if spec not in over)
        )
    sequence: dict[Pass, None] = {}
    results = [target.made_by for target in work.roots() if target.made_by in place]
    pending = [*reversed(as_written), *reversed(results)]
    while pending:
        missing = [one for one in first[pending[-1]] if one not in sequence]
        if missing:
            pending += reversed(missing)
        else:
            sequence[pending.pop()] = None
    return list(sequence)


def bytes_of(spec: TargetSpec, work: Work) -> int:
    return Memory(spec.format, work.sizes[spec]).bytes
