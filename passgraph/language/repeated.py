"""What a long program computes again and again: calls of one function of the prelude, which need one copy in machine
code.

Calls are told by what they compute, not by name: those of a function differ where an argument is known, or where a
part was computed before.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from passgraph.language import scalar as s
from passgraph.language.emitter import COMMUTATIVE

#: Shorter programs compile in no time, and run up to a tenth faster without calls.
MIN_PROGRAM = 4_000
#: Instructions that a function has at least, and how often it is called: below, LLVM saves nothing.
MIN_LENGTH, MIN_CALLS = 12, 3


@dataclass(frozen=True, slots=True)
class Call:
    """Consecutive instructions as a call: ``key`` is what they compute, of ``given`` what others use ``wanted``."""

    key: tuple[object, ...]
    instructions: tuple[s.Op | s.Choose, ...]
    given: tuple[s.Val, ...]
    wanted: tuple[s.Val, ...]


def repeated(program: s.ScalarProgram) -> dict[int, Call]:
    """The calls that are worth a function, by the number of the first value of each."""
    if not program.calls or s.count(program.body) < MIN_PROGRAM:
        return {}
    parts = list(_parts(program.body, _owners(program)))
    inside = {i.to.id: number for number, part in enumerate(parts) for i in part}
    wanted: dict[int, s.Val] = {}
    for user, operand in _uses(program, inside):
        if isinstance(operand, s.Val) and operand.id in inside and inside[operand.id] != user:
            wanted[operand.id] = operand
    calls = defaultdict(list)
    for part in parts:
        call = _call(part, wanted)
        calls[call.key].append(call)
    return {c.instructions[0].to.id: c for alike in calls.values() if len(alike) >= MIN_CALLS for c in alike}


def _owners(program: s.ScalarProgram) -> dict[int, int]:
    """Of each value that a call makes the call's number."""
    return {value: n for n, (first, last) in enumerate(program.calls) for value in range(first, last + 1)}


def _parts(body: Sequence[s.Instruction], owners: dict[int, int]) -> Iterator[tuple[s.Op | s.Choose, ...]]:
    """What is left of each call where it stands, in one row."""
    part: list[s.Op | s.Choose] = []
    for i in (*body, None):
        owner = owners.get(i.to.id) if isinstance(i, (s.Op, s.Choose)) else None
        if part and owners[part[0].to.id] != owner:
            if len(part) >= MIN_LENGTH:
                yield tuple(part)
            part = []
        if owner is not None:
            assert isinstance(i, (s.Op, s.Choose))
            part.append(i)
        elif isinstance(i, s.If):
            yield from _parts(i.then, owners)
            yield from _parts(i.orelse, owners)
        elif isinstance(i, s.For):
            yield from _parts(i.body, owners)


def _uses(program: s.ScalarProgram, inside: dict[int, int]) -> Iterator[tuple[int | None, s.Operand]]:
    """Each operand, and which part uses it."""
    for i in s.walk(program.body):
        user = inside.get(i.to.id) if isinstance(i, (s.Op, s.Choose)) else None
        for operand in s.operands_of(i):
            yield user, operand
    for output in program.outputs:
        for operand in (*output.values, *output.unrounded):
            yield None, operand
    if program.keep is not None:
        yield None, program.keep


def _call(part: tuple[s.Op | s.Choose, ...], wanted: dict[int, s.Val]) -> Call:
    """A part with its values numbered by where they stand in it, and what is given by where it is first used."""
    made: dict[int, int] = {}
    given: dict[int, s.Val] = {}
    key: list[object] = []

    def named(operand: s.Operand) -> object:
        if isinstance(operand, s.Lit):
            return repr(operand)
        if operand.id in made:
            return made[operand.id]
        given.setdefault(operand.id, operand)
        return -1 - list(given).index(operand.id), operand.type

    for number, i in enumerate(part):
        told = [named(operand) for operand in s.operands_of(i)]
        if isinstance(i, s.Op) and i.operation in COMMUTATIVE:
            told.sort(key=repr)
        key.append((i.operation, i.on, *told) if isinstance(i, s.Op) else ("choose", *told))
        made[i.to.id] = number
    results = tuple([wanted[i.to.id] for i in part if i.to.id in wanted])
    return Call((*key, *[made[value.id] for value in results]), part, tuple(given.values()), results)
