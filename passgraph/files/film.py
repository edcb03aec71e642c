"""Sinks that write all frames into one file, each for its time: what videos and animated pictures have in common."""

from __future__ import annotations

import os
from fractions import Fraction
from pathlib import Path

from passgraph import arguments
from passgraph.errors import InputError
from passgraph.files.animation import Animation
from passgraph.files.frame import Frame, Sink, Source
from passgraph.files.pipe import Pipe
from passgraph.files.sequences import Pictures, is_made
from passgraph.files.video import Video
from passgraph.writing import NewFile, place_of

#: Frames a second of pictures that do not say how many.
RATE = Fraction(25)


def rate_given(source: Source) -> Fraction | None:
    """Frames a second, where a source says it; of a video or an animation on average."""
    if isinstance(source, (Animation, Video)):
        return Fraction(source.rate) if source.rate else None
    return source.raw.rate if isinstance(source, Pipe) and source.raw else None


class Film(Sink):
    """Frames to one file, which has its name when it is whole.

    ``rate``: frames a second of pictures; frames that have times keep them.
    """

    is_one_file = True

    #: What messages call such a file.
    kind = "a film"

    def __init__(self, path: str | os.PathLike[str], rate: Fraction | None) -> None:
        self.path, self.rate = arguments.path(path, f"{self.kind} to write"), rate
        self._size: tuple[int, int] | None = None
        self._first: int | None = None  # number of the first frame
        self._made: NewFile | None = None

    @property
    def name(self) -> str:
        return os.fspath(self.path)

    def rate_for(self, source: Source) -> Fraction:
        """How many frames of a source there are a second."""
        return self.rate or rate_given(source) or RATE

    def is_made(self, source: Source) -> bool:
        """Whether the whole file is there, newer than what it is made from: it has its name only then."""
        if isinstance(source, (Animation, Video)):
            return is_made(self.path, [source.path])
        return isinstance(source, Pictures) and is_made(self.path, source.paths.values())

    def begin(self, source: Source) -> None:
        self._rate, self._size, self._first = self.rate_for(source), None, None
        target = place_of(self.path)
        if isinstance(source, (Animation, Video)) and target == Path(os.path.realpath(source.path)):
            raise InputError(f"{self.path}: would be overwritten while it is read; give the output another name")
        self._made = NewFile(self.path)

    def _check_size(self, frame: Frame, size: tuple[int, int]) -> None:
        """All frames have the first one's size."""
        self._size = self._size or size
        if size != self._size:
            raise InputError(
                f"{frame.name}: makes {size[0]}x{size[1]} pixels, and {self.path} has frames of {self._size[0]}x"
                f"{self._size[1]}; {self.kind} has one size"
            )

    def _start_of(self, frame: Frame) -> Fraction:
        """Seconds until a frame: its own; a picture's by its number, so that one that is missing leaves its time."""
        if self._first is None:
            self._first = frame.number
        pts = frame.metadata.get("pts")
        return (frame.number - self._first) / self._rate if pts is None else pts * frame.metadata["time_base"]

    def _length_of(self, frame: Frame) -> Fraction:
        """Seconds for which a frame is shown."""
        length = frame.metadata.get("duration")
        return 1 / self._rate if length is None else length * frame.metadata["time_base"]

    def _renamed(self) -> None:
        """The file is whole: it gets its name."""
        assert self._made is not None
        self._made.complete()
        self._made = None
