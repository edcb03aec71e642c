"""Builds instructions of LLVM's text, each a line (ir.py): methods are called as LLVM calls what they write."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from typing import Any

from passgraph.backends.numpy.machine.ir import (
    Block,
    Function,
    IntType,
    Phi,
    PointerType,
    Type,
    Value,
    VectorType,
    VoidType,
    joined,
)  # fmt: skip

_POINTER, _BIT = PointerType(), IntType(1)
_SIGNED = {"<": "slt", "<=": "sle", ">": "sgt", ">=": "sge", "==": "eq", "!=": "ne"}
_UNSIGNED = {"<": "ult", "<=": "ule", ">": "ugt", ">=": "uge", "==": "eq", "!=": "ne"}
_ORDERED = {"<": "olt", "<=": "ole", ">": "ogt", ">=": "oge", "==": "oeq", "!=": "one"}
_UNORDERED = {"<": "ult", "<=": "ule", ">": "ugt", ">=": "uge", "==": "ueq", "!=": "une", "uno": "uno"}


def _aligned(align: int | None) -> str:
    return "" if align is None else f", align {align}"


def _of_two(name: str) -> Callable[[IRBuilder, Value, Value], Value]:
    return lambda self, x, y: self._made(x.type, f"{name} {x.type.text} {x.text}, {y.text}")


def _cast(name: str) -> Callable[[IRBuilder, Value, Type], Value]:
    def emit(self: IRBuilder, x: Value, kind: Type) -> Value:
        return x if x.type is kind else self._made(kind, f"{name} {x.type.text} {x.text} to {kind.text}")

    return emit


class IRBuilder:
    """Writes at the end of ``block``; before its end, where it has one."""

    def __init__(self, function: Function) -> None:
        self.function, self.module, self.block = function, function.module, function.append_basic_block("entry")

    # Places

    def append_basic_block(self, name: str) -> Block:
        return self.function.append_basic_block(name)

    def position_at_end(self, block: Block) -> None:
        self.block = block

    @contextmanager
    def goto_block(self, block: Block) -> Iterator[None]:
        """What is written inside stands in another block."""
        before, self.block = self.block, block
        yield
        self.block = before

    def goto_entry_block(self) -> AbstractContextManager[None]:
        return self.goto_block(self.function.entry_basic_block)

    @contextmanager
    def if_then(self, condition: Value) -> Iterator[None]:
        then, behind = self.append_basic_block("then"), self.append_basic_block("behind")
        self.cbranch(condition, then, behind)
        with self._branch(then, behind):
            yield
        self.position_at_end(behind)

    @contextmanager
    def if_else(self, condition: Value) -> Iterator[tuple[AbstractContextManager[None], AbstractContextManager[None]]]:
        then, orelse, behind = (self.append_basic_block(name) for name in ("then", "else", "behind"))
        self.cbranch(condition, then, orelse)
        yield self._branch(then, behind), self._branch(orelse, behind)
        self.position_at_end(behind)

    @contextmanager
    def _branch(self, block: Block, behind: Block) -> Iterator[None]:
        self.position_at_end(block)
        yield
        if not self.block.end:
            self.branch(behind)

    # Ends of blocks

    def branch(self, to: Block) -> None:
        self.block.end = f"br label %{to.name}"

    def cbranch(self, condition: Value, then: Block, orelse: Block, weights: tuple[int, int] | None = None) -> None:
        """``weights``: how often one is taken, and the other."""
        self.block.end = f"br i1 {condition.text}, label %{then.name}, label %{orelse.name}"
        if weights is not None:
            told = ", ".join(['!"branch_weights"', *(f"i32 {weight}" for weight in weights)])
            self.block.end += f", !prof {self.module.metadata(told)}"

    def ret(self, value: Value) -> None:
        self.block.end = f"ret {value}"

    def ret_void(self) -> None:
        self.block.end = "ret void"

    # Values

    def _made(self, kind: Any, line: str) -> Value:
        block, text = self.block, f"%v{next(self.function.numbers)}"
        block.lines.append(f"{text} = {line}")
        return Value(kind, text, block)

    fadd, fsub, fmul, fdiv = map(_of_two, ("fadd", "fsub", "fmul", "fdiv"))
    add, sub, mul, sdiv, srem = map(_of_two, ("add", "sub", "mul", "sdiv", "srem"))
    shl, ashr, lshr, and_, or_, xor = map(_of_two, ("shl", "ashr", "lshr", "and", "or", "xor"))
    sext, zext, trunc, bitcast, inttoptr = map(_cast, ("sext", "zext", "trunc", "bitcast", "inttoptr"))
    fptrunc, fpext = map(_cast, ("fptrunc", "fpext"))
    sitofp, uitofp, fptosi = map(_cast, ("sitofp", "uitofp", "fptosi"))

    def select(self, condition: Value, then: Value, orelse: Value) -> Value:
        return self._made(then.type, f"select {joined((condition, then, orelse))}")

    def fneg(self, x: Value) -> Value:
        return self._made(x.type, f"fneg {x}")

    def not_(self, x: Value) -> Value:
        ones = f"splat ({x.type.element} -1)" if isinstance(x.type, VectorType) else "-1"
        return self._made(x.type, f"xor {x}, {ones}")

    def icmp_signed(self, sign: str, x: Value, y: Value) -> Value:
        return self._compared("icmp", _SIGNED[sign], x, y)

    def icmp_unsigned(self, sign: str, x: Value, y: Value) -> Value:
        return self._compared("icmp", _UNSIGNED[sign], x, y)

    def fcmp_ordered(self, sign: str, x: Value, y: Value) -> Value:
        return self._compared("fcmp", _ORDERED[sign], x, y)

    def fcmp_unordered(self, sign: str, x: Value, y: Value) -> Value:
        return self._compared("fcmp", _UNORDERED[sign], x, y)

    def _compared(self, name: str, sign: str, x: Value, y: Value) -> Value:
        kind = x.type
        found = VectorType(_BIT, kind.count) if isinstance(kind, VectorType) else _BIT
        return self._made(found, f"{name} {sign} {kind.text} {x.text}, {y.text}")

    def phi(self, kind: Type) -> Phi:
        made = Phi(kind, f"%v{next(self.function.numbers)}", self.block)
        self.block.phis.append(made)
        return made

    def call(self, function: Value, given: Sequence[Value], attrs: Sequence[str] = ()) -> Value:
        kind = function.type.pointee.return_type
        line = f"call {kind.text} {function.text}({joined(given)}) {' '.join(attrs)}"
        if isinstance(kind, VoidType):
            self.block.lines.append(line)
            return function
        return self._made(kind, line)

    # Memory

    def alloca(self, kind: Type, size: Value | None = None) -> Value:
        return self._made(_POINTER, f"alloca {kind}" + (f", {size}" if size is not None else ""))

    def load(self, place: Value, typ: Type, align: int | None = None, steady: bool = False) -> Value:
        """``steady``: nothing writes there meanwhile."""
        line = f"load {typ.text}, ptr {place.text}" + _aligned(align)
        return self._made(typ, f"{line}, !invariant.load {self.module.metadata('')}" if steady else line)

    def store(self, value: Value, place: Value, align: int | None = None) -> None:
        self.block.lines.append(f"store {value}, ptr {place.text}{_aligned(align)}")

    def gep(self, place: Value, indices: Sequence[Value], inbounds: bool = False, *, source_etype: Type) -> Value:
        """Of a vector of indices a vector of places."""
        kind = indices[0].type
        found = VectorType(_POINTER, kind.count) if isinstance(kind, VectorType) else _POINTER
        inside = "inbounds " if inbounds else ""
        return self._made(found, f"getelementptr {inside}{source_etype.text}, ptr {place.text}, {joined(indices)}")

    def atomic_rmw(self, name: str, place: Value, value: Value, ordering: str) -> Value:
        return self._made(value.type, f"atomicrmw {name} ptr {place.text}, {value} {ordering}")

    # Vectors and structs

    def extract_element(self, x: Value, place: Value) -> Value:
        return self._made(x.type.element, f"extractelement {x}, {place}")

    def insert_element(self, x: Value, value: Value, place: Value) -> Value:
        return self._made(x.type, f"insertelement {x}, {value}, {place}")

    def shuffle_vector(self, x: Value, y: Value, places: Value) -> Value:
        kind = VectorType(x.type.element, places.type.count)
        return self._made(kind, f"shufflevector {joined((x, y, places))}")

    def extract_value(self, x: Value, place: int) -> Value:
        return self._made(x.type.elements[place], f"extractvalue {x}, {place}")

    def insert_value(self, x: Value, value: Value, place: int) -> Value:
        return self._made(x.type, f"insertvalue {x}, {value}, {place}")
