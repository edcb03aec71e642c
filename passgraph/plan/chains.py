"""Chains: consecutive pixel steps that a backend may make one, since what lies between is read by them alone."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from passgraph.plan.data import PixelStep, Plan


def chain_ends(plan: Plan, start: int) -> Iterator[int]:
    """Steps before which a chain that begins with step ``start`` may end, the longest chain first."""
    if not plan.options.fuse:
        return
    end = start
    while end < len(plan.steps) and _alike(plan, start, end):
        end += 1
    writers = Counter(resource for step in plan.steps for resource in step.writes)
    for shorter in range(end, start + 1, -1):
        if _closed(plan, start, shorter, writers):
            yield shorter


def _alike(plan: Plan, start: int, number: int) -> bool:
    first, step = plan.steps[start], plan.steps[number]
    return isinstance(step, PixelStep) and step.size == first.size and step.static == first.static


def _closed(plan: Plan, start: int, end: int, writers: Counter[int]) -> bool:
    """Whether what all steps but the last write is seen by none but the steps of the chain."""
    inner = {resource for step in plan.steps[start : end - 1] for resource in step.writes}
    if any(plan.resources[r].persistent or plan.resources[r].history is not None or writers[r] > 1 for r in inner):
        return False
    others = (*plan.steps[:start], *plan.steps[end:])
    return not any(resource in inner for step in others for resource in step.reads)
