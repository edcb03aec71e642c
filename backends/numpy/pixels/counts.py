"""Count bins of rows (`passgraph.plan.data.CountStep`): each texel increments its bin in a table."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from passgraph.backends.numpy.machine import llvm
from passgraph.backends.numpy.machine.llvm import IRBuilder
from passgraph.backends.numpy.machine.machine_code import function_code, lanes
from passgraph.backends.numpy.machine.workers import Workers
from passgraph.backends.numpy.vector.lanes import F32, I32, I64, Lanes, counting, zeros
from passgraph.cached import cached_property
from passgraph.graph.targets import MOST_BINS

if TYPE_CHECKING:
    from passgraph.backends.base import Block
    from passgraph.backends.numpy.storage import Storage
    from passgraph.plan.data import CountStep

#: Neighboring numbers are often equal: they go to several tables in turn, so that additions do not wait for each other.
TABLES = 4
#: Entries of a table, padded by a vector.
ROOM = MOST_BINS + 32
#: Texels in one piece of work.
PIECE = 65_536
_CALL = ctypes.CFUNCTYPE(None, *[ctypes.c_int64] * 9)


class Counts:
    """The counting pass, compiled."""

    def __init__(self, step: CountStep, workers: Workers) -> None:
        self.workers, self.rows, self.bins, width = workers, step.size[1], step.bins, lanes()
        self.code = function_code(("counts", str(width)), lambda name: counts_text(name, width))

    @cached_property
    def function(self) -> Any:
        return self.code.function(_CALL)

    def __call__(self, outputs: Sequence[Storage], images: Sequence[Storage], block: Block) -> None:
        (image,), (counts,) = images, outputs
        each = max(1, PIECE // image.size[0])

        def piece(number: int) -> None:
            first = number * each
            end = min(first + each, self.rows)
            self.function(*image.by_rows, counts.address, counts.pitch, self.bins, first, end)

        self.workers.each(piece, -(-self.rows // each))


def counts_text(name: str, width: int) -> str:
    """Return a module with ``counts(picture…, output…, bins, first, end)``: counts these rows into the output's."""
    module = llvm.Module(name)
    function = llvm.Function(module, llvm.FunctionType(llvm.VoidType(), [I64] * 9), name)
    b = Lanes(IRBuilder(function), width)
    picture, across, down, pitch, output, apart, bins, first, end = function.args
    tables = b.alloca(I32, _long(TABLES * ROOM))
    source, target = (b.inttoptr(address, llvm.PointerType()) for address in (picture, output))
    with counting(b, first, end, _long(1)) as y:
        with counting(b, _long(0), b.add(bins, _long(1)), _long(width)) as entry:
            for table in range(TABLES):
                place = _place(b, tables, b.add(entry, _long(table * ROOM)), I32)
                b.plain.store(zeros(b.vector(I32)), place, align=4)
        with b.if_then(b.icmp_signed("<", y, down)):  # rows below the picture count nothing
            _row(b, _place(b, source, b.mul(y, pitch), F32), across, bins, tables)
        _sums(b, tables, _place(b, target, b.mul(b.mul(y, apart), _long(4)), F32), bins)
    b.ret_void()
    return str(module)


def _long(number: int) -> Any:
    return llvm.Constant(I64, number)


def _place(b: Lanes, pointer: Any, index: Any, kind: Any) -> Any:
    return b.gep(pointer, [index], True, source_etype=kind)


def _row(b: Lanes, row: Any, across: Any, bins: Any, tables: Any) -> None:
    """Count a row's numbers in the tables: vectors, then the rest one by one."""
    turns = b.lanes
    vectors_end = b.sub(across, b.srem(across, _long(turns)))
    with counting(b, _long(0), vectors_end, _long(turns)) as x:
        loaded = b.load(_place(b, row, x, F32), typ=b.vector(F32), align=4)
        numbers = _bins(b, loaded, bins)
        for lane in range(turns):
            _add(b, tables, b.extract_element(numbers, llvm.Constant(I32, lane)), lane % TABLES)
    with counting(b, vectors_end, across, _long(1)) as x:
        _add(b, tables, _bins(b, b.load(_place(b, row, x, F32), typ=F32, align=4), bins), 0)


def _bins(b: Lanes, value: Any, bins: Any) -> Any:
    """Return the bins as ints; 0 for numbers in no bin."""
    one, most = llvm.Constant(F32, 1.0), b.sitofp(bins, F32)
    inside = b.and_(b.fcmp_ordered(">=", value, one), b.fcmp_ordered("<=", value, most))
    near = b.fptosi(b.select(inside, value, llvm.Constant(F32, 0.0)), I32)
    return b.select(b.fcmp_ordered("==", b.sitofp(near, F32), value), near, llvm.Constant(I32, 0))


def _add(b: Lanes, tables: Any, number: Any, table: int) -> None:
    place = _place(b, tables, b.add(number, llvm.Constant(I32, table * ROOM)), I32)
    b.plain.store(b.plain.add(b.load(place, typ=I32), llvm.Constant(I32, 1)), place)


def _sums(b: Lanes, tables: Any, row: Any, bins: Any) -> None:
    """Write the sums of the tables, from entry 1 on, as the floats of a row."""
    with counting(b, _long(0), bins, _long(b.lanes)) as x:
        total = None
        for table in range(TABLES):
            place = _place(b, tables, b.add(x, _long(table * ROOM + 1)), I32)
            part = b.load(place, typ=b.vector(I32), align=4)
            total = part if total is None else b.add(total, part)
        numbers = b.add(b.trunc(x, I32), b.counting(I32))
        in_range = b.icmp_signed("<", numbers, b.trunc(bins, I32))
        b.store_masked(b.sitofp(total, F32), _place(b, row, x, F32), in_range, 4)
