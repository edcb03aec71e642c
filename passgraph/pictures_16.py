"""Files of 16 bits a channel, which Pillow does not write in colour: PNG and TIFF."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from passgraph.picture_notes import Notes

#: Colour types by channels (PNG, 3rd edition, section 11.2.1): gray, gray and alpha, RGB, RGBA.
_PNG_COLOURS = {1: 0, 2: 4, 3: 2, 4: 6}
#: Each row is stored as its differences from the one above: filter type 2, "Up" (section 9.2).
_UP = 2
#: zlib's level, as for pictures of 8 bits.
_LEVEL = 4
#: Rows that are compressed at a time.
_ROWS_AT_ONCE = 256
#: Types of TIFF's entries (TIFF 6.0, section 2), by struct's letters; a RATIONAL is two numbers.
_SHORT, _LONG, _RATIONAL, _BYTES = (3, "H"), (4, "I"), (5, "I"), (7, "B")


def png_of(pixels: NDArray[np.uint16], notes: Notes | None = None) -> bytes:
    """The bytes of a PNG file of (h, w, 1 to 4) uint16, with notes of another file.

    >>> png_of(np.zeros((2, 3, 4), np.uint16))[:8]
    b'\\x89PNG\\r\\n\\x1a\\n'
    """
    height, width, channels = pixels.shape
    header = struct.pack(">IIBBBBB", width, height, 16, _PNG_COLOURS[channels], 0, 0, 0)
    packed, above = zlib.compressobj(_LEVEL), np.zeros((1, width * channels * 2), np.uint8)
    parts = []
    for top in range(0, height, _ROWS_AT_ONCE):
        part = np.ascontiguousarray(pixels[top : top + _ROWS_AT_ONCE], ">u2")
        rows = part.view(np.uint8).reshape(len(part), -1)
        filtered = np.empty((len(rows), rows.shape[1] + 1), np.uint8)
        filtered[:, 0] = _UP
        np.subtract(rows, np.concatenate([above, rows[:-1]]), out=filtered[:, 1:])
        parts.append(packed.compress(filtered.tobytes()))
        above = rows[-1:]
    data = b"".join([*parts, packed.flush()])
    notes = notes or Notes()
    colours = _chunk(b"iCCP", b"ICC profile\0\0" + zlib.compress(notes.profile)) if notes.profile else b""
    if notes.resolution:
        colours += _chunk(b"pHYs", struct.pack(">IIB", *(round(dots / 0.0254) for dots in notes.resolution), 1))
    if notes.exif:
        colours += _chunk(b"eXIf", notes.exif.removeprefix(b"Exif\0\0"))
    return b"".join(
        [b"\x89PNG\r\n\x1a\n", _chunk(b"IHDR", header), colours, _chunk(b"IDAT", data), _chunk(b"IEND", b"")]
    )


def _chunk(kind: bytes, data: bytes) -> bytes:
    """Not longer than 2^31 - 1 bytes, as readers expect (section 5.3); longer data goes on in chunks behind it."""
    most = (1 << 31) - 1
    pieces = [data[at : at + most] for at in range(0, len(data), most)] or [b""]
    return b"".join(
        struct.pack(">I", len(piece)) + kind + piece + struct.pack(">I", zlib.crc32(kind + piece)) for piece in pieces
    )


def tiff_of(pixels: NDArray[np.uint16], notes: Notes | None = None) -> bytes:
    """The bytes of a TIFF file of (h, w, 1 to 4) uint16, in one strip, not compressed, with notes of another file.

    Raises
    ------
    ValueError : for what its offsets of 32 bits do not reach.

    >>> tiff_of(np.zeros((2, 3, 4), np.uint16))[:4]
    b'II*\\x00'
    """
    height, width, channels = pixels.shape
    data = np.ascontiguousarray(pixels, "<u2").tobytes()
    notes = notes or Notes()
    dots_an_inch = notes.resolution or ()
    gray, alpha = channels < 3, channels in (2, 4)
    entries: list[tuple[int, tuple[int, str], Sequence[int]]] = [
        (256, _LONG, [width]), (257, _LONG, [height]), (258, _SHORT, [16] * channels),
        (259, _SHORT, [1]), (262, _SHORT, [1 if gray else 2]), (273, _LONG, [8]), (277, _SHORT, [channels]),
        (278, _LONG, [height]), (279, _LONG, [len(data)]),
        *((tag, _RATIONAL, [round(dots * 1000), 1000]) for tag, dots in zip((282, 283), dots_an_inch, strict=False)),
        (284, _SHORT, [1]), *([(296, _SHORT, [2])] if dots_an_inch else []),
        *([(338, _SHORT, [2])] if alpha else []),  # straight alpha
        *([(34675, _BYTES, notes.profile)] if notes.profile else []),  # ICC.1:2022, annex B.4
    ]  # fmt: skip
    directory = 8 + len(data)  # even, as its place must be
    beyond = directory + 2 + 12 * len(entries) + 4
    if beyond >= 1 << 32:
        raise ValueError(f"{len(data)} bytes of pixels are more than a TIFF file's 2^32")
    rows, far = [], b""
    for tag, (kind, letter), values in entries:
        held = struct.pack(f"<{len(values)}{letter}", *values)
        if len(held) > 4:
            held, far = struct.pack("<I", beyond + len(far)), far + held
        count = len(values) // (2 if kind == _RATIONAL[0] else 1)
        rows.append(struct.pack("<HHI", tag, kind, count) + held.ljust(4, b"\0"))
    return b"".join([b"II*\0", struct.pack("<I", directory), data, struct.pack("<H", len(rows)), *rows, b"\0" * 4, far])
