"""Fragments that depend on those below them: stencil and depth tests, updates, blending and masks, in vectors."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from passgraph.backends.numpy.machine import ir
from passgraph.backends.numpy.machine.native import Code, function_code
from passgraph.backends.numpy.raster.blocks import Blocks
from passgraph.backends.numpy.raster.entries import SPAN_ROWS
from passgraph.backends.numpy.raster.kernel import Fragments, kernel_parts
from passgraph.backends.numpy.raster.layout import TILE
from passgraph.backends.numpy.raster.planes import interpolated, plane_numbers
from passgraph.backends.numpy.storage import FLOAT
from passgraph.backends.numpy.vector.lane_body import LaneBody
from passgraph.backends.numpy.vector.lanes import Lanes, counting
from passgraph.backends.numpy.vector.operations import BOOL, F32, I8, I32, I64
from passgraph.backends.numpy.vector.stored import element
from passgraph.graph.draw_state import Stencil
from passgraph.plan.data import DrawStep

_SIGNS = {"less": "<", "equal": "==", "less_equal": "<=", "greater": ">", "not_equal": "!=", "greater_equal": ">="}
_FULL = ir.Constant(I32, 255)
_ONE, _NONE = ir.Constant(I32, 1), ir.Constant(I32, 0)
#: What becomes of a held stencil value, by the operation's name; ``r`` is the reference.
_STENCIL: dict[str, Callable[[Lanes, Any, Any], Any]] = {
    "keep": lambda b, held, r: held,
    "zero": lambda b, held, r: _NONE,
    "replace": lambda b, held, r: r,
    "increment": lambda b, held, r: b.select(b.icmp_signed("<", held, _FULL), b.add(held, _ONE), held),
    "increment_wrap": lambda b, held, r: b.and_(b.add(held, _ONE), _FULL),
    "decrement": lambda b, held, r: b.select(b.icmp_signed(">", held, _NONE), b.sub(held, _ONE), held),
    "decrement_wrap": lambda b, held, r: b.and_(b.sub(held, _ONE), _FULL),
    "invert": lambda b, held, r: b.xor(held, _FULL),
}


def merge_code(step: DrawStep) -> Code:
    """Compile ``merge(context, spans, triangle, left, top, bottom, clear)`` for a draw.

    It writes one triangle's pixels in a tile, ``spans`` of the rows ``top`` to ``bottom``; or, with ``clear`` other
    than 0, it clears those rows of the tile.
    """
    state = step.state
    fixed = (step.depth is not None, state.depth_compare, state.depth_write, state.stencil, state.color_mask)
    blends = [None if program is None else program.key for program in step.blending]
    parts = ("merge", *kernel_parts(step), repr(fixed), repr(blends))
    return function_code(parts, lambda name: _Merge(step, name).text())


def _rows(step: DrawStep) -> int:
    """Of a block.  Squares leave fewer lanes idle at edges; where next to nothing is computed, rows are read faster."""
    if step.fragment is None or step.fragment.keep is not None:
        return 1 if step.fragment is None else 4
    masks = step.state.color_mask
    return 4 if not masks or any(any(mask) for mask in masks) else 1


class _Merge(Fragments):
    """LLVM text of one such function."""

    def __init__(self, step: DrawStep, name: str) -> None:
        super().__init__(step, name, pointers=3, numbers=4)
        self.blocks = Blocks(self.builder, _rows(step))

    def text(self) -> str:
        b = self.builder
        context, spans, self.triangle, left, top, bottom, clear = self.function.args
        for given in (spans, self.triangle):
            given.add_attribute("noalias")
        self.triangle.add_attribute(f"dereferenceable({8 * plane_numbers(self.step)})")
        self.memory = self.found_in(context)
        left, top, bottom = (b.trunc(number, I32) for number in (left, top, bottom))
        with b.if_else(b.icmp_signed("!=", clear, ir.Constant(I64, 0))) as (clears, draws):
            with clears, counting(b, top, b.add(bottom, _ONE), _ONE) as y:
                self._clear(left, y)
            with draws, counting(b, top, b.add(bottom, _ONE), ir.Constant(I32, self.blocks.rows)) as y:
                self._row(spans, y, top, bottom)
        b.ret_void()
        return str(self.module)

    def _clear(self, left: Any, y: Any) -> None:
        """One row of the tile."""
        b = self.builder
        with counting(b, left, b.add(left, ir.Constant(I32, TILE)), ir.Constant(I32, b.lanes)) as x:
            inside = b.icmp_signed("<", b.add(x, b.counting(I32)), self.memory["width"])
            for number in range(len(self.channels)):
                if self.step.clears[number] is not None:
                    self.stored(number, x, y, self.clears(number), inside)

    def _row(self, spans: Any, y: Any, top: Any, bottom: Any) -> None:
        """A row of blocks."""
        b, blocks = self.builder, self.blocks
        kind = ir.VectorType(I32, blocks.rows)
        ends = []
        for side, name in enumerate(("smin", "smax")):
            offset = b.add(b.sub(y, top), ir.Constant(I32, side * SPAN_ROWS))
            loaded = b.load(b.gep(spans, [offset], True, source_etype=I32), typ=kind, align=4)
            reduce = b.intrinsic(f"llvm.vector.reduce.{name}.v{blocks.rows}i32", I32, [kind])
            ends.append((blocks.spread(loaded), b.plain.call(reduce, [loaded])))
        (firsts, low), (lasts, high) = ends
        self.y = b.add(y, blocks.row()) if blocks.rows > 1 else y
        self.rows = []
        for row in range(blocks.rows):
            # Rows beyond the triangle's end are not in the picture, perhaps.
            there = b.add(y, ir.Constant(I32, row))
            self.rows.append(b.select(b.icmp_signed("<", there, bottom), there, bottom))
        with counting(b, low, b.add(high, _ONE), ir.Constant(I32, blocks.columns)) as self.x:
            x = b.add(self.x, blocks.column())
            covered = b.and_(b.icmp_signed(">=", x, firsts), b.icmp_signed("<=", x, lasts))
            self.given = self.places(x, self.y)
            self.columns = x
            self._fragments(covered)

    def _planes(self, names: list[str]) -> None:
        """Make builtins known that depend on the triangle."""
        new = [name for name in names if name not in self.given]
        found = interpolated(self.builder, self.step, self.triangle, _NONE, self.columns, self.y, new)
        self.given |= {name: self.builder.spread(value) for name, value in zip(new, found, strict=True)}

    def _at(self, name: str, channels: int, kind: Any) -> list[Any]:
        """Where the rows of a block lie."""
        return [self.pixel(name, self.x, row, channels, kind) for row in self.rows]

    def _kernel(self, mask: Any) -> tuple[list[Any], Any]:
        self._planes(self.interpolated)
        return self.run(self.given, mask)

    def _fragments(self, covered: Any) -> None:
        """Rule 6 of docs/rasterisation.md.

        A kernel that discards runs before what it may prevent, but behind the depth test where nothing else hangs on
        that.
        """
        b, step, program = self.builder, self.step, self.program
        discards, stencil = program is not None and program.keep is not None, step.state.stencil
        results: list[Any] = []
        kept = covered
        if discards and stencil is not None:
            results, kept = self._kernel(covered)
        passed = self._depth_test(kept)
        if stencil is not None:
            passed = self._stencil_test(stencil, kept, passed)
        with b.if_then(b.any(passed)):
            if not results:
                results, passed = self._kernel(passed)
            if step.depth is not None and step.state.depth_write:
                self._planes(["fragment_depth"])
                self.blocks.store(self._at("depth", 1, F32), [self.given["fragment_depth"]], [passed], FLOAT)
            self._colours(results, passed)

    def _depth_test(self, mask: Any) -> Any:
        """The lanes of the mask that pass."""
        b, compare = self.builder, self.step.state.depth_compare
        if self.step.depth is None or compare == "always":
            return mask
        if compare == "never":
            return b.spread(ir.Constant(BOOL, 0))
        self._planes(["fragment_depth"])
        (held,) = self.blocks.load(self._at("depth", 1, F32), 1, FLOAT)
        method = b.fcmp_unordered if compare == "not_equal" else b.fcmp_ordered
        return b.and_(mask, method(_SIGNS[compare], self.given["fragment_depth"], held))

    def _stencil_test(self, stencil: Stencil, mask: Any, deep: Any) -> Any:
        """Update the stencil in the lanes of the mask, of which ``deep`` pass the depth test; those that pass both."""
        b = self.builder
        places = self._at("stencil", 1, I8)
        (loaded,) = self.blocks.numbers(places, 1, I8, 1)
        held = b.zext(loaded, I32)
        if stencil.compare in _SIGNS:
            seen = b.and_(held, ir.Constant(I32, stencil.read_mask))
            shown = b.icmp_signed(
                _SIGNS[stencil.compare], ir.Constant(I32, stencil.reference & stencil.read_mask), seen
            )
        else:
            shown = b.spread(ir.Constant(BOOL, int(stencil.compare == "always")))
        operations = (stencil.passed, stencil.depth_fail, stencil.fail)
        if stencil.write_mask and set(operations) != {"keep"}:
            given = ir.Constant(I32, stencil.reference)
            passed, failed, hidden = (b.spread(_STENCIL[name](b, held, given)) for name in operations)
            changed = b.select(shown, b.select(deep, passed, failed), hidden)
            rest = b.and_(held, ir.Constant(I32, 255 & ~stencil.write_mask))
            changed = b.or_(rest, b.and_(changed, ir.Constant(I32, stencil.write_mask)))
            self.blocks.store_numbers(places, [b.trunc(changed, I8)], [mask], 1)
        return b.and_(shown, deep)

    def _colours(self, results: list[Any], passed: Any) -> None:
        """Each target's components, blended with what it holds if the draw blends, into the channels that it writes."""
        b, step = self.builder, self.step
        begin = 0
        for number, count in enumerate(self.channels):
            parts, begin = results[begin : begin + count], begin + count
            mask = step.state.color_mask[number][:count] if step.state.color_mask else (True,) * count
            if not any(mask):
                continue
            held = step.output_formats[number]
            places = self._at(f"out{number}", count, element(held))
            blend = step.blending[number]
            if blend is not None:
                given = {f"source.{c}": part for c, part in enumerate(parts)}
                given |= {f"destination.{c}": part for c, part in enumerate(self.blocks.load(places, count, held))}
                parts = [b.spread(value) for value in LaneBody(blend, b, given, {}, passed).results()]
            none = b.spread(ir.Constant(BOOL, 0))
            self.blocks.store(places, parts, [passed if written else none for written in mask], held)
