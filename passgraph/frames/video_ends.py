"""Whether a video file goes on to the end that its container says it has.

Decoders end without a word where a file does, and not every container says how long its pictures last; but most say how
many bytes their parts have.

Sources: ISO/IEC 14496-12 (boxes of MP4 and MOV); RFC 8794 and 9559 (EBML and Matroska, with WebM); Microsoft, "AVI RIFF
File Reference" with OpenDML's further RIFF chunks; Microsoft, "Advanced Systems Format", section 2 (ASF, WMV); Adobe,
"Flash Video File Format Specification", annex E (FLV).
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO, TypeAlias

#: Parts that are looked at; a file of more is taken as whole.
MOST_PARTS = 1 << 20
#: Elements of Matroska whose parts follow them: a segment and a cluster.
_SEGMENT, _CLUSTER = 0x18538067, 0x1F43B675
_ASF = bytes.fromhex("3026b2758e66cf11a6d900aa0062ce6c")
#: From where a part begins to where it says that it ends; None where it says nothing, and at the end of the parts.
_Step: TypeAlias = Callable[[BinaryIO, int], "int | None"]


def promised_end(path: Path) -> int | None:
    """The byte at which a file says that the part ends in which it breaks off; None of one that is whole, or says
    nothing.

    >>> promised_end(Path(__file__)) is None
    True
    """
    length = path.stat().st_size
    with path.open("rb") as stream:
        step, at = _kind(stream.read(16))
        for _ in range(MOST_PARTS):
            if step is None or at >= length:
                return None
            end = step(stream, at)
            if end is None or end > length:
                return end
            at = end
    return None


def _kind(start: bytes) -> tuple[_Step | None, int]:
    """How the parts of a file are walked, and where the first begins."""
    if start[4:8] in (b"ftyp", b"moov", b"mdat", b"wide", b"free", b"skip"):
        return _box, 0
    if start[:4] == b"\x1aE\xdf\xa3":
        return _element, 0
    if start[:4] == b"RIFF" and start[8:12] == b"AVI ":
        return _riff, 0
    if start == _ASF:
        return _object, 0
    # The header says how long it is; a tag's length is told before it and behind it.
    return (_tag, int.from_bytes(start[5:9], "big") + 4) if start[:3] == b"FLV" else (None, 0)


def _read(stream: BinaryIO, at: int, count: int) -> bytes:
    stream.seek(at)
    return stream.read(count)


def _box(stream: BinaryIO, at: int) -> int | None:
    head = _read(stream, at, 16)
    size = int.from_bytes(head[:4], "big")
    if len(head) < 8 or not head[4:8].isalnum():
        return None  # not a box: what others have put behind them
    if size == 1:
        size = int.from_bytes(head[8:16], "big")
    return at + size if size >= 8 else None  # 0: up to the end, wherever that is


def _riff(stream: BinaryIO, at: int) -> int | None:
    head = _read(stream, at, 8)
    size = int.from_bytes(head[4:8], "little")
    return at + 8 + size + size % 2 if head[:4] == b"RIFF" and 0 < size < 0xFFFFFFFF else None


def _object(stream: BinaryIO, at: int) -> int | None:
    head = _read(stream, at, 24)
    size = int.from_bytes(head[16:24], "little")
    return at + size if len(head) == 24 and size >= 24 else None


def _tag(stream: BinaryIO, at: int) -> int | None:
    head = _read(stream, at, 4)
    return at + 11 + int.from_bytes(head[1:4], "big") + 4 if head[:1] in (b"\x08", b"\x09", b"\x12") else None


def _element(stream: BinaryIO, at: int) -> int | None:
    head = _read(stream, at, 12)
    first = _width(head[0], 4)
    if first is None or len(head) <= first:
        return None
    second = _width(head[first], 8)
    if second is None:
        return None
    name, start = int.from_bytes(head[:first], "big"), at + first + second
    size = int.from_bytes(head[first : first + second], "big") & ((1 << 7 * second) - 1)
    if size == (1 << 7 * second) - 1:  # unknown: its parts come next
        return start if name in (_SEGMENT, _CLUSTER) else None
    return start + size


def _width(byte: int, most: int) -> int | None:
    """Bytes of a number whose first one begins with so many zeros, less one."""
    width = 9 - byte.bit_length()
    return width if width <= most else None
