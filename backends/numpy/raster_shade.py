"""The fragments of one tile, all at once, after the nearest triangle of every pixel is known.

Only draws whose fragments do not depend on one another are shaded so; the rest go through raster_code.py.
"""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

from typing import Any

from llvmlite import ir

from passgraph.backends.numpy.lane_body import LaneBody
from passgraph.backends.numpy.lanes import Lanes, counting
from passgraph.backends.numpy.llvm_names import (
    DEPTH,
    EDGE1,
    EDGE2,
    FRONT,
    NEARNESS,
    PLANES,
    TILE,
    TO_Y,
    VARYINGS,
    is_varying,
)
from passgraph.backends.numpy.llvm_ops import F32, F64, I32, I64
from passgraph.backends.numpy.native import function_address, lanes
from passgraph.plan.data import DrawStep


def is_deferred(step: DrawStep) -> bool:
    """Whether a pixel's last fragment alone decides what it becomes."""
    state, program = step.state, step.fragment
    if program is None:
        return state.stencil is None
    blends = any(blend is not None for blend in state.blend)
    masks = any(not all(mask) for mask in state.color_mask)
    return state.stencil is None and program.keep is None and not blends and not masks


def plane_rows(step: DrawStep) -> int:
    """Rows of numbers of each triangle: depth, and more where something is interpolated."""
    return VARYINGS + len(step.varyings) if step.varyings else 1


def plane_numbers(step: DrawStep) -> int:
    """Numbers kept of each visible triangle."""
    return PLANES + 3 * plane_rows(step)


def shade_address(step: DrawStep) -> int:
    """Compile ``shade(context, ids, planes, x, y, rows)`` for a draw: it writes every pixel of a tile that a triangle
    covers, and the clear colour on the others where the draw clears."""
    program = step.fragment
    assert program is not None
    cleared = [clear is not None for clear in step.clears]
    parts = (
        "shade",
        program.key,
        repr(cleared),
        repr(step.varyings),
        repr([name for name, _ in program.builtins]),
        str(lanes()),
    )
    return function_address(parts, lambda name: _Printer(step, name).text())


def context_names(step: DrawStep) -> list[str]:
    """Entries of the context, in order: each an address or a size."""
    program = step.fragment
    assert program is not None
    names = ["floats", "ints", "clears", "width", "height"]
    for number in range(len(program.images)):
        names += [f"im{number}", f"im{number}_w", f"im{number}_h"]
    return [*names, *(f"out{number}" for number in range(len(program.outputs)))]


class _Printer:
    """LLVM text of one shading function."""

    def __init__(self, step: DrawStep, name: str) -> None:
        assert step.fragment is not None
        self.step, self.program = step, step.fragment
        self.module = ir.Module(name)
        pointer = ir.PointerType()
        kind = ir.FunctionType(ir.VoidType(), [pointer, pointer, pointer, I64, I64, I64])
        self.function = ir.Function(self.module, kind, name)
        self.builder = Lanes(ir.IRBuilder(self.function.append_basic_block("entry")), lanes())

    def text(self) -> str:
        b = self.builder
        context, ids, planes, left, top, rows = self.function.args
        self.planes, self.ids = planes, ids
        self.memory = self._memory(context)
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

    def _memory(self, context: Any) -> dict[str, Any]:
        """The context's entries: pointers, or sizes as int32."""
        b = self.builder
        found = {}
        for place, name in enumerate(context_names(self.step)):
            entry = b.load_at(context, ir.Constant(I64, place), I64, steady=True)
            size = name in ("width", "height") or name.endswith(("_w", "_h"))
            found[name] = b.trunc(entry, I32) if size else b.inttoptr(entry, ir.PointerType())
        return found

    def _pixels(self, at: Any, slots: Any, covered: Any) -> None:
        """Interpolate, run the kernel, store: neighbours in one row of the tile."""
        b = self.builder
        largest = b.intrinsic(f"llvm.vector.reduce.smax.v{b.lanes}i32", I32, [slots.type])
        one = b.plain.call(largest, [slots])
        # Lanes that no triangle covers go with one that some other lane has.
        slots = b.select(covered, slots, one)
        x = b.add(b.add(self.left, b.and_(at, ir.Constant(I32, TILE - 1))), b.counting(I32))
        y = b.add(self.top, b.lshr(at, ir.Constant(I32, TILE.bit_length() - 1)))
        given = self._builtins(slots, one, x, y)
        body = LaneBody(self.program, b, given, self.memory, covered)
        self._store(at, covered, body.results())

    def _store(self, at: Any, covered: Any, results: list[Any] | None) -> None:
        """Results where a triangle covers a pixel, elsewhere the clear colour; no results: only that."""
        b = self.builder
        column = b.add(self.left, b.and_(at, ir.Constant(I32, TILE - 1)))
        row = b.add(self.top, b.lshr(at, ir.Constant(I32, TILE.bit_length() - 1)))
        first = b.add(b.mul(b.sext(row, I64), b.sext(self.memory["width"], I64)), b.sext(column, I64))
        inside = b.icmp_signed("<", b.add(column, b.counting(I32)), self.memory["width"])
        begin = 0
        for number, output in enumerate(self.program.outputs):
            count = len(output.values)
            parts = [] if results is None else [b.spread(value) for value in results[begin : begin + count]]
            mask = covered
            if self.step.clears[number] is not None:
                places = [ir.Constant(I64, begin + channel) for channel in range(count)]
                clears = [b.spread(b.load_at(self.memory["clears"], place, F32, steady=True)) for place in places]
                parts = [b.select(covered, *pair) for pair in zip(parts, clears, strict=True)] if parts else clears
                mask = inside
            begin += count
            if parts:
                start = b.mul(first, ir.Constant(I64, count))
                place = b.gep(self.memory[f"out{number}"], [start], True, source_etype=F32)
                b.store_masked(b.interleaved(parts), place, b.interleaved([mask] * count), F32)

    def _builtins(self, slots: Any, one: Any, x: Any, y: Any) -> dict[str, Any]:
        """What the kernel reads: place, size, and what the triangle's planes say here."""
        b = self.builder
        names = [name for name, _ in self.program.builtins]
        given = {"x": x, "y": y, "pixel.0": x, "pixel.1": y,
                 "output_size.0": self.memory["width"], "output_size.1": self.memory["height"]}  # fmt: skip
        for number, use in enumerate(self.program.images):
            given |= {f"size.{use.name}.{axis}": self.memory[f"im{number}_{'wh'[axis]}"] for axis in range(2)}
        wanted = [n for n in names if is_varying(n) or n in ("front_facing", "fragment_depth")]
        if not wanted:
            return given
        # Inside large triangles all lanes have the same planes, and one load serves all.
        same, apart, merged = (b.append_basic_block(name) for name in ("same", "apart", "merged"))
        b.cbranch(b.all(b.icmp_signed("==", slots, one)), same, apart)
        sides = []
        for block, slot in ((same, one), (apart, slots)):
            b.position_at_end(block)
            values = [b.spread(value) for value in self._interpolated(wanted, slot, x, y)]
            sides.append((values, b.block))
            b.branch(merged)
        b.position_at_end(merged)
        for number, name in enumerate(wanted):
            phi = b.phi(sides[0][0][number].type)
            for values, block in sides:
                phi.add_incoming(values[number], block)
            given[name] = phi
        return given

    def _interpolated(self, names: list[str], slot: Any, x: Any, y: Any) -> list[Any]:
        """Perspective-correct: the corners, by how near the pixel's centre is to each (rasterisation rule 5)."""
        b = self.builder
        base = b.mul(slot, ir.Constant(I32, plane_numbers(self.step)))

        def entry(place: int) -> Any:
            return b.load_at(self.planes, b.add(base, ir.Constant(I32, place)), F64, steady=False)

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
                row = VARYINGS + self.step.varyings.index(name.removeprefix("varying."))
                value, *more = numbers(row)
                for part, share in zip(more, near, strict=True):
                    value = b.fadd(value, b.fmul(part, share))
                found.append(b.fptrunc(value, F32))
        return found
