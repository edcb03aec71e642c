"""Write a picture into a copy of an OpenEXR file: its other layers, parts, windows and attributes stay as they are.

Parts that the picture does not go into are copied block by block (:mod:`.exr_parts`).  Its own part is written again,
in scan lines with ZIP, without loss whatever compression it had; its other channels keep their type and their bits.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from passgraph.errors import InputError
from passgraph.exr_parts import (
    PIXEL_TYPES,
    ZIP_ROWS,
    Attribute,
    Channel,
    ExrParts,
    Header,
    channels_attribute,
    window_attribute,
    zip_block,
)
from passgraph.image_files import ImageFile, Window, opened_image
from passgraph.image_formats import COLOR_ENTRIES, Metadata, Pixels

#: Rows that are read and written at a time: no compression puts more into a block (OpenEXR 3.5).
_ROWS = 256
_LETTERS = {1: "Y", 2: "YA", 3: "RGB", 4: "RGBA"}
#: Most threads that compress.
_THREADS = 8


@dataclass(frozen=True)
class KeptLayers:
    """What a picture is written into.

    Attributes
    ----------
    source : an OpenEXR file
    layer : the layer of it from which the picture was made, None for its color
    into : the layer that the picture becomes, which is replaced or added; None for the file's color
    """

    source: Path
    layer: str | None = None
    into: str | None = None

    def place_of(self, picture: Pixels) -> Window | None:
        """Return where a picture lies in the file, by its size: the display window, with overscan or without.

        None if it has another size, so that it cannot be among the file's layers.
        """
        with opened_image(self.source, layer=self.layer, overscan=True) as image:
            spec = image.spec
            display = Window(spec.full_x, spec.full_y, spec.full_width, spec.full_height)
            found = [window for window in (image.window, display) if picture.shape[:2] == (window.height, window.width)]
            return found[0] if found else None

    def write(
        self, file: Path, to: Path, picture: Pixels, place: Window, bits: int | None, tags: Metadata, *, converted: bool
    ) -> None:
        """Write the copy.

        Parameters
        ----------
        file : the name in messages
        to : the path of the copy
        picture : (h, w, 1 to 4) floats, color times alpha, at ``place``
        bits : 16 or 32 for the picture's channels; by default those that it replaces, or else was made from
        tags : metadata of the picture, of which the file gets the color tags if the picture replaces its color
        converted : True if its color space is not that of the source

        Raises
        ------
        InputError : the source is damaged, or the layer has one channel and the picture has colors.
        OSError : the path exists or cannot be written.
        """
        with ExitStack() as stack:
            read = stack.enter_context(opened_image(self.source, layer=self.layer))
            try:
                part = stack.enter_context(opened_image(self.source, layer=self.into))
                replaced = _replaced(file, part, picture)
            except InputError as error:
                if isinstance(error, _UnfitError):
                    raise
                prefix, part = f"{self.into}." if self.into else "", read
                replaced = [(prefix + letter, i) for i, letter in enumerate(_LETTERS[picture.shape[2]])]
            kind = PIXEL_TYPES.index({16: "float16", 32: "float32"}.get(bits or 0, read.dtype.name))
            try:
                with self.source.open("rb") as source, to.open("xb") as stream:
                    parts = ExrParts.read(source)
                    header = parts.headers[part.subimage]
                    was = {channel.name: channel for channel in header.channels}
                    for name, _ in replaced:
                        channel = was.get(name.encode()) or Channel(name.encode(), kind)
                        same = bits is None and channel.dtype.kind == "f"
                        was[channel.name] = channel if same else channel._replace(kind=kind)
                    channels = sorted(was.values())
                    window = _window(part, picture, place)
                    header = _header(header, channels, window)
                    header = header if self.into else _tagged(header, tags, converted=converted)
                    new = {name.encode(): picture[..., index] for name, index in replaced}
                    blocks = _blocks(part, channels, window, new, place)
                    parts.write(stream, source, part.subimage, header, blocks)
            except (ValueError, struct.error) as error:
                raise part.corrupt(error) from error


class _UnfitError(InputError):
    pass


def _replaced(file: Path, part: ImageFile, picture: Pixels) -> list[tuple[str, int]]:
    """Return the names of the channels of a layer, each with its index in the picture."""
    names = [part.spec.channelnames[index] for index in part.order]
    colors, given = len(names) - part.has_alpha, picture.shape[2]
    has_alpha = given in (2, 4)
    wide = given - has_alpha > 1
    if colors == 1 and wide and not (picture[..., 1:3] == picture[..., :1]).all():
        raise _UnfitError(
            f"{file}: {names[0]} is one channel, and the picture has colors; expected gray. Name another layer, "
            "such as out.exr:comp"
        )
    if colors > given:
        raise _UnfitError(f"{file}: the layer has the channels {', '.join(names)}; got a picture of {given} channels")
    found = [(name, i if wide else 0) for i, name in enumerate(names[:colors])]
    if has_alpha and (part.has_alpha or colors < given):
        layer, dot, _ = names[0].rpartition(".")
        found.append((names[-1] if part.has_alpha else f"{layer}{dot}A", given - 1))
    return found


def _window(part: ImageFile, picture: Pixels, place: Window) -> Window:
    """Return the data window: the part's own; or, if the picture is not 0 outside of it, one around both."""
    spec = part.spec
    own = Window(spec.x, spec.y, spec.width, spec.height)
    y, x = own.y - place.y, own.x - place.x
    inside = np.zeros(picture.shape[:2], bool)
    inside[max(y, 0) : max(y + own.height, 0), max(x, 0) : max(x + own.width, 0)] = True
    return own if inside.all() or not picture[~inside].any() else own.joined(place)


def _header(header: Header, channels: list[Channel], window: Window) -> Header:
    return header.with_attributes({b"channels": channels_attribute(channels), b"dataWindow": window_attribute(*window)})


def _tagged(header: Header, tags: Metadata, *, converted: bool) -> Header:
    """Return the header of another picture: with its color tags, and without the preview of the one before."""
    changed: dict[bytes, Attribute | None] = {b"preview": None}
    if converted:
        changed |= dict.fromkeys(name.encode() for name in COLOR_ENTRIES)
    for name, _, value in tags.attributes_for("openexr"):
        key = name.encode()
        if name == "colorInteropID" and (converted or key not in header.attributes):
            changed[key] = Attribute(key, b"string", str(value).encode())
        elif name == "chromaticities" and (converted or key not in header.attributes):
            changed[key] = Attribute(key, key, struct.pack("<8f", *value))
    return header.with_attributes(changed)


def _blocks(
    part: ImageFile, channels: list[Channel], window: Window, new: dict[bytes, Any], place: Window
) -> Iterator[bytes]:
    """Yield the ZIP blocks of a part: its own pixels, and over them the new ones at their place."""
    spec = part.spec
    places, begin = dict[bytes, slice](), 0
    for channel in channels:
        places[channel.name] = slice(begin, begin + window.width * channel.dtype.itemsize)
        begin = places[channel.name].stop
    types = {channel.name: channel.dtype for channel in channels}
    names = [name.encode() for name in spec.channelnames]
    runs = [list(run) for _, run in groupby(range(len(names)), lambda index: str(spec.channelformat(index)))]
    with ThreadPoolExecutor(min(_THREADS, os.cpu_count() or 1), "passgraph_exr") as pool:
        for top in range(window.y, window.y + window.height, _ROWS):
            band = Window(window.x, top, window.width, min(_ROWS, window.y + window.height - top))
            rows = np.zeros((band.height, begin), np.uint8)
            put = partial(_put, rows, places, types, band)
            y0, y1 = max(top, spec.y), min(top + band.height, spec.y + spec.height)
            if y0 < y1:
                for run in runs:
                    kind = str(spec.channelformat(run[0]))
                    stored = part.read_part((y0, y1, spec.x, spec.x + spec.width), range(run[0], run[-1] + 1), kind)
                    for index in run:
                        put(names[index], stored[..., index - run[0]], spec.x, y0)
            for name, values in new.items():
                first = max(top - place.y, 0)
                put(name, values[first : max(top + band.height - place.y, 0)], place.x, place.y + first)
            yield from pool.map(
                lambda i, rows=rows, top=top: zip_block(top + i, rows[i : i + ZIP_ROWS]),
                range(0, band.height, ZIP_ROWS),
            )


def _put(
    rows: Pixels, places: dict[bytes, slice], types: dict[bytes, Any], band: Window, name: bytes, values: Pixels,
    x: int, y: int,
) -> None:  # fmt: skip
    """Write the values of a channel, whose corner is at (x, y), into the bytes of a band of rows."""
    channel = rows[:, places[name]].view(types[name])
    x0, x1 = max(x, band.x), min(x + values.shape[1], band.x + band.width)
    y0, y1 = max(y, band.y), min(y + values.shape[0], band.y + band.height)
    if x0 < x1 and y0 < y1:
        with np.errstate(over="ignore"):  # values beyond half floats become infinite, as in a float target
            channel[y0 - band.y : y1 - band.y, x0 - band.x : x1 - band.x] = values[y0 - y : y1 - y, x0 - x : x1 - x]
