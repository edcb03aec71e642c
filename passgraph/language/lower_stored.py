"""What targets hold of results: functions of the prelude round them, where there may be something to round."""

from __future__ import annotations

from typing import TYPE_CHECKING

from passgraph.formats import Store
from passgraph.language import scalar as s

if TYPE_CHECKING:
    from passgraph.language.emitter import Emitter
    from passgraph.language.lower import Lowering

#: Every whole number up to this one is a half: 11 bits.
_WHOLE_HALVES = 2048


def stored(lowering: Lowering, value: s.Operand, functions: tuple[Store, ...]) -> tuple[s.Operand, s.Operand]:
    """A channel as it is stored, and before the last function, which rounds."""
    unrounded = value
    for function, *numbers in functions:
        unrounded = value
        if function != "quantize_half" or not is_whole_half(lowering.emitter, value):
            value = lowering.prelude(str(function), [value, *(s.Lit("float", float(number)) for number in numbers)])
    return value, unrounded


def is_whole_half(emitter: Emitter, value: s.Operand) -> bool:
    """Whether a float is surely a whole number that 16 bits hold, so that rounding would take its time for nothing."""
    if not emitter.simplify:
        return False
    if isinstance(value, s.Lit):
        return abs(value.value) <= _WHOLE_HALVES and float(value.value).is_integer()
    made = emitter.made.get(value.id)
    if isinstance(made, s.Choose):
        return is_whole_half(emitter, made.then) and is_whole_half(emitter, made.orelse)
    if made is None or made.operation != "to_float":
        return False
    bounds = emitter.range_of(made.arguments[0]) if made.on == "int" else None
    return made.on == "bool" or (bounds is not None and max(map(abs, bounds)) <= _WHOLE_HALVES)
