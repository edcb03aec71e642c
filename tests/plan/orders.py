"""Other orders of passes than the planner's own, and lifetimes that they give."""

from __future__ import annotations

import numpy as np

from passgraph.graph.targets import Pass
from passgraph.plan.dependencies import topological_order
from passgraph.plan.draft import Draft
from passgraph.plan.order import Copies, dependencies


def shuffled(draft: Draft, seed: int) -> tuple[list[Pass], Copies]:
    """A random topological order of the passes, in place of the one that needs least memory."""
    waits, copies = dependencies(draft)
    place = dict(zip(waits, np.random.default_rng(seed).permutation(len(waits)), strict=True))
    return topological_order(waits, place), copies


def apart(one: tuple[int, int], other: tuple[int, int]) -> bool:
    """Whether two lifetimes, first and last step of each, share no step."""
    return one[1] < other[0] or other[1] < one[0]
