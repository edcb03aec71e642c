"""Other orders of passes than the planner's own."""

from __future__ import annotations

import networkx as nx
import numpy as np

from passgraph.graph import Pass
from passgraph.plan.order import Copies, dependencies
from passgraph.plan.work import Work


def shuffled(work: Work, seed: int) -> tuple[list[Pass], Copies]:
    """A random topological order of the passes, in place of the one that needs least memory."""
    graph, copies = dependencies(work)
    passes = list(graph)
    place = dict(zip(passes, np.random.default_rng(seed).permutation(len(passes)), strict=True))
    return list(nx.lexicographical_topological_sort(graph, key=place.__getitem__)), copies
