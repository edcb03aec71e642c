"""The order of passes: producers first, readers before content is drawn over, and little memory alive at once."""

from __future__ import annotations

from typing import TypeAlias

import networkx as nx

from passgraph.graph import DrawPass, Pass
from passgraph.plan.collect import Lowered, Work, drawn_over
from passgraph.plan.data import Memory
from passgraph.targets import Target, TargetSpec

#: Contents that a draw must not write over: each with the draw that takes a copy.
Copies: TypeAlias = set[tuple[Target, Pass]]


def dependencies(work: Work) -> tuple[nx.DiGraph, Copies]:
    """Who waits for whom, and which contents must be copied because someone still needs them.

    A draw over existing content writes in place.  Whoever else reads that content must come before; where that is
    impossible (the reader waits for the draw, the content is a result, or two draws start from it) a copy is made.
    """
    graph = nx.DiGraph()
    graph.add_nodes_from(work.passes)
    readers: dict[Target, list[Pass]] = {}
    for lowered in work.passes.values():
        for target in contents_read(lowered):
            readers.setdefault(target, []).append(lowered.node)
            if target.made_by in work.passes:
                graph.add_edge(target.made_by, lowered.node)
    copies: Copies = set()
    kept = {t.content for t in work.roots()}
    for lowered in work.passes.values():
        for content in drawn_over(lowered.node):
            others = [r for r in readers.get(content, []) if r is not lowered.node]
            shared = content in kept or any(content in drawn_over(r) for r in others)
            waits = any(nx.has_path(graph, lowered.node, r) for r in others)
            if shared or waits:
                copies.add((content, lowered.node))
                work.notes.append(
                    f"copied {content.name} before {lowered.name} draws over it: its content is still needed"
                )
            else:
                graph.add_edges_from((r, lowered.node) for r in others)
    return graph, copies


def contents_read(lowered: Lowered) -> list[Target]:
    """Contents that a pass needs: images it really reads and what it draws over."""
    images = [t.content for t in lowered.images.values() if not t.is_previous]
    return [*images, *drawn_over(lowered.node)]


def order(work: Work) -> tuple[list[Pass], Copies]:
    """The sequence of passes and the contents to copy first."""
    graph, copies = dependencies(work)
    written = {node: low.index for node, low in work.passes.items()}
    if not work.options.order:
        return list(nx.lexicographical_topological_sort(graph, key=lambda n: written[n])), copies
    return _least_memory(graph, written, work), copies


def _least_memory(graph: nx.DiGraph, written: dict[Pass, int], work: Work) -> list[Pass]:
    """Greedy: of the passes that may run, the one after which least memory is held; ties as written."""
    consumers = {spec: 0 for low in work.passes.values() for spec in specs_written(low.node)}
    for low in work.passes.values():
        for target in contents_read(low):
            if isinstance(target.spec, TargetSpec):
                consumers[target.spec] = consumers.get(target.spec, 0) + 1
    kept = {t.spec for t in work.roots()}
    waiting = {node: graph.in_degree(node) for node in graph}
    ready = [node for node, count in waiting.items() if count == 0]
    alive: set[TargetSpec] = set()
    sequence: list[Pass] = []

    def cost(node: Pass) -> int:
        low = work.passes[node]
        grown = sum(bytes_of(s, work) for s in specs_written(node) if s not in alive)
        freed = 0
        for target in set(contents_read(low)):
            if isinstance(target.spec, TargetSpec) and consumers[target.spec] == 1 and target.spec not in kept:
                freed += bytes_of(target.spec, work)
        return grown - freed

    while ready:
        node = min(ready, key=lambda n: (cost(n), written[n]))
        ready.remove(node)
        sequence.append(node)
        alive.update(specs_written(node))
        for target in contents_read(work.passes[node]):
            if isinstance(target.spec, TargetSpec):
                consumers[target.spec] -= 1
                if not consumers[target.spec] and target.spec not in kept:
                    alive.discard(target.spec)
        for follower in graph.successors(node):
            waiting[follower] -= 1
            if not waiting[follower]:
                ready.append(follower)
    return sequence


def specs_written(node: Pass) -> list[TargetSpec]:
    depth = node.depth if isinstance(node, DrawPass) else None
    return [*node.into, *((depth,) if depth is not None else ())]


def bytes_of(spec: TargetSpec, work: Work) -> int:
    return Memory(spec.format, work.sizes[spec]).bytes
