"""What triangles' numbers (layout.py) say at the pixels of a vector."""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

from typing import Any

from llvmlite import ir

from passgraph.backends.numpy.raster.layout import DEPTH, EDGE1, EDGE2, FRONT, NEARNESS, PLANES, TO_Y, VARYINGS
from passgraph.backends.numpy.vector.lanes import Lanes
from passgraph.backends.numpy.vector.operations import F32, F64, I32
from passgraph.plan.data import DrawStep


def plane_rows(step: DrawStep) -> int:
    """Rows of numbers of each triangle: depth, and more where something is interpolated."""
    return VARYINGS + len(step.varyings) if step.varyings else 1


def plane_numbers(step: DrawStep) -> int:
    """Numbers kept of each triangle."""
    return PLANES + 3 * plane_rows(step)


def interpolated(b: Lanes, step: DrawStep, table: Any, slot: Any, x: Any, y: Any, names: list[str]) -> list[Any]:
    """Builtins of the triangle in that place of the table, or of one triangle a lane, at pixels (``x``, ``y``).

    Perspective-correct: the corners, by how near the pixel's centre is to each (rasterisation rule 5).
    """
    base = b.mul(slot, ir.Constant(I32, plane_numbers(step)))

    def entry(place: int) -> Any:
        return b.load_at(table, b.add(base, ir.Constant(I32, place)), F64, steady=False)

    across = b.sitofp(x, F64)
    down = b.fadd(entry(TO_Y), b.sitofp(y, F64))

    def numbers(row: int) -> list[Any]:
        return [entry(PLANES + 3 * row + part) for part in range(3)]

    def plane(row: int) -> Any:
        start, step_x, step_y = numbers(row)
        return b.fadd(b.fadd(start, b.fmul(step_y, down)), b.fmul(step_x, across))

    def nearness() -> list[Any]:
        """To the second and the third corner; to all three it is 1."""
        edges, (area, *more) = (plane(EDGE1), plane(EDGE2)), numbers(NEARNESS)
        parts = [b.fmul(edge, factor) for edge, factor in zip(edges, more, strict=True)]
        # Nothing here is negative: the sum keeps its digits, however near to the eye one corner is.
        total = b.fadd(b.fadd(b.fsub(b.fsub(area, edges[0]), edges[1]), parts[0]), parts[1])
        share = b.fdiv(ir.Constant(F64, 1.0), total)
        return [b.fmul(part, share) for part in parts]

    near: list[Any] = []
    found = []
    for name in names:
        if name == "front_facing":
            found.append(b.fcmp_ordered("!=", entry(FRONT), ir.Constant(F64, 0.0)))
        elif name == "fragment_depth":
            z = plane(DEPTH)
            z = b.select(b.fcmp_ordered("<", z, ir.Constant(F64, 0.0)), ir.Constant(F64, 0.0), z)
            z = b.select(b.fcmp_ordered(">", z, ir.Constant(F64, 1.0)), ir.Constant(F64, 1.0), z)
            found.append(b.fptrunc(z, F32))
        else:
            near = near or nearness()
            row = VARYINGS + step.varyings.index(name.removeprefix("varying."))
            value, *more = numbers(row)
            for part, share in zip(more, near, strict=True):
                value = b.fadd(value, b.fmul(part, share))
            found.append(b.fptrunc(value, F32))
    return found
