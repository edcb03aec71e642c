"""TIFF files made by hand (TIFF 6.0), uncompressed: what they hold does not depend on any library."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any

import numpy as np

WHITE_IS_ZERO, BLACK_IS_ZERO, RGB, PALETTE, CMYK = 0, 1, 2, 3, 5
UNSPECIFIED, ASSOCIATED, UNASSOCIATED = 0, 1, 2


def tiff(
    values: np.ndarray[Any, Any],
    bits: int,
    photometric: int,
    *,
    planar: bool = False,
    tile: int = 0,
    rows: int = 0,
    extra: Sequence[int] = (),
    palette: Sequence[int] = (),
    order: str = "<",
) -> bytes:
    """A file of (height, width, samples): integers below 2 to the power of `bits`, or floats; in tiles or strips."""
    height, width, samples = values.shape
    planes = [values[..., [sample]] for sample in range(samples)] if planar else [values]
    rows = rows or height
    segments = [
        _packed(_padded(plane[y : y + (tile or rows), x : x + (tile or width)], tile), bits, order)
        for plane in planes
        for y in range(0, height, tile or rows)
        for x in range(0, width, tile or width)
    ]
    places = 8 + np.cumsum([0, *map(len, segments)])
    sizes = list(map(len, segments))
    tags: dict[int, tuple[str, Sequence[int]]] = {
        256: ("I", [width]), 257: ("I", [height]), 258: ("H", [bits] * samples), 259: ("H", [1]),
        262: ("H", [photometric]), 277: ("H", [samples]), 284: ("H", [1 + planar]),
        339: ("H", [3 if values.dtype.kind == "f" else 1] * samples),
    }  # fmt: skip
    if extra:
        tags[338] = "H", extra
    if palette:
        tags[320] = "H", palette
    if tile:
        tags |= {322: ("I", [tile]), 323: ("I", [tile]), 324: ("I", places[:-1].tolist()), 325: ("I", sizes)}
    else:
        tags |= {273: ("I", places[:-1].tolist()), 278: ("I", [rows]), 279: ("I", sizes)}
    directory, behind = struct.pack(f"{order}H", len(tags)), b""
    end = int(places[-1]) + 2 + 12 * len(tags) + 4
    for tag, (code, numbers) in sorted(tags.items()):
        packed = struct.pack(f"{order}{len(numbers)}{code}", *numbers)
        if len(packed) > 4:
            place = struct.pack(f"{order}I", end + len(behind))
            behind += packed
        else:
            place = packed.ljust(4, b"\0")
        directory += struct.pack(f"{order}HHI", tag, 3 if code == "H" else 4, len(numbers)) + place
    head = (b"II*\0" if order == "<" else b"MM\0*") + struct.pack(f"{order}I", int(places[-1]))
    return head + b"".join(segments) + directory + bytes(4) + behind


def _padded(block: np.ndarray[Any, Any], tile: int) -> np.ndarray[Any, Any]:
    if not tile:
        return block
    full = np.zeros((tile, tile, block.shape[2]), block.dtype)
    full[: block.shape[0], : block.shape[1]] = block
    return full


def _packed(block: np.ndarray[Any, Any], bits: int, order: str) -> bytes:
    """Rows of samples, each row from a byte's first bit; of an even size altogether."""
    if bits % 8 == 0:
        data = block.astype(f"{order}{block.dtype.kind}{bits // 8}").tobytes()
    else:
        flat = block.reshape(len(block), -1, 1) >> np.arange(bits - 1, -1, -1)
        data = np.packbits((flat & 1).astype(np.uint8).reshape(len(block), -1), axis=1).tobytes()
    return data + bytes(len(data) % 2)
