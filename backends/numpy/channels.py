"""Kernels that treat every channel alike, such as blurs: found by comparing the channels' computations.

Such a pass runs over the interleaved numbers one by one instead of pixel by pixel: loads and stores are contiguous,
so LLVM needs no shuffles, and there is a quarter of the code to compile.
"""

from __future__ import annotations

from dataclasses import replace

from passgraph.language import scalar as s
from passgraph.language.emitter import COMMUTATIVE, eliminate_dead

#: Builtins that do not tell one channel's loop index from another's.
_SHARED_BUILTINS = ("output_size.", "size.", "pixel.1")


def single_channel(program: s.ScalarProgram, channels: tuple[int, ...]) -> s.ScalarProgram | None:
    """The program of one channel that stands for all, or None where the channels differ."""
    if len(program.outputs) != 1 or channels[0] < 2 or any(use.channels != channels[0] for use in program.images):
        return None
    if not program.images or any(use.absolute for use in program.images):
        return None
    defined: dict[int, tuple[s.Instruction, int]] = {}
    for instruction in program.body:
        if isinstance(instruction, (s.If, s.For, s.Read, s.Write, s.Break, s.Continue)):
            return None
        if isinstance(instruction, s.LoadBuiltin) and not instruction.name.startswith(_SHARED_BUILTINS):
            return None
        if isinstance(instruction, s.LoadTexel):
            for channel, value in enumerate(instruction.to):
                if value is not None:
                    defined[value.id] = (instruction, channel)
        else:
            for value in s.results_of(instruction):
                defined[value.id] = (instruction, 0)
    numbering: dict[tuple[object, ...], int] = {}
    shapes = {_shape(value, channel, defined, numbering, {}) for channel, value in enumerate(program.outputs[0].values)}
    if len(shapes) != 1 or None in shapes:
        return None
    first = program.outputs[0].values[0]
    body = eliminate_dead(list(program.body), [first])
    return replace(program, body=body, outputs=(replace(program.outputs[0], values=(first,)),))


def _shape(
    value: s.Operand,
    channel: int,
    defined: dict[int, tuple[s.Instruction, int]],
    numbering: dict[tuple[object, ...], int],
    memo: dict[int, int | None],
) -> int | None:
    """A number that equals another channel's exactly when the computations match; None for a foreign channel."""
    if isinstance(value, s.Lit):
        return numbering.setdefault(("literal", repr(value)), len(numbering))
    if value.id in memo:
        return memo[value.id]
    instruction, read = defined[value.id]
    key: tuple[object, ...]
    if isinstance(instruction, s.LoadTexel):
        if read != channel:
            memo[value.id] = None
            return None
        key = ("texel", instruction.image, repr(instruction.x), repr(instruction.y), instruction.border)
    else:
        parts = [_shape(a, channel, defined, numbering, memo) for a in s.operands_of(instruction)]
        if None in parts:
            memo[value.id] = None
            return None
        name = type(instruction).__name__
        detail: tuple[object, ...] = ()
        if isinstance(instruction, s.Op):
            detail = (instruction.operation, instruction.on)
            if instruction.operation in COMMUTATIVE:
                parts = sorted(parts, key=lambda part: part or 0)
        elif isinstance(instruction, (s.LoadUniform, s.LoadTable, s.LoadBuiltin)):
            detail = (
                getattr(instruction, "block", None)
                or getattr(instruction, "table", None)
                or getattr(instruction, "name", None),
            )
        key = (name, *detail, *parts)
    memo[value.id] = numbering.setdefault(key, len(numbering))
    return memo[value.id]
