"""Frames of an APNG put together: Pillow unpacks the pixels of each, and this file does the rest.

Pillow lays colours that are partly seen through over others as if nothing were seen through there, clears pictures
without alpha to black, and begins with the picture before the first frame.

Source: PNG specification, third edition (W3C, 2025), "Animation information" and "fcTL Frame Control Chunk".
"""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
#: Kinds of chunks that pictures hang on.
_READ = (b"IHDR", b"PLTE", b"tRNS", b"IDAT", b"fcTL", b"fdAT")
#: How a frame is left: all of it seen through, or as it was before; and how it is laid on what is there.
_GOES, _BACK, _OVER = 1, 2, 1


class _Control(NamedTuple):
    """Of a frame: its place in the file's order, size, place, length, what becomes of it and how it is laid."""

    number: int
    width: int
    height: int
    left: int
    upper: int
    time: int
    units: int
    dispose: int
    blend: int


def pictures_of(data: bytes, size: tuple[int, int]) -> Iterator[NDArray[np.uint8]]:
    """Whole pictures (h, w, 4); raises ValueError, or whatever Pillow does, where the file is damaged."""
    shown = np.zeros((size[1], size[0], 4), np.uint8)
    for number, (control, part) in enumerate(_frames(data)):
        left, upper = control.left, control.upper
        place = shown[upper : upper + control.height, left : left + control.width]
        before = shown.copy() if control.dispose == _BACK else None
        place[:] = _over(part, place) if control.blend == _OVER and number else part
        yield shown.copy()
        if control.dispose == _GOES or (control.dispose == _BACK and not number):
            place[:] = 0
        elif before is not None:
            shown = before


def _over(new: NDArray[np.uint8], old: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Colours over others, neither multiplied by alpha."""
    made = np.where(new[..., 3:] == 255, new, old)
    mixed = (new[..., 3] > 0) & (new[..., 3] < 255)
    one, other = new[mixed].astype(np.float32), old[mixed].astype(np.float32)
    share, rest = one[:, 3:] / 255, other[:, 3:] / 255 * (1 - one[:, 3:] / 255)
    made[mixed, :3] = (one[:, :3] * share + other[:, :3] * rest) / (share + rest) + 0.5
    made[mixed, 3:] = (share + rest) * 255 + 0.5
    return made


def _frames(data: bytes) -> Iterator[tuple[_Control, NDArray[np.uint8]]]:
    """Each frame's control and pixels."""
    head: dict[bytes, bytes] = {}
    control, order = None, 0
    pixels: list[bytes] = []
    for kind, body in _chunks(data):
        if kind in (b"fcTL", b"IEND"):
            if control is not None:
                yield control, _unpacked(control, head, b"".join(pixels))
            control, pixels = None, []
        if kind in (b"fcTL", b"fdAT"):
            if int.from_bytes(body[:4], "big") != order:
                raise ValueError("frames are out of order")
            order += 1
        if kind == b"fcTL":
            control = _Control._make(struct.unpack(">IIIIIHHBB", body))
            width, height = struct.unpack(">II", head[b"IHDR"][:8])
            if control.left + control.width > width or control.upper + control.height > height:
                raise ValueError("the frame lies beyond the picture")
        elif kind in (b"IDAT", b"fdAT") and control is not None:
            pixels.append(body if kind == b"IDAT" else body[4:])
        elif kind in (b"IHDR", b"PLTE", b"tRNS"):
            head[kind] = body
    raise ValueError("the file ends within a frame" if control is not None else "there are no more frames")


def _chunks(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    at = len(_SIGNATURE)
    while at + 12 <= len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        body, end = data[at + 8 : at + 8 + length], data[at + 8 + length : at + 12 + length]
        if len(end) < 4:
            return
        if zlib.crc32(kind + body) != int.from_bytes(end, "big") and kind in _READ:
            raise ValueError(f"the chunk {kind.decode('latin-1')!r} is damaged")
        yield kind, body
        at += 12 + length


def _chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def _unpacked(control: _Control, head: dict[bytes, bytes], pixels: bytes) -> NDArray[np.uint8]:
    """(h, w, 4), out of a PNG of this frame."""
    from PIL import Image

    chunks = {**head, b"IHDR": struct.pack(">II", control.width, control.height) + head[b"IHDR"][8:], b"IDAT": pixels}
    file = _SIGNATURE + b"".join(_chunk(kind, body) for kind, body in chunks.items()) + _chunk(b"IEND", b"")
    with Image.open(io.BytesIO(file), formats=["PNG"]) as image:
        return np.asarray(image.convert("RGBA"))
