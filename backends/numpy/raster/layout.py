"""Constants and array layouts shared by the rasterizer's fixed functions and their host."""

from __future__ import annotations

from passgraph.language.builtin_name import BuiltinName


def is_of_triangle(name: BuiltinName) -> bool:
    """Return True if a fragment builtin depends on the triangle."""
    return name.kind == "front_facing" or name.is_of_triangle


#: Rows of a triangle's numbers, three each.  A plane is the value on column 0 of the first corner's row, and the change
#: along x and y.  First the plane of depth; with interpolation then the edges opposite to the second and the third
#: corner (whole numbers, exact in float64), the area with the 1/w of those two corners relative to the first's, and for
#: each varying the first corner's value and the differences of the others to it.
DEPTH, EDGE1, EDGE2, NEARNESS, VARYINGS = 0, 1, 2, 3, 4

#: Layout of a triangle's numbers: how far down pixel row 0 is from its first corner, 1 if it faces the viewer, then the
#: rows above.
TO_Y, FRONT, PLANES = 0, 1, 2

#: Side of a tile in pixels, a power of 2: its color and depth (a few formats) stay in a core's second-level cache.
TILE = 64

#: Most corners of a triangle clipped by six planes.
MAX_CORNERS = 9
#: Most vertices that clipping one triangle makes: a plane cuts two edges.
NEW_VERTICES = 12
#: Lists of corners for clipping in one chunk: the polygon, and the result of clipping by a plane.
CORNER_LISTS = 2
#: Entries of each list: the corners, rounded up to cache lines, as chunks write side by side.
CORNER_ROOM = 16

#: A triangle's first pixels in the rows of a tile, then as many last ones; vectors may read three rows farther.
SPAN_ROWS = TILE + 3
#: The first pixel of an empty row; its last is -1.
NOWHERE = 1 << 30

#: A depth test passes if the new depth is on one of these sides of the stored one.
LESS, EQUAL, GREATER = 1, 2, 4
TESTS = {
    "never": 0, "less": LESS, "equal": EQUAL, "less_equal": LESS | EQUAL, "greater": GREATER,
    "not_equal": LESS | GREATER, "greater_equal": GREATER | EQUAL, "always": LESS | EQUAL | GREATER,
}  # fmt: skip
