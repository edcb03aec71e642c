"""LLVM text around the bodies of pixel passes: pieces of the target, and their rows.

A single pass is a chain of one (see chains.py).  Threads take pieces by a shared counter.  Relative reads use tables of
row addresses, one for each row within reach above and below, with the border rule for rows applied.  Within a row the
kernel's body (body.py) ignores the border: at both ends of a row the table points to strips, which are copies of the
few texels there with the rule applied.  So one body serves the whole row.

A body is a function of its own, called for each part of a row: passes of the same shape share the code here.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from passgraph.backends.numpy.machine import llvm
from passgraph.backends.numpy.machine.llvm import IRBuilder
from passgraph.backends.numpy.pixels.body import BODY, POINTER, number, times
from passgraph.backends.numpy.pixels.buffer_layout import IMAGE, Layout, StageLayout, View
from passgraph.backends.numpy.vector.lanes import F32, I32, I64, Lanes, border, counting
from passgraph.backends.numpy.vector.texels import decoded, element
from passgraph.language.borders import BORDERS


def pixel_text(layout: Layout, name: str) -> str:
    """Return a module with ``pieces(context, own)``: both point to entries named by :class:`Layout`."""
    module = llvm.Module(name)
    function = llvm.Function(module, llvm.FunctionType(llvm.VoidType(), [POINTER, POINTER]), name)
    b = Lanes(IRBuilder(function), layout.stages[0].lanes)
    memory = {}
    for block, names in zip(function.args, ([*layout.fixed, *layout.bound], layout.own), strict=True):
        for place, entry in enumerate(names):
            loaded = b.load_at(block, number(place), I64, steady=True)
            memory[entry] = loaded if is_size(entry) else b.inttoptr(loaded, _kind(entry))
    _pieces(b, function.args[0], layout, memory)
    b.ret_void()
    return str(module)


def is_size(name: str) -> bool:
    numbers = ("counter", "count", "columns", "tile", "band", "width", "height")
    return name in numbers or name.startswith("pitch") or name.endswith(("_w", "_h", "_p", "_last"))


def _kind(name: str) -> Any:
    return llvm.PointerType(BODY) if name.startswith("body") else POINTER


def smaller(b: Lanes, x: Any, y: Any) -> Any:
    return b.select(b.icmp_signed("<", x, y), x, y)


def larger(b: Lanes, x: Any, y: Any) -> Any:
    return b.select(b.icmp_signed(">", x, y), x, y)


def _pieces(b: Lanes, counter: Any, layout: Layout, memory: dict[str, Any]) -> None:
    """Emit the loop over pieces: take a piece, compute its rows."""
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
        # The last rows of a piece may be computed twice, so that the number of rows together is constant.
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
        self.frame = stage.frame
        with b.goto_entry_block():
            self.behind = b.alloca(I64)
            self.entries = b.alloca(I64, number(self.frame.count))
            #: Table of rows for each view read across; for other views the body's rows are used.
            self.rows = [b.alloca(POINTER, number(view.rows)) if view.across else None for view in stage.views]
        self.turns: dict[int, Any] = {}
        self._begin_frame()

    def _begin_frame(self) -> None:
        """Emit the part of the frame that is the same for all rows."""
        b, memory, n = self.b, self.memory, self.stage.number
        entries = {name: memory[name] for name in ("width", "height")}
        entries |= {name: memory[f"{name}{n}"] for name in ("floats", "ints")}
        for image in range(len(self.stage.program.images)):
            if image in self.stage.rings:
                entries |= {f"im{image}_w": memory["width"], f"im{image}_h": memory["height"]}
            else:
                entries |= {f"im{image}{end}": memory[f"im{n}_{image}{end}"] for end in IMAGE}
        for name, value in entries.items():
            b.store(value, self._entry(self.frame.places[name]))

    def begin(self, x0: Any, y0: Any) -> None:
        """Set the columns and the first row that this stage computes for a piece."""
        b, margin = self.b, self.stage.stage.margin
        self.first = larger(b, number(0), b.sub(x0, number(margin.left)))
        reached = b.add(b.add(x0, self.memory["tile"]), number(margin.right))
        self.end = smaller(b, self.memory["width"], reached)
        if self.stage.last:
            return
        self.memory[f"from{self.stage.number}"] = self.first
        if self.layout.stages[-1].rows > 1:
            # If the last stage moves its last rows up, so do the stages that it reads.
            last = b.sub(self.memory["height"], number(self.layout.stages[-1].rows))
            y0 = larger(b, number(0), smaller(b, y0, last))
        b.store(larger(b, number(0), b.sub(y0, number(margin.up))), self.behind)

    def follow(self, bottom: Any) -> None:
        """Compute the missing rows that the last stage needs up to ``bottom``."""
        b, margin = self.b, self.stage.stage.margin
        stop = smaller(b, self.memory["height"], b.add(bottom, number(margin.down)))
        behind = b.load(self.behind, typ=I64)
        with counting(b, behind, stop, number(1)) as y:
            self.row(y)
        b.store(larger(b, behind, stop), self.behind)

    def row(self, y: Any) -> None:
        """Compute row ``y``, and the rows computed with it, from the first to the last column."""
        b, stage = self.b, self.stage
        for at, view in enumerate(stage.views):
            with self._each(view.rows) as k:
                b.store(self._row(view, b.add(b.sub(y, number(view.up)), k)), self._row_entry(at, k))
        for slot in range(len(stage.channels)):
            for row in range(stage.rows):
                b.store(self._target(slot, b.add(y, number(row))), self._entry(self.frame.target(slot, row)))
        if not (stage.reach.left or stage.reach.right):
            self._stretch(y, self.first, self.end)
            return
        cut, rest = self._cuts()
        # Parts of a row: its beginning with reads outside, the middle (maybe in segments), its end with reads outside.
        segment = number(stage.segment) if stage.segment else b.sub(rest, cut)
        middles = b.sdiv(b.add(b.sub(rest, cut), number(stage.segment - 1)), segment) if stage.segment else number(1)
        last = b.add(middles, number(1))
        with counting(b, number(0), b.add(last, number(1)), number(1)) as part:
            is_first, is_last = b.icmp_signed("==", part, number(0)), b.icmp_signed("==", part, last)
            middle = b.add(cut, b.mul(b.sub(part, number(1)), segment))
            begin = b.select(is_first, self.first, b.select(is_last, rest, middle))
            end = b.select(is_first, cut, b.select(is_last, self.end, smaller(b, rest, b.add(middle, segment))))
            with b.if_then(b.icmp_signed("<", begin, end)):
                for at in (at for at, view in enumerate(stage.views) if view.across):
                    self._point(at, begin, end, b.not_(b.or_(is_first, is_last)))
                self._stretch(y, begin, end)

    def _cuts(self) -> tuple[Any, Any]:
        """Return the columns between which no read leaves a row; a narrow row is all beginning."""
        b, (left, right, _, _) = self.b, self.stage.reach
        is_narrow = b.icmp_signed("<=", b.sub(self.end, self.first), number(self.stage.narrow))
        cut = smaller(b, larger(b, self.first, number(left)), self.end)
        rest = smaller(b, self.end, larger(b, cut, b.sub(self.memory["width"], number(right))))
        return b.select(is_narrow, self.end, cut), b.select(is_narrow, self.end, rest)

    @contextmanager
    def _each(self, count: int) -> Iterator[Any]:
        if count == 1:
            yield number(0)
            return
        with counting(self.b, number(0), number(count), number(1)) as k:
            yield k

    def _entry(self, place: int, k: Any = None) -> Any:
        """Return the address of a frame entry, or of the ``k``-th entry behind it."""
        at = number(place) if k is None else self.b.add(number(place), k)
        return self.b.gep(self.entries, [at], True, source_etype=POINTER)

    def _row_entry(self, at: int, k: Any) -> Any:
        """Return the frame entry that holds the address of a view's row."""
        own = self.rows[at]
        if own is None:
            return self._entry(self.frame.view(at), k)
        return self.b.gep(own, [k], True, source_etype=POINTER)

    def _row(self, view: View, y: Any) -> Any:
        """Return the address of an image's row by the border rule; a row of zeros outside."""
        b, memory, n = self.b, self.memory, self.stage.number
        inner = border(b, view.border, b.trunc(y, I32), b.trunc(memory["height"], I32))
        inside = b.icmp_signed("==", b.sext(inner, I64), y)
        inner = b.sext(inner, I64)
        if view.image in self.stage.rings:
            producer, slot = self.stage.rings[view.image]
            ring, start = memory[f"ring{producer}_{slot}"], memory[f"from{producer}"]
            ring_row = b.srem(inner, number(self.layout.ring_rows(producer)))
            first = b.sub(b.mul(ring_row, memory[f"pitch{producer}"]), start)
            row = b.gep(ring, [b.mul(first, number(view.channels))], False, source_etype=F32)
        else:
            picture = f"im{n}_{view.image}"
            first = b.mul(b.mul(inner, memory[f"{picture}_p"]), number(view.channels))
            row = b.gep(memory[picture], [first], False, source_etype=element(view.stored))
            # Memory behind the last row of a foreign picture may not be read: a padded copy replaces that row.
            row = b.select(b.icmp_signed("==", inner, memory[f"{picture}_last"]), memory[f"{picture}_row"], row)
        return b.select(inside, row, memory["zeros"]) if BORDERS[view.border].blank else row

    def _point(self, at: int, begin: Any, end: Any, is_middle: Any) -> None:
        """Point a view's table to its rows, or to copies: at a row's ends, and for numbers that are decoded first."""
        b, stage, view = self.b, self.stage, self.stage.views[at]
        left, right, _, _ = stage.reach
        count = b.add(b.sub(end, begin), number(left + right))
        start, channels = b.sub(begin, number(left)), number(view.channels)
        with self._each(view.rows) as k:
            row = b.load(self._row_entry(at, k), typ=POINTER)
            place = self._entry(self.frame.view(at), k)
            b.store(row, place)
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
        """Copy numbers of a row into a strip, as float32 if the strip holds these; up to a vector more than
        ``count``."""
        b, element_type, read = self.b, element(view.stored), element(view.read)
        with counting(b, number(0), count, number(b.lanes)) as i:
            place = b.gep(row, [b.add(start, i)], True, source_etype=element_type)
            if view.decodes:
                # Prefetch the next part of the row while the body runs over this one.
                ahead = b.intrinsic("llvm.prefetch.p0", llvm.VoidType(), [POINTER, I32, I32, I32])
                there = b.gep(place, [number(self.stage.segment * view.channels)], source_etype=element_type)
                b.plain.call(ahead, [there, llvm.Constant(I32, 0), llvm.Constant(I32, 3), llvm.Constant(I32, 1)])
            values = b.load(place, typ=b.vector(element_type), align=view.stored.bits // 8)
            values = decoded(b, values, view.stored) if view.decodes else values
            b.plain.store(values, b.gep(strip, [i], True, source_etype=read), align=view.read.bits // 8)

    def _take_beyond(self, view: View, row: Any, start: Any, end: Any, strip: Any) -> None:
        """Copy texels of columns ``start`` to ``end`` into a strip: those of the row, then others by the border
        rule."""
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
        """Copy one texel into a strip, by the border rule."""
        b, channels, kind = self.b, number(view.channels), element(view.read)
        inner = b.sext(border(b, view.border, b.trunc(x, I32), b.trunc(self.memory["width"], I32)), I64)
        for channel in range(view.channels):
            value = b.load_at(row, b.add(b.mul(inner, channels), number(channel)), element(view.stored))
            if view.decodes:
                value = decoded(b, value, view.stored)
            if BORDERS[view.border].blank:
                value = b.select(b.icmp_signed("==", inner, x), value, llvm.Constant(kind, 0))
            place = b.add(b.mul(i, channels), number(channel))
            b.plain.store(value, b.gep(strip, [place], True, source_etype=kind), align=view.read.bits // 8)

    def _target(self, slot: int, y: Any) -> Any:
        """Return the address of column 0 in a row of results."""
        b, stage, channels = self.b, self.stage, self.stage.channels[slot]
        if stage.last:
            target, first = self.memory[f"out{slot}"], b.mul(y, self.memory[f"out{slot}_p"])
        else:
            target = self.memory[f"ring{stage.number}_{slot}"]
            ring_row = b.srem(y, number(self.layout.ring_rows(stage.number)))
            first = b.sub(b.mul(ring_row, self.memory[f"pitch{stage.number}"]), self.first)
        kind = element(stage.outputs[slot])
        return b.gep(target, [b.mul(first, number(channels))], False, source_etype=kind)

    def _stretch(self, y: Any, begin: Any, end: Any) -> None:
        """Emit the body over columns from ``begin`` to ``end``."""
        b, stage = self.b, self.stage
        begin, last = times(b, begin, stage.alike), times(b, end, stage.alike)
        is_short = b.icmp_signed("<", b.sub(last, begin), number(stage.turn))
        with b.if_else(is_short) as (short, long):
            with short:
                self._short(y, begin, last)
            with long:
                self._call(y, begin, last)

    def _call(self, y: Any, begin: Any, last: Any) -> None:
        self.b.plain.call(self.memory[f"body{self.stage.number}"], [self.entries, y, begin, last])

    def _short(self, y: Any, begin: Any, last: Any) -> None:
        """Emit a part shorter than one iteration: compute into scratch memory, and copy the needed results."""
        b, stage = self.b, self.stage
        for slot, count in enumerate(stage.counts):
            kind = element(stage.outputs[slot])
            with self._each(stage.rows) as row:
                row_start = self._turn_of(slot, row)
                shifted = b.gep(row_start, [b.mul(begin, number(-count))], False, source_etype=kind)
                b.store(shifted, self._entry(self.frame.target(slot), row))
        self._call(y, begin, b.add(begin, number(stage.turn)))
        for slot, count in enumerate(stage.counts):
            kind, align = element(stage.outputs[slot]), stage.outputs[slot].bits // 8
            with self._each(stage.rows) as row:
                row_start, target = self._turn_of(slot, row), self._target(slot, b.add(y, row))
                b.store(target, self._entry(self.frame.target(slot), row))
                target = b.gep(target, [times(b, begin, count)], True, source_etype=kind)
                with counting(b, number(0), times(b, b.sub(last, begin), count), number(1)) as i:
                    b.plain.store(
                        b.load_at(row_start, i, kind), b.gep(target, [i], True, source_etype=kind), align=align
                    )

    def _turn_of(self, slot: int, row: Any) -> Any:
        """Return scratch memory for an iteration's results of a row."""
        b, stage = self.b, self.stage
        if slot not in self.turns:
            with b.goto_entry_block():
                self.turns[slot] = b.alloca(element(stage.outputs[slot]), number(self._numbers(slot) * stage.rows))
        kind = element(stage.outputs[slot])
        return b.gep(self.turns[slot], [b.mul(row, number(self._numbers(slot)))], True, source_etype=kind)

    def _numbers(self, slot: int) -> int:
        return self.stage.turn * self.stage.counts[slot]
