"""The base class of sinks that write all frames, with their times, into one file: videos and animations."""

from __future__ import annotations

import os
from fractions import Fraction
from pathlib import Path
from typing import Any

from passgraph import arguments
from passgraph.errors import InputError
from passgraph.files.animation import Animation
from passgraph.files.frame import Frame, Sink, Source
from passgraph.files.pipe import Pipe
from passgraph.files.video import Video
from passgraph.writing import NewFile, place_of

#: Frames a second of sources without a rate, and the fewest and most that are written.
RATE, LEAST_RATE, MOST_RATE = Fraction(25), Fraction(1, 1000), Fraction(1000)


def rate_given(source: Source) -> Fraction | None:
    """Return the frames a second of a source (the average of a video or an animation); None if unknown."""
    if isinstance(source, (Animation, Video)):
        return Fraction(source.rate) if source.rate else None
    return source.raw.rate if isinstance(source, Pipe) and source.raw else None


def partial_path(path: Path) -> Path:
    """Return the name of an incomplete film that plays.

    >>> partial_path(Path("out/b.mp4")).name
    'b.partial.mp4'
    """
    return path.with_name(f"{path.stem}.partial{path.suffix}")


def check_rate(rate: Fraction, where: str) -> None:
    """Raise InputError for frames a second that cannot be written."""
    if not LEAST_RATE <= rate <= MOST_RATE:
        raise InputError(f"{where}: {float(rate):g} frames a second; expected {LEAST_RATE} to {MOST_RATE}")


class Film(Sink):
    """A sink that writes all frames into one file, which appears under its name when it is complete.

    ``rate`` is the frames a second of sources without times; frames that have times keep them.
    """

    is_one_file = True

    #: The kind of file, for messages.
    kind = "a film"

    def __init__(self, path: str | os.PathLike[str], rate: Fraction | None) -> None:
        self.path, self.rate = arguments.path(path, f"{self.kind} to write"), rate
        if rate is not None:
            check_rate(rate, os.fspath(self.path))
        self._size: tuple[int, int] | None = None
        self._first: int | None = None  # number of the first frame
        self._new_file: NewFile | None = None
        #: The incomplete file that an interrupted run left, which plays.
        self.left: Path | None = None

    @property
    def name(self) -> str:
        return os.fspath(self.path)

    def rate_for(self, source: Source) -> Fraction:
        """Return the frames a second to write for a source."""
        return self.rate or rate_given(source) or RATE

    def stored_as(self) -> dict[str, Any]:
        return {"rate": str(self.rate), "color": repr(getattr(self, "color", None))}

    def encoded(self) -> int:
        """Return the number of frames of an incomplete file that `go_on` can continue."""
        return 0

    def go_on(self) -> None:
        """Continue the incomplete file: the first frames, which it has, are not taken but kept. Call before `begin`."""
        raise NotImplementedError

    def keep(self, frame: Frame) -> None:
        self._first = frame.number if self._first is None else self._first

    def begin(self, source: Source) -> None:
        self._rate, self._size, self._first, self.left = self.rate_for(source), None, None, None
        targets = [place_of(self.path), place_of(partial_path(self.path))]
        if isinstance(source, (Animation, Video)) and Path(os.path.realpath(source.path)) in targets:
            raise InputError(f"{self.path}: would be overwritten while it is read; give the output another name")
        self._new_file = NewFile(self.path)

    def _check_size(self, frame: Frame, size: tuple[int, int]) -> None:
        """Raise InputError for a frame whose size differs from the first one's."""
        self._size = self._size or size
        if size != self._size:
            raise InputError(
                f"{frame.name}: makes {size[0]}x{size[1]} pixels, and {self.path} has frames of {self._size[0]}x"
                f"{self._size[1]}; {self.kind} has one size"
            )

    def _start_of(self, frame: Frame) -> Fraction:
        """Return the start time of a frame in seconds: its own, or from its number, so that gaps keep their time."""
        if self._first is None:
            self._first = frame.number
        pts = frame.metadata.get("pts")
        return (frame.number - self._first) / self._rate if pts is None else pts * frame.metadata["time_base"]

    def _length_of(self, frame: Frame) -> Fraction:
        """Return the duration of a frame in seconds."""
        length = frame.metadata.get("duration")
        return 1 / self._rate if length is None else length * frame.metadata["time_base"]

    def _complete_file(self) -> None:
        """Rename the temporary file, now complete, to the output's name."""
        assert self._new_file is not None
        with self._new_file as new_file:
            new_file.complete()
        self._new_file = None

    def abandon(self) -> None:
        if self._new_file is not None:
            self._new_file.discard()
            self._new_file = None
