"""Pictures of files have no slices: taken for volumes of one slice they would be read as something else."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from passgraph.language import ir


def read_as_volumes(program: ir.TypedKernel) -> list[str]:
    """The images whose slices a kernel asks for."""
    read = ir.expressions(*program.body, *(result.value for result in program.results))
    return list(dict.fromkeys(one.image for one in read if isinstance(one, ir.Property) and one.name == "slices"))


def flat_volumes(outputs: Iterable[Any]) -> list[str]:
    """The names of pictures without slices that passes behind these targets read as volumes."""
    from passgraph.graph.targets import PixelPass
    from passgraph.plan.reach import passes_behind

    passes = [made for made in passes_behind(list(outputs)) if isinstance(made, PixelPass)]
    return [name for one in passes for name in read_as_volumes(one.kernel.program) if one.images[name].slice_count == 1]
