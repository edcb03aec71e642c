"""Animated GIFs, in and out: Pillow packs and unpacks the pixels of each frame, and this file does the rest.

Of frames that leave the one before them, or what lies behind all, Pillow shows others than browsers do.
Of frames of which some are seen through Pillow writes wrong ones and files that break off, and of times and repeats
that a GIF does not say it raises errors without a name.

Source: GIF89a specification (CompuServe, 1990), with Netscape's extension for loops.
"""

from __future__ import annotations

import io
import struct
from collections.abc import Iterator, Sequence
from typing import BinaryIO, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from passgraph.files.animation_times import behind, table_bytes

#: A number of two bytes at most: repeats, hundredths of a second.
MOST = 65_535
#: Hundredths of a second at least that players show a frame for as long as they are told.
LEAST = 2
#: Of a table of colours.
_ENTRIES = 256
#: How a frame is left: as it is, or all of it seen through, or as it was before.
_STAYS, _GOES, _BACK = 1, 2, 3
#: Shades of grey, whose entries are their numbers.
_GREYS = np.arange(256, dtype=np.uint8).repeat(3).tobytes()
#: Left, upper, right and lower.
_Box: TypeAlias = "tuple[int, int, int, int]"


class Paletted(NamedTuple):
    """A picture of up to 256 colours.

    Attributes
    ----------
    indices : (h, w) uint8
    colours : (count, 3) uint8
    unseen : the entry behind these of what cannot be seen, or None
    """

    indices: NDArray[np.uint8]
    colours: NDArray[np.uint8]
    unseen: int | None

    def rgba(self) -> NDArray[np.uint8]:
        """(h, w, 4) uint8."""
        table = np.zeros((len(self.colours) + 1, 4), np.uint8)
        table[:-1, :3], table[:-1, 3] = self.colours, 255
        made: NDArray[np.uint8] = table[self.indices]
        return made

    def with_unseen(self) -> Paletted:
        """With an entry that cannot be seen: where there is no room the rarest colour becomes the nearest other."""
        if self.unseen is not None:
            return self
        count = len(self.colours)
        if count < _ENTRIES:
            return self._replace(unseen=count)
        rarest = int(np.bincount(self.indices.ravel(), minlength=count).argmin())
        others = np.delete(self.colours, rarest, axis=0)
        nearest = int(np.square(others.astype(int) - self.colours[rarest]).sum(axis=1).argmin())
        new = np.insert(np.arange(count - 1, dtype=np.uint8), rarest, nearest)
        return Paletted(new[self.indices], others, count - 1)

    def table(self) -> tuple[bytes, int]:
        """The colours as a GIF has them, and the exponent of their count less one."""
        count = len(self.colours) + (self.unseen is not None)
        depth = max(0, (count - 1).bit_length() - 1)
        return self.colours.tobytes().ljust(3 << depth + 1, b"\0"), depth


def write_gif(stream: BinaryIO, pictures: Sequence[Paletted], lengths: Sequence[int], plays: int) -> None:
    """All pictures, each for so many hundredths of a second.

    Parameters
    ----------
    pictures : of one size
    lengths : `LEAST` or more
    plays : how often, 0 for without end; `MOST` + 1 at most is said
    """
    height, width = pictures[0].indices.shape
    is_seen_through = any(picture.unseen is not None for picture in pictures)
    if is_seen_through:
        # Where a frame has no such entry some decoders leave its first colour behind.
        pictures = [picture.with_unseen() for picture in pictures]
    stream.write(b"GIF89a" + struct.pack("<HHBBB", width, height, 0x70, 0, 0))
    if plays != 1:
        # What is counted follows the first time.
        stream.write(b"!\xff\x0bNETSCAPE2.0\x03\x01" + struct.pack("<HB", min(plays - 1, MOST) if plays else 0, 0))
    for picture, (left, upper, right, lower), length in _changes(pictures, lengths, is_seen_through):
        how = (_GOES if is_seen_through else _STAYS) << 2 | (picture.unseen is not None)
        table, depth = picture.table()
        place = struct.pack("<HHHHB", left, upper, right - left, lower - upper, 0x80 | depth)
        pixels = _packed(picture.indices[upper:lower, left:right])
        for hundredths in _delays(length):
            stream.write(b"!\xf9\x04" + struct.pack("<BHBB", how, hundredths, picture.unseen or 0, 0))
            stream.write(b"," + place + table + pixels)
    stream.write(b";")


def _changes(
    pictures: Sequence[Paletted], lengths: Sequence[int], is_seen_through: bool
) -> Iterator[tuple[Paletted, _Box, int]]:
    """Pictures that are not as the one before, where they are another, and how long until the next.

    What is seen through shows what lies behind: then all of each picture is written, and goes after its time.
    """
    pending, box, total, before = pictures[0], (0, 0, *pictures[0].indices.shape[::-1]), 0, pictures[0].rgba()
    for picture, length in zip(pictures, lengths, strict=True):
        shown = picture.rgba()
        differs = (shown != before).any(axis=2)
        if differs.any():
            yield pending, box, total
            rows, columns = np.flatnonzero(differs.any(axis=1)), np.flatnonzero(differs.any(axis=0))
            if not is_seen_through:
                box = int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1
            pending, before, total = picture, shown, 0
        total += length
    yield pending, box, total


def _delays(length: int) -> Iterator[int]:
    """A time in parts that can be said, none of them shorter than players show."""
    while length > MOST:
        part = min(MOST, length - LEAST)
        yield part
        length -= part
    yield length


def _packed(indices: NDArray[np.uint8]) -> bytes:
    """Pixels as a GIF has them: taken from one of shades of grey, whose entries are these numbers."""
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(indices)).save(file, "GIF", optimize=False, interlace=0)
    data = file.getvalue()
    at = 13 + table_bytes(data[10])
    while data[at] == 0x21:  # an extension
        at = behind(data, at + 2)
    at += 10
    return data[at : behind(data, at + 1)]


def pictures_of(data: bytes, size: tuple[int, int]) -> Iterator[NDArray[np.uint8]]:
    """Whole pictures (h, w, 4) as browsers show them: behind all frames there is nothing.

    Raises whatever Pillow raises of pixels that are damaged, and IndexError or struct.error where the file breaks off.
    """
    shown = np.zeros((size[1], size[0]), np.uint32)  # four bytes as one number: found and kept at once
    at, how, unseen = 13 + table_bytes(data[10]), 0, None
    common = data[13:at] or _GREYS
    while data[at] in (0x21, 0x2C):
        if data[at] == 0x21:
            if data[at + 1] == 0xF9:
                how, unseen = data[at + 3] >> 2 & 7, data[at + 6] if data[at + 3] & 1 else None
            at = behind(data, at + 2)
            continue
        left, upper, width, height, packed = struct.unpack_from("<HHHHB", data, at + 1)
        begin = at + 10 + table_bytes(packed)
        table, at = data[at + 10 : begin] or common, behind(data, begin + 1)
        colours = np.zeros((256, 4), np.uint8)
        colours[:, 3] = 255
        colours[: len(table) // 3, :3] = np.frombuffer(table, np.uint8).reshape(-1, 3)
        if unseen is not None:
            colours[unseen] = 0
        before = shown.copy() if how == _BACK else shown
        place = shown[upper : upper + height, left : left + width]
        indices = _unpacked(data[begin:at], width, height, packed)[: place.shape[0], : place.shape[1]]
        np.copyto(place, colours.view(np.uint32)[:, 0][indices], where=True if unseen is None else indices != unseen)
        yield shown.copy().view(np.uint8).reshape(*shown.shape, 4)
        if how == _GOES:
            place[:] = 0
        shown, how, unseen = before, 0, None


def _unpacked(pixels: bytes, width: int, height: int, packed: int) -> NDArray[np.uint8]:
    """Indices (h, w), as a frame's pixels have them."""
    from PIL import Image

    head = b"GIF89a" + struct.pack("<HHBBB", width, height, 0xF7, 0, 0) + _GREYS
    place = b"," + struct.pack("<HHHHB", 0, 0, width, height, packed & 0x40)
    with Image.open(io.BytesIO(head + place + pixels + b";"), formats=["GIF"]) as image:
        return np.asarray(image)
