"""Textures within mpv user shaders: ``//!TEXTURE`` blocks, whose texels stand behind them in hexadecimal digits."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import InputError
from passgraph.graph.targets import Target
from passgraph.shaders.containers.mpv_header import MpvBlock
from passgraph.shaders.containers.pictures import brought

#: Texels to a side, and to a texture.
MAX_SIDE, MAX_TEXELS = 16_384, 1 << 22
_FORMAT = re.compile(r"(r|rg|rgb|rgba)(8|16|16hf|16f|32f)")
#: What the digits hold.  A player is given float32 for its half floats, and rounds them; of halves the name ends in hf.
_KINDS: dict[str, str] = {"8": "u1", "16": "<u2", "16hf": "<f2", "16f": "<f4", "32f": "<f4"}
_FILTERS = {"LINEAR": "linear", "NEAREST": "nearest"}
_BORDERS = {"CLAMP": "clamp", "REPEAT": "repeat", "MIRROR": "mirror"}


def read_texture(block: MpvBlock, file: str) -> Target:
    """The picture that a block is, with its filter and border; a volume is one of its slices below one another.

    Raises
    ------
    InputError
        For a size, format, filter or border that there is not, and for another count of digits than these ask for,
        which is looked at before memory is asked for.
    """
    name = block.first("TEXTURE")
    where = f"{file}:{block.line}: //!TEXTURE {name}"
    if "STORAGE" in block.said:
        raise InputError(f"{where}: a texture that passes write (//!STORAGE) is not read here")
    sides = block.first("SIZE").split()
    if len(sides) not in (2, 3) or not all(re.fullmatch(r"\d{1,5}", side) for side in sides):
        raise InputError(f"{where}: SIZE is width and height, and the depth of a volume, got {block.first('SIZE')!r}")
    width, height, depth = (*map(int, sides), 1)[:3]
    if not (min(width, height, depth) >= 1 and max(width, height, depth) <= MAX_SIDE) or (
        width * height * depth > MAX_TEXELS or height * depth > 4 * MAX_SIDE
    ):
        raise InputError(f"{where}: SIZE has sides from 1 to {MAX_SIDE} and at most {MAX_TEXELS} texels")
    found = _FORMAT.fullmatch(block.first("FORMAT"))
    if found is None:
        raise InputError(
            f"{where}: FORMAT is such as rgba16f, of 8 or 16 bits or floats, got {block.first('FORMAT')!r}"
        )
    letters, kind = found[1], found[2]
    texels = _texels(block.code, (height * depth, width, len(letters)), np.dtype(_KINDS[kind]), where)
    picture = brought(where, f"{letters}{kind.replace('h', '')}", texels)
    picture = picture.filter(_said(block, "FILTER", _FILTERS, where)).border(_said(block, "BORDER", _BORDERS, where))
    return picture.slices(depth) if len(sides) == 3 else picture


def _texels(text: str, shape: tuple[int, int, int], kind: np.dtype[Any], where: str) -> NDArray[np.float32]:
    digits = "".join(text.split())
    expected = 2 * kind.itemsize * int(np.prod(shape))
    if len(digits) != expected:
        raise InputError(f"{where}: its size and format ask for {expected} hexadecimal digits, got {len(digits)}")
    if not re.fullmatch(r"[0-9a-fA-F]*", digits):
        raise InputError(f"{where}: its texels must be hexadecimal digits")
    stored = np.frombuffer(bytes.fromhex(digits), kind).reshape(shape)
    most = np.iinfo(kind).max if kind.kind == "u" else 1
    with np.errstate(all="ignore"):
        return (stored / np.float64(most)).astype(np.float32)


def _said(block: MpvBlock, name: str, known: dict[str, str], where: str) -> str:
    word = block.first(name, next(iter(known)))
    if word not in known:
        raise InputError(f"{where}: {name} is one of {', '.join(known)}, got {word!r}")
    return known[word]
