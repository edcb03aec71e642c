"""The order in which generated code hands values to a program's body."""

from __future__ import annotations

from passgraph.language.scalar import ScalarProgram


def argument_names(program: ScalarProgram, builtins: list[str]) -> list[str]:
    """Members of the tuple: place, builtins in the program's order, images with their sizes, parameter blocks."""
    names = ["x", "y", *builtins]
    for index in range(len(program.images)):
        names += [f"im{index}", f"im{index}_w", f"im{index}_h"]
    return [*names, "floats", "ints"]


#: Members behind those where a fragment kernel has varyings: the planes' values at the row's start, the planes, the way
#: along the row, and w at this fragment.
PLANE_ARGUMENTS = ["values", "planes", "dx", "w"]


def is_varying(name: str) -> bool:
    return name.startswith("varying.")


#: Rows of a triangle's planes: depth, 1/w, then the varyings.  Each is the value at the first corner and the change
#: along x and along y.
DEPTH, INVERSE_W, VARYINGS = 0, 1, 2

#: Where a visible triangle's numbers lie: how far down its first corner is from pixel row 0, whether it faces the
#: viewer, then for each plane its value on column 0 of that row, and its steps along x and y.
TO_Y, FRONT, PLANES = 0, 1, 2

#: Side of a tile in pixels, a power of 2: its colour and depth (a few formats) stay in a core's second-level cache.
TILE = 64
