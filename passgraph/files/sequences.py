"""Frames from and to picture files and arrays, one or many."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from passgraph import arguments
from passgraph.cached import cached_property
from passgraph.errors import InputError
from passgraph.files.frame import Frame, Sink, Source, Stored
from passgraph.files.names import Pattern
from passgraph.image_formats import WRITABLE, Metadata
from passgraph.pictures import (
    check_holds_bits,
    fewer_bits,
    format_of_suffix,
    is_deep,
    load_stored,
    metadata_of,
    save,
    split_layer,
)

#: Most frames without pictures.
MOST_NUMBERS = 1 << 31


class Pictures:
    """Frames from picture files, of any formats that `passgraph.load` reads.

    ``paths`` are files in order, or a mapping from the frame's number to its file, as `Pattern.files` gives. Each may
    name a layer of an OpenEXR file: ``shot.exr:diffuse``.

    >>> [frame.number for frame in Pictures(["a.png", "b.png"])]
    [1, 2]
    """

    def __init__(self, paths: Iterable[str | os.PathLike[str]] | Mapping[int, Path], name: str | None = None) -> None:
        numbered = paths if isinstance(paths, Mapping) else dict(enumerate(map(Path, paths), 1))
        self.paths: dict[int, Path] = dict(numbered)
        self._name = name

    @property
    def name(self) -> str:
        if self._name is not None:
            return self._name
        paths = list(self.paths.values())
        return os.fspath(paths[0]) if len(paths) == 1 else f"{len(paths)} pictures"

    @property
    def count(self) -> int:
        return len(self.paths)

    @cached_property
    def has_alpha(self) -> bool:
        """False if no file has, by its header."""
        return not all(metadata_of(path).opaque for path in dict.fromkeys(self.paths.values()))

    def __iter__(self) -> Iterator[Frame]:
        for number, path in self.paths.items():
            yield Frame(number, os.fspath(path), lambda path=path: load_stored(path))  # type: ignore[misc]


class Repeated(Pictures):
    """One picture file as several frames: it is read once.

    >>> [frame.name for frame in Repeated("a.png", 3)]
    ['a.png', 'a.png', 'a.png']
    """

    def __init__(self, path: str | os.PathLike[str], count: int) -> None:
        whole = arguments.whole_number(count, "frames: count", 1, MOST_NUMBERS, InputError)
        super().__init__(dict.fromkeys(range(1, whole + 1), Path(path)), os.fspath(path))

    @cached_property
    def _picture(self) -> Stored:
        return load_stored(self.paths[1])

    def __iter__(self) -> Iterator[Frame]:
        for number in self.paths:
            yield Frame(number, self.name, lambda: self._picture)


class ToPictures(Sink):
    """Each frame to a picture file of its own, which is written whole or not at all.

    Parameters
    ----------
    paths : the files by the frames' numbers, or a `Pattern`
    bits : 8, or 16 for .png and .tif; left out, those of the source: 16 where its picture file has 16, or its video
        more than 8.  Where the format holds 8, a warning says so.

    Formats of whole numbers hold results rounded; .exr and .npy hold them as they are.  Of a source that is `Pictures`
    each keeps its color profile, resolution and EXIF.
    """

    whole_when_prepared = True

    def __init__(self, paths: Mapping[int, Path] | Pattern, bits: int | None = None) -> None:
        if bits not in (None, 8, 16):
            raise InputError(f"bits of pictures are 8 or 16, got {arguments.shown(bits)}")
        self.paths, self.bits = paths, bits
        self._inputs: Mapping[int, Path] = {}
        self._deep = False

    @property
    def name(self) -> str:
        if isinstance(self.paths, Pattern):
            return self.paths.text
        folders = {path.parent for path in self.paths.values()}
        return os.fspath(next(iter(folders))) if len(folders) == 1 else f"{len(self.paths)} pictures"

    def path(self, frame: Frame) -> Path:
        return self.paths.path(frame.number) if isinstance(self.paths, Pattern) else self.paths[frame.number]

    def begin(self, source: Source) -> None:
        self._inputs = source.paths if isinstance(source, Pictures) else {}
        self._deep = getattr(source, "deep", False)
        if loss := self.lost_bits(source):
            warnings.warn(loss, stacklevel=2)
        for path in self._named:
            format_of_suffix(path)
            if self.bits == 16:
                check_holds_bits(path, 16)

    @property
    def _named(self) -> list[Path]:
        """Files to be, or one of a pattern's."""
        return [self.paths.path(1)] if isinstance(self.paths, Pattern) else list(self.paths.values())

    def in_bytes(self, source: Source) -> bool:
        held = [format_of_suffix(path).dtypes for path in self._named]
        if self.bits == 16 or any(dtypes[0] != "uint8" for dtypes in held):
            return False
        return not (self.bits is None and any("uint16" in dtypes for dtypes in held) and _deep(source))

    def lost_bits(self, source: Source) -> str:
        """What to say where a source has 16 bits a channel and a format here holds 8; empty where none is lost."""
        for path in self._named if self.bits is None else []:
            kind = format_of_suffix(path)
            if kind.dtypes == ("uint8",) and (name := _deep(source)):
                return f"{path}: {fewer_bits(kind)} ({name})"
        return ""

    def notes(self, frame: Frame) -> Metadata | None:
        """What a frame's output keeps of the picture file that it is made of."""
        made_of = self._inputs.get(frame.number)
        return None if made_of is None else metadata_of(made_of)

    def holds(self, frame: Frame) -> bool:
        given = self._inputs.get(frame.number)
        return is_made(self.path(frame), [] if given is None else [given])

    def stores(self, frame: Frame, size: tuple[int, int]) -> np.dtype[Any]:
        kind = format_of_suffix(self.path(frame))
        if kind.is_float:
            return np.dtype(np.float32)
        bits = self.bits or bits_of(self.path(frame), self._inputs.get(frame.number), self._deep)
        return np.dtype(np.uint16 if bits == 16 else kind.dtypes[0])

    def prepare(self, frame: Frame, picture: Stored) -> None:
        path = self.path(frame)
        bits = self.bits if format_of_suffix(path).is_float else None
        save(path, picture, like=self.notes(frame), bits=bits)


def bits_of(output: Path, made_of: Path | None, deep: bool = False) -> int:
    """Bits a channel of an output where nothing is said: those of what it is made of, if the format has them."""
    kind = WRITABLE.get(output.suffix.lower())
    if kind is None or "uint16" not in kind.dtypes:
        return 8
    if kind.dtypes[0] == "uint16":
        return 16
    return 16 if deep or (made_of is not None and is_deep(made_of)) else 8


def _deep(source: Source) -> str:
    """The name of a source's first picture, or of its video, with more than 8 bits a channel; empty where none has."""
    if isinstance(source, Pictures):
        return next((os.fspath(path) for path in source.paths.values() if is_deep(path)), "")
    return source.name if getattr(source, "deep", False) else ""


def is_made(output: Path, inputs: Iterable[Path]) -> bool:
    """Whether an output is there, no older than its inputs: outputs have their names only when they are whole."""
    try:
        made = output.stat()
        return made.st_size > 0 and all(made.st_mtime_ns >= split_layer(path)[0].stat().st_mtime_ns for path in inputs)
    except OSError:
        return False


class Still:
    """One picture, of a file or an array, that goes with every frame of another source."""

    #: Iterating never ends: others decide how many frames there are.
    endless = True
    count = None

    def __init__(self, picture: str | os.PathLike[str] | Stored) -> None:
        is_array = isinstance(picture, np.ndarray)
        self.name = "a still picture" if is_array else os.fspath(picture)  # type: ignore[arg-type]
        self._picture: Stored = picture if is_array else load_stored(Path(picture))  # type: ignore[assignment, arg-type]

    def __iter__(self) -> Iterator[Frame]:
        for number in count(1):
            yield Frame.of(number, self.name, self._picture)


class Held:
    """Frames of a source that goes with another one: where it ends first, its last frame is repeated.

    ``tell`` is called with a line that says so, once.
    """

    endless = True

    def __init__(self, source: Source, tell: Callable[[str], object]) -> None:
        self.source, self.name, self.count, self._tell = source, source.name, source.count, tell

    def __iter__(self) -> Iterator[Frame]:
        last, number = None, 0
        for last in self.source:
            number += 1
            yield last
        if last is None:
            raise InputError(f"{self.name}: has no frames; expected one or more")
        held = Frame(last.number, last.name, cache(last.read), last.metadata)
        self._tell(f"{self.name}: ends after {number} frames; its last one goes with those that follow")
        while True:
            yield held


class Arrays:
    """Frames from arrays, (h, w) or (h, w, 1 to 4), counted from 1.

    >>> next(iter(Arrays([np.zeros((2, 3, 4), np.float32)]))).name
    'array 1'
    """

    name = "arrays"

    def __init__(self, pictures: Sequence[Stored]) -> None:
        self.pictures = pictures

    @property
    def count(self) -> int:
        return len(self.pictures)

    def __iter__(self) -> Iterator[Frame]:
        for number, picture in enumerate(self.pictures, 1):
            yield Frame.of(number, f"array {number}", picture)


class Numbers:
    """Frames that bring no pictures, counted from 1, for programs that take none: what changes are their values.

    >>> [frame.number for frame in Numbers(3)]
    [1, 2, 3]
    """

    name = "frames"

    has_alpha = False

    def __init__(self, count: int) -> None:
        self.count = arguments.whole_number(count, "frames: count", 1, MOST_NUMBERS, InputError)

    def __iter__(self) -> Iterator[Frame]:
        for number in range(1, self.count + 1):
            yield Frame(number, f"frame {number}", _nothing)


def _nothing() -> Stored:
    raise InputError("frames: a program that takes pictures got a source without any; give one such as Pictures([...])")


class ToArrays(Sink):
    """Frames to a list of float32 arrays, ``pictures``."""

    def __init__(self) -> None:
        self.pictures: list[Stored] = []

    def take(self, frame: Frame, prepared: Any) -> None:
        self.pictures.append(prepared)
