"""Names of several files: folders, wildcards, numbered sequences, and which name an output has."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from dataclasses import dataclass
from glob import glob
from pathlib import Path

from passgraph.cached import cached_property
from passgraph.errors import InputError
from passgraph.image_formats import READ_SUFFIXES

#: Pictures that `passgraph.load` does not read.
UNREAD_SUFFIXES = (".avif", ".heic", ".heif", ".dng", ".cr2", ".cr3", ".nef", ".arw")
#: Files that are read and written as videos.
VIDEO_SUFFIXES = (".mp4", ".m4v", ".mov", ".mkv", ".webm", ".avi", ".ts", ".mpg", ".mpeg", ".ogv", ".wmv", ".flv")
#: Files that are written as animated pictures, and what Pillow calls their formats.
WRITTEN_ANIMATIONS = {".gif": "GIF", ".apng": "PNG"}

_PLACE = re.compile(r"%(0?)(\d*)d|#+")
#: Digits of a frame's number; no sequence has more.
_MOST_DIGITS = 18


@dataclass(frozen=True)
class Pattern:
    """A numbered sequence: ``shot.%04d.exr`` or ``shot.####.exr``, the number in the last part of the path.

    >>> Pattern("out/shot.####.exr").path(7).as_posix(), Pattern("a%d.png").number("a12.png")
    ('out/shot.0007.exr', 12)
    """

    text: str

    @staticmethod
    def is_in(text: str) -> bool:
        """Whether a name has one place for a number."""
        return len(_PLACE.findall(os.path.basename(text))) == 1

    @cached_property
    def _parts(self) -> tuple[str, str, str, int]:
        """Folder, what is before and behind the number, and the digits that it has at least."""
        folder, name = os.path.split(self.text)
        found = _PLACE.search(name)
        if found is None:
            raise InputError(f"{self.text}: has no place for a number; write %04d or #### in the name")
        digits = len(found[0]) if found[0].startswith("#") else int(found[2] or 1) if found[1] else 1
        if digits > _MOST_DIGITS:
            raise InputError(f"{self.text}: asks for {digits} digits; expected at most {_MOST_DIGITS}")
        return folder, name[: found.start()], name[found.end() :], digits

    def path(self, number: int) -> Path:
        folder, before, behind, digits = self._parts
        return Path(folder, f"{before}{number:0{digits}d}{behind}")

    def number(self, name: str) -> int | None:
        """The number in a file's name; None where it is not of this sequence."""
        _, before, behind, digits = self._parts
        middle = name[len(before) : len(name) - len(behind)]
        if not (name.startswith(before) and name.endswith(behind) and middle.isascii() and middle.isdigit()):
            return None
        written = len(middle) == digits or (len(middle) > digits and middle[0] != "0")
        return int(middle) if written and len(middle) <= _MOST_DIGITS else None

    def files(self) -> dict[int, Path]:
        """The files that are there, by number, in order."""
        folder = self._parts[0] or "."
        try:
            names = os.listdir(folder)
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or error
            raise InputError(f"{self.text}: the folder {folder} cannot be read ({reason})") from error
        found = {number: Path(self._parts[0], name) for name in names if (number := self.number(name)) is not None}
        if not found:
            raise InputError(f"{self.text}: no file has such a name; check the folder and the digits of the number")
        return dict(sorted(found.items()))


def missing_numbers(numbers: Iterable[int]) -> str:
    """The gaps in a sequence, as "3, 7-9"; empty where it has none.

    >>> missing_numbers([1, 2, 4, 8])
    '3, 5-7'
    """
    gaps, before = list[str](), None
    for number in numbers:
        if before is not None and number > before + 1:
            gaps.append(f"{before + 1}" if number == before + 2 else f"{before + 1}-{number - 1}")
        before = number
    return ", ".join(gaps)


def in_order(paths: Iterable[Path]) -> list[Path]:
    """Sorted as people count: numbers in names by value.

    >>> [path.name for path in in_order([Path("a10.png"), Path("a9.png")])]
    ['a9.png', 'a10.png']
    """
    return sorted(paths, key=lambda path: [_key(part) for part in re.split(r"([0-9]+)", os.fspath(path))])


def _key(part: str) -> tuple[int, int, str]:
    return (1, int(part), part) if part.isascii() and part.isdigit() else (0, 0, part)


def is_picture(path: Path) -> bool:
    return path.suffix.lower() in READ_SUFFIXES


def is_video(path: Path) -> bool:
    return path.suffix.lower() in VIDEO_SUFFIXES


def is_film(path: Path) -> bool:
    """Whether an output of this name is one file of many frames: a video or an animated picture."""
    return is_video(path) or path.suffix.lower() in WRITTEN_ANIMATIONS


def folder_files(folder: Path) -> list[Path]:
    """Pictures and videos of a folder, not of those in it; hidden files are left out."""
    try:
        names = [name for name in os.listdir(folder) if not name.startswith(".")]
    except OSError as error:
        raise InputError(f"{folder}: cannot be read ({error.strerror}); check its permissions") from error
    known = [path for name in names if is_picture(path := folder / name) or is_video(path)]
    found = [
        path for path in known if path.is_file() or not path.exists()
    ]  # a link to nothing is named when it is read
    if not found:
        raise InputError(f"{folder}: has no pictures and no videos; expected files such as .png, .exr, .mp4")
    return in_order(found)


def unread_files(folder: Path) -> list[Path]:
    """Pictures of a folder in formats that are not read; none where it cannot be listed, see `folder_files`."""
    try:
        found = [path for path in folder.iterdir() if path.suffix.lower() in UNREAD_SUFFIXES and path.is_file()]
    except OSError:
        return []
    return in_order(found)


def glob_files(text: str) -> list[Path]:
    """What a wildcard finds: every file, whatever its suffix."""
    try:
        found = [path for name in glob(text, recursive=True) if (path := Path(name)).is_file()]
    except ValueError:  # a null byte
        found = []
    if not found:
        raise InputError(f"{text}: no file has such a name; check the wildcard (the folder here is {Path.cwd()})")
    return in_order(found)


def has_wildcard(text: str) -> bool:
    return any(c in text for c in "*?[") and not os.path.lexists(text)
