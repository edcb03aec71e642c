# mypy: disable-error-code="untyped-decorator"
"""The rasteriser's fixed functions as the host calls them, and the numbers that both know.

They are written in setup.py, tiles.py and order.py, which are loaded only where their text (``fixed/``) is made anew;
generate.py does that.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from passgraph.backends.numpy.machine.shipped import NumbaCode, Shipped
from passgraph.language.ir import of_triangle, own_pixel


def is_of_triangle(name: str) -> bool:
    """Whether a builtin of a fragment hangs on its triangle."""
    return name == "front_facing" or of_triangle(own_pixel(name)[0])


#: Rows of a triangle's numbers, three each.  Planes are the value on column 0 of the first corner's row, and the change
#: along x and y: depth, and where something is interpolated the edges opposite to the second and the third corner
#: (whole numbers, which float64 holds exactly).  Then the area with the 1/w of those two corners over the first's; then
#: of each varying the first corner's and what the others have more.
DEPTH, EDGE1, EDGE2, NEARNESS, VARYINGS = 0, 1, 2, 3, 4

#: Where a triangle's numbers lie: how far down pixel row 0 is from its first corner, whether it faces the viewer, then
#: the rows above.
TO_Y, FRONT, PLANES = 0, 1, 2

#: Side of a tile in pixels, a power of 2: its colour and depth (a few formats) stay in a core's second-level cache.
TILE = 64


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


#: A triangle cut by six planes has at most nine corners.
MAX_CORNERS = 9
#: Vertices that cutting one triangle makes at most: a plane cuts two edges.
NEW_VERTICES = 12
#: Lists of corners that clipping in one chunk needs: the polygon, and what a plane makes of it.
CORNER_LISTS = 2
#: Entries of each list: those corners in whole cache lines, as chunks write side by side.
CORNER_ROOM = 16

#: A triangle's first pixels in the rows of a tile, then as many last ones; vectors may reach three rows farther.
SPAN_ROWS = TILE + 3
#: The first pixel of a row without any; its last is -1.
NOWHERE = 1 << 30

#: A depth test passes where the new depth is on one of these sides of the held one.
LESS, EQUAL, GREATER = 1, 2, 4
TESTS = {
    "never": 0, "less": LESS, "equal": EQUAL, "less_equal": LESS | EQUAL, "greater": GREATER,
    "not_equal": LESS | GREATER, "greater_equal": GREATER | EQUAL, "always": LESS | EQUAL | GREATER,
}  # fmt: skip

_FOLDER = Path(__file__).parent
#: Where the functions are written, what they take from elsewhere, and how they become text.
SOURCES = (
    *(_FOLDER / f"{name}.py" for name in ("call", "entries", "layout", "order", "setup", "tiles", "triangle")),
    *(_FOLDER.parent / "machine" / f"{name}.py" for name in ("jit", "portable")),
)
SHIPPED = Shipped(_FOLDER / "fixed", SOURCES, "python -m passgraph.backends.numpy.raster.generate")


#: LLVM's first level is enough for text that has been optimised before; in the loops over a tile's triangles its third
#: takes out conditions that stay the same.
_SETUP, _PIXELS = 1, 3


def _entry(module: str, function: str, pieces: int, kinds: str, level: int = _SETUP) -> NumbaCode:
    def find() -> Callable[..., Any]:
        found: Callable[..., Any] = getattr(
            import_module(f"passgraph.backends.numpy.raster.{module}"), function
        ).py_func
        return found

    return NumbaCode(function, pieces, kinds.split(), find, SHIPPED, level)


project = _entry("setup", "project", 2, "f64[2] i64 i64 i32[1] i32[1] f64[1] f64[1] u8[1]")
classify = _entry("setup", "classify", 3, "i32[2] u8[1] u8[1] i64[2]")
assemble = _entry(
    "setup", "assemble", 5,
    "i32[2] u8[1] u8[1] f64[2] f32[2] i64 i64 i64 i32[1] i32[1] f64[1] f64[1] i32[2] i64[2]",
)  # fmt: skip
count_tiles = _entry("setup", "count_tiles", 3, "i32[2] i64 i64[2]")
fill_tiles = _entry("setup", "fill_tiles", 3, "i32[2] i64 i64[2] i32[1]")
tiles = _entry(
    "tiles", "tiles", 0,
    "i64[1] i64 i64[1] i64 i64[1] i32[1] i32[2] i32[1] i32[1] f64[1] f64[1] f32[2] f64 f64 i64 i64 "
    "f32[1] i64 i64 i64 f64 i32[1] i32[1] i64 f64[1] i64 i64[1]",
    _PIXELS,
)  # fmt: skip
in_order = _entry(
    "order", "in_order", 0,
    "i64[1] i64 i64[1] i64 i64[1] i32[1] i32[2] i32[1] i32[1] f64[1] f64[1] f32[2] f64 f64 i64 i64 "
    "f32[1] f64 i64 i32[1] i64 f64[1] i64 i64[1]",
    _PIXELS,
)  # fmt: skip

FIXED = (project, classify, assemble, count_tiles, fill_tiles, tiles, in_order)
