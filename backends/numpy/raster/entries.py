"""The rasteriser's fixed functions as the host calls them, and the numbers that both know.

They are written in setup.py, tiles.py and order.py, which are loaded only where their text (``fixed/``) is made anew;
generate.py does that.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

from passgraph.backends.numpy.machine.shipped import NumbaCode, Shipped
from passgraph.backends.numpy.raster.layout import TILE

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
    *(_FOLDER / f"{name}.py" for name in ("layout", "rasterize", "setup")),
    _FOLDER.parent / "machine" / "numba_text.py",
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
    "rasterize", "tiles", 0,
    "i64[1] i64 i64[1] i64 i64[1] i32[1] i32[2] i32[1] i32[1] f64[1] f64[1] f32[2] f64 f64 i64 i64 "
    "f32[1] i64 i64 i64 f64 i32[1] i32[1] i64 f64[1] i64 i64[1]",
    _PIXELS,
)  # fmt: skip
in_order = _entry(
    "rasterize", "in_order", 0,
    "i64[1] i64 i64[1] i64 i64[1] i32[1] i32[2] i32[1] i32[1] f64[1] f64[1] f32[2] f64 f64 i64 i64 "
    "f32[1] f64 i64 i32[1] i64 f64[1] i64 i64[1]",
    _PIXELS,
)  # fmt: skip

FIXED = (project, classify, assemble, count_tiles, fill_tiles, tiles, in_order)
