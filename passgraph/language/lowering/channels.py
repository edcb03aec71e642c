"""Detect kernels that treat all channels alike, such as blurs, by comparing the channels' computations.

Such a pass runs over the interleaved numbers instead of pixel by pixel: loads and stores are contiguous, so LLVM needs
no shuffles, and there is a quarter of the code to compile.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeAlias

from passgraph.formats import Format
from passgraph.language import scalar as s
from passgraph.language.builtin_name import PIXEL
from passgraph.language.emitter import COMMUTATIVE, eliminate_dead

#: Programs with these instructions are computed pixel by pixel.
_STRUCTURED = (s.If, s.For, s.Read, s.Write, s.ReadAt, s.WriteAt, s.Break, s.Continue)
Numbering: TypeAlias = dict[tuple[object, ...], int]


def before_rounding(program: s.ScalarProgram) -> s.ScalarProgram:
    """Return the program without rounding to the targets' formats: machine code rounds as it stores."""
    outputs = tuple(replace(output, values=output.unrounded) for output in program.outputs)
    body = eliminate_dead(program.body, [value for output in outputs for value in output.values])
    return replace(program, body=body, outputs=outputs)


def single_channel(program: s.ScalarProgram, channels: tuple[int, ...]) -> s.ScalarProgram | None:
    """Return the program of one channel that is valid for all; None if the channels differ."""
    if len(program.outputs) != 1 or channels[0] < 2 or any(use.channels != channels[0] for use in program.images):
        return None
    if not program.images or any(use.absolute for use in program.images):
        return None
    if any(isinstance(instruction, _STRUCTURED) for instruction in program.body):
        return None
    builtins = (instruction.name for instruction in program.body if isinstance(instruction, s.LoadBuiltin))
    if PIXEL[0] in builtins:  # it depends on the channel's loop index
        return None
    numbering: Numbering = {}
    output = program.outputs[0]
    shape = _shape(program, 0, output.values[0], numbering)
    other_channels = ((channel, value) for channel, value in enumerate(output.values) if channel)
    if shape is None or any(_shape(program, channel, value, numbering) != shape for channel, value in other_channels):
        return None
    first = replace(output, values=output.values[:1], unrounded=output.unrounded[:1])
    return replace(program, body=eliminate_dead(program.body, first.values), outputs=(first,))


def selection(program: s.ScalarProgram, images: Sequence[Format], outputs: Sequence[Format]) -> s.ScalarProgram | None:
    """Return the program on stored numbers if it only selects among its inputs; None otherwise.

    Storing is monotonic, and storing a stored number again changes nothing.  So minima and maxima of stored numbers are
    the stored minima and maxima, and a register holds four bytes in the place of each float32.
    """
    if len(outputs) != 1 or not outputs[0].steps:
        return None
    (output,), (stored,) = program.outputs, outputs
    if any((image_format.number, image_format.steps) != (stored.number, stored.steps) for image_format in images):
        return None
    for i in program.body:
        chooses = isinstance(i, s.Op) and i.on == "float" and i.operation in ("min", "max")
        reads = isinstance(i, s.LoadTexel) and i.relative
        if not (chooses or reads) or (chooses and any(isinstance(part, s.Lit) for part in s.operands_of(i))):
            return None
    return program if all(isinstance(value, s.Val) for value in output.values) else None


def _shape(program: s.ScalarProgram, channel: int, result: s.Operand, numbering: Numbering) -> int | None:
    """Return a number that is equal for two channels exactly if their computations match; None for a foreign channel.

    Visits each instruction once, in order: programs may be thousands of instructions deep.
    """
    counts: dict[int, int | None] = {}

    def number_of(value: s.Operand) -> int | None:
        return _numbered(("literal", repr(value)), numbering) if isinstance(value, s.Lit) else counts[value.id]

    for i in program.body:
        if isinstance(i, s.LoadTexel):
            own = _numbered(("texel", i.image, repr(i.x), repr(i.y), i.border), numbering)
            counts |= {v.id: own if number == channel else None for number, v in enumerate(i.to) if v is not None}
            continue
        parts = [number_of(operand) for operand in s.operands_of(i)]
        key = None if None in parts else (type(i).__name__, *_detail(i), *_ordered(i, parts))
        for value in s.results_of(i):
            counts[value.id] = None if key is None else _numbered(key, numbering)
    return number_of(result)


def _numbered(key: tuple[object, ...], numbering: Numbering) -> int:
    return numbering.setdefault(key, len(numbering))


def _ordered(i: s.Instruction, parts: list[int | None]) -> list[int | None]:
    return sorted(parts, key=lambda part: part or 0) if isinstance(i, s.Op) and i.operation in COMMUTATIVE else parts


def _detail(i: s.Instruction) -> tuple[object, ...]:
    """Return what distinguishes instructions of one kind besides their operands."""
    if isinstance(i, s.Op):
        return i.operation, i.on
    if isinstance(i, s.LoadUniform):
        return (i.block,)
    if isinstance(i, s.LoadTable):
        return (i.table,)
    return (i.name,) if isinstance(i, s.LoadBuiltin) else ()
