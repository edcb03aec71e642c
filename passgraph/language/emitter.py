"""Build a scalar program: number values, fold constants, share common subexpressions, drop dead code."""

from __future__ import annotations

import math
from collections import ChainMap
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from typing import cast

import numpy as np

from passgraph.errors import KernelLengthError
from passgraph.language import scalar as s
from passgraph.language.builtin_name import BuiltinName
from passgraph.language.operations import OPERATIONS
from passgraph.language.source import NOWHERE, Span, fail
from passgraph.language.value_ranges import Ranges


@dataclass(eq=False)
class _Block:
    """A branch or loop: executing its instructions needs its condition, and a loop's jumps."""

    around: _Block | None
    condition: s.Operand | None = None
    jumps: list[_Block | None] = field(default_factory=list)  # blocks with a loop's breaks and continues


class _Liveness:
    """Liveness of values, variables and blocks; visits each once."""

    def __init__(self, body: Sequence[s.Instruction], roots: Sequence[s.Operand]) -> None:
        self.definitions: dict[int, tuple[s.Instruction, _Block | None]] = {}
        self.writes: dict[str, list[tuple[tuple[s.Operand, ...], _Block | None]]] = {}
        self._scan(body, None, None)
        self.needed: set[int] = set()
        self.variables: set[str] = set()
        self.blocks: set[_Block] = set()
        self.pending: list[int] = []
        self._need(*roots)
        while self.pending:
            instruction, block = self.definitions[self.pending.pop()]
            self._need(*s.operands_of(instruction))
            self._enter(block)
            if isinstance(instruction, (s.Read, s.ReadAt)):
                self._write(_variable(instruction))

    def _scan(self, body: Sequence[s.Instruction], block: _Block | None, loop: _Block | None) -> None:
        for instruction in body:
            if isinstance(instruction, (s.Op, s.Choose)):  # first, as most instructions are
                self.definitions[instruction.to.id] = (instruction, block)
            elif isinstance(instruction, s.If):
                inner = _Block(block, instruction.condition)
                self._scan(instruction.then, inner, loop)
                self._scan(instruction.orelse, inner, loop)
            elif isinstance(instruction, s.For):
                inner = _Block(block)
                self.definitions[instruction.index.id] = (instruction, inner)
                self._scan(instruction.body, inner, inner)
            elif isinstance(instruction, (s.Write, s.WriteAt)):
                self.writes.setdefault(_variable(instruction), []).append((s.operands_of(instruction), block))
            elif isinstance(instruction, (s.Break, s.Continue)):
                if loop is not None:
                    loop.jumps.append(block)
            else:
                for value in s.results_of(instruction):
                    self.definitions[value.id] = (instruction, block)

    def _need(self, *operands: s.Operand) -> None:
        for operand in operands:
            if isinstance(operand, s.Val) and operand.id not in self.needed:
                self.needed.add(operand.id)
                self.pending.append(operand.id)

    def _write(self, variable: str) -> None:
        if variable not in self.variables:
            self.variables.add(variable)
            for values, block in self.writes.get(variable, []):
                self._need(*values)
                self._enter(block)

    def _enter(self, block: _Block | None) -> None:
        pending = [block]
        while pending:
            block = pending.pop()
            if block is not None and block not in self.blocks:
                self.blocks.add(block)
                if block.condition is not None:
                    self._need(block.condition)
                pending += [block.around, *block.jumps]


def _variable(instruction: s.Read | s.Write | s.ReadAt | s.WriteAt) -> str:
    """Return the variable or array; their field names differ."""
    return instruction.variable if isinstance(instruction, (s.Read, s.Write)) else instruction.array


def eliminate_dead(body: Sequence[s.Instruction], roots: Sequence[s.Operand]) -> tuple[s.Instruction, ...]:
    """Drop instructions that no root depends on."""
    return tuple(_sweep(body, _Liveness(body, roots)))


def _sweep(body: Sequence[s.Instruction], live: _Liveness) -> list[s.Instruction]:
    live_instructions: list[s.Instruction] = []
    for instruction in body:
        if isinstance(instruction, (s.Op, s.Choose)):
            if instruction.to.id in live.needed:
                live_instructions.append(instruction)
        elif isinstance(instruction, s.If):
            then, orelse = _sweep(instruction.then, live), _sweep(instruction.orelse, live)
            if then or orelse:
                live_instructions.append(replace(instruction, then=tuple(then), orelse=tuple(orelse)))
        elif isinstance(instruction, s.For):
            inner = _sweep(instruction.body, live)
            if any(isinstance(i, (s.Write, s.WriteAt)) for i in s.walk(inner)):
                live_instructions.append(replace(instruction, body=tuple(inner)))
        elif isinstance(instruction, (s.Write, s.WriteAt)):
            if _variable(instruction) in live.variables:
                live_instructions.append(instruction)
        elif isinstance(instruction, s.LoadTexel):
            to = tuple(v if v is not None and v.id in live.needed else None for v in instruction.to)
            while to and to[-1] is None:
                to = to[:-1]
            if to:
                live_instructions.append(replace(instruction, to=to))
        elif isinstance(instruction, (s.Break, s.Continue)) or any(
            value.id in live.needed for value in s.results_of(instruction)
        ):
            live_instructions.append(instruction)
    return live_instructions


#: Branches of at most this length become selections, which vectorize; longer ones stay branches.
MAX_SELECTED_INSTRUCTIONS = 12
#: Most expressions lowered and instructions emitted for one kernel, loops unrolled.
MAX_STEPS = 200_000
_RESULT = {
    "N": "", "G": "float", "I": "int", "S": "int", "U": "int", "B": "bool", "f": "float", "i": "int", "b": "bool",
}  # fmt: skip
COMMUTATIVE = frozenset(row.name for row in OPERATIONS.values() if row.commutes)


class Emitter:
    """Collects instructions.  ``simplify=False`` disables folding of floats, sharing and selection."""

    def __init__(self, simplify: bool = True) -> None:
        self.simplify = simplify
        self.blocks: list[list[s.Instruction]] = [[]]
        self.known: list[dict[tuple[object, ...], object]] = [{}]
        self.ids = self.highest = 0
        self.variables: dict[str, str] = {}
        self.arrays: dict[str, tuple[str, int]] = {}  # scalar type, length
        #: Inclusive ranges of loop indices, and of parameters with a declared range.
        self.ranges: dict[int, tuple[float, float]] = {}
        self.tables: dict[str, tuple[str, tuple[bool | int | float, ...]]] = {}
        self.table_names: dict[int, str] = {}  # by identity of the values, which the program keeps
        self.held_tables: dict[int, tuple[int | float, ...]] = {}  # uint tables, by identity of their values
        self.builtins: dict[BuiltinName, str] = {}
        self.steps = 0
        self.span = NOWHERE  # span of the statement being lowered, for errors
        self.made: dict[int, s.Op | s.Choose] = {}
        self.bounds = Ranges(self.made, self.ranges)
        #: Pixel indices, inside of the picture: idle vector lanes are beyond its end, so only loop bounds may rely on
        #: it.
        self.places: dict[int, tuple[float, float]] = {}
        self.trip_bounds = Ranges(self.made, ChainMap(self.places, self.ranges))
        #: Factors of the products of the kernel being lowered, by value, if it contracts them with sums.
        self.products: dict[int, tuple[s.Operand, ...]] | None = None

    def begin_kernel(self, contracts: bool) -> None:
        """Begin a kernel or a producer inside it: products are contracted with sums of the same kernel only, so that
        results do not depend on which passes are computed together."""
        self.products = {} if contracts else None

    # Values

    def step(self) -> None:
        """Count work, to bound the compilation of any text."""
        self.steps += 1
        if self.steps > MAX_STEPS:
            message = f"the kernel takes more than {MAX_STEPS} steps to compile; make loops shorter"
            raise KernelLengthError(self.span.point_at(message))

    def fresh(self, type_: str) -> s.Val:
        self.ids += 1
        if self.ids > self.highest:
            self.highest = self.ids
        else:
            self._forget(self.ids)
        return s.Val(type_, self.ids)

    def back_to(self, ids: int) -> None:
        """Reuse the numbers of values after this one: those values were dropped."""
        self.ids = ids

    def _forget(self, number: int) -> None:
        """Forget a value number that an abandoned unrolling returns for reuse."""
        self.made.pop(number, None)
        self.ranges.pop(number, None)
        self.places.pop(number, None)
        if self.products is not None:
            self.products.pop(number, None)
        for bounds in (self.bounds, self.trip_bounds):
            bounds.forget(number)

    def push(self, instruction: s.Instruction) -> None:
        self.step()
        self.blocks[-1].append(instruction)

    def _shared(self, key: tuple[object, ...]) -> object | None:
        if not self.simplify:
            return None
        for scope in reversed(self.known):
            if key in scope:
                return scope[key]
        return None

    def op(self, name: str, *arguments: s.Operand, span: Span = NOWHERE) -> s.Operand:
        """Emit a primitive operation, folded, shared or contracted with a product where possible."""
        if self.products is None or arguments[0].type != "float":
            return self._op(name, arguments, span)
        if name in ("add", "sub"):
            return self._sum(name, arguments, span)
        result = self._op(name, arguments, span)
        if name == "mul" and isinstance(result, s.Val):
            self.products[result.id] = arguments
        return result

    def _sum(self, name: str, terms: tuple[s.Operand, ...], span: Span) -> s.Operand:
        """Emit a sum or difference; if a term is a product, as one multiplication with addition (`fma`)."""
        assert self.products is not None
        for place in (1, 0):
            term, other = terms[place], terms[1 - place]
            factors = self.products.get(term.id) if isinstance(term, s.Val) else None
            if factors is not None:
                one, two = factors
                if name == "sub" and place == 1:
                    one = self._op("neg", (one,), span)
                elif name == "sub":
                    other = self._op("neg", (other,), span)
                return self._op("fma", (one, two, other), span)
        return self._op(name, terms, span)

    def _op(self, name: str, arguments: tuple[s.Operand, ...], span: Span) -> s.Operand:
        on = arguments[0].type
        result = _fixed_result(name) or on
        # Known integers and bools always fold: loop bounds depend on them.
        is_integer = result != "float" and all(isinstance(a, s.Lit) and a.type != "float" for a in arguments)
        if self.simplify or is_integer:
            folded = self._fold(name, result, arguments)
            if folded is not None:
                return folded
        argument_keys = tuple([repr(a) for a in arguments])
        if self.simplify and name in COMMUTATIVE:
            one, other = arguments
            if (isinstance(one, s.Lit), argument_keys[0]) > (isinstance(other, s.Lit), argument_keys[1]):
                arguments, argument_keys = (other, one), argument_keys[::-1]
        key = (name, on, *argument_keys)
        shared = self._shared(key)
        if shared is not None:
            return cast(s.Operand, shared)
        to = self.fresh(result)
        instruction = s.Op(to, name, on, arguments, span)
        self.push(instruction)
        self.made[to.id] = instruction
        self.known[-1][key] = to
        return to

    def _fold(self, name: str, result: str, arguments: tuple[s.Operand, ...]) -> s.Operand | None:
        literals = [a for a in arguments if isinstance(a, s.Lit)]
        if len(literals) == len(arguments):
            return fold(name, result, tuple(literals))
        if name in ("less", "greater") and repr(arguments[0]) == repr(arguments[1]):
            return s.Lit("bool", False)
        if len(arguments) != 2 or not literals:
            return None
        (one,) = literals
        (other,) = (a for a in arguments if isinstance(a, s.Val))
        right = arguments[1] is one
        # Only identities that hold for every float, including signed zeros and NaN.
        if name == "mul" and one.value == 1:
            return other
        if name == "div" and right and one.value == 1:
            return other
        if name == "add" and one.type == "int" and one.value == 0:
            return other
        if name == "sub" and right and one.value == 0 and math.copysign(1, one.value) > 0:
            return other
        if name in ("mul", "bit_and") and one.type == "int" and one.value == 0:
            return one
        if name in ("add", "sub", "mul", "div") and one.value != one.value:
            return one
        if name == "logical_and":
            return other if one.value else one
        if name == "logical_or":
            return one if one.value else other
        return None

    def choose(self, condition: s.Operand, then: s.Operand, orelse: s.Operand) -> s.Operand:
        if isinstance(condition, s.Lit) and (self.simplify or then.type != "float"):
            return then if condition.value else orelse
        if self.simplify:
            if repr(then) == repr(orelse):
                return then
            if then.type == "bool":
                return self._choose_bool(condition, then, orelse)
        key = ("choose", repr(condition), repr(then), repr(orelse))
        shared = self._shared(key)
        if shared is not None:
            return cast(s.Operand, shared)
        to = self.fresh(then.type)
        instruction = s.Choose(to, condition, then, orelse)
        self.push(instruction)
        self.made[to.id] = instruction
        self.known[-1][key] = to
        return to

    def _choose_bool(self, condition: s.Operand, then: s.Operand, orelse: s.Operand) -> s.Operand:
        if_true = self.op("logical_and", condition, then)
        if_false = self.op("logical_and", self.op("logical_not", condition), orelse)
        return self.op("logical_or", if_true, if_false)

    def builtin(self, name: BuiltinName, type_: str) -> s.Operand:
        """Load a builtin at its first use; inside a branch or loop only for that block."""
        self.builtins[name] = type_
        return self._load(("builtin", name), type_, lambda to: s.LoadBuiltin(to, name))

    def uniform(self, slot: s.UniformSlot, index: s.Operand) -> s.Operand:
        block = slot.block
        self._check_inside(index, slot.offset, slot.count, f"parameter {slot.name}")
        return self._load(("uniform", block, repr(index)), block, lambda to: s.LoadUniform(to, block, index))

    def _check_inside(self, index: s.Operand, first: int, count: int, what: str) -> None:
        """Raise KernelError unless an index is known to lie inside: generated code reads and writes memory by it.

        Whatever reads by a computed index clamps it first, so this can fail only by a fault of the compiler.
        """
        low, high = self.bounds.range_of(index)[:2]
        if not first <= low <= high < first + count:
            fail(
                self.span,
                f"{what} has the numbers {first} to {first + count - 1}, and is read or written at {low:g} to "
                f"{high:g}; this is a fault of passgraph: please report it with the text of the kernel",
            )

    def table_name(self, type_: str, values: tuple[bool | int | float, ...]) -> str:
        """Return the name of a table with these values; cached by tuple identity, as comparing takes time."""
        table = self.table_names.get(id(values))
        if table is None:
            contents = type_, repr(values)
            equal_tables = (name for name, (t, v) in self.tables.items() if (t, repr(v)) == contents)
            table = self.table_names[id(values)] = next(equal_tables, f"table{len(self.tables)}")
            self.tables[table] = type_, values
        return table

    def table(self, name: str, type_: str, values: tuple[bool | int | float, ...], index: s.Operand) -> s.Operand:
        self._check_inside(index, 0, len(values), f"the constant {name}")
        self.tables[name] = (type_, values)
        return self._load(("table", name, repr(index)), type_, lambda to: s.LoadTable(to, name, index))

    def _load(self, key: tuple[object, ...], type_: str, make: object) -> s.Operand:
        shared = self._shared(key)
        if shared is not None:
            return cast(s.Operand, shared)
        to = self.fresh(type_)
        self.push(make(to))  # type: ignore[operator]
        self.known[-1][key] = to
        return to

    def texel(
        self,
        image: str,
        x: s.Operand,
        y: s.Operand,
        relative: bool,
        border: str,
        channels: int,
        span: Span,
        filtered: bool = False,
    ) -> list[s.Operand]:
        """Load four channels; those that the image lacks are 0, 0, 1."""
        key = ("texel", image, repr(x), repr(y), relative, border, filtered)
        shared = self._shared(key)
        if shared is None:
            shared = tuple(self.fresh("float") for _ in range(channels))
            self.push(s.LoadTexel(shared, image, x, y, relative, border, filtered, span))
            self.known[-1][key] = shared
        missing = (s.Lit("float", 0.0), s.Lit("float", 0.0), s.Lit("float", 0.0), s.Lit("float", 1.0))
        return [*cast("tuple[s.Val, ...]", shared), *missing[channels:]]

    # Variables and blocks

    def variable(self, type_: str) -> str:
        name = f"m{len(self.variables)}"
        self.variables[name] = type_
        return name

    def read(self, name: str) -> s.Val:
        to = self.fresh(self.variables[name])
        self.push(s.Read(to, name))
        return to

    def array(self, type_: str, length: int) -> str:
        name = f"a{len(self.arrays)}"
        self.arrays[name] = type_, length
        return name

    def read_at(self, array: str, index: s.Operand) -> s.Val:
        type_, length = self.arrays[array]
        self._check_inside(index, 0, length, f"array {array}")
        to = self.fresh(type_)
        self.push(s.ReadAt(to, array, index))
        return to

    def write_at(self, array: str, index: s.Operand, value: s.Operand) -> None:
        self._check_inside(index, 0, self.arrays[array][1], f"array {array}")
        self.push(s.WriteAt(array, index, value))

    def begin(self) -> None:
        self.blocks.append([])
        self.known.append({})

    def end(self) -> list[s.Instruction]:
        self.known.pop()
        return self.blocks.pop()

    @staticmethod
    def selectable(block: list[s.Instruction]) -> bool:
        """Return True if a branch is short and pure, so that it may always be computed."""
        cheap = all(isinstance(i, (s.Op, s.Choose, s.LoadUniform, s.LoadBuiltin)) for i in block)
        return cheap and len(block) <= MAX_SELECTED_INSTRUCTIONS

    def range_of(self, value: s.Operand) -> tuple[int, int] | None:
        """Return bounds of an int that loop indices, limits (min, max, clamp) or selections bound on both sides, or
        None."""
        bounds = self.bounds.range_of(value)
        return (int(bounds.low), int(bounds.high)) if bounds.known else None


@cache
def _fixed_result(name: str) -> str:
    """Return the scalar type of an operation's result; empty if it is that of its arguments."""
    return _RESULT[OPERATIONS[name].result]


def fold(name: str, result: str, arguments: tuple[s.Lit, ...]) -> s.Lit:
    """Evaluate a primitive on literals: the reference's value, rounded once."""
    dtypes = {"float": np.float64, "int": np.int64, "bool": np.bool_}
    with np.errstate(all="ignore"):
        value = OPERATIONS[name].reference(*(np.array([a.value], dtypes[a.type]) for a in arguments))[0]
        if result == "float":
            return s.Lit("float", float(np.float32(value)))
    return s.Lit(result, bool(value) if result == "bool" else int(value))
