"""Dead code: what no result depends on is dropped from a scalar program."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from passgraph.language import scalar as s


@dataclass(eq=False)
class _Block:
    """A branch or loop around instructions: running them takes its condition, and a loop's jumps."""

    around: _Block | None
    condition: s.Operand | None = None
    jumps: list[_Block | None] = field(default_factory=list)  # where a loop's breaks and continues stand


class _Liveness:
    """Which values, variables and blocks the results need; one visit for each."""

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
            if isinstance(instruction, (s.Op, s.Choose)):  # first, since most are
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
    """The variable or array; their names differ."""
    return instruction.variable if isinstance(instruction, (s.Read, s.Write)) else instruction.array


def eliminate_dead(body: Sequence[s.Instruction], roots: Sequence[s.Operand]) -> tuple[s.Instruction, ...]:
    """Drop what no root depends on."""
    return tuple(_sweep(body, _Liveness(body, roots)))


def _sweep(body: Sequence[s.Instruction], live: _Liveness) -> list[s.Instruction]:
    kept: list[s.Instruction] = []
    for instruction in body:
        if isinstance(instruction, (s.Op, s.Choose)):
            if instruction.to.id in live.needed:
                kept.append(instruction)
        elif isinstance(instruction, s.If):
            then, orelse = _sweep(instruction.then, live), _sweep(instruction.orelse, live)
            if then or orelse:
                kept.append(replace(instruction, then=tuple(then), orelse=tuple(orelse)))
        elif isinstance(instruction, s.For):
            inner = _sweep(instruction.body, live)
            if any(isinstance(i, (s.Write, s.WriteAt)) for i in s.walk(inner)):
                kept.append(replace(instruction, body=tuple(inner)))
        elif isinstance(instruction, (s.Write, s.WriteAt)):
            if _variable(instruction) in live.variables:
                kept.append(instruction)
        elif isinstance(instruction, s.LoadTexel):
            to = tuple(v if v is not None and v.id in live.needed else None for v in instruction.to)
            while to and to[-1] is None:
                to = to[:-1]
            if to:
                kept.append(replace(instruction, to=to))
        elif isinstance(instruction, (s.Break, s.Continue)) or any(
            value.id in live.needed for value in s.results_of(instruction)
        ):
            kept.append(instruction)
    return kept
