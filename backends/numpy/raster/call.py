"""What numba's code calls that numba does not have."""

# mypy: disable-error-code="untyped-decorator"
from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

_I64 = ir.IntType(64)


@intrinsic
def pg_take(typing_context: Any, counter: Any) -> Any:
    """The next number of a counter that threads share: an array of one int64, which it raises by 1."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = context.make_array(signature.args[0])(context, builder, arguments[0])
        return builder.atomic_rmw("add", array.data, ir.Constant(_I64, 1), "monotonic")

    return types.int64(counter), generate


@intrinsic
def pg_soon(typing_context: Any, array: Any, row: Any) -> Any:
    """Fetch the entry of an array that is read soon, or the row of one, into the cache."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kind = signature.args[0]
        made = context.make_array(kind)(context, builder, arguments[0])
        step = builder.extract_value(made.strides, 0)
        start = builder.ptrtoint(made.data, _I64)
        place = builder.inttoptr(builder.add(start, builder.mul(arguments[1], step)), ir.PointerType())
        name, number = "llvm.prefetch.p0", ir.IntType(32)
        declared = ir.FunctionType(ir.VoidType(), [ir.PointerType(), number, number, number])
        fetch = builder.module.globals.get(name) or ir.Function(builder.module, declared, name)
        builder.call(fetch, [place, ir.Constant(number, 0), ir.Constant(number, 3), ir.Constant(number, 1)])
        return context.get_dummy_value()

    return types.void(array, types.int64), generate


def _call(target: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """Call the function at the address that comes first with what follows, arrays by their addresses."""
    given = []
    for kind, value in zip(signature.args[1:], arguments[1:], strict=True):
        array = isinstance(kind, types.Array)
        given.append(target.make_array(kind)(target, builder, value).data if array else value)
    function = ir.FunctionType(ir.VoidType(), [value.type for value in given])
    builder.call(builder.inttoptr(arguments[0], function.as_pointer()), given)
    return target.get_dummy_value()


@intrinsic
def pg_shade(
    typing_context: Any, address: Any, context: Any, ids: Any, planes: Any, left: Any, top: Any, rows: Any
) -> Any:
    """Write one tile's pixels (shade.py)."""
    return types.void(types.int64, context, ids, planes, types.int64, types.int64, types.int64), _call


@intrinsic
def pg_merge(
    typing_context: Any, address: Any, context: Any, spans: Any, triangle: Any, left: Any, top: Any, bottom: Any,
    clear: Any,
) -> Any:  # fmt: skip
    """Write one triangle's pixels in a tile (merge.py)."""
    return types.void(types.int64, context, spans, triangle, *[types.int64] * 4), _call
