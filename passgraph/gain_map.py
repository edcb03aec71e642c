"""JPEG files with a gain map (Ultra HDR, Adobe gain map, ISO 21496-1): their base picture, and their HDR rendition.

Such a file holds an ordinary JPEG, which every viewer shows, and behind it a second one: the gain map, by which the
first becomes a picture with highlights above 1. Sources: Ultra HDR Image Format 1.1 (Android), Gain Map Specification
1.0 (Adobe), ISO 21496-1:2025, annex C.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from fractions import Fraction
from io import BytesIO
from typing import BinaryIO
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from passgraph.records import dataclass
from passgraph.srgb import srgb_to_linear

#: Name of the HDR rendition: ``photo.jpg:hdr``.
HDR = "hdr"

_XMP, _ISO = b"http://ns.adobe.com/xap/1.0/\0", b"urn:iso:std:iso:ts:21496:-1\0"
_NAMESPACE = "http://ns.adobe.com/hdr-gain-map/1.0/"
_LIST_ITEM = "{http://www.w3.org/1999/02/22-rdf-syntax-ns#}li"
_START, _APP1, _APP2, _SCAN, _END = 0xD8, 0xE1, 0xE2, 0xDA, 0xD9
#: A marker within entropy-coded data: not a stuffed 0xFF, and no restart (ITU-T T.81, B.1.1.2).
_MARKER = re.compile(rb"\xff[^\x00\xd0-\xd7\xff]")
#: Most JPEG streams that are looked through behind the first one.
_MOST_STREAMS = 16
#: Rows computed at a time have at most this many pixels.
_PIXELS_AT_ONCE = 1 << 18

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Gain:
    """The metadata of a gain map; triples hold a number for each of red, green and blue.

    Attributes
    ----------
    least, most : log2 of the gain that the map's 0 and 1 stand for
    gamma : exponent with which the map is encoded
    base_offset, hdr_offset : added to the base picture, and subtracted from the product
    headroom : log2 of the brightest white, relative to that of the base picture, for which the HDR rendition is made
    """

    least: Triple
    most: Triple
    gamma: Triple
    base_offset: Triple
    hdr_offset: Triple
    headroom: float

    def applied(self, base: NDArray[np.uint8], gains: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Return linear light (h, w, 3), where 1 is white of the base picture.

        Parameters
        ----------
        base : (h, w, 1 or 3), sRGB-encoded
        gains : the map, (rows, columns, 1 or 3), of any size; it is interpolated linearly between pixel centers
        """
        height, width, _ = base.shape
        light = srgb_to_linear(np.arange(256, dtype=np.float32) / np.float32(255))
        result = np.empty((height, width, 3), np.float32)
        columns, right, x = _positions(width, gains.shape[1])
        rows, below, y = _positions(height, gains.shape[0])
        least, most, gamma, base_offset, hdr_offset = (
            np.array(triple, np.float32)
            for triple in (self.least, self.most, self.gamma, self.base_offset, self.hdr_offset)
        )
        band = max(_PIXELS_AT_ONCE // width, 1)
        for top in range(0, height, band):
            part = slice(top, top + band)
            upper, lower = (
                gains[row][:, columns] * (1 - x[:, None]) + gains[row][:, right] * x[:, None]
                for row in (rows[part], below[part])
            )
            weight = y[part, None, None]
            gain = ((upper * (1 - weight) + lower * weight) / np.float32(255)) ** (1 / gamma)
            boost = np.exp2(least * (1 - gain) + most * gain)
            result[part] = (light[base[part]] + base_offset) * boost - hdr_offset
        return result


def _positions(size: int, samples: int) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float32]]:
    """Return, for each pixel of a row, the samples before and behind it, and the weight of the second."""
    place = np.clip((np.arange(size) + 0.5) * (samples / size) - 0.5, 0, samples - 1)
    before = np.floor(place).astype(np.intp)
    return before, np.minimum(before + 1, samples - 1), (place - before).astype(np.float32)


@dataclass(frozen=True)
class GainMapFile:
    """The parts of a file: JPEG streams of the base picture and of the gain map, and the map's metadata."""

    base: bytes
    gains: bytes
    gain: Gain


def declares_gain_map(stream: BinaryIO) -> bool:
    """Return True if a file begins with a JPEG whose header announces a gain map; reads nothing but the header."""
    return any(
        (marker == _APP1 and payload.startswith(_XMP) and _NAMESPACE.encode() in payload)
        or (marker == _APP2 and payload.startswith(_ISO))
        for marker, payload in _segments(stream)
    )


def base_picture(data: bytes) -> bytes:
    """Return the first JPEG stream of a file, without what follows it."""
    return data[: _end(data, 0)]


def gain_map_of(data: bytes) -> GainMapFile:
    """Return the parts of a JPEG file with a gain map.

    Raises
    ------
    ValueError : the file has no gain map that can be read; the text says why.
    """
    base = base_picture(data)
    place, why = len(base), "it has no gain map"
    for _ in range(_MOST_STREAMS):
        place = data.find(b"\xff\xd8\xff", place)
        if place < 0:
            break
        end = _end(data, place)
        try:
            if (gain := _gain_of(data[place:end])) is not None:
                return GainMapFile(base, data[place:end], gain)
        except (ValueError, struct.error, ZeroDivisionError, ElementTree.ParseError) as error:
            why = str(error)
        place = max(end, place + 2)
    raise ValueError(why)


def _segments(stream: BinaryIO) -> Iterator[tuple[int, bytes]]:
    """Yield the marker segments (marker, payload) of a JPEG stream before its first scan."""
    if stream.read(2) != bytes([0xFF, _START]):
        return
    while True:
        head = stream.read(4)
        while head[:2] == b"\xff\xff":  # fill bytes
            head = head[1:] + stream.read(1)
        if len(head) < 4 or head[0] != 0xFF or head[1] in (_SCAN, _END):
            return
        yield head[1], stream.read(max(int.from_bytes(head[2:], "big") - 2, 0))


def _end(data: bytes, start: int) -> int:
    """Return where the JPEG stream that begins at ``start`` ends: behind its end marker, or at the data's end."""
    place = start + 2
    while (found := _MARKER.search(data, place)) is not None:
        marker, place = data[found.start() + 1], found.end()
        if marker == _END:
            return place
        if marker not in (0x01, _START):
            place += max(int.from_bytes(data[place : place + 2], "big"), 2)
    return len(data)


def _gain_of(jpeg: bytes) -> Gain | None:
    """Return the metadata of a gain map; None if a JPEG stream has none. ISO's comes before Adobe's."""
    found: dict[bytes, bytes] = {}
    for _, payload in _segments(BytesIO(jpeg)):
        for name in (_ISO, _XMP):
            if payload.startswith(name) and (name == _ISO or _NAMESPACE.encode() in payload):
                found.setdefault(name, payload[len(name) :])
    if _ISO in found:
        return _of_iso(found[_ISO])
    return _of_xmp(found[_XMP]) if _XMP in found else None


_MULTICHANNEL, _BASE_COLORS, _BACKWARD, _COMMON_DENOMINATOR = 0x80, 0x40, 4, 8


def _of_iso(payload: bytes) -> Gain:
    """Parse the binary metadata; a common denominator is libultrahdr's (1.4.0, gainmapmetadata.cpp)."""
    stream = BytesIO(payload)

    def fraction(kind: str) -> float:
        (above,) = struct.unpack(f">{kind}", stream.read(4))
        return float(Fraction(above, common or struct.unpack(">I", stream.read(4))[0]))

    version, _, flags = struct.unpack(">HHB", stream.read(5))
    if version:
        raise ValueError(f"its gain map has version {version}; expected 0")
    if flags & _BACKWARD:
        raise ValueError("its base picture is the HDR rendition")
    if not flags & _BASE_COLORS:
        raise ValueError("its gain map is for other primaries than those of the base picture")
    common = struct.unpack(">I", stream.read(4))[0] if flags & _COMMON_DENOMINATOR else 0
    base, headroom = fraction("I"), fraction("I")
    if headroom < base:
        raise ValueError("its base picture is the HDR rendition")
    rows = [[fraction(kind) for kind in "iiIii"] for _ in range(3 if flags & _MULTICHANNEL else 1)]
    return _gain([_triple(list(column)) for column in zip(*rows, strict=True)], headroom)


#: The properties in the order of `Gain`, and their values where they are missing; None for those that must be there.
_PROPERTIES = {"GainMapMin": 0.0, "GainMapMax": None, "Gamma": 1.0, "OffsetSDR": 1 / 64, "OffsetHDR": 1 / 64}


def _of_xmp(packet: bytes) -> Gain:
    if b"<!" in packet:  # XMP has no document type; entities could grow without bound
        raise ValueError("its metadata is no XMP")
    root = ElementTree.fromstring(packet.strip(b"\0 \r\n\t"))
    found: dict[str, list[str]] = {}
    for element in root.iter():
        for name, value in element.attrib.items():
            found.setdefault(name, [value])
        found.setdefault(element.tag, [item.text or "" for item in element.iter(_LIST_ITEM)] or [element.text or ""])

    def numbers(name: str, default: float | None) -> Triple:
        values = found.get(f"{{{_NAMESPACE}}}{name}")
        if values is None and default is None:
            raise ValueError(f"its gain map has no {name}")
        return _triple([default] if values is None else [float(value) for value in values])  # type: ignore[list-item]

    if found.get(f"{{{_NAMESPACE}}}BaseRenditionIsHDR", [""])[0].strip().lower() == "true":
        raise ValueError("its base picture is the HDR rendition")
    (headroom, *_) = numbers("HDRCapacityMax", None)
    return _gain([numbers(name, default) for name, default in _PROPERTIES.items()], headroom)


def _triple(values: list[float]) -> Triple:
    if len(values) not in (1, 3):
        raise ValueError(f"its gain map has {len(values)} values for a property; expected 1 or 3")
    red, green, blue = values * (3 // len(values))
    return red, green, blue


def _gain(triples: list[Triple], headroom: float) -> Gain:
    least, most, gamma, base_offset, hdr_offset = triples
    if not np.isfinite([*triples, (headroom,) * 3]).all() or min(gamma) <= 0:
        raise ValueError("its gain map has metadata that is no number")
    return Gain(least, most, gamma, base_offset, hdr_offset, headroom)
