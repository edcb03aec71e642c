"""The rasterizer's fixed functions, for calls from the host.

They are written for numba in setup.py and rasterize.py, which are imported only by generate.py to regenerate their text
(``fixed/``).
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

from passgraph.backends.numpy.machine.shipped import NumbaCode, Shipped

_FOLDER = Path(__file__).parent
#: The functions' module, its dependencies, and the code that generates the text.
SOURCES = (
    *(_FOLDER / f"{name}.py" for name in ("layout", "rasterize", "setup")),
    _FOLDER.parent / "machine" / "numba_text.py",
)
SHIPPED = Shipped(_FOLDER / "fixed", SOURCES, "python -m passgraph.backends.numpy.raster.generate")


#: LLVM's level 1 suffices for text that is already optimized; in the loops over a tile's triangles level 3 hoists
#: invariant conditions.
_SETUP, _PIXELS = 1, 3


def _entry(module: str, function: str, pieces: int, kinds: str, level: int = _SETUP) -> NumbaCode:
    def find() -> Callable[..., Any]:
        entry: Callable[..., Any] = getattr(
            import_module(f"passgraph.backends.numpy.raster.{module}"), function
        ).py_func
        return entry

    return NumbaCode(function, pieces, kinds.split(), find, SHIPPED, level)


project = _entry("setup", "project", 2, "f64[2] i64 i64 i32[1] i32[1] f64[1] f64[1] u8[1]")
classify = _entry("setup", "classify", 3, "i32[2] u8[1] u8[1] i64[2]")
assemble = _entry(
    "setup",
    "assemble",
    5,
    "i32[2] u8[1] u8[1] f64[2] f32[2] i64 i64 i64 i32[1] i32[1] f64[1] f64[1] i32[2] i64[2]",
)
count_tiles = _entry("setup", "count_tiles", 3, "i32[2] i64 i64[2]")
fill_tiles = _entry("setup", "fill_tiles", 3, "i32[2] i64 i64[2] i32[1]")
tiles = _entry(
    "rasterize",
    "tiles",
    0,
    "i64[1] i64 i64[1] i64 i64[1] i32[1] i32[2] i32[1] i32[1] f64[1] f64[1] f32[2] f64 f64 i64 i64 "
    "f32[1] i64 i64 i64 f64 i32[1] i32[1] i64 f64[1] i64 i64[1]",
    _PIXELS,
)
in_order = _entry(
    "rasterize",
    "in_order",
    0,
    "i64[1] i64 i64[1] i64 i64[1] i32[1] i32[2] i32[1] i32[1] f64[1] f64[1] f32[2] f64 f64 i64 i64 "
    "f32[1] f64 i64 i32[1] i64 f64[1] i64 i64[1]",
    _PIXELS,
)

FIXED = (project, classify, assemble, count_tiles, fill_tiles, tiles, in_order)
