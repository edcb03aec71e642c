"""The parts of an OpenEXR file as they are stored: headers, and compressed blocks that are copied byte for byte.

Libraries decode what they copy, which loses what they do not know: deep samples, smaller levels, attributes of other
programs, the bits of lossy compressions.  Here a block is bytes.  The layout is that of "OpenEXR File Layout"
(openexr.com): a magic number, a version with flags, the headers, the positions of the blocks of each part, and the
blocks, each with its part's number in files of several parts.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

MAGIC = 20000630
#: Flags of the version: one part in tiles, names of more than 31 bytes, deep samples, several parts.
_TILED, _LONG_NAMES, _DEEP, _SEVERAL = 0x200, 0x400, 0x800, 0x1000
#: Most bytes of a name, and of one header; a header holds manifests and previews.
_MOST_NAME, _MOST_HEADER = 256, 1 << 28
#: Bytes of a block before its sizes, behind its part's number: a row, or a tile's column, row and two levels.
_PLACE = {b"scanlineimage": 4, b"tiledimage": 16, b"deepscanline": 4, b"deeptile": 16}
#: Rows that ZIP compresses together, its number, and its level in OpenEXR 3.5.
ZIP_ROWS, _ZIP, _ZIP_LEVEL = 16, 3, 4
PIXEL_TYPES = ("uint32", "float16", "float32")


class Attribute(NamedTuple):
    """An attribute of a header; the value is as it is stored."""

    name: bytes
    kind: bytes
    value: bytes


class Channel(NamedTuple):
    """A channel of a part; ``kind`` is an index of `PIXEL_TYPES`."""

    name: bytes
    kind: int
    linear: int = 0
    sampling: tuple[int, int] = (1, 1)

    @property
    def dtype(self) -> np.dtype[np.generic]:
        return np.dtype(PIXEL_TYPES[self.kind])


class Header:
    """The attributes of a part, by name."""

    def __init__(self, attributes: Sequence[Attribute]) -> None:
        self.attributes = {one.name: one for one in attributes}

    def value(self, name: bytes) -> bytes:
        """Return the value of an attribute; ValueError if there is none."""
        if name not in self.attributes:
            raise ValueError(f"there is no attribute {name.decode(errors='replace')}")
        return self.attributes[name].value

    @property
    def channels(self) -> list[Channel]:
        found, text = list[Channel](), self.value(b"channels")
        while text and text != b"\0":
            name, _, rest = text.partition(b"\0")
            kind, linear, *sampling = struct.unpack("<iB3xii", rest[:16])
            if not 0 <= kind < len(PIXEL_TYPES):
                raise ValueError(f"a channel of type {kind}")
            found.append(Channel(name, kind, linear, (sampling[0], sampling[1])))
            text = rest[16:]
        return found

    def with_attributes(self, changed: Mapping[bytes, Attribute | None]) -> Header:
        """Return the header with some attributes replaced, added or, where None is given, left out."""
        merged = {**self.attributes, **changed}
        return Header([one for one in merged.values() if one is not None])

    def encoded(self) -> bytes:
        return b"".join(
            b"%b\0%b\0%b%b" % (one.name, one.kind, struct.pack("<i", len(one.value)), one.value)
            for one in self.attributes.values()
        )


def channels_attribute(channels: Sequence[Channel]) -> Attribute:
    """Return the attribute that lists channels, which must be in the order of their names."""
    listed = [b"%b\0%b" % (one.name, struct.pack("<iB3xii", one.kind, one.linear, *one.sampling)) for one in channels]
    return Attribute(b"channels", b"chlist", b"".join(listed) + b"\0")


def window_attribute(x: int, y: int, width: int, height: int) -> Attribute:
    return Attribute(b"dataWindow", b"box2i", struct.pack("<4i", x, y, x + width - 1, y + height - 1))


@dataclass(frozen=True)
class ExrParts:
    """The headers of a file, and the positions of the blocks of its parts if it has several."""

    version: int
    headers: list[Header]
    positions: list[NDArray[np.uint64]]

    @staticmethod
    def read(file: BinaryIO) -> ExrParts:
        """Read the headers of a file; ValueError if they are broken, or a part does not have all of its blocks."""
        magic, version = struct.unpack("<iI", _exactly(file, 8))
        if magic != MAGIC:
            raise ValueError("it is no OpenEXR file")
        headers = [Header(list(_attributes(file)))]
        if not version & _SEVERAL:
            return ExrParts(version, headers, [])
        while following := list(_attributes(file)):
            headers.append(Header(following))
        positions = []
        for header in headers:
            (count,) = struct.unpack("<i", header.value(b"chunkCount"))
            found = np.frombuffer(_exactly(file, 8 * max(count, 0)), "<u8")
            if not found.all():
                raise ValueError("a part is not complete")
            positions.append(found)
        return ExrParts(version, headers, positions)

    def blocks(self, part: int, file: BinaryIO) -> Iterator[bytes]:
        """Yield the blocks of a part of several, each with its part's number."""
        kind = self.headers[part].value(b"type").rstrip(b"\0")
        if kind not in _PLACE:
            raise ValueError(f"a part of type {kind.decode(errors='replace')}")
        size = 4 + _PLACE[kind]
        for position in self.positions[part].tolist():
            file.seek(position)
            start = _exactly(file, size)
            # Flat: the size of the data. Deep: those of a table and of the samples, and the samples' when unpacked.
            sizes = _exactly(file, 24 if kind.startswith(b"deep") else 4)
            length = (
                sum(struct.unpack("<2Q", sizes[:16])) if kind.startswith(b"deep") else struct.unpack("<i", sizes)[0]
            )
            yield start + sizes + _exactly(file, length)

    def write(self, to: BinaryIO, source: BinaryIO, part: int, header: Header, blocks: Iterator[bytes]) -> None:
        """Write the file with one part replaced by scan lines, given as ZIP blocks; others are copied from ``source``.

        Parameters
        ----------
        header : of the part, with its window and channels; what says how it is stored is added here
        blocks : as `zip_block` makes them, for each `ZIP_ROWS` rows, top to bottom
        """
        _, top, _, bottom = struct.unpack("<4i", header.value(b"dataWindow"))
        count, several = -(-(bottom + 1 - top) // ZIP_ROWS), bool(self.version & _SEVERAL)
        stored: dict[bytes, Attribute | None] = {
            b"compression": Attribute(b"compression", b"compression", bytes([_ZIP])),
            b"lineOrder": Attribute(b"lineOrder", b"lineOrder", b"\0"),
            b"tiles": None,
        }
        for attribute in (
            Attribute(b"type", b"string", b"scanlineimage"),
            Attribute(b"chunkCount", b"int", struct.pack("<i", count)),
        ):
            if several or attribute.name in header.attributes:
                stored[attribute.name] = attribute
        headers = [*self.headers]
        headers[part] = header.with_attributes(stored)
        names = [name for head in headers for name in (*head.attributes, *(one.name for one in head.channels))]
        version = self.version & ~_TILED | (
            _LONG_NAMES if max(map(len, names)) > 31 else 0
        )  # of one part it says TILED
        to.write(struct.pack("<iI", MAGIC, version))
        to.write(b"".join(head.encoded() + b"\0" for head in headers) + b"\0" * several)
        counts = [len(self.positions[n]) if n != part else count for n in range(len(headers))]
        table, positions = to.tell(), list[int]()
        to.write(bytes(8 * sum(counts)))
        number = struct.pack("<i", part) if several else b""
        for n in range(len(headers)):
            copied = self.blocks(n, source) if n != part else (number + block for block in blocks)
            for block in copied:
                positions.append(to.tell())
                to.write(block)
        if len(positions) != sum(counts):
            raise ValueError(f"{len(positions)} blocks, expected {sum(counts)}")
        to.seek(table)
        to.write(np.array(positions, "<u8").tobytes())


def _attributes(file: BinaryIO) -> Iterator[Attribute]:
    while name := _name_in(file):
        kind = _name_in(file)
        (length,) = struct.unpack("<i", _exactly(file, 4))
        yield Attribute(name, kind, _exactly(file, length))


def _name_in(file: BinaryIO) -> bytes:
    """Read a name, which ends with a byte 0."""
    name = bytearray()
    while (byte := _exactly(file, 1)) != b"\0":
        name += byte
        if len(name) > _MOST_NAME:
            raise ValueError("a name is too long")
    return bytes(name)


def _exactly(file: BinaryIO, length: int) -> bytes:
    found = file.read(length) if 0 <= length <= _MOST_HEADER else b""
    if len(found) != length:
        raise ValueError("it ends early")
    return found


def zip_block(y: int, rows: NDArray[np.uint8]) -> bytes:
    """Return the block of some rows, (rows, bytes of a row), which begin at row ``y`` of the file.

    The bytes are split into those at even and at odd places, then each is replaced by its difference to the one before
    (OpenEXR, internal_zip.c).  A block that does not become smaller is stored as it is.
    """
    plain = np.ascontiguousarray(rows).reshape(-1)
    split = np.concatenate([plain[0::2], plain[1::2]])
    split[1:] = split[1:] - split[:-1] + np.uint8(128)
    data = zlib.compress(split.tobytes(), _ZIP_LEVEL)
    data = data if len(data) < len(plain) else plain.tobytes()
    return struct.pack("<ii", y, len(data)) + data
