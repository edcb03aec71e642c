"""Fragments in vectors: the kernel, shading of a whole tile, and tests and blending in order."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from passgraph.backends.numpy.machine import llvm
from passgraph.backends.numpy.machine.llvm import IRBuilder
from passgraph.backends.numpy.machine.machine_code import Code, function_code, lanes
from passgraph.backends.numpy.raster.layout import SPAN_ROWS, TILE, is_of_triangle
from passgraph.backends.numpy.raster.planes import Blocks, interpolated, plane_numbers
from passgraph.backends.numpy.storage import FLOAT
from passgraph.backends.numpy.vector.lane_body import LaneBody, for_lanes
from passgraph.backends.numpy.vector.lanes import BOOL, F32, I8, I32, I64, Lanes, counting
from passgraph.backends.numpy.vector.texels import element, rounded, store
from passgraph.formats import Format
from passgraph.graph.draw_state import Stencil
from passgraph.language.builtin_name import OUTPUT_SIZE, PIXEL, BuiltinName, size_names
from passgraph.language.scalar import ScalarProgram
from passgraph.plan.data import DrawStep

#: Suffixes of an image's sizes: width and height, and row stride in pixels.
SIZES = ("_w", "_h", "_p")


def kernel_parts(step: DrawStep) -> tuple[str, ...]:
    """Return the key of a draw's fragment code, apart from the draw's state."""
    cleared = [clear is not None for clear in step.clears]
    program = step.fragment
    kernel = () if program is None else (program.key, repr([name for name, _ in program.builtins]))
    formats = [(format_.number, format_.steps) for format_ in (*_image_formats(step), *step.output_formats)]
    return *kernel, repr(cleared), repr(formats), repr(step.varyings), str(lanes())


def context_names(step: DrawStep) -> list[str]:
    """Return the names of the context's entries, in order: each an address or a size."""
    names = ["floats", "ints", "clears", "depth", "stencil", "width", "height"]
    return [
        *names,
        *image_names(step.fragment),
        *(f"out{number}{end}" for number in range(len(step.outputs)) for end in ("", "_p")),
    ]


def image_names(program: ScalarProgram | None) -> list[str]:
    """Return the names of context entries for a program's images."""
    count = 0 if program is None else len(program.images)
    return [f"im{number}{end}" for number in range(count) for end in ("", *SIZES)]


def found_in(b: Lanes, context: Any, names: Sequence[str]) -> dict[str, Any]:
    """Return a context's entries: pointers, or sizes as int32."""
    values = {}
    for place, name in enumerate(names):
        entry = b.load_at(context, llvm.Constant(I64, place), I64, steady=True)
        size = name in ("width", "height") or name.endswith(SIZES)
        values[name] = b.trunc(entry, I32) if size else b.inttoptr(entry, llvm.PointerType())
    return values


def image_sizes(program: ScalarProgram | None, memory: Mapping[str, Any]) -> dict[BuiltinName, Any]:
    """Return the builtins with the sizes of images, and the lengths of their rows."""
    found = {}
    for number, use in enumerate(() if program is None else program.images):
        for name, entry in zip((*size_names(use.name), BuiltinName("pitch", use.name)), "whp", strict=True):
            found[name] = memory[f"im{number}_{entry}"]
    return found


def _image_formats(step: DrawStep) -> tuple[Format, ...]:
    return step.image_formats[len(step.vertex.images) :]


class Fragments:
    """An LLVM function under construction, whose arguments are pointers (the first is the context) and integers."""

    def __init__(self, step: DrawStep, name: str, pointers: int, numbers: int) -> None:
        self.step, self.program = step, step.fragment
        self.module = llvm.Module(name)
        kind = llvm.FunctionType(llvm.VoidType(), [llvm.PointerType()] * pointers + [I64] * numbers)
        self.function = llvm.Function(self.module, kind, name)
        self.builder = Lanes(IRBuilder(self.function), lanes())
        self.memory: dict[str, Any] = {}
        builtins = [] if self.program is None else [name for name, _ in self.program.builtins]
        #: Builtins that depend on the triangle.
        self.interpolated = [name for name in builtins if is_of_triangle(name)]
        #: Clear values of each target.
        self.channels = [] if self.program is None else [len(output.values) for output in self.program.outputs]

    def found_in(self, context: Any) -> dict[str, Any]:
        """Return the context's entries: pointers, or sizes as int32."""
        return found_in(self.builder, context, context_names(self.step))

    def places(self, x: Any, y: Any) -> dict[BuiltinName, Any]:
        """Return the builtins that depend on the position only."""
        size = self.memory["width"], self.memory["height"]
        place = dict(zip((*PIXEL, *OUTPUT_SIZE), (x, y, *size), strict=True))
        return place | image_sizes(self.program, self.memory)

    def run(self, builtins: dict[BuiltinName, Any], mask: Any) -> tuple[list[Any], Any]:
        """Run the kernel in the mask's lanes: return the components of all outputs, and the mask of lanes that it
        keeps."""
        b, program = self.builder, self.program
        if program is None:
            return [], mask
        body = LaneBody(for_lanes(program), b, builtins, self.memory, mask, _image_formats(self.step))
        results = [b.spread(value) for value in body.results()]
        return results, mask if program.keep is None else b.and_(mask, body.operand(program.keep))

    def clears(self, number: int) -> list[Any]:
        """Return the clear value of each channel of a target."""
        b, begin = self.builder, sum(self.channels[:number])
        places = [llvm.Constant(I64, begin + channel) for channel in range(self.channels[number])]
        return [b.spread(b.load_at(self.memory["clears"], place, F32, steady=True)) for place in places]

    def pixel(self, name: str, column: Any, row: Any, numbers: int, kind: Any) -> Any:
        """Return the address of a pixel in a picture of the targets' size."""
        b = self.builder
        pitch = self.memory.get(f"{name}_p", self.memory["width"])
        first = b.add(b.mul(b.sext(row, I64), b.sext(pitch, I64)), b.sext(column, I64))
        return b.gep(self.memory[name], [b.mul(first, llvm.Constant(I64, numbers))], True, source_etype=kind)

    def stored(self, number: int, column: Any, row: Any, parts: Sequence[Any], mask: Any) -> None:
        """Store components of target ``number`` for pixels of a row, in the lanes of the mask."""
        b, format_ = self.builder, self.step.output_formats[number]
        place = self.pixel(f"out{number}", column, row, len(parts), element(format_))
        store(b, [rounded(b, part, format_) for part in parts], place, format_, mask)


def is_deferred(step: DrawStep) -> bool:
    """Return True if only the last fragment of a pixel matters."""
    state, program = step.state, step.fragment
    if program is None:
        return state.stencil is None
    blends = any(blend is not None for blend in state.blend)
    masks = any(not all(mask) for mask in state.color_mask)
    return state.stencil is None and program.keep is None and not blends and not masks


def shade_code(step: DrawStep) -> Code:
    """Compile ``shade(context, ids, planes, x, y, rows)`` for a draw: it writes every pixel of a tile that a triangle
    covers, and the clear color on the others if the draw clears."""
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
        end = b.mul(b.trunc(rows, I32), llvm.Constant(I32, TILE))
        with counting(b, llvm.Constant(I32, 0), end, llvm.Constant(I32, b.lanes)) as at:
            where = b.gep(ids, [at], True, source_etype=I32)
            slots = b.load(where, typ=b.vector(I32), align=4)
            covered = b.icmp_signed(">=", slots, llvm.Constant(I32, 0))
            with b.if_else(b.any(covered)) as (shade, empty):
                with shade:
                    self._pixels(at, slots, covered)
                with empty:
                    self._store(at, covered, None)
        b.ret_void()
        return str(self.module)

    def _pixels(self, at: Any, slots: Any, covered: Any) -> None:
        """Interpolate, run the kernel, store: neighboring pixels in one row of the tile."""
        b = self.builder
        largest = b.intrinsic(f"llvm.vector.reduce.smax.v{b.lanes}i32", I32, [slots.type])
        one = b.plain.call(largest, [slots])
        # Lanes without a triangle use the triangle of some other lane.
        slots = b.select(covered, slots, one)
        x = b.add(b.add(self.left, b.and_(at, llvm.Constant(I32, TILE - 1))), b.counting(I32))
        y = b.add(self.top, b.lshr(at, llvm.Constant(I32, TILE.bit_length() - 1)))
        builtins = self.places(x, y) | self._builtins(slots, one, x, y)
        self._store(at, covered, self.run(builtins, covered)[0])

    def _store(self, at: Any, covered: Any, results: list[Any] | None) -> None:
        """Store results where a triangle covers a pixel, elsewhere the clear color; without results only that."""
        b = self.builder
        column = b.add(self.left, b.and_(at, llvm.Constant(I32, TILE - 1)))
        row = b.add(self.top, b.lshr(at, llvm.Constant(I32, TILE.bit_length() - 1)))
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

    def _builtins(self, slots: Any, one: Any, x: Any, y: Any) -> dict[BuiltinName, Any]:
        """Evaluate the triangles' planes at the pixels: the builtins of the kernel."""
        b, names = self.builder, self.interpolated
        if not names:
            return {}
        # Inside large triangles all lanes have the same planes, so one load suffices.
        same, apart, merged = (b.append_basic_block(name) for name in ("same", "apart", "merged"))
        b.cbranch(b.all(b.icmp_signed("==", slots, one)), same, apart)
        sides = []
        for block, slot in ((same, one), (apart, slots)):
            b.position_at_end(block)
            values = [b.spread(value) for value in interpolated(b, self.step, self.planes, slot, x, y, names)]
            sides.append((values, b.block))
            b.branch(merged)
        b.position_at_end(merged)
        builtin_values = {}
        for number, name in enumerate(names):
            phi = b.phi(sides[0][0][number].type)
            for values, block in sides:
                phi.add_incoming(values[number], block)
            builtin_values[name] = phi
        return builtin_values


_SIGNS = {"less": "<", "equal": "==", "less_equal": "<=", "greater": ">", "not_equal": "!=", "greater_equal": ">="}
_FULL = llvm.Constant(I32, 255)
_ONE, _NONE = llvm.Constant(I32, 1), llvm.Constant(I32, 0)
_DEPTH = BuiltinName("fragment_depth")
#: New stencil value, by the operation's name; ``r`` is the reference.
_STENCIL: dict[str, Callable[[Lanes, Any, Any], Any]] = {
    "keep": lambda b, stored, r: stored,
    "zero": lambda b, stored, r: _NONE,
    "replace": lambda b, stored, r: r,
    "increment": lambda b, stored, r: b.select(b.icmp_signed("<", stored, _FULL), b.add(stored, _ONE), stored),
    "increment_wrap": lambda b, stored, r: b.and_(b.add(stored, _ONE), _FULL),
    "decrement": lambda b, stored, r: b.select(b.icmp_signed(">", stored, _NONE), b.sub(stored, _ONE), stored),
    "decrement_wrap": lambda b, stored, r: b.and_(b.sub(stored, _ONE), _FULL),
    "invert": lambda b, stored, r: b.xor(stored, _FULL),
}


def merge_code(step: DrawStep) -> Code:
    """Compile ``merge(context, spans, triangle, left, top, bottom, clear)`` for a draw.

    It writes one triangle's pixels in a tile, ``spans`` of the rows ``top`` to ``bottom``; if ``clear`` is not 0, it
    clears those rows of the tile instead.
    """
    state = step.state
    fixed = (step.depth is not None, state.depth_compare, state.depth_write, state.stencil, state.color_mask)
    blends = [None if program is None else program.key for program in step.blending]
    parts = ("merge", *kernel_parts(step), repr(fixed), repr(blends))
    return function_code(parts, lambda name: _Merge(step, name).text())


def _rows(step: DrawStep) -> int:
    """Return the rows of a block. Squares leave fewer lanes idle at edges; where little is computed, rows are read
    faster."""
    if step.fragment is None or step.fragment.keep is not None:
        return 1 if step.fragment is None else 4
    masks = step.state.color_mask
    return 4 if not masks or any(any(mask) for mask in masks) else 1


class _Merge(Fragments):
    """LLVM text of one merging function."""

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
        with b.if_else(b.icmp_signed("!=", clear, llvm.Constant(I64, 0))) as (clears, draws):
            with clears, counting(b, top, b.add(bottom, _ONE), _ONE) as y:
                self._clear(left, y)
            with draws, counting(b, top, b.add(bottom, _ONE), llvm.Constant(I32, self.blocks.rows)) as y:
                self._row(spans, y, top, bottom)
        b.ret_void()
        return str(self.module)

    def _clear(self, left: Any, y: Any) -> None:
        """Clear one row of the tile."""
        b = self.builder
        with counting(b, left, b.add(left, llvm.Constant(I32, TILE)), llvm.Constant(I32, b.lanes)) as x:
            inside = b.icmp_signed("<", b.add(x, b.counting(I32)), self.memory["width"])
            for number in range(len(self.channels)):
                if self.step.clears[number] is not None:
                    self.stored(number, x, y, self.clears(number), inside)

    def _row(self, spans: Any, y: Any, top: Any, bottom: Any) -> None:
        """Emit a row of blocks."""
        b, blocks = self.builder, self.blocks
        kind = llvm.VectorType(I32, blocks.rows)
        ends = []
        for side, name in enumerate(("smin", "smax")):
            offset = b.add(b.sub(y, top), llvm.Constant(I32, side * SPAN_ROWS))
            loaded = b.load(b.gep(spans, [offset], True, source_etype=I32), typ=kind, align=4)
            reduce = b.intrinsic(f"llvm.vector.reduce.{name}.v{blocks.rows}i32", I32, [kind])
            ends.append((blocks.spread(loaded), b.plain.call(reduce, [loaded])))
        (firsts, low), (lasts, high) = ends
        self.y = b.add(y, blocks.row()) if blocks.rows > 1 else y
        self.rows = []
        for row in range(blocks.rows):
            # Rows below the triangle may be outside of the picture.
            there = b.add(y, llvm.Constant(I32, row))
            self.rows.append(b.select(b.icmp_signed("<", there, bottom), there, bottom))
        with counting(b, low, b.add(high, _ONE), llvm.Constant(I32, blocks.columns)) as self.x:
            x = b.add(self.x, blocks.column())
            covered = b.and_(b.icmp_signed(">=", x, firsts), b.icmp_signed("<=", x, lasts))
            self.given = self.places(x, self.y)
            self.columns = x
            self._fragments(covered)

    def _planes(self, names: list[BuiltinName]) -> None:
        """Define the builtins that depend on the triangle."""
        new = [name for name in names if name not in self.given]
        planes = interpolated(self.builder, self.step, self.triangle, _NONE, self.columns, self.y, new)
        self.given |= {name: self.builder.spread(value) for name, value in zip(new, planes, strict=True)}

    def _at(self, name: str, channels: int, kind: Any) -> list[Any]:
        """Return the addresses of a block's rows."""
        return [self.pixel(name, self.x, row, channels, kind) for row in self.rows]

    def _kernel(self, mask: Any) -> tuple[list[Any], Any]:
        self._planes(self.interpolated)
        return self.run(self.given, mask)

    def _fragments(self, covered: Any) -> None:
        """Emit rule 6 of docs/rasterization.md.

        A kernel that discards runs before the tests that it may prevent, but after the depth test if nothing else
        depends on the order.
        """
        b, step, program = self.builder, self.step, self.program
        discards, stencil = program is not None and program.keep is not None, step.state.stencil
        results: list[Any] = []
        surviving = covered
        if discards and stencil is not None:
            results, surviving = self._kernel(covered)
        passed = self._depth_test(surviving)
        if stencil is not None:
            passed = self._stencil_test(stencil, surviving, passed)
        with b.if_then(b.any(passed)):
            if not results:
                results, passed = self._kernel(passed)
            if step.depth is not None and step.state.depth_write:
                self._planes([_DEPTH])
                self.blocks.store(self._at("depth", 1, F32), [self.given[_DEPTH]], [passed], FLOAT)
            self._colours(results, passed)

    def _depth_test(self, mask: Any) -> Any:
        """Return the lanes of the mask that pass the depth test."""
        b, compare = self.builder, self.step.state.depth_compare
        if self.step.depth is None or compare == "always":
            return mask
        if compare == "never":
            return b.spread(llvm.Constant(BOOL, 0))
        self._planes([_DEPTH])
        (stored,) = self.blocks.load(self._at("depth", 1, F32), 1, FLOAT)
        method = b.fcmp_unordered if compare == "not_equal" else b.fcmp_ordered
        return b.and_(mask, method(_SIGNS[compare], self.given[_DEPTH], stored))

    def _stencil_test(self, stencil: Stencil, mask: Any, deep: Any) -> Any:
        """Update the stencil in the mask's lanes (``deep`` pass the depth test); return the lanes that pass both
        tests."""
        b = self.builder
        places = self._at("stencil", 1, I8)
        (loaded,) = self.blocks.numbers(places, 1, I8, 1)
        stored = b.zext(loaded, I32)
        if stencil.compare in _SIGNS:
            masked = b.and_(stored, llvm.Constant(I32, stencil.read_mask))
            shown = b.icmp_signed(
                _SIGNS[stencil.compare], llvm.Constant(I32, stencil.reference & stencil.read_mask), masked
            )
        else:
            shown = b.spread(llvm.Constant(BOOL, int(stencil.compare == "always")))
        operations = (stencil.passed, stencil.depth_fail, stencil.fail)
        if stencil.write_mask and set(operations) != {"keep"}:
            reference = llvm.Constant(I32, stencil.reference)
            passed, failed, hidden = (b.spread(_STENCIL[name](b, stored, reference)) for name in operations)
            changed = b.select(shown, b.select(deep, passed, failed), hidden)
            rest = b.and_(stored, llvm.Constant(I32, 255 & ~stencil.write_mask))
            changed = b.or_(rest, b.and_(changed, llvm.Constant(I32, stencil.write_mask)))
            self.blocks.store_numbers(places, [b.trunc(changed, I8)], [mask], 1)
        return b.and_(shown, deep)

    def _colours(self, results: list[Any], passed: Any) -> None:
        """Write each target's components, blended if the draw blends, to the channels in the color mask."""
        b, step = self.builder, self.step
        begin = 0
        for number, count in enumerate(self.channels):
            parts, begin = results[begin : begin + count], begin + count
            mask = step.state.color_mask[number][:count] if step.state.color_mask else (True,) * count
            if not any(mask):
                continue
            format_ = step.output_formats[number]
            places = self._at(f"out{number}", count, element(format_))
            blend = step.blending[number]
            if blend is not None:
                sides = {"source": parts, "destination": self.blocks.load(places, count, format_)}
                parts_of_blend = {
                    BuiltinName(kind, component=c): part for kind, side in sides.items() for c, part in enumerate(side)
                }
                parts = [
                    b.spread(value) for value in LaneBody(for_lanes(blend), b, parts_of_blend, {}, passed).results()
                ]
            none = b.spread(llvm.Constant(BOOL, 0))
            self.blocks.store(places, parts, [passed if written else none for written in mask], format_)
