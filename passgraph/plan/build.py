"""Build a plan from targets, phase by phase.

collect → specialize → levels → cull, trim → fuse → order → emit (static steps, lifetimes and memory) → limits.  Each
phase takes the draft of the one before (:mod:`passgraph.plan.draft`) and returns a new one; drafts are frozen.  Their
``notes`` record the decisions.  The last draft becomes the plan.
"""

from __future__ import annotations

from collections.abc import Mapping

from passgraph.formats import Format
from passgraph.graph.targets import Target
from passgraph.plan.collect import collect
from passgraph.plan.data import Options, Plan
from passgraph.plan.emit import emit
from passgraph.plan.fuse import fuse
from passgraph.plan.limits import Limits, check
from passgraph.plan.order import order
from passgraph.plan.specialize import specialize
from passgraph.plan.trim import cull, trim


def build(
    outputs: Mapping[str, Target],
    size: tuple[int, int] | None = None,
    inputs: Mapping[str, tuple[Format, tuple[int, int]]] | None = None,
    options: Options | None = None,
    limits: Limits | None = None,
    *,
    in_windows: bool = False,
) -> Plan:
    """Plan the passes behind ``outputs``.

    Parameters
    ----------
    outputs
        Result name → target.
    size
        (width, height) of the output in pixels; default: the size of the first input.
    inputs
        Format and size of each input that the graph leaves open.
    options
        Optimizations that run; default: all.
    limits
        Limits of the device; default: none.
    in_windows
        Pictures are never allocated whole (see :mod:`.window`): they may exceed the limits of device and memory.

    Raises
    ------
    GraphError
        For a cycle, inconsistent sizes or formats, or history that no pass writes; the message names pass, target and
        remedy.
    BackendError
        For a pass that exceeds a device limit, with pass, limit and device.
    """
    options = options or Options()
    limits = limits or Limits()
    draft = specialize(collect(outputs, size, inputs or {}, in_windows), options, limits)
    if any(target.has_levels for node in draft.passes for target in node.images.values()):
        from passgraph.plan.mipmaps import add_levels

        draft = add_levels(draft)
    draft = cull(draft)
    while (trimmed := trim(draft)) is not draft:
        draft = cull(trimmed)
    draft = fuse(draft)
    plan = emit(draft, order(draft))
    if not in_windows:
        check(plan, limits)
    return plan
