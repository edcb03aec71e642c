"""Classes to build LLVM text: types, constants, functions, blocks and instructions."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from itertools import count
from typing import Any

#: Attribute of a function that is one loop over points: it has no branches, and computes nothing outside the points.
POINTS = '"points"'


class _Once(type):
    """Metaclass of types: equal types are the same object."""

    objects: dict[Any, Any] = {}  # noqa: RUF012 (of all classes together)

    def __call__(cls, *given: Any) -> Any:
        key = (cls, *(tuple(part) if isinstance(part, list) else part for part in given))
        found = _Once.objects.get(key)
        return found or _Once.objects.setdefault(key, super().__call__(*key[1:]))  # one object in all threads


class Type(metaclass=_Once):
    """An LLVM type; ``text`` is its spelling."""

    text: str

    def __str__(self) -> str:
        return self.text

    def number(self, value: Any) -> str:
        """Return a constant's text."""
        return str(value)


class VoidType(Type):
    text = "void"


class IntType(Type):
    def __init__(self, width: int) -> None:
        self.text, self.width = f"i{width}", width

    def number(self, value: Any) -> str:
        return str(int(value))


class _Real(Type):
    """A float type; constants are rounded to its precision and written as the bits of the same float64."""

    letter: str

    def number(self, value: Any) -> str:
        (rounded,) = struct.unpack(self.letter, struct.pack(self.letter, float(value)))
        return f"0x{int.from_bytes(struct.pack('>d', rounded)):016x}"


class HalfType(_Real):
    text, letter = "half", "e"


class FloatType(_Real):
    text, letter = "float", "f"


class DoubleType(_Real):
    text, letter = "double", "d"


class VectorType(Type):
    def __init__(self, element: Type, count: int) -> None:
        self.text, self.element, self.count = f"<{count} x {element.text}>", element, count


class ArrayType(Type):
    def __init__(self, element: Type, count: int) -> None:
        self.text = f"[{count} x {element.text}]"

    def number(self, value: Any) -> str:
        return f"[{', '.join(map(str, value))}]"


class LiteralStructType(Type):
    def __init__(self, elements: Sequence[Type]) -> None:
        self.text, self.elements = f"{{{', '.join(map(str, elements))}}}", elements


class FunctionType(Type):
    def __init__(self, return_type: Type, args: Sequence[Type]) -> None:
        self.text = f"{return_type.text} ({', '.join(map(str, args))})"
        self.return_type, self.args = return_type, args


class PointerType(Type):
    """A pointer; ``pointee`` is set for functions, to call them through it."""

    text = "ptr"

    def __init__(self, pointee: FunctionType | None = None) -> None:
        self.pointee = pointee


class Value:
    """A value; ``text`` is its name in operands; ``parent`` is the block of an instruction's result."""

    __slots__ = ("parent", "text", "type")

    def __init__(self, kind: Any, text: str, parent: Block | None = None) -> None:
        self.type, self.text, self.parent = kind, text, parent

    def __str__(self) -> str:
        return f"{self.type.text} {self.text}"


class Constant(Value):
    __slots__ = ("constant",)

    def __init__(self, kind: Any, constant: Any) -> None:
        super().__init__(kind, kind.number(constant))
        self.constant = constant

    def bitcast(self, kind: Type) -> Value:
        """Return the constant's bits as another type."""
        return Value(kind, f"bitcast ({self} to {kind.text})")


class Argument(Value):
    __slots__ = ("attributes",)

    def __init__(self, kind: Type, text: str) -> None:
        super().__init__(kind, text)
        self.attributes = ""

    def add_attribute(self, attribute: str) -> None:
        self.attributes += f" {attribute}"


class Phi(Value):
    """A phi node; printed once all incoming values are known."""

    __slots__ = ("incoming",)

    def __init__(self, kind: Type, text: str, parent: Block) -> None:
        super().__init__(kind, text, parent)
        self.incoming: list[str] = []

    def add_incoming(self, value: Value, block: Block) -> None:
        self.incoming.append(f"[{value.text}, %{block.name}]")

    def line(self) -> str:
        return f"{self.text} = phi {self.type.text} {', '.join(self.incoming)}"


class Block:
    """A sequence of instructions; ``end`` is the terminator."""

    def __init__(self, name: str) -> None:
        self.name, self.end = name, ""
        self.phis: list[Phi] = []
        self.lines: list[str] = []

    @property
    def is_terminated(self) -> bool:
        return bool(self.end)

    def written(self) -> str:
        return "\n  ".join([f"{self.name}:", *(phi.line() for phi in self.phis), *self.lines, self.end])


class Function(Value):
    """A function of a module; without blocks, a declaration."""

    __slots__ = ("args", "attributes", "blocks", "ftype", "linkage", "module", "name", "numbers")

    def __init__(self, module: Module, ftype: Any, name: str) -> None:
        super().__init__(PointerType(ftype), f"@{name}")
        self.module, self.ftype, self.name, self.linkage = module, ftype, name, ""
        self.args = [Argument(kind, f"%a{number}") for number, kind in enumerate(ftype.args)]
        self.attributes: set[str] = set()
        self.blocks: list[Block] = []
        self.numbers = count()  # to number its values and blocks
        module.globals[name] = self

    @property
    def entry_basic_block(self) -> Block:
        return self.blocks[0]

    def append_basic_block(self, name: str) -> Block:
        self.blocks.append(Block(f"{name}.{next(self.numbers)}" if self.blocks else name))
        return self.blocks[-1]

    def written(self) -> str:
        kind = self.ftype.return_type
        if not self.blocks:
            return f"declare {kind} {self.text}({', '.join(map(str, self.ftype.args))})"
        given = ", ".join(f"{a.type}{a.attributes} {a.text}" for a in self.args)
        head = f"define {self.linkage} {kind} {self.text}({given}) {' '.join(sorted(self.attributes))}"
        return "\n".join([f"{head} {{", *(block.written() for block in self.blocks), "}"])


class GlobalVariable(Value):
    """A private constant of a module, in memory."""

    __slots__ = ("initializer",)

    def __init__(self, module: Module, initializer: Constant) -> None:
        name = f"table.{len(module.globals)}"
        super().__init__(PointerType(), f"@{name}")
        self.initializer = initializer
        module.globals[name] = self

    def written(self) -> str:
        return f"{self.text} = internal constant {self.initializer}"


class Module:
    def __init__(self, name: str) -> None:
        self.name = name
        self.globals: dict[str, Any] = {}
        self._metadata: dict[str, str] = {}

    def metadata(self, text: str) -> str:
        """Return the name of a metadata node for instructions."""
        return self._metadata.setdefault(text, f"!{len(self._metadata)}")

    def __str__(self) -> str:
        said = [f"{name} = !{{{text}}}" for text, name in self._metadata.items()]
        return "\n\n".join([*(each.written() for each in self.globals.values()), *said, ""])


def joined(values: Sequence[Value]) -> str:
    """Return operands with their types."""
    return ", ".join([f"{value.type.text} {value.text}" for value in values])


_POINTER, _BIT = PointerType(), IntType(1)
_SIGNED = {"<": "slt", "<=": "sle", ">": "sgt", ">=": "sge", "==": "eq", "!=": "ne"}
_UNSIGNED = {"<": "ult", "<=": "ule", ">": "ugt", ">=": "uge", "==": "eq", "!=": "ne"}
_ORDERED = {"<": "olt", "<=": "ole", ">": "ogt", ">=": "oge", "==": "oeq", "!=": "one"}
_UNORDERED = {"<": "ult", "<=": "ule", ">": "ugt", ">=": "uge", "==": "ueq", "!=": "une", "uno": "uno"}


def _aligned(align: int | None) -> str:
    return "" if align is None else f", align {align}"


def _binary(name: str) -> Callable[[IRBuilder, Value, Value], Value]:
    return lambda self, x, y: self._value(x.type, f"{name} {x.type.text} {x.text}, {y.text}")


def _cast(name: str) -> Callable[[IRBuilder, Value, Type], Value]:
    def emit(self: IRBuilder, x: Value, kind: Type) -> Value:
        return x if x.type is kind else self._value(kind, f"{name} {x.type.text} {x.text} to {kind.text}")

    return emit


class IRBuilder:
    """Appends to ``block``, before its terminator if it has one."""

    def __init__(self, function: Function) -> None:
        self.function, self.module, self.block = function, function.module, function.append_basic_block("entry")

    # Places

    def append_basic_block(self, name: str) -> Block:
        return self.function.append_basic_block(name)

    def position_at_end(self, block: Block) -> None:
        self.block = block

    @contextmanager
    def goto_block(self, block: Block) -> Iterator[None]:
        """Emit into another block inside the ``with``."""
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
        """``weights``: how often each branch is taken."""
        self.block.end = f"br i1 {condition.text}, label %{then.name}, label %{orelse.name}"
        if weights is not None:
            weights_text = ", ".join(['!"branch_weights"', *(f"i32 {weight}" for weight in weights)])
            self.block.end += f", !prof {self.module.metadata(weights_text)}"

    def ret(self, value: Value) -> None:
        self.block.end = f"ret {value}"

    def ret_void(self) -> None:
        self.block.end = "ret void"

    # Values

    def _value(self, kind: Any, line: str) -> Value:
        block, text = self.block, f"%v{next(self.function.numbers)}"
        block.lines.append(f"{text} = {line}")
        return Value(kind, text, block)

    fadd, fsub, fmul, fdiv = map(_binary, ("fadd", "fsub", "fmul", "fdiv"))
    add, sub, mul, sdiv, srem = map(_binary, ("add", "sub", "mul", "sdiv", "srem"))
    shl, ashr, lshr, and_, or_, xor = map(_binary, ("shl", "ashr", "lshr", "and", "or", "xor"))
    sext, zext, trunc, bitcast, inttoptr = map(_cast, ("sext", "zext", "trunc", "bitcast", "inttoptr"))
    fptrunc, fpext = map(_cast, ("fptrunc", "fpext"))
    sitofp, uitofp, fptosi = map(_cast, ("sitofp", "uitofp", "fptosi"))

    def select(self, condition: Value, then: Value, orelse: Value) -> Value:
        return self._value(then.type, f"select {joined((condition, then, orelse))}")

    def fneg(self, x: Value) -> Value:
        return self._value(x.type, f"fneg {x}")

    def not_(self, x: Value) -> Value:
        ones = f"splat ({x.type.element} -1)" if isinstance(x.type, VectorType) else "-1"
        return self._value(x.type, f"xor {x}, {ones}")

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
        return self._value(found, f"{name} {sign} {kind.text} {x.text}, {y.text}")

    def phi(self, kind: Type) -> Phi:
        node = Phi(kind, f"%v{next(self.function.numbers)}", self.block)
        self.block.phis.append(node)
        return node

    def call(self, function: Value, given: Sequence[Value], attrs: Sequence[str] = ()) -> Value:
        kind = function.type.pointee.return_type
        line = f"call {kind.text} {function.text}({joined(given)}) {' '.join(attrs)}"
        if isinstance(kind, VoidType):
            self.block.lines.append(line)
            return function
        return self._value(kind, line)

    # Memory

    def alloca(self, kind: Type, size: Value | None = None) -> Value:
        return self._value(_POINTER, f"alloca {kind}" + (f", {size}" if size is not None else ""))

    def load(self, place: Value, typ: Type, align: int | None = None, steady: bool = False) -> Value:
        """``steady``: the memory is not written meanwhile."""
        line = f"load {typ.text}, ptr {place.text}" + _aligned(align)
        return self._value(typ, f"{line}, !invariant.load {self.module.metadata('')}" if steady else line)

    def store(self, value: Value, place: Value, align: int | None = None) -> None:
        self.block.lines.append(f"store {value}, ptr {place.text}{_aligned(align)}")

    def gep(self, place: Value, indices: Sequence[Value], inbounds: bool = False, *, source_etype: Type) -> Value:
        """Compute an address, or a vector of addresses for a vector of indices."""
        kind = indices[0].type
        found = VectorType(_POINTER, kind.count) if isinstance(kind, VectorType) else _POINTER
        inside = "inbounds " if inbounds else ""
        return self._value(found, f"getelementptr {inside}{source_etype.text}, ptr {place.text}, {joined(indices)}")

    def atomic_rmw(self, name: str, place: Value, value: Value, ordering: str) -> Value:
        return self._value(value.type, f"atomicrmw {name} ptr {place.text}, {value} {ordering}")

    # Vectors and structs

    def extract_element(self, x: Value, place: Value) -> Value:
        return self._value(x.type.element, f"extractelement {x}, {place}")

    def insert_element(self, x: Value, value: Value, place: Value) -> Value:
        return self._value(x.type, f"insertelement {x}, {value}, {place}")

    def shuffle_vector(self, x: Value, y: Value, places: Value) -> Value:
        kind = VectorType(x.type.element, places.type.count)
        return self._value(kind, f"shufflevector {joined((x, y, places))}")

    def extract_value(self, x: Value, place: int) -> Value:
        return self._value(x.type.elements[place], f"extractvalue {x}, {place}")

    def insert_value(self, x: Value, value: Value, place: int) -> Value:
        return self._value(x.type, f"insertvalue {x}, {value}, {place}")
