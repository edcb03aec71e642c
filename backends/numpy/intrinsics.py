"""What generated code calls behind the fragment kernel: blended results into a target's format."""

# mypy: disable-error-code="untyped-decorator"
from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import float32, int32, njit, types
from numba.extending import intrinsic

from passgraph.backends.numpy.llvm_ops import F32, I32, I64, call


def _unary(source: Any, result: Any, emit: Any) -> Any:
    @intrinsic
    def instruction(typing_context: Any, value: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return emit(builder, arguments[0])

        return result(source), generate

    return instruction


pg_bits = _unary(types.float32, types.int32, lambda b, x: b.bitcast(x, I32))
pg_float = _unary(types.int32, types.float32, lambda b, x: b.bitcast(x, F32))
pg_rint = _unary(types.float32, types.float32, call("llvm.roundeven.f32", F32))


@intrinsic
def pg_take(typing_context: Any, counter: Any) -> Any:
    """The next number of a counter that threads share: an array of one int64, which it raises by 1."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = context.make_array(signature.args[0])(context, builder, arguments[0])
        return builder.atomic_rmw("add", array.data, ir.Constant(I64, 1), "monotonic")

    return types.int64(counter), generate


@njit
def pg_quantize(x: Any, low: Any, steps: Any) -> Any:
    """Nearest of the stored values, halves to even; NaN gives the least."""
    return pg_rint(min(max(low, x), float32(1.0)) * steps) / steps


@njit
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
