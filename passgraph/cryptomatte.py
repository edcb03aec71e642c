"""Cryptomatte: mattes of objects by name, from layers of an OpenEXR file.

Each pixel has ranks: the number of an object, and how much of the pixel it covers, the largest first.  A layer such as
``crypto_object00`` holds two: red and green, blue and alpha.  The number is a hash of the object's name, stored as the
float of the same bits.  The header has the names, or the file that lists them.
Source: J. Friedman and A. C. Jones, "Cryptomatte Specification" 1.2.0, Psyop, 2015-2018.
"""

from __future__ import annotations

import json
import os
import re
import struct
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path, PurePosixPath

import numpy as np
from numpy.typing import NDArray

from passgraph import arguments
from passgraph.errors import InputError
from passgraph.exr_parts import ExrParts
from passgraph.pictures import Picture, load
from passgraph.reading import check_regular, read_bytes

_KEY = re.compile(r"cryptomatte/([^/]+)/(name|manifest|manif_file|hash|conversion)")
_KNOWN = {"hash": "MurmurHash3_32", "conversion": "uint32_to_float32"}
#: Most bytes of a file of names: millions of objects.
_MOST_BYTES = 1 << 28
#: Names that an error lists.
_SHOWN = 10
_WILDCARDS = re.compile(r"[*?\[]")


@dataclass(frozen=True)
class Cryptomatte:
    """One Cryptomatte of a file.

    Attributes
    ----------
    file : the OpenEXR file
    name : such as "crypto_object"
    layers : its layers, in order: "crypto_object00", "crypto_object01" ...
    numbers : the number of each object by name; empty if the file does not list them
    """

    file: Path
    name: str
    layers: tuple[str, ...]
    numbers: Mapping[str, np.float32]

    @staticmethod
    def load(path: str | os.PathLike[str], name: str | None = None) -> Cryptomatte:
        """Read the names of a Cryptomatte, from the header of an OpenEXR file or the file that it names.

        Parameters
        ----------
        path : an OpenEXR file
        name : which of several, such as ``"crypto_material"``; without it the first one

        Raises
        ------
        InputError
            The file has no Cryptomatte, or none of that name, or its list of names is damaged.
        """
        file = arguments.path(path, "a file with Cryptomattes")
        check_regular(file, "an OpenEXR file")
        try:
            with file.open("rb") as stream:
                headers = ExrParts.read(stream).headers
        except (ValueError, struct.error) as error:
            raise InputError(f"{file}: is no OpenEXR file, or damaged ({error}); make or copy it again") from error
        found: dict[str, dict[str, str]] = {}
        layers = set[str]()
        for header in headers:
            for key, attribute in header.attributes.items():
                if match := _KEY.fullmatch(key.decode(errors="replace")):
                    found.setdefault(match[1], {})[match[2]] = attribute.value.decode(errors="replace")
            layers |= {one.name.decode(errors="replace").rpartition(".")[0] for one in header.channels}
            if (part := header.attributes.get(b"name")) is not None:
                layers.add(part.value.decode(errors="replace"))
        named = {one["name"]: one for one in found.values() if "name" in one}
        if not named:
            raise InputError(f"{file}: has no Cryptomatte; expected attributes cryptomatte/.../name. Render one")
        if name is not None and name not in named:
            raise InputError(f"{file}: has no Cryptomatte {name!r}; it has {', '.join(named)}")
        chosen = next(iter(named)) if name is None else name
        entries = named[chosen]
        for entry, expected in _KNOWN.items():
            if entries.get(entry, expected) != expected:
                raise InputError(f"{file}: {chosen} has the {entry} {entries[entry]!r}; expected {expected!r}")
        ranked = sorted(layer for layer in layers if re.fullmatch(rf"{re.escape(chosen)}\d+", layer))
        if not ranked:
            raise InputError(f"{file}: has no layers {chosen}00 ..., though its header names a Cryptomatte {chosen}")
        return Cryptomatte(file, chosen, tuple(ranked), _numbers(file, chosen, entries))

    def find(self, names: Iterable[str]) -> NDArray[np.float32]:
        """Return the numbers of objects, sorted.

        Parameters
        ----------
        names : names, where ``*``, ``?`` and ``[...]`` stand for any text, one letter, and some letters. A file
            without a list of names has any name, but no such pattern.

        Raises
        ------
        InputError
            No object has such a name.
        """
        found = set[np.float32]()
        for name in names:
            matching = {number for known, number in self.numbers.items() if fnmatchcase(known, name)}
            if name in self.numbers:
                matching = {self.numbers[name]}
            elif not self.numbers and not _WILDCARDS.search(name):
                matching = {number_of(name)}
            if not matching:
                raise InputError(f"{self.file}: {self.name} has no object {name!r}; {self._known(name)}")
            found |= matching
        return np.array(sorted(found), np.float32)

    def _known(self, name: str) -> str:
        if not self.numbers:
            return "the file does not list names, so give them in full"
        listed = list(self.numbers)
        more = f" and {len(listed) - _SHOWN} others" if len(listed) > _SHOWN else ""
        return f"it has {', '.join(listed[:_SHOWN])}{more}{arguments.near(name, listed)}"

    def pick(self, x: int, y: int) -> np.float32:
        """Return the number of the object that covers most of a pixel, counted from the top left.

        Raises
        ------
        InputError
            The pixel is outside of the picture, or shows no object.
        """
        first = self._rank(0)
        height, width = first.shape[:2]
        if not (0 <= x < width and 0 <= y < height):
            raise InputError(f"{self.file}: has {width}×{height} pixels, and ({x}, {y}) is none of them")
        number = np.float32(first[y, x, 0])
        if not number or not first[y, x, 1] > 0:
            raise InputError(f"{self.file}: {self.name} has no object at pixel ({x}, {y}); pick another one")
        return number

    def name_of(self, number: np.float32) -> str | None:
        """Return the name of an object; None if the file does not list it."""
        return next((name for name, known in self.numbers.items() if known == number), None)

    def ranks(self) -> dict[str, Picture]:
        """Load the layers, each (height, width, 4) float32, by their names."""
        return {layer: self._rank(place) for place, layer in enumerate(self.layers)}

    def _rank(self, place: int) -> Picture:
        return load(self.file, layer=self.layers[place])


def _numbers(file: Path, name: str, entries: Mapping[str, str]) -> dict[str, np.float32]:
    where, text = f"{file}: {name}", entries.get("manifest", "{}")
    if beside := entries.get("manif_file"):
        # Specification: relative to the picture, with slashes. Text of a file may not lead out of its folder.
        relative = PurePosixPath(beside)
        if relative.is_absolute() or ".." in relative.parts or "\\" in beside:
            raise InputError(f"{where}: its list of names {beside!r} is not beside it; expected a relative path")
        where = str(file.parent / relative)
        if (file.parent / relative).is_file():
            text = read_bytes(file.parent / relative, "a list of names", _MOST_BYTES).decode(errors="replace")
    try:
        listed = json.loads(text)
        return {str(key): _as_float(int(str(value), 16)) for key, value in listed.items()}
    except (ValueError, AttributeError, struct.error, RecursionError) as error:
        raise InputError(
            f"{where}: the list of names is damaged ({error}); expected JSON of names and numbers"
        ) from error


def number_of(name: str) -> np.float32:
    """Return the number of an object: the float of its hash's bits."""
    return _as_float(hash_of(name))


def _as_float(bits: int) -> np.float32:
    return np.float32(struct.unpack("<f", struct.pack("<I", bits))[0])


def hash_of(name: str) -> int:
    """Return the hash of a name: MurmurHash3_x86_32, and the lowest bit of the exponent flipped where it is 0 or 255.

    >>> hex(hash_of("ball_asset"))
    '0x79b62f5e'

    So no number is NaN, infinite, or so small that a device may take it as 0.  Source of MurmurHash3: A. Appleby, 2011.
    """
    data, most = name.encode(), 0xFFFFFFFF

    def rotated(value: int, by: int) -> int:
        return (value << by | value >> (32 - by)) & most

    def scrambled(block: bytes) -> int:
        return rotated(int.from_bytes(block, "little") * 0xCC9E2D51 & most, 15) * 0x1B873593 & most

    found, whole = 0, len(data) // 4 * 4
    for start in range(0, whole, 4):
        found = (rotated(found ^ scrambled(data[start : start + 4]), 13) * 5 + 0xE6546B64) & most
    found ^= scrambled(data[whole:]) ^ len(data)
    for shift, factor in ((16, 0x85EBCA6B), (13, 0xC2B2AE35), (16, 1)):
        found = (found ^ found >> shift) * factor & most
    return found ^ 1 << 23 if found >> 23 & 255 in (0, 255) else found
