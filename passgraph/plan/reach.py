"""What lies behind some targets: passes, producers first, and the inputs that they read."""

from __future__ import annotations

from collections.abc import Mapping

from passgraph.errors import GraphError
from passgraph.plan.remembered import remembered
from passgraph.targets import InputSpec, Like, Pass, Target, TargetSpec


def passes_behind(outputs: list[Target]) -> list[Pass]:
    """Every pass behind the outputs, producers first; history leads to its writer where that is in reach.

    Handles cannot be made before their passes, so a cycle can only be forged by hand; it is refused all the same.
    """
    ranks: dict[Pass, int] = {}
    edges: list[tuple[Pass, Pass]] = []
    pending = [t.made_by for t in outputs if t.made_by is not None]
    while pending:
        node = pending.pop()
        if node in ranks:
            continue
        ranks[node] = len(ranks)
        makers = [target.made_by for target in node.reads if target.made_by is not None]
        edges += [(maker, node) for maker in makers]
        pending += makers
    described = ("reachable", len(ranks), [(ranks[maker], ranks[node]) for maker, node in edges])
    nodes = list(ranks)
    (sequence,) = remembered(described, lambda: [[ranks[node] for node in _producers_first(ranks, edges)]])
    return [nodes[rank] for rank in sequence]


def _producers_first(ranks: Mapping[Pass, int], edges: list[tuple[Pass, Pass]]) -> list[Pass]:
    """Of passes that may come next the one with the highest rank."""
    import networkx as nx

    dependencies = nx.DiGraph()
    dependencies.add_nodes_from(ranks)
    dependencies.add_edges_from(edges)
    try:
        return list(nx.lexicographical_topological_sort(dependencies, key=lambda n: -ranks[n]))
    except nx.NetworkXUnfeasible:
        cycle = " → ".join(edge[0].name for edge in nx.find_cycle(dependencies))
        raise GraphError(
            f"passes form a cycle: {cycle}; read last frame's content with pg.previous() where it closes"
        ) from None


def inputs_behind(outputs: list[Target]) -> dict[str, InputSpec]:
    """Every input behind some targets, by name."""
    return inputs_of(passes_behind(outputs))


def inputs_of(passes: list[Pass]) -> dict[str, InputSpec]:
    specs: dict[str, InputSpec] = {}
    lenders = [spec for node in passes for spec in node.writes]
    seen: set[TargetSpec] = set()
    for given in [*(t.spec for node in passes for t in node.reads), *lenders]:
        found = given
        # The input itself, and inputs that only lend their size.
        while isinstance(found, TargetSpec) and isinstance(found.size, Like) and found not in seen:
            seen.add(found)
            found = found.size.other.spec
        if isinstance(found, InputSpec) and specs.setdefault(found.name, found) is not found:
            raise GraphError(f"two different inputs are called {found.name!r}; use one handle, or give them two names")
    return specs
