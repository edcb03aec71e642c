"""Calls from numba's code into machine code of our own."""

# mypy: disable-error-code="untyped-decorator"
from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic


@intrinsic
def pg_shade(
    typing_context: Any, address: Any, context: Any, ids: Any, planes: Any, left: Any, top: Any, rows: Any
) -> Any:
    """Call the function at ``address`` (see raster_shade.py): it writes one tile's pixels."""

    def generate(target: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        given = []
        for kind, value in zip(signature.args[1:], arguments[1:], strict=True):
            array = isinstance(kind, types.Array)
            given.append(target.make_array(kind)(target, builder, value).data if array else value)
        function = ir.FunctionType(ir.VoidType(), [value.type for value in given])
        builder.call(builder.inttoptr(arguments[0], function.as_pointer()), given)
        return target.get_dummy_value()

    return types.void(types.int64, context, ids, planes, types.int64, types.int64, types.int64), generate
