"""What commands run a user's own graphs on: devices, and pictures of their inputs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from passgraph.arguments import near
from passgraph.errors import DeviceMissingError, InputError

if TYPE_CHECKING:
    from passgraph.commands.own_file import Graph
    from passgraph.verify.conformance.case import Picture

#: Size of pictures that are made for a check, where none is given.
MADE_SIZE = (96, 64)


class InputType(click.ParamType[tuple[str, Path]]):
    """NAME=FILE."""

    name = "NAME=FILE"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, Path]:
        if isinstance(value, tuple):
            return value
        name, sign, path = str(value).partition("=")
        if not (name and sign and path):
            self.fail(f"{value!r} is not NAME=FILE, such as frame=photo.png", param, ctx)
        return name, Path(path)


def opened(names: Sequence[str]) -> list[Any]:
    """The backends named, or all that are here."""
    from passgraph.backends.registry import backend_names, open_backend

    if names:
        return [open_backend(name) for name in names]
    made = []
    for name in backend_names():
        if name not in ("reference", "null"):
            try:
                made.append(open_backend(name))
            except DeviceMissingError as error:
                click.echo(f"{name}: missing: {' '.join(str(error).split())}")
    if not made:
        raise InputError("no backend is here to be checked; see: passgraph backends")
    return made


def read_inputs(graphs: Mapping[str, Graph], inputs: Sequence[tuple[str, Path]]) -> dict[str, Picture]:
    from passgraph.pictures import load
    from passgraph.plan.reach import inputs_behind

    known = sorted({name for graph in graphs.values() for name in inputs_behind(list(graph.values()))})
    for name, _ in inputs:
        if name not in known:
            raise InputError(f"there is no input {name!r}{near(name, known)}; there are {', '.join(known) or 'none'}")
    return {name: load(path) for name, path in inputs}


def plain_input(size: tuple[int, int], seed: int, number: str) -> Picture:
    """A picture of usual values, for a channel's type."""
    from passgraph.verify.conformance.scenes import plausible

    return plausible(size, seed)


def extreme_input(size: tuple[int, int], seed: int, number: str) -> Picture:
    """A picture that also holds zeros, negative, huge and tiny values, where the format has them."""
    from passgraph.verify.conformance.scenes import picture, with_special

    return with_special(picture(size, seed), number)


def made_inputs(
    graph: Graph,
    pictures: Mapping[str, Picture],
    size: tuple[int, int] | None,
    made_size: tuple[int, int] = MADE_SIZE,
    made: Callable[[tuple[int, int], int, str], Picture] = plain_input,
) -> tuple[tuple[int, int], dict[str, Picture]]:
    """The output's size and a picture for each input: given, its default, or made.

    ``made`` makes a picture of a size, with a seed, for a channel's type: `plain_input` or `extreme_input`.
    """
    from passgraph.plan.reach import inputs_behind

    first = next(iter(pictures.values()), None)
    chosen = size or (made_size if first is None else (first.shape[1], first.shape[0]))
    brought = {}
    for number, (name, spec) in enumerate(inputs_behind(list(graph.values())).items()):
        channels = 4 if spec.format is None else spec.format.channels
        if name in pictures:
            brought[name] = pictures[name][:, :, :channels]
        elif spec.default is None:
            kind = "f4" if spec.format is None else spec.format.number
            brought[name] = made(spec.size or chosen, number, kind)[:, :, :channels]
    return chosen, brought
