"""Dependencies of targets: the passes behind them in topological order, and the inputs that they read."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from heapq import heapify, heappop, heappush

from passgraph.errors import GraphError
from passgraph.graph.targets import Blocks, InputSpec, Like, Pass, Target, TargetSpec


def topological_order(waits: Mapping[Pass, Collection[Pass]], rank: Mapping[Pass, int]) -> list[Pass]:
    """Return the passes in topological order; among passes that are ready, the one of lowest rank first.

    Passes on a cycle, and those that depend on one, are left out.
    """
    followers: dict[Pass, list[Pass]] = {node: [] for node in waits}
    for node, before in waits.items():
        for one in before:
            followers[one].append(node)
    missing = {node: len(before) for node, before in waits.items()}
    ready = [(rank[node], node) for node, count in missing.items() if not count]
    heapify(ready)
    sequence: list[Pass] = []
    while ready:
        _, node = heappop(ready)
        sequence.append(node)
        for follower in followers[node]:
            missing[follower] -= 1
            if not missing[follower]:
                heappush(ready, (rank[follower], follower))
    return sequence


def passes_behind(outputs: list[Target]) -> list[Pass]:
    """Return every pass behind the outputs, producers first; history leads to its writer if that is reachable.

    The API cannot make a cycle, since a handle needs its pass; cycles in handmade graphs raise an error.
    """
    waits: dict[Pass, dict[Pass, None]] = {}
    pending = [t.made_by for t in outputs if t.made_by is not None]
    while pending:
        node = pending.pop()
        if node not in waits:
            makers = [target.made_by for target in node.reads if target.made_by is not None]
            waits[node] = dict.fromkeys(makers)
            pending += makers
    # Passes reached last were written first.
    sequence = topological_order(waits, {node: -number for number, node in enumerate(waits)})
    if len(sequence) < len(waits):
        raise GraphError(
            f"passes form a cycle: {_cycle(waits)}; read last frame's content with pg.previous() where it closes"
        )
    return sequence


def read_history(outputs: Iterable[Target]) -> bool:
    """Return True if a pass behind the outputs reads an earlier run's picture."""
    return any(target.is_previous for node in passes_behind(list(outputs)) for target in node.reads)


def _cycle(waits: Mapping[Pass, Collection[Pass]]) -> str:
    import networkx as nx

    edges = nx.find_cycle(nx.DiGraph((maker, node) for node, makers in waits.items() for maker in makers))
    return " → ".join(maker.name for maker, _ in edges)


def inputs_behind(outputs: list[Target]) -> dict[str, InputSpec]:
    """Return every input behind some targets, by name."""
    return inputs_of(passes_behind(outputs))


def inputs_of(passes: list[Pass]) -> dict[str, InputSpec]:
    specs: dict[str, InputSpec] = {}
    lenders = [spec for node in passes for spec in node.writes]
    seen: set[TargetSpec] = set()
    for candidate in [*(t.spec for node in passes for t in node.reads), *lenders]:
        input_spec = candidate
        # The input itself, and inputs from which only a size is taken.
        while (
            isinstance(input_spec, TargetSpec) and isinstance(input_spec.size, Like | Blocks) and input_spec not in seen
        ):
            seen.add(input_spec)
            input_spec = input_spec.size.other.spec
        if isinstance(input_spec, InputSpec) and specs.setdefault(input_spec.name, input_spec) is not input_spec:
            raise GraphError(
                f"two different inputs are called {input_spec.name!r}; use one handle, or give them two names"
            )
    return specs
