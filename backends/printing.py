"""Print scalar programs in shading languages; GLSL and OpenCL C share the C-like part."""

from __future__ import annotations

import hashlib
import math
import struct
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from typing import ClassVar

import numpy as np

from passgraph import disk_cache
from passgraph.cached import cached_property
from passgraph.language import scalar as s
from passgraph.language.builtin_name import BuiltinName
from passgraph.language.operations import OPERATIONS
from passgraph.language.source import NOWHERE, Span
from passgraph.records import dataclass

INT_MIN = -(2**31)
#: INT_MIN has no literal: 2147483648 overflows before it is negated.
INT_MIN_TEXT = "(-2147483647 - 1)"
#: The smallest normal float32; compilers may flush smaller literals.
SMALLEST_NORMAL = 2.0**-126


@dataclass(frozen=True)
class Listing:
    """Generated source, with the kernel line behind each of its lines."""

    text: str
    spans: tuple[Span, ...]

    def span_at(self, line: int) -> Span:
        """Return the kernel span behind a generated line, counted from 1 as compilers count."""
        return self.spans[min(max(line, 1), len(self.spans)) - 1] if self.spans else NOWHERE


class KeptListing(Listing):
    """Source from the disk cache. Its spans, for errors, are those of the source printed again."""

    def __init__(self, text: str, make: Callable[[], Listing]) -> None:
        vars(self).update(text=text, make=make)

    @cached_property
    def spans(self) -> tuple[Span, ...]:
        listing: Listing = vars(self)["make"]()
        return listing.spans


def kept(make: Callable[[], Listing], *key: object) -> Listing:
    """Return the source that ``make`` prints, from the disk cache if it is there.

    ``key`` is everything that its text depends on, in objects whose ``repr`` tells them apart; a program by its `key`.
    """
    stamp = disk_cache.package_stamp()
    if stamp is None:
        return make()
    name = hashlib.sha256(repr((stamp, make.__module__, key)).encode(errors="surrogatepass")).hexdigest()
    data = disk_cache.recall("sources", name)
    if data is not None:
        return KeptListing(data.decode(errors="surrogatepass"), make)
    listing = make()
    disk_cache.remember("sources", name, listing.text.encode(errors="surrogatepass"))
    return listing


class Printer(ABC):
    """Prints one program.  Values are named ``v1``, ``v2`` …, variables ``m0``, ``m1`` …"""

    #: Names of ``bool``, ``int`` and ``float``.
    types: ClassVar[Mapping[str, str]]
    #: Argument type → primitive operation → expression; ``{0}`` is the first argument.
    spelled: ClassVar[Mapping[str, Mapping[str, str]]]
    #: Suffix of a float literal: ``"f"`` where a literal is double by default.
    float_suffix: ClassVar[str] = ""

    def __init__(self, program: s.ScalarProgram) -> None:
        self.program = program
        self.files = {span.file for span in program.sources}
        self.here = program.sources[0] if program.sources else NOWHERE
        self.names: dict[int, str] = {}  # value id → expression without side effects
        self.lines: list[str] = []
        self.spans: list[Span] = []
        self.depth = 0

    # Syntax of the language

    @abstractmethod
    def constant(self, type_: str, name: str, expression: str) -> str:
        """Declare a value that is never written again."""

    @abstractmethod
    def variable(self, type_: str, name: str) -> str:
        """Declare a variable that branches and loops write; it needs no initial value."""

    @abstractmethod
    def array(self, type_: str, name: str, length: int) -> str:
        """Declare an array; it needs no initial value."""

    @abstractmethod
    def choice(self, condition: str, then: str, orelse: str) -> str:
        """Return ``then`` if the condition holds, else ``orelse``; both may be computed."""

    @abstractmethod
    def loop(self, index: str, start: str, compare: str, stop: str, step: str) -> str:
        """Open a loop whose index advances by ``step`` while it compares with ``stop``."""

    @abstractmethod
    def repetition(self, index: str, count: str) -> str:
        """Open a loop of ``count`` iterations."""

    @abstractmethod
    def float_from_bits(self, bits: int) -> str:
        """Return the float with these bits (a signed 32-bit int): infinities, NaN and denormals have no literal."""

    # Sources of values

    @abstractmethod
    def uniform(self, block: str, index: str | int) -> str:
        """Return entry ``index`` (an int if known) of the block ``"float"`` or ``"int"``."""

    @abstractmethod
    def builtin(self, name: BuiltinName) -> str:
        """Return the expression of a builtin."""

    def sample(self, load: s.Sample) -> None:
        """Print one sample of a texture, and :meth:`name` (or :meth:`value`) its results."""
        raise AssertionError(load)

    def load(self, load: s.Load) -> None:
        """Print the loads of numbers from a buffer, for languages that have them."""
        raise AssertionError(load)

    def store(self, store: s.Store) -> None:
        """Print the stores of numbers into a buffer."""
        raise AssertionError(store)

    def table(self, name: str, index: str) -> str:
        return f"{name}[{index}]"

    def operation(self, op: s.Op, arguments: list[str]) -> str:
        """Return the expression of an operation; arguments are names or literals, cheap to repeat."""
        return self.spelled[op.on][op.operation].format(*arguments)

    # Text

    def line(self, text: str = "", span: Span | None = None) -> None:
        """Print one or more lines of source, indented."""
        for part in text.split("\n"):
            self.lines.append("    " * self.depth + part if part else "")
            self.spans.append(span or self.here)

    def listing(self) -> Listing:
        return Listing("\n".join(self.lines) + "\n", tuple(self.spans))

    def front(self, text: str) -> None:
        """Put text before everything printed so far."""
        lines = text.strip("\n").split("\n")
        self.lines[:0] = lines
        self.spans[:0] = [self.program.sources[0] if self.program.sources else NOWHERE] * len(lines)

    def called(self, functions: Mapping[str, str]) -> str:
        """Return those of ``functions`` (name → text) that the text calls so far, in order.

        Functions may call earlier ones.
        """
        text = "\n".join(self.lines)
        needed: list[str] = []
        for name in reversed(list(functions)):
            if f"{name}(" in text:
                needed.append(functions[name].strip("\n"))
                text += functions[name]
        return "\n".join(reversed(needed))

    # Operands

    def operand(self, operand: s.Operand) -> str:
        return self.literal(operand) if isinstance(operand, s.Lit) else self.names[operand.id]

    def literal(self, literal: s.Lit) -> str:
        if literal.type == "bool":
            return "true" if literal.value else "false"
        if literal.type == "int":
            return self.int_literal(int(literal.value))
        return self.float_literal(float(literal.value))

    def int_literal(self, value: int) -> str:
        if value == INT_MIN:
            return INT_MIN_TEXT
        return f"({value})" if value < 0 else str(value)

    def float_literal(self, value: float) -> str:
        """Return all digits of the nearest float32, so that compilers need not round."""
        with np.errstate(over="ignore", under="ignore"):
            exact = float(np.float32(value))
        negative_zero = exact == 0 and math.copysign(1, exact) < 0
        if not math.isfinite(exact) or 0 < abs(exact) < SMALLEST_NORMAL or negative_zero:
            return self.float_from_bits(struct.unpack("<i", struct.pack("<f", exact))[0])
        text = f"{exact!r}{self.float_suffix}"
        return f"({text})" if exact < 0 else text

    # Values

    def name(self, value: s.Val, expression: str) -> None:
        """Use ``expression`` for a value: it must stay valid and cheap wherever the value is used."""
        self.names[value.id] = expression

    def value(self, value: s.Val, expression: str, span: Span | None = None) -> None:
        """Declare a value and compute it here."""
        self.names[value.id] = f"v{value.id}"
        self.line(self.constant(value.type, f"v{value.id}", expression), span)

    def variables(self) -> None:
        """Declare the variables of branches and loops."""
        for name, type_ in self.program.variables:
            self.line(self.variable(type_, name))
        for name, type_, length in self.program.arrays:
            self.line(self.array(type_, name, length))

    @cached_property
    def uses(self) -> Counter[int]:
        """Return how often each value is printed: addresses that are printed once stand where they are used."""
        printed: Counter[int] = Counter()
        for i in s.walk(self.program.body):
            times = sum(to is not None for to in i.to) if isinstance(i, s.Load) else 1
            times = len(i.values) if isinstance(i, s.Store) else times
            for operand in s.operands_of(i):
                if isinstance(operand, s.Val):
                    printed[operand.id] += times
        return printed

    # Instructions

    def block(self, body: Iterable[s.Instruction]) -> None:
        for instruction in body:
            self.instruction(instruction)

    def instruction(self, i: s.Instruction) -> None:
        if isinstance(i, s.Op):
            self.move(i.span)
            inlined = i.on in (s.INDEX, s.LONG, s.COORDINATE) and self.uses[i.to.id] == 1
            (self.name if inlined else self.value)(i.to, self.operation(i, [self.operand(a) for a in i.arguments]))
        elif isinstance(i, s.Choose):
            condition, then, orelse = (self.operand(a) for a in (i.condition, i.then, i.orelse))
            self.value(i.to, self.choice(condition, then, orelse))
        elif isinstance(i, s.LoadUniform):
            if isinstance(i.index, s.Lit):
                self.name(i.to, self.uniform(i.block, int(i.index.value)))
            else:
                self.value(i.to, self.uniform(i.block, self.operand(i.index)))
        elif isinstance(i, s.LoadTable):
            self.value(i.to, self.table(i.table, self.operand(i.index)))
        elif isinstance(i, s.LoadBuiltin):
            self.name(i.to, self.builtin(i.name))
        elif isinstance(i, s.Sample):
            self.move(i.span)
            self.sample(i)
        elif isinstance(i, s.Load):
            self.move(i.span)
            self.load(i)
        elif isinstance(i, s.Store):
            self.store(i)
        elif isinstance(i, s.Read):
            self.value(i.to, i.variable)
        elif isinstance(i, s.Write):
            self.line(f"{i.variable} = {self.operand(i.value)};")
        elif isinstance(i, s.ReadAt):
            self.value(i.to, f"{i.array}[{self.operand(i.index)}]")
        elif isinstance(i, s.WriteAt):
            self.line(f"{i.array}[{self.operand(i.index)}] = {self.operand(i.value)};")
        elif isinstance(i, s.If):
            self.branch(i)
        elif isinstance(i, s.For):
            self.trips(i)
        else:
            self.line("break;" if isinstance(i, s.Break) else "continue;")

    def branch(self, i: s.If) -> None:
        self.line(f"if ({self.operand(i.condition)}) {{")
        self.indented(i.then)
        if i.orelse:
            self.line("} else {")
            self.indented(i.orelse)
        self.line("}")

    def trips(self, i: s.For) -> None:
        """Print a loop; it counts iterations if the index would overflow 32 bits after the last one."""
        index = f"v{i.index.id}"
        self.name(i.index, index)
        start, stop, step, trips = (self.int_literal(n) for n in (i.start, i.stop, i.step, i.trips))
        if i.wraps:
            add, multiply = (self.spelled["int"][name] for name in ("add", "mul"))
            self.line(self.repetition(f"{index}t", trips))
            self.depth += 1
            self.line(self.constant("int", index, add.format(start, multiply.format(f"{index}t", step))))
            self.depth -= 1
        else:
            self.line(self.loop(index, start, "<" if i.step > 0 else ">", stop, step))
        self.indented(i.body)
        self.line("}")

    def indented(self, body: Iterable[s.Instruction]) -> None:
        self.depth += 1
        self.block(body)
        self.depth -= 1

    def move(self, span: Span) -> None:
        """Set the span of the following lines; the prelude's lines belong to the kernel line that calls it."""
        if span.file in self.files:
            self.here = span


#: No intermediate value overflows, and ``%`` never gets a negative operand (undefined in GLSL 3.30).
FLOOR_DIVIDE = f"""
int pg_floor_divide(int a, int b)
{{
    if (b == 0) {{ return 0; }}
    if (b == -1) {{ return a == {INT_MIN_TEXT} ? a : -a; }}
    int q = a / b;
    int r = a - q * b;
    return r != 0 && (r < 0) != (b < 0) ? q - 1 : q;
}}
"""
INT_MOD = """
int pg_int_mod(int a, int b)
{
    if (b == 0 || b == -1) { return 0; }
    int r = a - (a / b) * b;
    return r != 0 && (r < 0) != (b < 0) ? r + b : r;
}
"""

_NUMBERS = {
    "min": "({1} < {0} ? {1} : {0})", "max": "({0} < {1} ? {1} : {0})",
    "less": "({0} < {1})", "less_equal": "({0} <= {1})", "greater": "({0} > {1})", "greater_equal": "({0} >= {1})",
    "equal": "({0} == {1})", "not_equal": "({0} != {1})",
}  # fmt: skip
#: Operations with the same name in both languages, by the type of their arguments.
SPELLED: dict[str, dict[str, str]] = {
    "float": {
        **_NUMBERS,
        "add": "({0} + {1})", "sub": "({0} - {1})", "mul": "({0} * {1})", "div": "({0} / {1})", "neg": "(-{0})",
        "floor": "floor({0})", "ceil": "ceil({0})", "trunc": "trunc({0})", "sqrt": "sqrt({0})",
        "isnan": "pg_isnan({0})", "isinf": "pg_isinf({0})", "to_int": "pg_to_int({0})",
    },
    "int": {
        **_NUMBERS,
        "floor_divide": "pg_floor_divide({0}, {1})", "int_mod": "pg_int_mod({0}, {1})",
        "bit_and": "({0} & {1})", "bit_or": "({0} | {1})", "bit_xor": "({0} ^ {1})", "bit_not": "(~{0})",
        "shift_right": "({0} >> ({1} & 31))",
    },
    s.INDEX: {
        "add": "({0} + {1})", "sub": "({0} - {1})", "mul": "({0} * {1})", "neg": "(-{0})",
        "min": "min({0}, {1})", "max": "max({0}, {1})", "not_equal": "({0} != {1})",
        "less": "({0} < {1})", "greater_equal": "({0} >= {1})",
    },
    s.COORDINATE: {"add": "({0} + {1})", "sub": "({0} - {1})", "mul": "({0} * {1})", "clamp": "clamp({0}, {1}, {2})"},
    "bool": {
        "logical_and": "({0} && {1})", "logical_or": "({0} || {1})", "logical_not": "(!{0})",
        "to_int": "({0} ? 1 : 0)",
    },
}  # fmt: skip


def builtin_calls(functions: Iterable[str], **own_names: str) -> dict[str, str]:
    """Return the spellings of a language's built-in functions: calls by the operation's name or the language's own.

    >>> builtin_calls(["exp", "atan2"], atan2="atan")
    {'exp': 'exp({0})', 'atan2': 'atan({0}, {1})'}
    """
    operands = {name: ", ".join(f"{{{i}}}" for i in range(len(OPERATIONS[name].operands))) for name in functions}
    return {name: f"{own_names.get(name, name)}({given})" for name, given in operands.items()}


def spelled(own: Mapping[str, Mapping[str, str]]) -> dict[str, dict[str, str]]:
    """Return :data:`SPELLED` with a language's own spellings."""
    return {kind: {**SPELLED.get(kind, {}), **own.get(kind, {})} for kind in {**SPELLED, **own}}


class CLike(Printer):
    """A language with C's statements."""

    types: ClassVar[Mapping[str, str]] = {
        "bool": "bool",
        "int": "int",
        "float": "float",
        s.INDEX: "int",
        s.COORDINATE: "float",
    }

    def declared(self, type_: str) -> str:
        """Return the declaration of a value without its name: type and qualifiers."""
        return self.types[type_]

    def constant(self, type_: str, name: str, expression: str) -> str:
        return f"{self.declared(type_)} {name} = {expression};"

    def variable(self, type_: str, name: str) -> str:
        zero = {"bool": "false", "int": "0", "float": "0.0" + self.float_suffix}[type_]
        return f"{self.declared(type_)} {name} = {zero};"

    def array(self, type_: str, name: str, length: int) -> str:
        return f"{self.declared(type_)} {name}[{length}];"

    def choice(self, condition: str, then: str, orelse: str) -> str:
        return f"({condition} ? {then} : {orelse})"

    def loop(self, index: str, start: str, compare: str, stop: str, step: str) -> str:
        return f"for (int {index} = {start}; {index} {compare} {stop}; {index} += {step}) {{"

    def repetition(self, index: str, count: str) -> str:
        return f"for (int {index} = 0; {index} < {count}; ++{index}) {{"
