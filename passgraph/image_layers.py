"""Choose the channels of a picture file to read: of a layer, a part or a channel by name, or of the picture itself.

A file has parts, a part has channels, and a channel's name may begin with its layer: ``diffuse.R``.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import field
from pathlib import Path

from passgraph.errors import InputError
from passgraph.records import dataclass

#: Names of parts that hold the picture, among others with color (Nuke, Arnold, V-Ray; Houdini, RenderMan).
_PICTURE = ("", "rgba", "rgb", "beauty", "c", "ci")
#: Channels as Nuke names them.
_LETTERS = {"RED": "R", "GREEN": "G", "BLUE": "B", "ALPHA": "A"}
#: Layers of Cryptomatte: pairs of an object's number and how much of the pixel it covers (specification 1.2.0).
_CRYPTOMATTE = re.compile(r"(?:^|[._])crypto[^.]*[0-9]{2}$", re.IGNORECASE)
#: Most channels that are read of a layer of data.
_MOST = 4


@dataclass(frozen=True)
class Part:
    """A part of a file.

    Attributes
    ----------
    name : its name; "" if it has none
    view : the eye that it is for, in stereo pictures
    channels : names of its channels
    data : names of layers that hold no color, whatever their channels are called
    """

    name: str
    channels: Sequence[str]
    view: str = ""
    data: Collection[str] = field(default=())

    @property
    def kind(self) -> str:
        """Return the name without the view: of ``diffuse.left`` it is ``diffuse``, of ``left`` nothing."""
        return self.name if not self.view else re.sub(rf"(^|[._]){re.escape(self.view)}([._]|$)", "", self.name)

    def layers(self) -> dict[str, dict[str, int]]:
        """Return the channels of each layer, "" for those in none, with their index; color by its first letter.

        >>> Part("", ["R", "Z", "diffuse.red"]).layers()
        {'': {'R': 0, 'Z': 1}, 'diffuse': {'R': 2}}
        """
        layers: dict[str, dict[str, int]] = {}
        for index, name in enumerate(self.channels):
            layer, _, channel = name.rpartition(".")
            layers.setdefault(layer, {}).setdefault(_LETTERS.get(channel.upper(), channel.upper()), index)
        return layers

    def is_data(self, layer: str) -> bool:
        """Return True for Cryptomatte's layers, and for a part of one."""
        name = layer or self.name
        return name in self.data or bool(_CRYPTOMATTE.search(name))

    def layer_names(self) -> list[str]:
        """Return the names of layers, and of channels outside any layer.

        >>> Part("", ["R", "G", "B", "Z", "diffuse.R", "diffuse.G"]).layer_names()
        ['Z', 'diffuse']
        """
        found = dict.fromkeys(name.rpartition(".")[0] or name for name in self.channels)
        return [name for name in found if name not in ("R", "G", "B", "A", "Y")]


@dataclass(frozen=True)
class Channels:
    """The channels to read: the index of their part, their indices in it, and True if the last is alpha of color."""

    part: int
    order: list[int]
    has_alpha: bool


def find_channels(file: Path, parts: Sequence[Part], layer: str | None, *, has_layers: bool) -> Channels:
    """Return the channels of a layer, a part or a channel by name; without a name, of the picture itself.

    ``has_layers``: the file's format names its channels, so that channels of other names are no color.

    Raises
    ------
    InputError : there is no such layer; or no name is given, and several layers have color, or none has.
    """
    found = _picture(file, parts) if layer is None else _named(file, parts, layer)
    if found is not None:
        return found
    if layer is None and not has_layers:
        return Channels(0, list(range(len(parts[0].channels)))[:_MOST], False)
    layers = [name for part in parts for name in part.layer_names()]
    known = list(dict.fromkeys([*layers, *(part.name for part in parts if part.name)]))
    if layer is None or any(part.name == layer for part in parts):
        names = [name for part in parts for name in part.channels]
        raise InputError(
            f"{file}: has no color: its channels are {', '.join(names)}; name a layer: {file}:{(known or names)[0]}"
        )
    raise InputError(f"{file}: no layer {layer!r}; it has {', '.join(known) or 'none'}")


def _picture(file: Path, parts: Sequence[Part]) -> Channels | None:
    """Return red, green and blue outside any layer, else of the only layer that has them, else gray.

    Depth and positions may be called Y or X, Y and Z too, so they come last in a file of several parts.
    """
    if (found := _one_part(file, parts, lambda part: _color_of(part, "", "RGB"))) is not None:
        return found
    if len(parts) == 1 and (found := _gray(file, parts)) is not None:
        return found
    colored: dict[str, Channels] = {}
    for index, part in enumerate(parts):
        for name in part.layers():
            if (channels := _color_of(part, name, "RGB")) is not None:
                colored.setdefault(name, Channels(index, *channels))
    _check_one(file, colored)
    return next(iter(colored.values()), None) or _gray(file, parts)


def _gray(file: Path, parts: Sequence[Part]) -> Channels | None:
    return _one_part(file, parts, lambda part: _color_of(part, "", "XYZ") or _color_of(part, "", "Y"))


def _one_part(
    file: Path, parts: Sequence[Part], color: Callable[[Part], tuple[list[int], bool] | None]
) -> Channels | None:
    """Return the color of the only part that has some: of the first of its views, or of the one named as a picture."""
    found = {index: channels for index, part in enumerate(parts) if (channels := color(part)) is not None}
    kinds: dict[str, int] = {}
    for index in found:
        kinds.setdefault(parts[index].kind, index)
    pictures = [index for kind, index in kinds.items() if kind.lower() in _PICTURE]
    if len(kinds) > 1 and not pictures:
        _check_one(file, [parts[index].name for index in kinds.values()])
    chosen = [*pictures, *kinds.values()][:1]
    return Channels(chosen[0], *found[chosen[0]]) if chosen else None


def _check_one(file: Path, names: Iterable[str]) -> None:
    known = list(names)
    if len(known) > 1:
        raise InputError(f"{file}: has several layers with color: {', '.join(known)}; name one: {file}:{known[0]}")


def _named(file: Path, parts: Sequence[Part], name: str) -> Channels | None:
    for index, part in enumerate(parts):
        if part.name == name:
            return _whole(file, index, part)
    for index, part in enumerate(parts):
        if name and name in (layers := part.layers()):
            color = _color_of(part, name, "RGB") or _color_of(part, name, "Y")
            return Channels(index, *(color or (list(layers[name].values())[:_MOST], False)))
    for index, part in enumerate(parts):
        if name in part.channels:
            return Channels(index, [list(part.channels).index(name)], False)
    return None


def _whole(file: Path, index: int, part: Part) -> Channels | None:
    """Return the color of a part, or its numbers if it has none and at most four channels."""
    if not part.is_data(""):
        if found := _color_of(part, "", "RGB") or _color_of(part, "", "Y"):
            return Channels(index, *found)
        colored = {name: color for name in part.layers() if (color := _color_of(part, name, "RGB")) is not None}
        _check_one(file, colored)
        if colored:
            return Channels(index, *next(iter(colored.values())))
    return Channels(index, list(range(len(part.channels))), False) if len(part.channels) <= _MOST else None


def _color_of(part: Part, layer: str, wanted: str) -> tuple[list[int], bool] | None:
    """Return the indices of a layer's color, and of its alpha, and True if there is alpha; None if it has no color.

    >>> _color_of(Part("", ["Z", "R", "G", "B", "A"]), "", "RGB"), _color_of(Part("", ["U", "V"]), "", "RGB")
    (([1, 2, 3, 4], True), None)
    """
    channels = part.layers().get(layer, {})
    is_xyz = wanted == "Y" and "X" in channels
    # With W there are four numbers, such as motion to and from two frames.
    if part.is_data(layer) or "W" in channels or is_xyz or not channels.keys() >= set(wanted):
        return None
    has_alpha = "A" in channels
    return [channels[letter] for letter in wanted + "A" * has_alpha], has_alpha
