"""File names of sequences: folders, wildcards and numbered sequences."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from glob import glob
from pathlib import Path

from passgraph.cached import cached_property
from passgraph.errors import InputError, reason
from passgraph.image_formats import READ_SUFFIXES
from passgraph.records import dataclass

#: Suffixes of picture files that `passgraph.load` does not read.
UNREAD_SUFFIXES = (".avif", ".heic", ".heif", ".dng", ".cr2", ".cr3", ".nef", ".arw")
#: Suffixes of files that are read and written as videos.
VIDEO_SUFFIXES = (
    ".mp4", ".m4v", ".mov", ".mkv", ".webm", ".avi", ".ts", ".mpg", ".mpeg", ".ogv", ".wmv", ".flv", ".y4m"
)  # fmt: skip
#: Suffixes of files that are written as animations, with Pillow's names of the formats.
WRITTEN_ANIMATIONS = {".gif": "GIF", ".apng": "PNG"}

_PLACE = re.compile(r"%(0?)(\d*)d|#+")
#: Most digits of a frame's number.
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
        """Return True if the last part of a path has exactly one placeholder for a number."""
        return len(_PLACE.findall(os.path.basename(text))) == 1

    @cached_property
    def _parts(self) -> tuple[str, str, str, int]:
        """The folder, the text before and after the number, and the number's least count of digits."""
        folder, name = os.path.split(self.text)
        match = _PLACE.search(name)
        if match is None:
            raise InputError(f"{self.text}: has no place for a number; write %04d or #### in the name")
        digits = len(match[0]) if match[0].startswith("#") else int(match[2] or 1) if match[1] else 1
        if digits > _MOST_DIGITS:
            raise InputError(f"{self.text}: asks for {digits} digits; expected at most {_MOST_DIGITS}")
        return folder, name[: match.start()], name[match.end() :], digits

    def path(self, number: int) -> Path:
        folder, before, behind, digits = self._parts
        return Path(folder, f"{before}{number:0{digits}d}{behind}")

    def number(self, name: str) -> int | None:
        """Return the number in a file's name; None if the name is not of this sequence."""
        _, before, behind, digits = self._parts
        middle = name[len(before) : len(name) - len(behind)]
        figures = middle.removeprefix("-")
        if not (name.startswith(before) and name.endswith(behind) and figures.isascii() and figures.isdigit()):
            return None
        # The width counts the sign, as of printf (C17, 7.21.6.1), or it does not: -001 and -0001 are frame -1 of ####.
        written = digits in (len(middle), len(figures)) or (len(figures) > digits and figures[0] != "0")
        is_negative_zero = figures != middle and not figures.strip("0")
        return int(middle) if written and not is_negative_zero and len(figures) <= _MOST_DIGITS else None

    def files(self) -> dict[int, Path]:
        """Return the files that exist, by number, in order."""
        folder = self._parts[0] or "."
        try:
            names = os.listdir(folder)
        except (OSError, ValueError) as error:
            raise InputError(f"{self.text}: the folder {folder} cannot be read ({reason(error)})") from error
        files = {number: Path(self._parts[0], name) for name in names if (number := self.number(name)) is not None}
        if not files:
            raise InputError(f"{self.text}: no file has such a name; check the folder and the digits of the number")
        return dict(sorted(files.items()))


def missing_numbers(numbers: Iterable[int]) -> str:
    """Return the gaps in a sequence, as "3, 7-9"; empty if it has none.

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
    """Return paths in natural order: numbers in names sort by value.

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
    """Return True if an output of this name is one file of many frames: a video or an animation."""
    return is_video(path) or path.suffix.lower() in WRITTEN_ANIMATIONS


def folder_files(folder: Path) -> list[Path]:
    """Return the pictures and videos in a folder, without subfolders and hidden files."""
    try:
        names = [name for name in os.listdir(folder) if not name.startswith(".")]
    except OSError as error:
        raise InputError(f"{folder}: cannot be read ({reason(error)}); check its permissions") from error
    media = [path for name in names if is_picture(path := folder / name) or is_video(path)]
    # A broken link stays, so that reading it reports its name.
    files = [path for path in media if path.is_file() or not path.exists()]
    if not files:
        raise InputError(f"{folder}: has no pictures and no videos; expected files such as .png, .exr, .mp4")
    return in_order(files)


def unread_files(folder: Path) -> list[Path]:
    """Return the pictures in a folder whose formats are not read; none if it cannot be listed, see `folder_files`."""
    try:
        files = [path for path in folder.iterdir() if path.suffix.lower() in UNREAD_SUFFIXES and path.is_file()]
    except OSError:
        return []
    return in_order(files)


def glob_files(text: str) -> list[Path]:
    """Return the files that match a wildcard, of any suffix, in natural order."""
    try:
        files = [path for name in glob(text, recursive=True) if (path := Path(name)).is_file()]
    except ValueError:  # a null byte
        files = []
    if not files:
        raise InputError(f"{text}: no file has such a name; check the wildcard (the folder here is {Path.cwd()})")
    return in_order(files)


def has_wildcard(text: str) -> bool:
    return any(c in text for c in "*?[") and not os.path.lexists(text)
