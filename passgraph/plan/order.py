"""The order of passes: producers first, readers before content is drawn over, and little memory alive at once."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from heapq import heapify, heappop, heappush
from typing import TYPE_CHECKING, TypeAlias

from passgraph.plan.data import Memory
from passgraph.plan.remembered import remembered
from passgraph.plan.work import Work
from passgraph.targets import Pass, Target, TargetSpec

if TYPE_CHECKING:
    import networkx as nx

#: Contents that a draw must not write over: each with the draw that takes a copy.
Copies: TypeAlias = set[tuple[Target, Pass]]


def dependencies(work: Work) -> tuple[nx.DiGraph, Copies]:
    """Who waits for whom, and which contents must be copied because someone still needs them.

    A draw over existing content writes in place.  Whoever else reads that content must come before; where that is
    impossible (the reader waits for the draw, the content is a result, or two draws start from it) a copy is made.
    """
    import networkx as nx

    graph = nx.DiGraph()
    graph.add_nodes_from(work.passes)
    readers: dict[Target, list[Pass]] = {}
    for lowered in work.passes.values():
        for target in lowered.awaits:
            readers.setdefault(target, []).append(lowered.node)
            if target.made_by in work.passes:
                graph.add_edge(target.made_by, lowered.node)
    kept = {t.content for t in work.roots()}
    copies: Copies = set()
    before: list[tuple[Target, Pass, list[Pass]]] = []
    for draw in work.passes:
        for content in draw.drawn_over:
            others = [r for r in readers.get(content, []) if r is not draw]
            if content in kept or any(content in r.drawn_over for r in others):
                copies.add((content, draw))
            else:
                before.append((content, draw, others))
    waiting = graph.copy()
    waiting.add_edges_from((r, draw) for _, draw, others in before for r in others)
    if nx.is_directed_acyclic_graph(waiting):
        return waiting, copies
    # Some reader waits for the draw that waits for it: which one is searched for, draw by draw.
    for content, draw, others in before:
        if any(nx.has_path(graph, draw, r) for r in others):
            copies.add((content, draw))
        else:
            graph.add_edges_from((r, draw) for r in others)
    return graph, copies


def order(work: Work) -> tuple[list[Pass], Copies]:
    """The sequence of passes and the contents to copy first."""
    nodes = list(work.passes)
    described, contents = _described(nodes, work)
    # Memory apart, the same for every size of the output.
    as_written, edges, pairs = remembered(described, lambda: _rows(nodes, contents, work))
    numbered = list(contents)
    copies = {(numbered[content], nodes[node]) for content, node in zip(pairs[::2], pairs[1::2], strict=True)}
    for lowered in work.passes.values():
        for content in lowered.node.drawn_over:
            if (content, lowered.node) in copies:
                work.notes.append(
                    f"copied {content.name} before {lowered.name} draws over it: its content is still needed"
                )
    if not work.options.order:
        return [nodes[number] for number in as_written], copies
    followers: dict[Pass, list[Pass]] = {node: [] for node in nodes}
    for one, other in zip(edges[::2], edges[1::2], strict=True):
        followers[nodes[one]].append(nodes[other])
    return _least_memory(followers, work), copies


def _described(nodes: list[Pass], work: Work) -> tuple[object, dict[Target, int]]:
    """What :func:`dependencies` hang on, with numbers for passes and contents; and the numbers of contents."""
    numbers = {node: number for number, node in enumerate(nodes)}
    contents: dict[Target, int] = {}

    def told(target: Target) -> tuple[int, int | None]:
        made_by = None if target.made_by is None else numbers.get(target.made_by)
        return contents.setdefault(target, len(contents)), made_by

    rows = []
    for node, lowered in work.passes.items():
        read, over = lowered.awaits, node.drawn_over
        rows.append((lowered.index, [told(target) for target in read], [told(target) for target in over]))
    return ("order", rows, [told(target.content) for target in work.roots()]), contents


def _rows(nodes: list[Pass], contents: Mapping[Target, int], work: Work) -> list[list[int]]:
    """The passes in writing order as far as they can be, who waits for whom, and what is copied before which pass."""
    import networkx as nx

    graph, copies = dependencies(work)
    numbers = {node: number for number, node in enumerate(nodes)}
    as_written = nx.lexicographical_topological_sort(graph, key=lambda node: work.passes[node].index)
    return [
        [numbers[node] for node in as_written],
        [numbers[node] for edge in graph.edges for node in edge],
        [number for content, node in copies for number in (contents[content], numbers[node])],
    ]


def _least_memory(followers: Mapping[Pass, Sequence[Pass]], work: Work) -> list[Pass]:
    """Greedy: of the passes that may run, the one after which least memory is held; ties as written."""
    held = _Held(work)
    waiting = Counter(node for group in followers.values() for node in group)
    ready = {node for node in followers if not waiting[node]}
    # Costs as they were when they last changed; older entries of a pass are passed over.
    costs = {node: held.cost(node) for node in ready}
    heap = [(cost, work.passes[node].index, node) for node, cost in costs.items()]
    heapify(heap)
    sequence: list[Pass] = []
    while ready:
        cost, _, node = heappop(heap)
        if node not in ready or cost != costs[node]:
            continue
        ready.remove(node)
        sequence.append(node)
        changed = held.run(node) & ready
        for follower in followers[node]:
            waiting[follower] -= 1
            if not waiting[follower]:
                ready.add(follower)
                changed.add(follower)
        for other in changed:
            costs[other] = held.cost(other)
            heappush(heap, (costs[other], work.passes[other].index, other))
    return sequence


class _Held:
    """The targets that hold memory while passes run one behind the other."""

    def __init__(self, work: Work) -> None:
        self.work = work
        self.reads = {
            node: [t.spec for t in low.awaits if isinstance(t.spec, TargetSpec)] for node, low in work.passes.items()
        }
        self.consumers = Counter(spec for specs in self.reads.values() for spec in specs)
        self.kept = {t.spec for t in work.roots()}
        self.alive: set[TargetSpec] = set()
        #: Target → passes whose cost hangs on whether it is alive, and on whether one reader is left.
        self.touching: dict[TargetSpec, set[Pass]] = {}
        for node, specs in self.reads.items():
            for spec in (*specs, *node.writes):
                self.touching.setdefault(spec, set()).add(node)

    def cost(self, node: Pass) -> int:
        """Bytes that running a pass adds to what is held."""
        grown = sum(bytes_of(s, self.work) for s in node.writes if s not in self.alive)
        freed = 0
        for target in set(self.work.passes[node].awaits):
            spec = target.spec
            if isinstance(spec, TargetSpec) and self.consumers[spec] == 1 and spec not in self.kept:
                freed += bytes_of(spec, self.work)
        return grown - freed

    def run(self, node: Pass) -> set[Pass]:
        """Note that a pass has run; passes whose cost may be another now."""
        turned = [spec for spec in node.writes if spec not in self.alive]
        self.alive.update(turned)
        for spec in self.reads[node]:
            self.consumers[spec] -= 1
            if not self.consumers[spec] and spec not in self.kept:
                self.alive.discard(spec)
            if self.consumers[spec] <= 1:
                turned.append(spec)
        return {other for spec in turned for other in self.touching[spec]}


def bytes_of(spec: TargetSpec, work: Work) -> int:
    return Memory(spec.format, work.sizes[spec]).bytes
