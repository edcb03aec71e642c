"""Builds a scalar program: numbers values, folds constants, shares common subexpressions, drops what is unused."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import cast

import numpy as np

from passgraph.language import scalar as s
from passgraph.language.operations import OPERATIONS
from passgraph.language.source import NOWHERE, Span

#: Branches at most this long become selections, which vectorise; longer ones stay branches.
MAX_SELECTED_INSTRUCTIONS = 12
_RESULT = {"N": "", "G": "float", "I": "int", "B": "bool", "f": "float", "i": "int", "b": "bool"}
_COMMUTATIVE = {
    "add",
    "mul",
    "equal",
    "not_equal",
    "logical_and",
    "logical_or",
    "bit_and",
    "bit_or",
    "bit_xor",
}


class Emitter:
    """Instructions in the making.  ``simplify=False`` turns folding, sharing and selection off."""

    def __init__(self, simplify: bool = True) -> None:
        self.simplify = simplify
        self.blocks: list[list[s.Instruction]] = [[]]
        self.known: list[dict[tuple[object, ...], object]] = [{}]
        self.ids = 0
        self.variables: dict[str, str] = {}
        self.ranges: dict[int, tuple[int, int]] = {}  # loop indices: inclusive
        self.tables: dict[str, tuple[str, tuple[bool | int | float, ...]]] = {}
        self.builtins: dict[str, str] = {}

    # Values

    def fresh(self, type_: str) -> s.Val:
        self.ids += 1
        return s.Val(type_, self.ids)

    def push(self, instruction: s.Instruction) -> None:
        self.blocks[-1].append(instruction)

    def _shared(self, key: tuple[object, ...]) -> object | None:
        if not self.simplify:
            return None
        for scope in reversed(self.known):
            if key in scope:
                return scope[key]
        return None

    def op(self, name: str, *arguments: s.Operand, span: Span = NOWHERE) -> s.Operand:
        """A primitive operation, folded or shared where possible."""
        on = arguments[0].type
        result = self._result_type(name, on)
        if self.simplify:
            folded = self._fold(name, result, arguments)
            if folded is not None:
                return folded
            if name in _COMMUTATIVE:
                arguments = tuple(sorted(arguments, key=lambda a: (isinstance(a, s.Lit), repr(a))))
        key = (name, on, *map(repr, arguments))
        shared = self._shared(key)
        if shared is not None:
            return cast(s.Operand, shared)
        to = self.fresh(result)
        self.push(s.Op(to, name, on, arguments, span))
        self.known[-1][key] = to
        return to

    @staticmethod
    def _result_type(name: str, on: str) -> str:
        letter = OPERATIONS[name].signature.split("->")[1].strip()
        return _RESULT[letter] or on

    def _fold(self, name: str, result: str, arguments: tuple[s.Operand, ...]) -> s.Operand | None:
        if all(isinstance(a, s.Lit) for a in arguments):
            return fold(name, result, cast("tuple[s.Lit, ...]", arguments))
        one = next((a for a in arguments if isinstance(a, s.Lit)), None)
        other = next((a for a in arguments if isinstance(a, s.Val)), None)
        if len(arguments) != 2 or one is None or other is None:
            return None
        right = arguments[1] is one
        # Only identities that hold for every float, zeros' signs and NaN included.
        if name == "mul" and one.value == 1:
            return other
        if name == "div" and right and one.value == 1:
            return other
        if name == "add" and one.type == "int" and one.value == 0:
            return other
        if name == "sub" and right and one.value == 0 and math.copysign(1, one.value) > 0:
            return other
        if name == "mul" and one.type == "int" and one.value == 0:
            return one
        if name == "logical_and":
            return other if one.value else one
        if name == "logical_or":
            return one if one.value else other
        return None

    def choose(self, condition: s.Operand, then: s.Operand, orelse: s.Operand) -> s.Operand:
        if self.simplify:
            if isinstance(condition, s.Lit):
                return then if condition.value else orelse
            if repr(then) == repr(orelse):
                return then
            if then.type == "bool":
                return self._choose_bool(condition, then, orelse)
        key = ("choose", repr(condition), repr(then), repr(orelse))
        shared = self._shared(key)
        if shared is not None:
            return cast(s.Operand, shared)
        to = self.fresh(then.type)
        self.push(s.Choose(to, condition, then, orelse))
        self.known[-1][key] = to
        return to

    def _choose_bool(self, condition: s.Operand, then: s.Operand, orelse: s.Operand) -> s.Operand:
        kept = self.op("logical_and", condition, then)
        other = self.op("logical_and", self.op("logical_not", condition), orelse)
        return self.op("logical_or", kept, other)

    def builtin(self, name: str, type_: str) -> s.Operand:
        """Loaded once, at the very top of the program, wherever it is first met."""
        self.builtins[name] = type_
        return self._load(("builtin", name), type_, lambda to: s.LoadBuiltin(to, name))

    def uniform(self, block: str, index: s.Operand) -> s.Operand:
        return self._load(("uniform", block, repr(index)), block, lambda to: s.LoadUniform(to, block, index))

    def table(
        self, name: str, type_: str, values: tuple[bool | int | float, ...], index: s.Operand
    ) -> s.Operand:
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
        self, image: str, x: s.Operand, y: s.Operand, relative: bool, border: str, channels: int, span: Span
    ) -> list[s.Operand]:
        """Four channels; those that the image lacks are 0, 0, 1."""
        key = ("texel", image, repr(x), repr(y), relative, border)
        shared = self._shared(key)
        if shared is None:
            shared = tuple(self.fresh("float") for _ in range(channels))
            self.push(s.LoadTexel(shared, image, x, y, relative, border, span))
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

    def begin(self) -> None:
        self.blocks.append([])
        self.known.append({})

    def end(self) -> list[s.Instruction]:
        self.known.pop()
        return self.blocks.pop()

    @staticmethod
    def selectable(block: list[s.Instruction]) -> bool:
        """Whether a branch is short and free of effects, so that computing it always does no harm."""
        cheap = all(isinstance(i, (s.Op, s.Choose, s.LoadUniform, s.LoadBuiltin)) for i in block)
        return cheap and len(block) <= MAX_SELECTED_INSTRUCTIONS

    def range_of(self, value: s.Operand, depth: int = 0) -> tuple[int, int] | None:
        """Bounds of an int made of literals and loop indices by + - * min max, or None."""
        if isinstance(value, s.Lit):
            return int(value.value), int(value.value)
        if value.id in self.ranges:
            return self.ranges[value.id]
        if depth > 16:
            return None
        for block in reversed(self.blocks):
            for instruction in reversed(block):
                if isinstance(instruction, s.Op) and instruction.to == value:
                    return self._op_range(instruction, depth + 1)
        return None

    def _op_range(self, op: s.Op, depth: int) -> tuple[int, int] | None:
        parts = [self.range_of(a, depth) for a in op.arguments]
        if any(p is None for p in parts) or op.operation not in ("add", "sub", "mul", "neg", "min", "max"):
            return None
        a = cast("tuple[int, int]", parts[0])
        b = cast("tuple[int, int]", parts[-1])
        if op.operation == "add":
            return a[0] + b[0], a[1] + b[1]
        if op.operation == "sub":
            return a[0] - b[1], a[1] - b[0]
        if op.operation == "neg":
            return -a[1], -a[0]
        if op.operation == "mul":
            products = [p * q for p in a for q in b]
            return min(products), max(products)
        pick = min if op.operation == "min" else max
        return pick(a[0], b[0]), pick(a[1], b[1])


def fold(name: str, result: str, arguments: tuple[s.Lit, ...]) -> s.Lit:
    """A primitive on literals: the reference's value, rounded once."""
    dtypes = {"float": np.float64, "int": np.int64, "bool": np.bool_}
    with np.errstate(all="ignore"):
        value = OPERATIONS[name].reference(*(np.array([a.value], dtypes[a.type]) for a in arguments))[0]
        if result == "float":
            return s.Lit("float", float(np.float32(value)))
    return s.Lit(result, bool(value) if result == "bool" else int(value))


def eliminate_dead(body: list[s.Instruction], roots: list[s.Operand]) -> tuple[s.Instruction, ...]:
    """Drop what no result depends on."""
    needed: set[int] = {r.id for r in roots if isinstance(r, s.Val)}
    live_variables: set[str] = set()
    while True:
        before = len(needed), len(live_variables)
        _mark(body, needed, live_variables)
        if (len(needed), len(live_variables)) == before:
            return tuple(_sweep(body, needed, live_variables))


def _mark(
    body: list[s.Instruction] | tuple[s.Instruction, ...], needed: set[int], variables: set[str]
) -> bool:
    """Mark backwards; true when something in the block has an effect."""
    effect = False
    for instruction in reversed(body):
        if isinstance(instruction, s.If):
            here = _mark(instruction.then, needed, variables) | _mark(instruction.orelse, needed, variables)
        elif isinstance(instruction, s.For):
            here = _mark(instruction.body, needed, variables)
        elif isinstance(instruction, s.Write):
            here = instruction.variable in variables
        elif isinstance(instruction, (s.Break, s.Continue)):
            here = True
        else:
            here = any(v.id in needed for v in s.results_of(instruction))
            if here and isinstance(instruction, s.Read):
                variables.add(instruction.variable)
        if here:
            effect = True
            needed.update(a.id for a in s.operands_of(instruction) if isinstance(a, s.Val))
    return effect


def _sweep(
    body: list[s.Instruction] | tuple[s.Instruction, ...], needed: set[int], variables: set[str]
) -> list[s.Instruction]:
    kept: list[s.Instruction] = []
    for instruction in body:
        if isinstance(instruction, s.If):
            then, orelse = (
                _sweep(instruction.then, needed, variables),
                _sweep(instruction.orelse, needed, variables),
            )
            if then or orelse:
                kept.append(replace(instruction, then=tuple(then), orelse=tuple(orelse)))
        elif isinstance(instruction, s.For):
            inner = _sweep(instruction.body, needed, variables)
            if any(isinstance(i, s.Write) for i in s.walk(inner)):
                kept.append(replace(instruction, body=tuple(inner)))
        elif isinstance(instruction, s.Write):
            if instruction.variable in variables:
                kept.append(instruction)
        elif isinstance(instruction, s.LoadTexel):
            to = tuple(v if v is not None and v.id in needed else None for v in instruction.to)
            while to and to[-1] is None:
                to = to[:-1]
            if to:
                kept.append(replace(instruction, to=to))
        elif isinstance(instruction, (s.Break, s.Continue)) or any(
            v.id in needed for v in s.results_of(instruction)
        ):
            kept.append(instruction)
    return kept
