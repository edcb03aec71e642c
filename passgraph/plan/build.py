"""From targets to a plan, phase by phase.

collect → specialise → cull → fuse → order → lifetimes and memory → static → emit.  Each phase takes and returns
plain data; what it decided goes into ``notes``.
"""

from __future__ import annotations

from collections.abc import Mapping

from passgraph.formats import Format
from passgraph.plan.collect import collect
from passgraph.plan.data import Options, Plan
from passgraph.plan.emit import emit
from passgraph.plan.fuse import fuse
from passgraph.plan.order import order
from passgraph.plan.specialise import cull, specialise
from passgraph.targets import Target


def build(
    outputs: Mapping[str, Target],
    size: tuple[int, int] | None = None,
    inputs: Mapping[str, tuple[Format, tuple[int, int]]] | None = None,
    options: Options | None = None,
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
        Which optimisations run; all by default.

    Raises
    ------
    GraphError
        For a cycle, sizes or formats that do not fit, history that nothing writes; the message names pass,
        target and mend.
    """
    options = options or Options()
    work = collect(outputs, size, inputs or {}, options)
    specialise(work)
    cull(work)
    fuse(work)
    sequence = order(work)
    return emit(work, sequence)
