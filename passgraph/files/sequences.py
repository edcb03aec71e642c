"""Sources and sinks of picture files and arrays."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from passgraph import arguments
from passgraph.cached import cached_property
from passgraph.color_tags import ColorSpace, Recoded
from passgraph.errors import InputError
from passgraph.files.digests import digest, file_state
from passgraph.files.frame import Frame, Sink, Source, Stored
from passgraph.files.names import Pattern
from passgraph.image_formats import WRITABLE, Metadata
from passgraph.pictures import (
    check_holds_bits,
    fewer_bits,
    fits_layers,
    format_of_suffix,
    in_layer,
    is_deep,
    is_exr,
    load_stored,
    metadata_of,
    save,
)

#: Most frames of a source without files.
MOST_NUMBERS = 1 << 31


class Pictures:
    """A source that reads picture files, in any format that `passgraph.load` reads.

    ``paths`` are files in order, or a mapping from the frame's number to its file, as `Pattern.files` returns. A path
    may name a layer of an OpenEXR file: ``shot.exr:diffuse``. ``overscan`` is as for `passgraph.load`.

    >>> [frame.number for frame in Pictures(["a.png", "b.png"])]
    [1, 2]
    """

    def __init__(
        self,
        paths: Iterable[str | os.PathLike[str]] | Mapping[int, Path],
        name: str | None = None,
        *,
        overscan: bool = False,
    ) -> None:
        numbered = paths if isinstance(paths, Mapping) else dict(enumerate(map(Path, paths), 1))
        self.paths: dict[int, Path] = dict(numbered)
        self._name, self.overscan = name, overscan

    @property
    def name(self) -> str:
        if self._name is not None:
            return self._name
        paths = list(self.paths.values())
        return os.fspath(paths[0]) if len(paths) == 1 else f"{len(paths)} pictures"

    @property
    def count(self) -> int:
        return len(self.paths)

    @property
    def first(self) -> int:
        """Return the number of the first frame; other sources count from 1."""
        return min(self.paths)

    @cached_property
    def has_alpha(self) -> bool:
        """False if no file has alpha, by its header."""
        return not all(metadata_of(path).opaque for path in dict.fromkeys(self.paths.values()))

    def __iter__(self) -> Iterator[Frame]:
        load = partial(load_stored, overscan=self.overscan)
        for number, path in self.paths.items():
            light = partial(load, path, linear=True)
            state = partial(file_state, path)
            yield Frame(number, os.fspath(path), partial(load, path), read_light=light, state=state)


class Repeated(Pictures):
    """A source that repeats one picture file as several frames, and reads it once.

    >>> [frame.name for frame in Repeated("a.png", 3)]
    ['a.png', 'a.png', 'a.png']
    """

    def __init__(self, path: str | os.PathLike[str], count: int) -> None:
        frames = arguments.whole_number(count, "frames: count", 1, MOST_NUMBERS, InputError)
        super().__init__(dict.fromkeys(range(1, frames + 1), Path(path)), os.fspath(path))

    def __iter__(self) -> Iterator[Frame]:
        read = cache(partial(load_stored, overscan=self.overscan))
        light = cache(partial(load_stored, overscan=self.overscan, linear=True))
        for number, path in self.paths.items():
            yield Frame(
                number, self.name, partial(read, path), read_light=partial(light, path), state=partial(file_state, path)
            )


class ToPictures(Sink):
    """A sink that writes each frame to its own picture file, atomically.

    Parameters
    ----------
    paths : the files by the frames' numbers, or a `Pattern`
    bits : 8, or 16 for .png and .tif; 16 or 32 for .exr. By default as the source: 16 if its picture file has 16, or
        its video more than 8, with a warning if the format holds only 8.
    color : the color space of the results, as for `passgraph.save`; by default the source's color tags are kept
    keep_layers : keep the other layers and parts of a frame that is an OpenEXR file, as for `passgraph.save`
    layer : the layer that results become in .exr files

    Integer formats hold rounded results; .exr and .npy hold the floats. Frames of `Pictures` keep their color tags,
    resolution and EXIF.
    """

    whole_when_prepared = True

    def __init__(
        self,
        paths: Mapping[int, Path] | Pattern,
        bits: int | None = None,
        color: ColorSpace | Recoded | str | None = None,
        *,
        keep_layers: bool = False,
        layer: str | None = None,
    ) -> None:
        if bits not in (None, 8, 16, 32):
            raise InputError(f"bits of pictures are 8 or 16, and 32 of floats, got {arguments.shown(bits)}")
        self.paths, self.bits = paths, bits
        self.color = ColorSpace(color, color) if isinstance(color, str) else color
        self.keep_layers, self.layer = keep_layers, layer
        #: Outputs without the layers of their source, since they have another size.
        self.without_layers: list[Path] = []
        self._inputs: Mapping[int, Path] = {}
        self._deep = False
        self._source: Source | None = None

    @property
    def name(self) -> str:
        if isinstance(self.paths, Pattern):
            return self.paths.text
        folders = {path.parent for path in self.paths.values()}
        return os.fspath(next(iter(folders))) if len(folders) == 1 else f"{len(self.paths)} pictures"

    def file(self, frame: Frame) -> Path:
        return self.paths.path(frame.number) if isinstance(self.paths, Pattern) else self.paths[frame.number]

    def begin(self, source: Source) -> None:
        self._inputs = source.paths if isinstance(source, Pictures) else {}
        self._deep = getattr(source, "deep", False)
        self._source = source
        if loss := self.lost_bits(source):
            warnings.warn(loss, stacklevel=2)
        for path in self._named:
            format_of_suffix(path)
            if self.bits is not None and self.bits > 8:
                check_holds_bits(path, self.bits)

    @property
    def _named(self) -> list[Path]:
        """The output files; of a pattern only one."""
        return [self.paths.path(1)] if isinstance(self.paths, Pattern) else list(self.paths.values())

    def in_bytes(self, source: Source) -> bool:
        stored_types = [format_of_suffix(path).dtypes for path in self._named]
        if self.bits == 16 or any(dtypes[0] != "uint8" for dtypes in stored_types):
            return False
        return not (self.bits is None and any("uint16" in dtypes for dtypes in stored_types) and _deep(source))

    def lost_bits(self, source: Source) -> str:
        """Return a warning if the source has 16 bits a channel and an output format holds 8; else empty."""
        for path in self._named if self.bits is None else []:
            kind = format_of_suffix(path)
            if kind.dtypes == ("uint8",) and (name := _deep(source)):
                return f"{path}: {fewer_bits(kind)} ({name})"
        return ""

    def notes(self, frame: Frame) -> Metadata | None:
        """Return the metadata that a frame's output keeps of its source file."""
        return result_metadata(frame, self._source, self.color)

    def stored_as(self) -> dict[str, Any]:
        layers = {"layer": self.layer, "keep_layers": self.keep_layers}
        return {"bits": self.bits, "deep": self._deep, "color": repr(self.color), **layers}

    def stores(self, frame: Frame, size: tuple[int, int]) -> np.dtype[Any]:
        kind = format_of_suffix(self.file(frame))
        if kind.is_float:
            return np.dtype(np.float32)
        bits = self.bits or bits_of(self.file(frame), self._inputs.get(frame.number), self._deep)
        return np.dtype(np.uint16 if bits == 16 else kind.dtypes[0])

    def prepare(self, frame: Frame, picture: Stored) -> None:
        path, settings = self.file(frame), self.settings(frame)
        if settings["layers_of"] is not None and not fits_layers(picture, settings["layers_of"]):
            settings["layers_of"] = None
            self.without_layers.append(path)
        save(in_layer(path, self.layer), picture, **settings)

    def settings(self, frame: Frame) -> dict[str, Any]:
        """Return the further arguments of `passgraph.save` for a frame."""
        path = self.file(frame)
        bits = self.bits if format_of_suffix(path).is_float else None
        return {"like": self.notes(frame), "bits": bits, "layers_of": self._layers_of(path, frame.number)}

    def _layers_of(self, path: Path, number: int) -> Path | None:
        source = self._inputs.get(number) if self.keep_layers else None
        return source if source is not None and is_exr(path) and is_exr(source) else None


def result_metadata(frame: Frame, source: Source | None, color: ColorSpace | Recoded | None) -> Metadata | None:
    """Return the metadata of a picture made of a source's frame, with the tags of its own color space."""
    path = source.paths.get(frame.number) if isinstance(source, Pictures) else None
    if path is not None:
        kept: Metadata | None = metadata_of(path)
    elif frame.described is not None:
        kept = frame.described()
    else:
        kept = getattr(source, "picture_metadata", None)
    return kept if color is None else (kept or Metadata()).in_space(color)


def source_metadata(source: Source) -> Metadata:
    """Return the metadata of a source's frames, of its first picture file where each has its own."""
    if isinstance(source, Pictures):
        return metadata_of(next(iter(source.paths.values()))) if source.paths else Metadata()
    return getattr(source, "picture_metadata", None) or Metadata()


def bits_of(output: Path, made_of: Path | None, deep: bool = False) -> int:
    """Return an output's default bits a channel: those of its source, if the format has them."""
    kind = WRITABLE.get(output.suffix.lower())
    if kind is None or "uint16" not in kind.dtypes:
        return 8
    if kind.dtypes[0] == "uint16":
        return 16
    return 16 if deep or (made_of is not None and is_deep(made_of)) else 8


def _deep(source: Source) -> str:
    """Return the name of a source's first picture, or of its video, with more than 8 bits a channel; else empty."""
    if isinstance(source, Pictures):
        return next((os.fspath(path) for path in source.paths.values() if is_deep(path)), "")
    return source.name if getattr(source, "deep", False) else ""


class Still:
    """A picture, a file or an array, that is repeated for every frame of another source."""

    #: Iterating never ends; other sources set the number of frames.
    endless = True
    count = None

    def __init__(self, picture: str | os.PathLike[str] | Stored, *, overscan: bool = False) -> None:
        self.name = "a still picture" if isinstance(picture, np.ndarray) else os.fspath(picture)
        self._state = cache(lambda: digest(self._picture))
        if isinstance(picture, np.ndarray):
            self._picture: Stored = picture
            self._light: Callable[[], Stored] = lambda: self._picture
            return
        load = partial(load_stored, Path(picture), overscan=overscan)
        self._picture, self._light = load(), cache(partial(load, linear=True))

    def __iter__(self) -> Iterator[Frame]:
        for number in count(1):
            yield Frame(number, self.name, lambda: self._picture, read_light=self._light, state=self._state)


class Held:
    """A source whose last frame is repeated if it ends before another source.

    ``tell`` is then called once, with a message.
    """

    endless = True

    def __init__(self, source: Source, tell: Callable[[str], object]) -> None:
        self.source, self.name, self.count, self._tell = source, source.name, source.count, tell

    def __iter__(self) -> Iterator[Frame]:
        return self.held(iter(self.source), self._tell)

    def held(self, frames: Iterator[Frame], tell: Callable[[str], object]) -> Iterator[Frame]:
        """Yield frames, then the last one of them again and again."""
        last, number = None, 0
        for last in frames:
            number += 1
            yield last
        if last is None:
            raise InputError(f"{self.name}: has no frames; expected one or more")
        repeated = replace(last, read=cache(last.read), read_light=last.read_light and cache(last.read_light))
        tell(f"{self.name}: ends after {number} frames; its last one goes with those that follow")
        while True:
            yield repeated


class Arrays:
    """A source of arrays, (h, w) or (h, w, 1 to 4), counted from 1.

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
            yield Frame.from_picture(number, f"array {number}", picture)


class Numbers:
    """A source of frame numbers without pictures, counted from 1, for programs that take only values.

    >>> [frame.number for frame in Numbers(3)]
    [1, 2, 3]
    """

    name = "frames"

    has_alpha = False

    def __init__(self, count: int) -> None:
        self.count = arguments.whole_number(count, "frames: count", 1, MOST_NUMBERS, InputError)

    def __iter__(self) -> Iterator[Frame]:
        for number in range(1, self.count + 1):
            yield Frame(number, f"frame {number}", _nothing, state=tuple)


def _nothing() -> Stored:
    raise InputError("frames: a program that takes pictures got a source without any; give one such as Pictures([...])")


class ToArrays(Sink):
    """A sink that appends each frame to ``pictures``, a list of float32 arrays."""

    def __init__(self) -> None:
        self.pictures: list[Stored] = []

    def take(self, frame: Frame, prepared: Any) -> None:
        self.pictures.append(prepared)
