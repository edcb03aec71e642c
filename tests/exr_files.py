"""OpenEXR files made by hand (file layout of OpenEXR 2), uncompressed: what the package OpenEXR does not write."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np

Channels = dict[str, np.ndarray[Any, Any]]


def scanlines(channels: Channels, sampling: dict[str, int]) -> bytes:
    """A file of float32 channels, some with a sample for each `sampling` pixels across and down."""
    height, width = next(array.shape for name, array in channels.items() if name not in sampling)
    blocks = []
    for y in range(height):
        steps = {name: sampling.get(name, 1) for name in sorted(channels)}
        rows = [channels[name][y // step].tobytes() for name, step in steps.items() if y % step == 0]
        data = b"".join(rows)
        blocks.append(struct.pack("<ii", y, len(data)) + data)
    return _file(2, _head(channels, (width, height), sampling), blocks)


def mip_mapped_cube(channels: Channels, tile: int) -> bytes:
    """A cube map, six faces one below the other, of float32 channels, with its smaller levels, which are zeros."""
    height, width = next(iter(channels.values())).shape
    blocks, level, (h, w) = list[bytes](), 0, (height, width)
    while True:
        for row in range(-(-h // tile)):
            for column in range(-(-w // tile)):
                y, x = slice(row * tile, min(row * tile + tile, h)), slice(column * tile, min(column * tile + tile, w))
                arrays = [array[:h, :w] * (level == 0) for _, array in sorted(channels.items())]
                lines = range(y.stop - y.start)
                data = b"".join(array[y, x][line].tobytes() for line in lines for array in arrays)
                blocks.append(struct.pack("<5i", column, row, level, level, len(data)) + data)
        if w == h == 1:
            break
        level, h, w = level + 1, max(1, h // 2), max(1, w // 2)
    head = _head(channels, (width, height), {})
    head += _attribute("tiles", "tiledesc", struct.pack("<IIB", tile, tile, 1)) + _attribute("envmap", "envmap", b"\1")
    return _file(0x202, head, blocks)


def _attribute(name: str, kind: str, data: bytes) -> bytes:
    return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(data)) + data


def _head(channels: Channels, size: tuple[int, int], sampling: dict[str, int]) -> bytes:
    listed = b"".join(
        name.encode() + b"\0" + struct.pack("<iB3xii", 2, 0, *[sampling.get(name, 1)] * 2) for name in sorted(channels)
    )
    window = struct.pack("<4i", 0, 0, size[0] - 1, size[1] - 1)
    return b"".join(
        _attribute(*entry)
        for entry in (
            ("channels", "chlist", listed + b"\0"), ("compression", "compression", b"\0"),
            ("dataWindow", "box2i", window), ("displayWindow", "box2i", window), ("lineOrder", "lineOrder", b"\0"),
            ("pixelAspectRatio", "float", struct.pack("<f", 1)), ("screenWindowCenter", "v2f", bytes(8)),
            ("screenWindowWidth", "float", struct.pack("<f", 1)),
        )
    )  # fmt: skip


def _file(version: int, head: bytes, blocks: list[bytes]) -> bytes:
    start = b"\x76\x2f\x31\x01" + struct.pack("<i", version) + head + b"\0"
    places = len(start) + 8 * len(blocks) + np.cumsum([0, *map(len, blocks)])[:-1]
    return start + struct.pack(f"<{len(blocks)}Q", *places.tolist()) + b"".join(blocks)
