"""What triangles' numbers (layout.py) say at the pixels of a vector."""

from __future__ import annotations

from typing import Any

from passgraph.backends.numpy.machine import ir
from passgraph.backends.numpy.raster.layout import DEPTH, EDGE1, EDGE2, FRONT, NEARNESS, PLANES, TO_Y, VARYINGS
from passgraph.backends.numpy.vector.lanes import Lanes
from passgraph.backends.numpy.vector.operations import F32, F64, I32
from passgraph.language.ir import own_pixel
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
    pixels: dict[str, _Pixel] = {}
    found = []
    for builtin in names:
        name, axes = own_pixel(builtin)
        if axes not in pixels:
            there = (b.xor(at, ir.Constant(I32, 1)) if axis in axes else at for axis, at in (("x", x), ("y", y)))
            pixels[axes] = _Pixel(b, step, table, slot, *there)
        found.append(pixels[axes].value(name))
    return found


class _Pixel:
    """A pixel's centre in its triangle, or in the triangle's plane beside it."""

    def __init__(self, b: Lanes, step: DrawStep, table: Any, slot: Any, x: Any, y: Any) -> None:
        self.b, self.step, self.table = b, step, table
        self.base = b.mul(slot, ir.Constant(I32, plane_numbers(step)))
        self.across = b.sitofp(x, F64)
        self.down = b.fadd(self._entry(TO_Y), b.sitofp(y, F64))
        self.near: list[Any] = []

    def value(self, name: str) -> Any:
        """A builtin that hangs on the triangle."""
        b = self.b
        if name == "front_facing":
            return b.fcmp_ordered("!=", self._entry(FRONT), ir.Constant(F64, 0.0))
        if name == "fragment_depth":
            z = self._plane(DEPTH)
            z = b.select(b.fcmp_ordered("<", z, ir.Constant(F64, 0.0)), ir.Constant(F64, 0.0), z)
            z = b.select(b.fcmp_ordered(">", z, ir.Constant(F64, 1.0)), ir.Constant(F64, 1.0), z)
            return b.fptrunc(z, F32)
        self.near = self.near or self._nearness()
        value, *more = self._numbers(VARYINGS + self.step.varyings.index(name.removeprefix("varying.")))
        for part, share in zip(more, self.near, strict=True):
            value = b.fadd(value, b.fmul(part, share))
        return b.fptrunc(value, F32)

    def _nearness(self) -> list[Any]:
        """To the second and the third corner; to all three it is 1."""
        b = self.b
        edges, (area, *more) = (self._plane(EDGE1), self._plane(EDGE2)), self._numbers(NEARNESS)
        parts = [b.fmul(edge, factor) for edge, factor in zip(edges, more, strict=True)]
        # In the triangle nothing is negative: the sum keeps its digits, however near to the eye one corner is.
        total = b.fadd(b.fadd(b.fsub(b.fsub(area, edges[0]), edges[1]), parts[0]), parts[1])
        share = b.fdiv(ir.Constant(F64, 1.0), total)
        return [b.fmul(part, share) for part in parts]

    def _plane(self, row: int) -> Any:
        b = self.b
        start, step_x, step_y = self._numbers(row)
        return b.fadd(b.fadd(start, b.fmul(step_y, self.down)), b.fmul(step_x, self.across))

    def _numbers(self, row: int) -> list[Any]:
        return [self._entry(PLANES + 3 * row + part) for part in range(3)]

    def _entry(self, place: int) -> Any:
        b = self.b
        return b.load_at(self.table, b.add(self.base, ir.Constant(I32, place)), F64, steady=False)
