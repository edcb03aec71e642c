"""The order in which generated code hands values to a program's body."""

from __future__ import annotations

from passgraph.language.scalar import ScalarProgram


def argument_names(program: ScalarProgram, builtins: list[str]) -> list[str]:
    """Members of the tuple: place, builtins in the program's order, images with their sizes, parameter blocks."""
    names = ["x", "y", "row", "width", "j", *builtins]
    for index in range(len(program.images)):
        names += [f"im{index}", f"im{index}_w", f"im{index}_h"]
    return [*names, "floats", "ints"]
