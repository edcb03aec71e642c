"""Where what the rasteriser's stages hand to one another lies."""

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

#: Side of a tile in pixels, a power of 2: its colour and depth (a few formats) stay in a core's second-level cache.
TILE = 64
