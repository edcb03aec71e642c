"""What two places of a graph have in common: a program whose images are named by their numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from passgraph.language import scalar as s


def nameless(program: s.ScalarProgram) -> s.ScalarProgram:
    """The same program, with image 0, 1 … as ``image0``, ``image1`` …, so that its key says nothing of names.

    What kernels call their images says nothing of what they compute.
    """
    names = {use.name: f"image{number}" for number, use in enumerate(program.images)}
    sizes = {f"size.{name}.{axis}": f"size.{new}.{axis}" for name, new in names.items() for axis in (0, 1)}
    return replace(
        program,
        body=_renamed(program.body, names, sizes),
        images=tuple(replace(use, name=names[use.name]) for use in program.images),
        builtins=tuple((sizes.get(name, name), kind) for name, kind in program.builtins),
    )


def _renamed(
    body: tuple[s.Instruction, ...], names: Mapping[str, str], sizes: Mapping[str, str]
) -> tuple[s.Instruction, ...]:
    made: list[s.Instruction] = []
    for i in body:
        if isinstance(i, s.LoadTexel):
            made.append(replace(i, image=names[i.image]))
        elif isinstance(i, s.LoadBuiltin) and i.name in sizes:
            made.append(replace(i, name=sizes[i.name]))
        elif isinstance(i, s.If):
            made.append(replace(i, then=_renamed(i.then, names, sizes), orelse=_renamed(i.orelse, names, sizes)))
        elif isinstance(i, s.For):
            made.append(replace(i, body=_renamed(i.body, names, sizes)))
        else:
            made.append(i)
    return tuple(made)
