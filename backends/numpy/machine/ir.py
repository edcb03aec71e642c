"""LLVM's text, written as it is built: types, constants, modules, functions and blocks; instructions by builder.py.

Named and called as in `llvmlite.ir`, as far as kernels need it.  That one first makes objects of every operand and
type, which takes longer than LLVM does with the text.  Pointers are of one kind, and LLVM alone checks what is built.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from itertools import count
from typing import Any

#: Attribute of a function that is one loop over points: nothing in it branches, or is found beside them.
POINTS = '"points"'


class _Once(type):
    """Types that are equal are one object."""

    made: dict[Any, Any] = {}  # noqa: RUF012 (of all classes together)

    def __call__(cls, *given: Any) -> Any:
        key = (cls, *(tuple(part) if isinstance(part, list) else part for part in given))
        found = _Once.made.get(key)
        return found or _Once.made.setdefault(key, super().__call__(*key[1:]))  # one object in all threads


class Type(metaclass=_Once):
    """``text`` is how LLVM writes it."""

    text: str

    def __str__(self) -> str:
        return self.text

    def number(self, value: Any) -> str:
        """A constant's text."""
        return str(value)


class VoidType(Type):
    text = "void"


class IntType(Type):
    def __init__(self, width: int) -> None:
        self.text, self.width = f"i{width}", width

    def number(self, value: Any) -> str:
        return str(int(value))


class _Real(Type):
    """Rounded to the type's own precision; written by the bits of the same float64."""

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
    """``pointee`` is said of functions, which are called by it."""

    text = "ptr"

    def __init__(self, pointee: FunctionType | None = None) -> None:
        self.pointee = pointee


class Value:
    """``text`` names it where it is used; ``parent`` is the block of what an instruction gives."""

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
        """The same bits as another type's."""
        return Value(kind, f"bitcast ({self} to {kind.text})")


class Argument(Value):
    __slots__ = ("attributes",)

    def __init__(self, kind: Type, text: str) -> None:
        super().__init__(kind, text)
        self.attributes = ""

    def add_attribute(self, attribute: str) -> None:
        self.attributes += f" {attribute}"


class Phi(Value):
    """What a value is where blocks meet; written down once it is known."""

    __slots__ = ("incoming",)

    def __init__(self, kind: Type, text: str, parent: Block) -> None:
        super().__init__(kind, text, parent)
        self.incoming: list[str] = []

    def add_incoming(self, value: Value, block: Block) -> None:
        self.incoming.append(f"[{value.text}, %{block.name}]")

    def line(self) -> str:
        return f"{self.text} = phi {self.type.text} {', '.join(self.incoming)}"


class Block:
    """Instructions one after another; ``end``, the last one, says where to go on."""

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
    """Of a module; without blocks only declared."""

    __slots__ = ("args", "attributes", "blocks", "ftype", "linkage", "module", "name", "numbers")

    def __init__(self, module: Module, ftype: Any, name: str) -> None:
        super().__init__(PointerType(ftype), f"@{name}")
        self.module, self.ftype, self.name, self.linkage = module, ftype, name, ""
        self.args = [Argument(kind, f"%a{number}") for number, kind in enumerate(ftype.args)]
        self.attributes: set[str] = set()
        self.blocks: list[Block] = []
        self.numbers = count()  # tell its values and blocks apart
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
    """A constant in memory, of its module alone."""

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
        """The name of what is said in braces about instructions."""
        return self._metadata.setdefault(text, f"!{len(self._metadata)}")

    def __str__(self) -> str:
        said = [f"{name} = !{{{text}}}" for text, name in self._metadata.items()]
        return "\n\n".join([*(each.written() for each in self.globals.values()), *said, ""])


def joined(values: Sequence[Value]) -> str:
    """Operands with their types."""
    return ", ".join([f"{value.type.text} {value.text}" for value in values])
