"""The order in which generated code hands values to a program's body."""

from __future__ import annotations

from passgraph.language.scalar import ScalarProgram


def argument_names(program: ScalarProgram, builtins: list[str]) -> list[str]:
    """Members of the tuple: place, builtins in the program's order, images with their sizes, parameter blocks."""
    names = ["x", "y", *builtins]
    for index in range(len(program.images)):
        names += [f"im{index}", f"im{index}_w", f"im{index}_h"]
    return [*names, "floats", "ints"]


#: Members behind those where a fragment kernel has varyings: the triangle's numbers, and how near to its second and its
#: third corner the fragment is.
PLANE_ARGUMENTS = ["planes", "near1", "near2"]


def is_varying(name: str) -> bool:
    return name.startswith("varying.")


#: Rows of a triangle's numbers, three each.  Planes are the value at the first corner and the change along x and y:
#: depth, and where something is interpolated the edges opposite to the second and the third corner (whole numbers,
#: which float64 holds exactly).  Then the area with the 1/w of those two corners over the first's; then of each varying
#: the first corner's and what the others have more.
DEPTH, EDGE1, EDGE2, NEARNESS, VARYINGS = 0, 1, 2, 3, 4

#: Where a visible triangle's numbers lie: how far down its first corner is from pixel row 0, whether it faces the
#: viewer, then the rows above, of planes with the value on column 0 of that row.
TO_Y, FRONT, PLANES = 0, 1, 2

#: Side of a tile in pixels, a power of 2: its colour and depth (a few formats) stay in a core's second-level cache.
TILE = 64
