"""The numbers that the rasterizer's fixed functions and their host share, and where stages leave their results."""

from __future__ import annotations

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

#: Side of a tile in pixels, a power of 2: its color and depth (a few formats) stay in a core's second-level cache.
TILE = 64

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
