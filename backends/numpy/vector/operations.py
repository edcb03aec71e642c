"""Primitive operations in LLVM: one row here for each primitive row of the operations table."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from passgraph.backends.numpy.machine import ir
from passgraph.language import scalar as s

F32, F64, I32, I64, BOOL = ir.FloatType(), ir.DoubleType(), ir.IntType(32), ir.IntType(64), ir.IntType(1)
I8 = ir.IntType(8)
TYPES = {"float": F32, "int": I32, "bool": BOOL}
#: Entries of arrays: bits would lie packed.
HELD = TYPES | {"bool": I32}


def constant(value: s.Lit) -> Any:
    if value.type == "float":
        number = float(np.float32(value.value))
        # LLVM's text has no sign for NaN and wants the bits of infinities: go through them.
        if math.isnan(number) or math.isinf(number):
            bits = int(np.float32(number).view(np.int32))
            return ir.Constant(I32, bits).bitcast(F32)
        return ir.Constant(F32, number)
    return ir.Constant(TYPES[value.type], int(value.value))


def call(name: str, result: Any) -> Callable[..., Any]:
    """An LLVM intrinsic on one float32; vector units have an instruction for each that is used here."""

    def emit(b: Any, x: Any) -> Any:
        kind = ir.FunctionType(result, [F32])
        function = b.module.globals.get(name) or ir.Function(b.module, kind, name)
        return b.call(function, [x])

    return emit


fabs = call("llvm.fabs.f32", F32)


def _floor_divide(b: Any, x: Any, y: Any) -> Any:
    quotient, rest, zero = _divide(b, x, y)
    down = b.and_(b.icmp_signed("!=", rest, _int(0)), b.icmp_signed("<", b.xor(rest, y), _int(0)))
    return b.select(zero, _int(0), b.select(down, b.sub(quotient, _int(1)), quotient))


def _int_mod(b: Any, x: Any, y: Any) -> Any:
    _, rest, zero = _divide(b, x, y)
    up = b.and_(b.icmp_signed("!=", rest, _int(0)), b.icmp_signed("<", b.xor(rest, y), _int(0)))
    return b.select(zero, _int(0), b.select(up, b.add(rest, y), rest))


def _divide(b: Any, x: Any, y: Any) -> tuple[Any, Any, Any]:
    """Quotient toward zero, rest, and whether the divisor is 0; the two cases that trap go around the division."""
    zero, minus = b.icmp_signed("==", y, _int(0)), b.icmp_signed("==", y, _int(-1))
    safe = b.select(b.or_(zero, minus), _int(1), y)
    quotient = b.select(minus, b.sub(_int(0), x), b.sdiv(x, safe))
    return quotient, b.sub(x, b.mul(quotient, y)), zero


def _int(value: int) -> Any:
    return ir.Constant(I32, value)


def _shift(b: Any, y: Any) -> Any:
    return b.and_(y, _int(31))


def _saturated(b: Any, x: Any) -> Any:
    """Toward zero, at most as far as an int reaches, NaN to 0.

    LLVM's own intrinsic comes out number by number on x86; this stays in vectors.
    """
    low, high = ir.Constant(F32, -(2.0**31)), ir.Constant(F32, 2.0**31)
    below = ir.Constant(F32, 2.0**31 - 128.0)  # the last float32 before 2**31
    ranged = b.select(b.fcmp_ordered(">", x, low), x, low)
    made = b.fptosi(b.select(b.fcmp_ordered("<", ranged, below), ranged, below), I32)
    made = b.select(b.fcmp_ordered(">=", x, high), _int(2**31 - 1), made)
    return b.select(b.fcmp_unordered("uno", x, x), _int(0), made)


_FLOAT: dict[str, Callable[..., Any]] = {
    "add": lambda b, x, y: b.fadd(x, y), "sub": lambda b, x, y: b.fsub(x, y), "mul": lambda b, x, y: b.fmul(x, y),
    "div": lambda b, x, y: b.fdiv(x, y), "neg": lambda b, x: b.fneg(x), "abs": fabs,
    "min": lambda b, x, y: b.select(b.fcmp_ordered("<", y, x), y, x),
    "max": lambda b, x, y: b.select(b.fcmp_ordered("<", x, y), y, x),
    "floor": call("llvm.floor.f32", F32), "ceil": call("llvm.ceil.f32", F32), "trunc": call("llvm.trunc.f32", F32),
    "round": call("llvm.roundeven.f32", F32), "sqrt": call("llvm.sqrt.f32", F32),
    "less": lambda b, x, y: b.fcmp_ordered("<", x, y), "less_equal": lambda b, x, y: b.fcmp_ordered("<=", x, y),
    "greater": lambda b, x, y: b.fcmp_ordered(">", x, y), "greater_equal": lambda b, x, y: b.fcmp_ordered(">=", x, y),
    "equal": lambda b, x, y: b.fcmp_ordered("==", x, y), "not_equal": lambda b, x, y: b.fcmp_unordered("!=", x, y),
    "isnan": lambda b, x: b.fcmp_unordered("uno", x, x),
    "isinf": lambda b, x: b.fcmp_ordered("==", fabs(b, x), constant(s.Lit("float", math.inf))),
    "bits_from_float": lambda b, x: b.bitcast(x, I32),
    "to_int": _saturated,
}  # fmt: skip
_INT: dict[str, Callable[..., Any]] = {
    "add": lambda b, x, y: b.add(x, y), "sub": lambda b, x, y: b.sub(x, y), "mul": lambda b, x, y: b.mul(x, y),
    "neg": lambda b, x: b.sub(_int(0), x),
    "abs": lambda b, x: b.select(b.icmp_signed("<", x, _int(0)), b.sub(_int(0), x), x),
    "floor_divide": _floor_divide, "int_mod": _int_mod,
    "min": lambda b, x, y: b.select(b.icmp_signed("<", y, x), y, x),
    "max": lambda b, x, y: b.select(b.icmp_signed("<", x, y), y, x),
    "less": lambda b, x, y: b.icmp_signed("<", x, y), "less_equal": lambda b, x, y: b.icmp_signed("<=", x, y),
    "greater": lambda b, x, y: b.icmp_signed(">", x, y), "greater_equal": lambda b, x, y: b.icmp_signed(">=", x, y),
    "equal": lambda b, x, y: b.icmp_signed("==", x, y), "not_equal": lambda b, x, y: b.icmp_signed("!=", x, y),
    "bit_and": lambda b, x, y: b.and_(x, y), "bit_or": lambda b, x, y: b.or_(x, y),
    "bit_xor": lambda b, x, y: b.xor(x, y),
    "bit_not": lambda b, x: b.not_(x),
    "shift_left": lambda b, x, y: b.shl(x, _shift(b, y)), "shift_right": lambda b, x, y: b.ashr(x, _shift(b, y)),
    "float_from_bits": lambda b, x: b.bitcast(x, F32), "to_float": lambda b, x: b.sitofp(x, F32),
}  # fmt: skip
_BOOL: dict[str, Callable[..., Any]] = {
    "logical_and": lambda b, x, y: b.and_(x, y), "logical_or": lambda b, x, y: b.or_(x, y),
    "logical_not": lambda b, x: b.not_(x),
    "to_float": lambda b, x: b.uitofp(x, F32), "to_int": lambda b, x: b.zext(x, I32),
}  # fmt: skip
_ROWS = {"float": _FLOAT, "int": _INT, "bool": _BOOL}


def emit_operation(builder: Any, name: str, on: str, arguments: list[Any]) -> Any:
    """The value of a primitive operation."""
    return _ROWS[on][name](builder, *arguments)
