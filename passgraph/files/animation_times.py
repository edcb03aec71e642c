"""How many frames an animated GIF, PNG or WebP file has and how long each is shown, told without its pixels.

Sources: GIF89a specification (CompuServe, 1990) with Netscape's extension for loops; PNG specification, third edition
(W3C, 2025), "Animation information"; WebP container specification (RFC 9649, section 2.7).
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

#: Files whose content may be an animation, by their suffixes.
ANIMATION_SUFFIXES = (".gif", ".png", ".apng", ".webp")
#: Browsers show a frame of no more than so long (in seconds) for longer: files say 0 where they mean "as usual".
SHORTEST, USUAL = Fraction(10, 1000), Fraction(100, 1000)
_PNG = b"\x89PNG\r\n\x1a\n"


@dataclass(frozen=True)
class Times:
    """What a file says of its frames.

    Attributes
    ----------
    seconds : how long each frame is shown
    plays : how often all of them are, 0 for without end
    said : how many frames its header promises; as many as there are where it says nothing
    whole : whether the file goes on to its end
    reach : (width, height) that frames reach, which may lie beyond the picture
    until : bytes up to the end of the last whole frame, where this is told
    """

    seconds: tuple[Fraction, ...]
    plays: int
    said: int
    whole: bool
    reach: tuple[int, int] = (0, 0)
    until: int = 0


def times_of(data: bytes) -> Times | None:
    """The times of an animation; None for any other file, and for one of a single picture.

    >>> times_of(b"GIF89a")
    """
    reading = next((read for start, read in _READERS.items() if data.startswith(start)), None)
    found = None if reading is None else reading(data)
    return found if found is not None and max(len(found.seconds), found.said) > 1 else None


def is_animated(path: Path) -> bool:
    """Whether a file is an animation of several frames; False of what cannot be read."""
    if path.suffix.lower() not in ANIMATION_SUFFIXES or not path.is_file():
        return False
    try:
        with path.open("rb") as stream:
            start = stream.read(_LOOKED_AT)
            # A PNG says so before its pixels, a WebP in its first chunk; of a GIF the frames are counted.
            if start.startswith(_PNG) and b"acTL" not in start:
                return False
            if start.startswith(b"RIFF") and start[12:16] != b"VP8X":
                return False
            return times_of(start + stream.read()) is not None
    except OSError:
        return False


#: Bytes in which a PNG names its chunks before the pixels, but for embedded colour profiles of unusual size.
_LOOKED_AT = 1 << 16


def _shown(seconds: Fraction) -> Fraction:
    return seconds if seconds > SHORTEST else USUAL


def _of_gif(data: bytes) -> Times:
    seconds: list[Fraction] = []
    delay, plays, whole, at, reach = Fraction(0), 1, False, 13, (0, 0)
    try:
        at += table_bytes(data[10])
        while not whole:
            kind, at = data[at], at + 1
            if kind == 0x3B:
                whole = True
            elif kind == 0x2C:  # a picture: its place, its colours, its pixels
                left, top, width, height = struct.unpack_from("<HHHH", data, at)
                reach = max(reach[0], left + width), max(reach[1], top + height)
                at = behind(data, at + 9 + table_bytes(data[at + 8]) + 1)
                seconds.append(_shown(delay))
                delay = Fraction(0)
            elif kind == 0x21:
                if data[at] == 0xF9:
                    delay = Fraction(int.from_bytes(data[at + 3 : at + 5], "little"), 100)
                elif data[at + 1 : at + 15] == b"\x0bNETSCAPE2.0\x03\x01":
                    again = struct.unpack_from("<H", data, at + 15)[0]
                    plays = again + 1 if again else 0
                at = behind(data, at + 1)
            else:
                break
    except (IndexError, struct.error):
        pass  # the file ends before its end
    return Times(tuple(seconds), plays, len(seconds), whole, reach=reach)


def table_bytes(packed: int) -> int:
    """Bytes of a table of colours."""
    return 3 << ((packed & 7) + 1) if packed & 0x80 else 0


def behind(data: bytes, at: int) -> int:
    """Where a chain of blocks, each with its length before it, has ended; IndexError where the file ends before."""
    while length := data[at]:
        at += length + 1
    return at + 1


def _of_png(data: bytes) -> Times | None:
    seconds: list[Fraction] = []
    at, plays, said, whole = len(_PNG), 0, 0, False
    while at + 12 <= len(data) and not whole:
        length, kind = struct.unpack_from(">I4s", data, at)
        is_there = at + 12 + length <= len(data)
        if kind == b"acTL" and length == 8 and is_there:
            said, plays = struct.unpack_from(">II", data, at + 8)
        elif kind == b"fcTL" and length == 26 and is_there:
            number, of = struct.unpack_from(">HH", data, at + 28)
            seconds.append(_shown(Fraction(number, of or 100)))
        whole = kind == b"IEND"
        at += length + 12
    return Times(tuple(seconds), plays, said, whole) if said else None


def _of_webp(data: bytes) -> Times | None:
    if data[8:16] != b"WEBPVP8X" or len(data) < 21 or not data[20] & 2:
        return None
    seconds: list[Fraction] = []
    end = struct.unpack_from("<I", data, 4)[0] + 8
    at, plays, until = 12, 0, 0
    while at + 8 <= len(data):
        kind, length = struct.unpack_from("<4sI", data, at)
        if kind == b"ANIM" and at + 14 <= len(data):
            plays = struct.unpack_from("<H", data, at + 12)[0]
        elif kind == b"ANMF" and at + 8 + length <= len(data) and length >= 16:
            seconds.append(_shown(Fraction(int.from_bytes(data[at + 20 : at + 23], "little"), 1000)))
            until = at + 8 + length + length % 2
        at += 8 + length + length % 2
    return Times(tuple(seconds), plays, len(seconds), end <= len(data), until=until)


_READERS: dict[bytes, Callable[[bytes], Times | None]] = {
    b"GIF87a": _of_gif, b"GIF89a": _of_gif, _PNG: _of_png, b"RIFF": _of_webp
}  # fmt: skip
