"""Build a plan from targets, phase by phase.

collect → specialize → levels → cull, trim → fuse → order → lifetimes and memory → static → emit → limits.  Each
phase takes and returns plain data; what it decided goes into ``notes``.
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
from passgraph.plan.specialise import specialise
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
        (width, height) of the output in pixels; left out, the size of the first input.
    inputs
        Format and size of each input, for those that the graph leaves open.
    options
        Which optimizations run; all by default.
    limits
        What the device takes; left out, nothing is held back.
    in_windows
        The pictures will never be made whole (see :mod:`.window`): they may be larger than a device or memory takes.

    Raises
    ------
    GraphError
        For a cycle, sizes or formats that do not fit, history that nothing writes; the message names pass,
        target and mend.
    BackendError
        For what the device does not take, with pass, limit and device.
    """
    options = options or Options()
    limits = limits or Limits()
    work = collect(outputs, size, inputs or {}, options, in_windows)
    work.filters = limits.filters
    specialise(work)
    if any(target.has_levels for node in work.passes for target in node.images.values()):
        from passgraph.plan.mipmaps import add_levels

        add_levels(work)
    cull(work)
    while trim(work):
        cull(work)
    fuse(work, limits)
    sequence = order(work)
    plan = emit(work, sequence)
    if not in_windows:
        check(plan, limits)
    return plan
