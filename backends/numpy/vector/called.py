"""Calls in machine code: one function for all that compute the same of vectors."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import Any

from passgraph.backends.numpy.machine import ir
from passgraph.backends.numpy.machine.builder import IRBuilder
from passgraph.backends.numpy.vector.constants import blank
from passgraph.backends.numpy.vector.lanes import Lanes
from passgraph.backends.numpy.vector.operations import TYPES, constant, emit_operation
from passgraph.language import scalar as s
from passgraph.language.repeated import Call


def called(b: Lanes, call: Call, given: Sequence[Any]) -> list[Any]:
    """What a call of these vectors gives: the values that it is wanted for."""
    name = f"call_{hashlib.sha256(repr(call.key).encode()).hexdigest()[:16]}"
    function = b.module.globals.get(name) or _function(b, name, call)
    found = b.plain.call(function, [b.spread(value) for value in given])
    if len(call.wanted) == 1:
        return [found]
    return [b.extract_value(found, place) for place in range(len(call.wanted))]


def _function(b: Lanes, name: str, call: Call) -> Any:
    kinds = [b.vector(TYPES[value.type]) for value in call.wanted]
    made = kinds[0] if len(kinds) == 1 else ir.LiteralStructType(kinds)
    function = ir.Function(b.module, ir.FunctionType(made, [b.vector(TYPES[v.type]) for v in call.given]), name)
    function.linkage = "internal"
    function.attributes.add("noinline")
    inner = Lanes(IRBuilder(function), b.lanes)
    values = dict(zip((value.id for value in call.given), function.args, strict=True))
    for i in call.instructions:
        parts = [constant(x) if isinstance(x, s.Lit) else values[x.id] for x in s.operands_of(i)]
        values[i.to.id] = (
            emit_operation(inner, i.operation, i.on, parts) if isinstance(i, s.Op) else inner.select(*parts)
        )
    results = [inner.spread(values[value.id]) for value in call.wanted]
    packed = results[0]
    if len(results) > 1:
        packed = blank(made)
        for place, value in enumerate(results):
            packed = inner.insert_value(packed, value, place)
    inner.ret(packed)
    return function
