"""What generated code calls: single machine instructions and int rules that numba lacks."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import float32, int32, njit, types
from numba.extending import intrinsic

_FLOAT, _INT = ir.FloatType(), ir.IntType(32)


def _cast(source: Any, result: Any, llvm_type: Any) -> Any:
    @intrinsic
    def cast(typing_context: Any, value: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.bitcast(arguments[0], llvm_type)

        return result(source), generate

    return cast


def _unary(name: str, result: Any, llvm_result: Any) -> Any:
    """An LLVM intrinsic from float32; vector units have an instruction for each of these."""

    @intrinsic
    def call(typing_context: Any, value: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            kind = ir.FunctionType(llvm_result, [_FLOAT])
            function = builder.module.globals.get(name) or ir.Function(builder.module, kind, name)
            return builder.call(function, arguments)

        return result(types.float32), generate

    return call


pg_bits = _cast(types.float32, types.int32, _INT)
pg_float = _cast(types.int32, types.float32, _FLOAT)
pg_floor = _unary("llvm.floor.f32", types.float32, _FLOAT)
pg_ceil = _unary("llvm.ceil.f32", types.float32, _FLOAT)
pg_trunc = _unary("llvm.trunc.f32", types.float32, _FLOAT)
pg_rint = _unary("llvm.rint.f32", types.float32, _FLOAT)
pg_sqrt = _unary("llvm.sqrt.f32", types.float32, _FLOAT)
pg_fabs = _unary("llvm.fabs.f32", types.float32, _FLOAT)
#: Saturates, and turns NaN into 0, as the language asks.
pg_to_int = _unary("llvm.fptosi.sat.i32.f32", types.int32, _INT)


@njit(inline="always")  # type: ignore[untyped-decorator]
def pg_floor_divide(a: Any, b: Any) -> Any:
    return int32(0) if b == 0 else int32(a // b)


@njit(inline="always")  # type: ignore[untyped-decorator]
def pg_int_mod(a: Any, b: Any) -> Any:
    return int32(0) if b == 0 else int32(a % b)


@njit  # type: ignore[untyped-decorator]
def pg_quantize_unorm(x: Any, steps: Any) -> Any:
    """Nearest of the stored values, halves to even; NaN gives 0."""
    return pg_rint(min(max(float32(0.0), x), float32(1.0)) * steps) / steps


@njit  # type: ignore[untyped-decorator]
def pg_quantize_half(x: Any) -> Any:
    """Nearest binary16, halves to even: the prelude's quantize_half."""
    bits = pg_bits(x)
    size = bits & int32(0x7FFFFFFF)
    if size > int32(0x7F800000):
        return x
    if size >= int32(0x477FF000):
        rounded = int32(0x7F800000)
    elif size < int32(0x38800000):
        rounded = pg_bits(pg_rint(pg_float(size) * float32(16777216.0)) * float32(2.0**-24))
    else:
        rounded = int32(size + int32(0xFFF) + int32((size >> int32(13)) & int32(1))) & int32(-8192)
    return pg_float(int32(rounded | (bits & int32(-2147483648))))
