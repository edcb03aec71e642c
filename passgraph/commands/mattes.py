"""``passgraph apply cryptomatte``: objects by name or by pixel, and the layers of their matte."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from passgraph.commands.clips import inputs_in_layer, sources_of
from passgraph.cryptomatte import Cryptomatte
from passgraph.effects.effect_table import Effect
from passgraph.errors import InputError
from passgraph.files.sequences import Pictures
from passgraph.pictures import is_exr
from passgraph.ranges import Range

if TYPE_CHECKING:
    from passgraph.effects.checked import Alpha
    from passgraph.effects.parameters import Parameter
    from passgraph.graph.targets import Target

NAME = "cryptomatte"
SUMMARY = "Write the matte of objects of a Cryptomatte, by name or by a pixel."


@dataclass(frozen=True, kw_only=True)
class MatteEffect(Effect):
    """The effect `passgraph.effects.cryptomatte`, on the first layer; further ones are its parameters.

    Attributes
    ----------
    layers : number of layers
    numbers : numbers of the objects
    """

    layers: int = 1
    numbers: tuple[float, ...] = ()

    @staticmethod
    def of(layers: int, numbers: Sequence[float]) -> MatteEffect:
        from passgraph.effects.pictures.cryptomatte import cryptomatte

        path = "passgraph.effects.pictures.cryptomatte:cryptomatte"
        return MatteEffect(NAME, path, "picture", SUMMARY, cryptomatte, layers=layers, numbers=tuple(numbers))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        from passgraph.effects.parameters import Parameter

        return tuple(Parameter(f"rank{i}", "picture", None, Range(), "") for i in range(1, self.layers))

    @property
    def linear(self) -> bool:
        return False

    @property
    def alpha(self) -> Alpha:
        return "straight"

    def build(self, *pictures: Any, **parameters: Any) -> Target:
        from passgraph.effects.pictures.cryptomatte import cryptomatte

        return cryptomatte([*pictures, *(parameters[one.name] for one in self.parameters)], self.numbers)


class Place(click.ParamType):  # type: ignore[type-arg]  # generic in newer clicks only
    """X,Y of a pixel."""

    name = "pixel"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int]:
        if isinstance(value, tuple):
            return value
        found = re.fullmatch(r"([0-9]{1,9}),([0-9]{1,9})", str(value))
        if found is None:
            self.fail(f"{value!r}: expected X,Y in pixels from the top left, such as 640,360", param, ctx)
        return int(found[1]), int(found[2])


def matte_options() -> list[click.Parameter]:
    return [
        click.Option(
            ["--name", "names"], multiple=True, metavar="NAME",
            help="Object, such as ball or 'ball*'; may be repeated.",
        ),
        click.Option(
            ["--pick", "picks"], multiple=True, type=Place(), metavar="X,Y",
            help="Pixel of the first frame, from the top left, that shows an object; may be repeated.",
        ),
        click.Option(
            ["--cryptomatte", "which"], metavar="NAME",
            help="Cryptomatte of the file, such as crypto_material.  [default: the first]",
        ),
    ]  # fmt: skip


def matte_of(
    inputs: tuple[str, ...], names: Sequence[str], picks: Sequence[tuple[int, int]], which: str | None
) -> tuple[MatteEffect, tuple[str, ...], dict[str, Any]]:
    """Return the effect, its inputs, and its parameters: further layers of the same files.

    Raises
    ------
    InputError
        The inputs are no OpenEXR files, no object is named, or none has such a name in any frame.
    """
    if len(inputs) != 1:
        raise InputError(f"{inputs[1]}: {NAME} reads one INPUT: a file, a folder, or a sequence (shot.####.exr)")
    # A name of any layer makes files of folders and patterns.
    sources = list(sources_of(inputs if not Path(inputs[0]).is_dir() else inputs_in_layer(inputs, "any"), None, []))
    files = [path for source in sources if isinstance(source, Pictures) for path in source.paths.values()]
    if not files or not all(map(is_exr, files)):
        raise InputError(f"{inputs[0]}: Cryptomattes are in OpenEXR files (.exr); give one, or a sequence of them")
    files = [path.with_name(path.name.removesuffix(":any")) for path in files]
    first = Cryptomatte.load(files[0], which)
    if not names and not picks:
        listed = list(first.numbers)
        some = f"; it has {', '.join(listed[:20])}{' ...' if len(listed) > 20 else ''}" if listed else ""
        raise InputError(f"{files[0]}: which objects of {first.name}? Give --name NAME or --pick X,Y{some}")
    numbers = {float(first.pick(x, y)) for x, y in picks} | _numbers(files, names, first)
    paths = [inputs_in_layer(inputs, layer)[0] for layer in first.layers]
    further = {f"rank{i}": Path(path) for i, path in enumerate(paths[1:], 1)}
    return MatteEffect.of(len(first.layers), sorted(numbers)), (paths[0],), further


def _numbers(files: Sequence[Path], names: Sequence[str], first: Cryptomatte) -> set[float]:
    """Return the numbers of objects of all frames, since each lists those that it shows.

    Further frames are read only if a name has a wildcard, or is not in those before.
    """
    found, missing = set[float](), dict.fromkeys(names)
    errors: dict[str, InputError] = {}
    for file in files:
        listed = first if file == files[0] else Cryptomatte.load(file, first.name)
        for name in names:
            try:
                found |= {float(number) for number in listed.find([name])}
                missing.pop(name, None)
            except InputError as error:
                errors.setdefault(name, error)
        if not missing and not any(set("*?[") & set(name) for name in names):
            break
    for name in missing:
        raise errors[name]
    return found
