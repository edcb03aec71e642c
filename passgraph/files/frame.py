"""Frames, the protocols of their sources and sinks, and the outcomes of a run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import field
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import InputError
from passgraph.files.digests import digest, file_state
from passgraph.image_formats import Metadata
from passgraph.records import dataclass

#: A picture (height, width, 1 to 4), row 0 on top: uint8 or uint16, sRGB-encoded, or float32.
Stored = NDArray[Any]
#: Most threads that read and write frames; each holds pictures in memory.
MOST_JOBS = 256


@dataclass(frozen=True, eq=False)
class Frame:
    """A frame of a source; its pixels are decoded lazily, in any thread.

    Attributes
    ----------
    number : the number in the file's name if it has one, else counted from 1
    name : the name in messages: the file's path, or the video's path and the frame's number
    read : return the picture; raises InputError if it cannot be decoded
    metadata : of a frame with a time, its ``pts`` and ``time_base``, and its ``duration`` if the file has it
    read_light : return the picture for a program that gets linear light: integers are decoded from sRGB then, so those
        that are encoded otherwise are returned as float32; None for `read`
    described : return the metadata of a picture that is in no file of its own, such as one of a stream; None without
    state : return plain data that changes with the pixels, without decoding them: of a file its size and modification
        time. With ``resume`` an output of another state is made again; None for pictures that only have names

    >>> Frame.from_picture(1, "gray", np.full((2, 3, 4), 128, np.uint8)).read().shape
    (2, 3, 4)
    """

    number: int
    name: str
    read: Callable[[], Stored]
    metadata: Mapping[str, Any] = field(default_factory=dict)
    read_light: Callable[[], Stored] | None = None
    described: Callable[[], Metadata] | None = None
    state: Callable[[], object] | None = None

    def pixels(self, *, linear: bool) -> Stored:
        """Return the picture for a program that gets linear light, or values as they are stored."""
        return self.read_light() if linear and self.read_light is not None else self.read()

    @staticmethod
    def unread(path: Path, number: int) -> Frame:
        """Return a frame of a file of several, by its number from 1, before its time and pixels are read."""

        def read() -> Stored:
            raise InputError(f"{name}: is not read yet")

        name = f"{path}, frame {number}"
        return Frame(number, name, read, state=lambda: (file_state(path), number))

    @staticmethod
    def from_picture(number: int, name: str, picture: Stored) -> Frame:
        """Return a frame of a picture in memory."""
        return Frame(number, name, lambda: picture, state=lambda: digest(picture))


class OutputError(InputError):
    """An output that cannot be written at all; it ends the run, since every later frame would fail too."""


@runtime_checkable
class Source(Protocol):
    """A source of frames: iterate to get them in order, before their pixels are decoded.

    `Frame.read` raises InputError for a damaged frame. Iterating raises InputError if the source cannot continue; the
    frames before are kept. Optional attributes: ``endless = True`` if the source never ends, so that other sources
    set the number of frames; ``has_alpha = False`` if no frame has alpha.
    """

    @property
    def name(self) -> str:
        """The source's name in messages."""

    @property
    def count(self) -> int | None:
        """The number of frames, perhaps estimated; None if unknown."""

    def __iter__(self) -> Iterator[Frame]: ...


class Sink:
    """A sink of frames. A run calls `begin`, then `take` for each frame in order, then `finish` or `abandon`."""

    #: True if `prepare` writes the frame's complete output, so that an interrupted run keeps it.
    whole_when_prepared = False
    #: True if all frames go into one file, ``path``, which does not exist until `finish`.
    is_one_file = False

    @property
    def name(self) -> str:
        """The sink's name in messages."""
        return type(self).__name__

    def begin(self, source: Source) -> None:
        """Begin a run; raise InputError for an output that cannot be written."""

    def stored_as(self) -> dict[str, Any]:
        """Return what the stored numbers depend on beside the results, as plain data."""
        return {}

    def file(self, frame: Frame) -> Path | None:
        """Return the file of its own that a frame is written to; None if it has none."""
        return None

    def holds(self, frame: Frame) -> bool:
        """Return True if the complete output of a frame without a file of its own exists already."""
        return False

    def in_bytes(self, source: Source) -> bool:
        """Return True if every frame of a source will be stored as uint8, so that the program can return uint8."""
        return False

    def stores(self, frame: Frame, size: tuple[int, int]) -> np.dtype[Any]:
        """Return the dtype that a frame of this width and height is stored in: uint8, uint16 or float32.

        Called for each frame in order; raises InputError for a size that does not fit.
        """
        return np.dtype(np.float32)

    def prepare(self, frame: Frame, picture: Stored) -> Any:
        """Encode a frame, in any thread and order; the result is passed to `take`."""
        return picture

    def take(self, frame: Frame, prepared: Any) -> None:
        """Write the next frame; called in order, from one thread."""

    def keep(self, frame: Frame) -> None:
        """Take note of the next frame, whose output exists already; called in order with `take`."""

    def finish(self) -> None:
        """Complete the output after the last frame."""

    def abandon(self) -> None:
        """End an interrupted run: what is incomplete is removed, or kept under another name."""


@dataclass(frozen=True)
class Outcome:
    """The outcome of a frame: "written", "kept" (its output existed already) or "failed", with the reason."""

    number: int
    name: str
    state: str
    reason: str = ""


@dataclass(frozen=True)
class Summary:
    """The outcome of a run.

    Attributes
    ----------
    written, kept : number of frames that were written, and of those that existed already
    failed : the frames that failed
    stopped : why the run or its source ended early; empty if neither did
    size : (width, height) of the last picture written
    seconds : from the first frame to the last
    remade : with ``resume``, those of the frames written whose output existed, but cut or made of something else
    """

    written: int = 0
    kept: int = 0
    failed: tuple[Outcome, ...] = ()
    stopped: str = ""
    size: tuple[int, int] | None = None
    seconds: float = 0.0
    remade: int = 0

    @property
    def whole(self) -> bool:
        """True if no frame failed and nothing ended early."""
        return not self.failed and not self.stopped
