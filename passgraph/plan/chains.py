"""Chains: consecutive pixel steps that a backend may make one, since what lies between is read by them alone."""

from __future__ import annotations

from collections import Counter

from passgraph.plan.data import PixelStep, Plan


def chain_end(plan: Plan, start: int) -> int:
    """The longest chain that begins with step ``start`` ends before this step; ``start + 1`` where there is none."""
    if not plan.options.fuse:
        return start + 1
    end = start
    while end < len(plan.steps) and _alike(plan, start, end):
        end += 1
    writers = Counter(resource for step in plan.steps for resource in step.writes)
    while end > start + 1 and not _closed(plan, start, end, writers):
        end -= 1
    return max(end, start + 1)


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
