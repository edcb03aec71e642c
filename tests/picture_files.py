"""Picture files made by hand, and how a refusal of one is looked at."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from passgraph.errors import InputError
from passgraph.files.made import NAME as RECORD

_rng = np.random.default_rng(1)
#: Random pictures (7, 5, channels) of bytes, by how many channels they have.
bytes_of = {channels: _rng.integers(0, 256, (7, 5, channels), dtype=np.uint8) for channels in (1, 2, 3, 4)}


def refused(expected: str, call: Any, *arguments: Any, **options: Any) -> str:
    """The one line of the InputError that the call raises, which must match `expected`."""
    with pytest.raises(InputError, match=expected) as caught:
        call(*arguments, **options)
    line = str(caught.value)
    assert "\n" not in line
    return line


def names_in(folder: str | Path = ".") -> list[str]:
    """The names of a folder's files in order, without the record of what made them."""
    return sorted(path.name for path in Path(folder).iterdir() if path.name != RECORD)


def png(width: int, height: int, depth: int, colour: int, rows: bytes, extra: bytes = b"") -> bytes:
    """A PNG made by hand: rows with their filter bytes."""

    def chunk(name: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    head = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + head + extra + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def png_16(values: np.ndarray[Any, Any], colour: int, extra: bytes = b"") -> bytes:
    height, width, _ = values.shape
    rows = b"".join(b"\0" + row.astype(">u2").tobytes() for row in values)
    return png(width, height, 16, colour, rows, extra)
