"""LLVM text of pixel passes: pieces of the target, their rows, and along each row vectors of pixels.

A pass is a chain of one (see chains.py).  Threads take pieces by a shared counter until none is left.
Relative reads go through tables of rows, one row for each of the reach above and below, with the border rule for rows
applied.  Along a row the kernel's body never looks at the border: at the two ends of a row the table leads to strips,
copies of the few texels there with the rule applied, so that one body serves the whole row.
"""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from llvmlite import ir

from passgraph.backends.numpy.pixels.layout import Layout, StageLayout, View
from passgraph.backends.numpy.vector.constants import blank, lanes_of
from passgraph.backends.numpy.vector.lane_body import LaneBody
from passgraph.backends.numpy.vector.lanes import Lanes, border, counting
from passgraph.backends.numpy.vector.operations import BOOL, F32, I32, I64
from passgraph.backends.numpy.vector.stored import decoded, element, woven
from passgraph.backends.numpy.vector.texels import neighbours
from passgraph.language import scalar as s
from passgraph.language.borders import BORDERS

POINTER = ir.PointerType()


def pixel_text(layout: Layout, name: str) -> str:
    """A module with ``pieces(context, own)``: both lead to entries as :class:`Layout` names them."""
    module = ir.Module(name)
    function = ir.Function(module, ir.FunctionType(ir.VoidType(), [POINTER, POINTER]), name)
    b = Lanes(ir.IRBuilder(function.append_basic_block("entry")), layout.stages[0].lanes)
    memory = {}
    for block, names in zip(function.args, ([*layout.fixed, *layout.bound], layout.own), strict=True):
        for place, entry in enumerate(names):
            loaded = b.load_at(block, number(place), I64, steady=True)
            memory[entry] = loaded if is_size(entry) else b.inttoptr(loaded, POINTER)
    _pieces(b, function.args[0], layout, memory)
    b.ret_void()
    return str(module)


def is_size(name: str) -> bool:
    numbers = ("counter", "count", "columns", "tile", "band", "width", "height")
    return name in numbers or name.startswith("pitch") or name.endswith(("_w", "_h", "_p", "_last"))


def number(value: int) -> Any:
    return ir.Constant(I64, value)


def smaller(b: Lanes, x: Any, y: Any) -> Any:
    return b.select(b.icmp_signed("<", x, y), x, y)


def larger(b: Lanes, x: Any, y: Any) -> Any:
    return b.select(b.icmp_signed(">", x, y), x, y)


def _pieces(b: Lanes, counter: Any, layout: Layout, memory: dict[str, Any]) -> None:
    """Take a piece, make its rows, take the next."""
    stages = [StageRows(b, layout, stage, memory) for stage in layout.stages]
    height, band, columns = (memory[name] for name in ("height", "band", "columns"))
    take, work, done = (b.append_basic_block(name) for name in ("take", "work", "done"))
    b.branch(take)
    b.position_at_end(take)
    piece = b.atomic_rmw("add", counter, number(1), "monotonic")
    b.cbranch(b.icmp_signed("<", piece, memory["count"]), work, done)
    b.position_at_end(work)
    x0, y0 = b.mul(b.srem(piece, columns), memory["tile"]), b.mul(b.sdiv(piece, columns), band)
    end = smaller(b, height, b.add(y0, band))
    at_once = layout.stages[-1].rows
    for stage in stages:
        stage.begin(x0, y0)
    with counting(b, y0, end, number(at_once)) as y:
        # The last rows of a piece may be made twice, so that there are always as many at once.
        bottom = larger(b, smaller(b, y, b.sub(end, number(at_once))), number(0)) if at_once > 1 else y
        for stage in stages[:-1]:
            stage.follow(b.add(bottom, number(at_once)))
        stages[-1].row(bottom)
    b.branch(take)
    b.position_at_end(done)


class StageRows:
    """Emits the rows of one stage."""

    def __init__(self, b: Lanes, layout: Layout, stage: StageLayout, memory: dict[str, Any]) -> None:
        self.b, self.layout, self.stage, self.memory = b, layout, stage, memory
        self.body_memory = self._body_memory()
        with b.goto_entry_block():
            self.behind = b.alloca(I64)
            #: For each view its rows, and what is read along the part of a row at work: them, or strips.
            self.rows = [b.alloca(POINTER, number(view.rows)) for view in stage.views]
            self.parts = [b.alloca(POINTER, number(view.rows)) for view in stage.views]

    def _body_memory(self) -> dict[str, Any]:
        """What the kernel's body finds by name: sizes are int32 there."""
        b, memory, n = self.b, self.memory, self.stage.number
        found = {"floats": memory[f"floats{n}"], "ints": memory[f"ints{n}"]}
        for image in range(len(self.stage.program.images)):
            ring = image in self.stage.rings
            found[f"im{image}_w"] = b.trunc(memory["width"] if ring else memory[f"im{n}_{image}_w"], I32)
            found[f"im{image}_h"] = b.trunc(memory["height"] if ring else memory[f"im{n}_{image}_h"], I32)
            if not ring:
                found[f"im{image}"] = memory[f"im{n}_{image}"]
                found[f"im{image}_p"] = b.trunc(memory[f"im{n}_{image}_p"], I32)
        return found

    def begin(self, x0: Any, y0: Any) -> None:
        """The columns and the first row that this stage makes for a piece."""
        b, margin = self.b, self.stage.stage.margin
        self.first = larger(b, number(0), b.sub(x0, number(margin.left)))
        reached = b.add(b.add(x0, self.memory["tile"]), number(margin.right))
        self.end = smaller(b, self.memory["width"], reached)
        if self.stage.last:
            return
        self.memory[f"from{self.stage.number}"] = self.first
        if self.layout.stages[-1].rows > 1:
            # As the last stage moves its last rows up, so do what it reads.
            last = b.sub(self.memory["height"], number(self.layout.stages[-1].rows))
            y0 = larger(b, number(0), smaller(b, y0, last))
        b.store(larger(b, number(0), b.sub(y0, number(margin.up))), self.behind)

    def follow(self, bottom: Any) -> None:
        """Make the rows that are needed before those of the last stage up to ``bottom``, and are not there yet."""
        b, margin = self.b, self.stage.stage.margin
        stop = smaller(b, self.memory["height"], b.add(bottom, number(margin.down)))
        behind = b.load(self.behind, typ=I64)
        with counting(b, behind, stop, number(1)) as y:
            self.row(y)
        b.store(larger(b, behind, stop), self.behind)

    def row(self, y: Any) -> None:
        """Row ``y``, and the next ones where several are made at once, from the first to the last column."""
        b, stage = self.b, self.stage
        for view, table in zip(stage.views, self.rows, strict=True):
            with self._each(view.rows) as k:
                b.store(self._row(view, b.add(b.sub(y, number(view.up)), k)), self._entry(table, k))
        if not (stage.reach.left or stage.reach.right):
            self.tables = self.rows
            self._stretch(y, self.first, self.end)
            return
        self.tables = self.parts
        cut, rest = self._cuts()
        # Parts of a row: what reads beyond its beginning, the middle (maybe in segments), what reads beyond its end.
        segment = number(stage.segment) if stage.segment else b.sub(rest, cut)
        middles = b.sdiv(b.add(b.sub(rest, cut), number(stage.segment - 1)), segment) if stage.segment else number(1)
        last = b.add(middles, number(1))
        with counting(b, number(0), b.add(last, number(1)), number(1)) as part:
            is_first, is_last = b.icmp_signed("==", part, number(0)), b.icmp_signed("==", part, last)
            middle = b.add(cut, b.mul(b.sub(part, number(1)), segment))
            begin = b.select(is_first, self.first, b.select(is_last, rest, middle))
            end = b.select(is_first, cut, b.select(is_last, self.end, smaller(b, rest, b.add(middle, segment))))
            with b.if_then(b.icmp_signed("<", begin, end)):
                for at in range(len(stage.views)):
                    self._point(at, begin, end, b.not_(b.or_(is_first, is_last)))
                self._stretch(y, begin, end)

    def _cuts(self) -> tuple[Any, Any]:
        """Columns between which no read leads out of a row; whole vectors there where something is cut off."""
        b, (left, right, _, _), unit = self.b, self.stage.reach, number(self.stage.pixels)
        short = larger(b, number(0), b.sub(number(left), self.first))
        short = b.mul(b.sdiv(b.add(short, b.sub(unit, number(1))), unit), unit)
        cut = smaller(b, b.add(self.first, short), self.end)
        free = b.sub(self.memory["width"], number(right))
        whole = b.mul(b.sdiv(larger(b, number(0), b.sub(free, cut)), unit), unit)
        rest = b.select(b.icmp_signed("<=", self.end, free), self.end, b.add(cut, whole))
        return cut, larger(b, cut, rest)

    @contextmanager
    def _each(self, count: int) -> Iterator[Any]:
        if count == 1:
            yield number(0)
            return
        with counting(self.b, number(0), number(count), number(1)) as k:
            yield k

    def _entry(self, table: Any, k: Any) -> Any:
        return self.b.gep(table, [k], True, source_etype=POINTER)

    def _row(self, view: View, y: Any) -> Any:
        """Where a row of an image begins, by the border rule; a row of zeros where there is none."""
        b, memory, n = self.b, self.memory, self.stage.number
        inner = border(b, view.border, b.trunc(y, I32), b.trunc(memory["height"], I32))
        inside = b.icmp_signed("==", b.sext(inner, I64), y)
        inner = b.sext(inner, I64)
        if view.image in self.stage.rings:
            producer, slot = self.stage.rings[view.image]
            ring, start = memory[f"ring{producer}_{slot}"], memory[f"from{producer}"]
            kept = b.srem(inner, number(self.layout.ring_rows(producer)))
            first = b.sub(b.mul(kept, memory[f"pitch{producer}"]), start)
            row = b.gep(ring, [b.mul(first, number(view.channels))], False, source_etype=F32)
        else:
            picture = f"im{n}_{view.image}"
            first = b.mul(b.mul(inner, memory[f"{picture}_p"]), number(view.channels))
            row = b.gep(memory[picture], [first], False, source_etype=element(view.held))
            # Behind the last row of somebody else's memory nothing may be read: a copy with room stands for it.
            row = b.select(b.icmp_signed("==", inner, memory[f"{picture}_last"]), memory[f"{picture}_row"], row)
        return b.select(inside, row, memory["zeros"]) if BORDERS[view.border].blank else row

    def _point(self, at: int, begin: Any, end: Any, is_middle: Any) -> None:
        """Let a view's table lead to its rows, or to copies: at a row's end, and where numbers are decoded first."""
        b, stage, view = self.b, self.stage, self.stage.views[at]
        left, right, _, _ = stage.reach
        count = b.add(b.sub(end, begin), number(left + right))
        start, channels = b.sub(begin, number(left)), number(view.channels)
        with self._each(view.rows) as k:
            row = b.load(self._entry(self.rows[at], k), typ=POINTER)
            place = self._entry(self.parts[at], k)
            b.store(row, place)
            if not view.across:
                return
            kind = element(view.read)
            offset = b.mul(b.add(b.mul(k, channels), number(view.strips)), number(stage.strip_pixels))
            strip = b.gep(self.memory["scratch"], [offset], True, source_etype=F32)
            shifted = b.gep(strip, [b.mul(start, number(-view.channels))], False, source_etype=kind)
            with b.if_else(is_middle) as (inside, beyond):
                with inside:
                    if view.decodes:
                        self._take(view, row, b.mul(start, channels), b.mul(count, channels), strip)
                        b.store(shifted, place)
                with beyond:
                    self._take_beyond(view, row, start, b.add(start, count), strip)
                    b.store(shifted, place)

    def _take(self, view: View, row: Any, start: Any, count: Any, strip: Any) -> None:
        """Numbers of a row into a strip, as float32 where it holds these; up to a vector more than ``count``."""
        b, held, read = self.b, element(view.held), element(view.read)
        with counting(b, number(0), count, number(b.lanes)) as i:
            place = b.gep(row, [b.add(start, i)], True, source_etype=held)
            if view.decodes:
                # The next part of the row is on its way while the body runs over this one.
                ahead = b.intrinsic("llvm.prefetch.p0", ir.VoidType(), [POINTER, I32, I32, I32])
                there = b.gep(place, [number(self.stage.segment * view.channels)], source_etype=held)
                b.plain.call(ahead, [there, ir.Constant(I32, 0), ir.Constant(I32, 3), ir.Constant(I32, 1)])
            values = b.load(place, typ=b.vector(held), align=view.held.bits // 8)
            values = decoded(b, values, view.held) if view.decodes else values
            b.plain.store(values, b.gep(strip, [i], True, source_etype=read), align=view.read.bits // 8)

    def _take_beyond(self, view: View, row: Any, start: Any, end: Any, strip: Any) -> None:
        """Texels of columns ``start`` to ``end`` into a strip: those of the row, then the others by the border rule."""
        b, channels = self.b, number(view.channels)
        first = smaller(b, larger(b, start, number(0)), end)
        last = larger(b, first, smaller(b, end, self.memory["width"]))
        begin = b.mul(b.sub(first, start), channels)
        inside = b.gep(strip, [begin], True, source_etype=element(view.read))
        self._take(view, row, b.mul(first, channels), b.mul(b.sub(last, first), channels), inside)
        for one, other in ((start, first), (last, end)):
            with counting(b, one, other, number(1)) as x:
                self._copy(view, row, x, strip, b.sub(x, start))

    def _copy(self, view: View, row: Any, x: Any, strip: Any, i: Any) -> None:
        """One texel into a strip, by the border rule."""
        b, channels, kind = self.b, number(view.channels), element(view.read)
        inner = b.sext(border(b, view.border, b.trunc(x, I32), b.trunc(self.memory["width"], I32)), I64)
        for channel in range(view.channels):
            value = b.load_at(row, b.add(b.mul(inner, channels), number(channel)), element(view.held))
            if view.decodes:
                value = decoded(b, value, view.held)
            if BORDERS[view.border].blank:
                value = b.select(b.icmp_signed("==", inner, x), value, ir.Constant(kind, 0))
            place = b.add(b.mul(i, channels), number(channel))
            b.plain.store(value, b.gep(strip, [place], True, source_etype=kind), align=view.read.bits // 8)

    def _stretch(self, y: Any, begin: Any, end: Any) -> None:
        """The body over columns from ``begin`` to ``end``: by pixels, or by single numbers where channels are alike."""
        b, stage = self.b, self.stage
        unit, step = number(stage.alike), b.lanes * stage.vectors
        last = b.mul(end, unit)
        with counting(b, b.mul(begin, unit), last, number(step)) as first:
            turns = [(row, b.add(first, number(vector * b.lanes)))
                     for row in range(stage.rows) for vector in range(stage.vectors)]  # fmt: skip
            body = Choosing if stage.selects else PixelBody
            results = [
                (at, *stored)
                for row, at in turns
                for stored in self._stored(b.add(y, number(row)), at, body(self, y, row, at).stored())
            ]
            full, part, behind = (b.append_basic_block(name) for name in ("full", "part", "stored"))
            b.cbranch(b.icmp_signed("<=", b.add(first, number(step)), last), full, part)
            for block, masked in ((full, False), (part, True)):
                b.position_at_end(block)
                for at, values, pointer, align in results:
                    if masked:
                        b.store_masked(values, pointer, self._before(last, at, values), align)
                    else:
                        b.plain.store(values, pointer, align=align)
                b.branch(behind)
            b.position_at_end(behind)

    def _before(self, last: Any, at: Any, values: Any) -> Any:
        """Which numbers of a vector of results, the first of them of pixel ``at``, lie before pixel ``last``."""
        b, count = self.b, values.type.count
        rest = b.mul(b.sub(last, at), number(count // b.lanes))
        rest = smaller(b, larger(b, rest, number(0)), number(count))
        numbers = lanes_of(range(count))
        first = b.plain.insert_element(blank(numbers.type), b.trunc(rest, I32), ir.Constant(I32, 0))
        spread = b.plain.shuffle_vector(first, blank(numbers.type), lanes_of([0] * count))
        return b.plain.icmp_signed("<", numbers, spread)

    def _stored(self, y: Any, at: Any, values: Sequence[Any]) -> Iterator[tuple[Any, Any, int]]:
        """Of each target a vector of results in the order of memory, where it goes and how that is aligned."""
        b, stage, begin = self.b, self.stage, 0
        counts = (1,) if stage.alike > 1 else stage.channels
        for slot, count in enumerate(counts):
            held = stage.outputs[slot]
            if stage.last:
                target, first = self.memory[f"out{slot}"], b.mul(y, self.memory[f"out{slot}_p"])
            else:
                target = self.memory[f"ring{stage.number}_{slot}"]
                kept = b.srem(y, number(self.layout.ring_rows(stage.number)))
                first = b.sub(b.mul(kept, self.memory[f"pitch{stage.number}"]), self.first)
            place = b.mul(b.add(b.mul(first, number(stage.alike)), at), number(count))
            pointer = b.gep(target, [place], True, source_etype=element(held))
            parts = [b.spread(value) for value in values[begin : begin + count]]
            begin += count
            yield woven(b, parts, held), pointer, held.bits // 8


class PixelBody(LaneBody):
    """The kernel on consecutive pixels of a row, or on consecutive numbers of it where channels are alike."""

    def __init__(self, place: StageRows, y: Any, row: int, at: Any) -> None:
        b, stage = place.b, place.stage
        self.place, self.row, self.at = place, row, at
        x, y = b.add(b.trunc(at, I32), b.counting(I32)), b.add(b.trunc(y, I32), ir.Constant(I32, row))
        width, height = (b.trunc(place.memory[name], I32) for name in ("width", "height"))
        given = {"pixel.0": x, "pixel.1": y, "output_size.0": width, "output_size.1": height}
        for image, use in enumerate(stage.program.images):
            given |= {f"size.{use.name}.{axis}": place.body_memory[f"im{image}_{'wh'[axis]}"] for axis in range(2)}
        super().__init__(stage.program, b, given, place.body_memory, b.spread(ir.Constant(BOOL, 1)), stage.images)
        self.views = {(view.image, view.border): number for number, view in enumerate(stage.views)}

    def stored(self) -> list[Any]:
        """Emit everything; the outputs' numbers as they are stored."""
        self.block(self.program.body)
        b, stage = self.builder, self.place.stage
        found = []
        for output, meant, held in zip(self.program.outputs, stage.formats, stage.outputs, strict=True):
            numbers = self.rounded(output, meant)
            found += numbers if held is meant else [decoded(b, b.spread(number), meant) for number in numbers]
        return found

    def texel(self, i: s.LoadTexel) -> None:
        at = self.views.get((self.numbers[i.image], i.border)) if i.relative else None
        if at is None:
            super().texel(i)
            return
        b, place = self.builder, self.place
        view, unit = place.stage.views[at], place.stage.alike
        x, y = (b.sext(self.operand(part), I64) for part in (i.x, i.y))
        row = b.load(place._entry(place.tables[at], b.add(y, number(view.up + self.row))), typ=POINTER)
        wanted = [channel for channel, value in enumerate(i.to) if value is not None]
        first = b.add(self.at, b.mul(x, number(unit)) if unit > 1 else x)
        self.keep(i, self.loaded(row, first, view, wanted))

    def loaded(self, row: Any, first: Any, view: View, wanted: Sequence[int]) -> list[Any]:
        """Channels of the pixels from number ``first`` of a row on, or the numbers themselves."""
        if self.place.stage.alike > 1:
            return neighbours(self.builder, row, first, 1, (0,), view.read) * len(wanted)
        place = self.builder.mul(first, number(view.channels))
        return neighbours(self.builder, row, place, view.channels, wanted, view.read)


class Choosing(PixelBody):
    """The kernel on consecutive numbers as they are stored: unsigned ones, which it only chooses among."""

    def stored(self) -> list[Any]:
        self.block(self.program.body)
        return [self.operand(value) for value in self.program.outputs[0].values]

    def emit(self, i: s.Instruction) -> None:
        if not isinstance(i, s.Op):
            super().emit(i)
            return
        x, y = (self.operand(part) for part in i.arguments)
        b, sign = self.builder, "<" if i.operation == "min" else ">"
        self.values[i.to.id] = b.select(b.icmp_unsigned(sign, x, y), x, y)

    def loaded(self, row: Any, first: Any, view: View, wanted: Sequence[int]) -> list[Any]:
        b, kind = self.builder, element(view.held)
        pointer = b.gep(row, [first], True, source_etype=kind)
        return [b.load(pointer, typ=b.vector(kind), align=view.held.bits // 8)] * len(wanted)
