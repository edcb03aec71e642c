"""The fragments of one tile, all at once, after the nearest triangle of every pixel is known.

Only draws whose fragments do not depend on one another are shaded so; the rest go through merge.py.
"""

from __future__ import annotations

from typing import Any

from passgraph.backends.numpy.machine import ir
from passgraph.backends.numpy.machine.native import Code, function_code
from passgraph.backends.numpy.raster.kernel import Fragments, kernel_parts
from passgraph.backends.numpy.raster.layout import TILE
from passgraph.backends.numpy.raster.planes import interpolated
from passgraph.backends.numpy.vector.lanes import counting
from passgraph.backends.numpy.vector.operations import I32
from passgraph.plan.data import DrawStep


def is_deferred(step: DrawStep) -> bool:
    """Whether a pixel's last fragment alone decides what it becomes."""
    state, program = step.state, step.fragment
    if program is None:
        return state.stencil is None
    blends = any(blend is not None for blend in state.blend)
    masks = any(not all(mask) for mask in state.color_mask)
    return state.stencil is None and program.keep is None and not blends and not masks


def shade_code(step: DrawStep) -> Code:
    """Compile ``shade(context, ids, planes, x, y, rows)`` for a draw: it writes every pixel of a tile that a triangle
    covers, and the clear colour on the others where the draw clears."""
    return function_code(("shade", *kernel_parts(step)), lambda name: _Shade(step, name).text())


class _Shade(Fragments):
    """LLVM text of one shading function."""

    def __init__(self, step: DrawStep, name: str) -> None:
        super().__init__(step, name, pointers=3, numbers=3)

    def text(self) -> str:
        b = self.builder
        context, ids, self.planes, left, top, rows = self.function.args
        self.memory = self.found_in(context)
        self.left, self.top = b.trunc(left, I32), b.trunc(top, I32)
        end = b.mul(b.trunc(rows, I32), ir.Constant(I32, TILE))
        with counting(b, ir.Constant(I32, 0), end, ir.Constant(I32, b.lanes)) as at:
            where = b.gep(ids, [at], True, source_etype=I32)
            slots = b.load(where, typ=b.vector(I32), align=4)
            covered = b.icmp_signed(">=", slots, ir.Constant(I32, 0))
            with b.if_else(b.any(covered)) as (shade, empty):
                with shade:
                    self._pixels(at, slots, covered)
                with empty:
                    self._store(at, covered, None)
        b.ret_void()
        return str(self.module)

    def _pixels(self, at: Any, slots: Any, covered: Any) -> None:
        """Interpolate, run the kernel, store: neighbours in one row of the tile."""
        b = self.builder
        largest = b.intrinsic(f"llvm.vector.reduce.smax.v{b.lanes}i32", I32, [slots.type])
        one = b.plain.call(largest, [slots])
        # Lanes that no triangle covers go with one that some other lane has.
        slots = b.select(covered, slots, one)
        x = b.add(b.add(self.left, b.and_(at, ir.Constant(I32, TILE - 1))), b.counting(I32))
        y = b.add(self.top, b.lshr(at, ir.Constant(I32, TILE.bit_length() - 1)))
        given = self.places(x, y) | self._builtins(slots, one, x, y)
        self._store(at, covered, self.run(given, covered)[0])

    def _store(self, at: Any, covered: Any, results: list[Any] | None) -> None:
        """Results where a triangle covers a pixel, elsewhere the clear colour; no results: only that."""
        b = self.builder
        column = b.add(self.left, b.and_(at, ir.Constant(I32, TILE - 1)))
        row = b.add(self.top, b.lshr(at, ir.Constant(I32, TILE.bit_length() - 1)))
        inside = b.icmp_signed("<", b.add(column, b.counting(I32)), self.memory["width"])
        begin = 0
        for number, count in enumerate(self.channels):
            parts = [] if results is None else results[begin : begin + count]
            mask = covered
            if self.step.clears[number] is not None:
                clears = self.clears(number)
                parts = [b.select(covered, *pair) for pair in zip(parts, clears, strict=True)] if parts else clears
                mask = inside
            begin += count
            if parts:
                self.stored(number, column, row, parts, mask)

    def _builtins(self, slots: Any, one: Any, x: Any, y: Any) -> dict[str, Any]:
        """What the triangles' planes say here."""
        b, wanted = self.builder, self.interpolated
        if not wanted:
            return {}
        # Inside large triangles all lanes have the same planes, and one load serves all.
        same, apart, merged = (b.append_basic_block(name) for name in ("same", "apart", "merged"))
        b.cbranch(b.all(b.icmp_signed("==", slots, one)), same, apart)
        sides = []
        for block, slot in ((same, one), (apart, slots)):
            b.position_at_end(block)
            values = [b.spread(value) for value in interpolated(b, self.step, self.planes, slot, x, y, wanted)]
            sides.append((values, b.block))
            b.branch(merged)
        b.position_at_end(merged)
        given = {}
        for number, name in enumerate(wanted):
            phi = b.phi(sides[0][0][number].type)
            for values, block in sides:
                phi.add_incoming(values[number], block)
            given[name] = phi
        return given
