"""A frame, what frames come from and go to, and what became of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import InputError

#: (height, width, 1 to 4), row 0 on top: uint8 or uint16, sRGB-encoded, or float32.
Stored = NDArray[Any]
#: Most threads that read and write frames: each holds pictures.
MOST_JOBS = 256


@dataclass(frozen=True, eq=False)
class Frame:
    """One picture of several; its pixels are made when they are asked for, in any thread.

    Attributes
    ----------
    number : of the file where its name has one, else counted from 1
    name : what messages and outputs call it: the path of its file, or the video's and its number
    read : gives the picture; raises InputError where it is broken
    metadata : of a video's frame its ``pts`` and ``time_base``

    >>> Frame.of(1, "gray", np.full((2, 3, 4), 128, np.uint8)).read().shape
    (2, 3, 4)
    """

    number: int
    name: str
    read: Callable[[], Stored]
    metadata: Mapping[str, Any] = field(default_factory=dict)

    @staticmethod
    def of(number: int, name: str, picture: Stored) -> Frame:
        """A frame whose picture is there already."""
        return Frame(number, name, lambda: picture)


class OutputError(InputError):
    """An output that cannot be written at all: the run ends, since no other frame would fare better."""


@runtime_checkable
class Source(Protocol):
    """What frames come from: iterating gives them in order, without their pixels.

    A frame that is broken raises InputError when it is read; a source that cannot go on raises it when it is
    iterated: what came before stays.  One that has ``endless = True`` goes with others, which say when to end; of one
    that has ``has_alpha = False`` no frame has alpha.
    """

    @property
    def name(self) -> str:
        """What messages call it."""

    @property
    def count(self) -> int | None:
        """How many frames there are, or about; None where nobody knows."""

    def __iter__(self) -> Iterator[Frame]: ...


class Sink:
    """What frames go to.  Each run calls `begin`, then `take` for each frame in order, then `finish` or `abandon`."""

    #: Whether `prepare` writes all that a frame needs, so that a run that is broken off keeps it.
    whole_when_prepared = False
    #: Whether all frames go into one file, which is not there until `finish`.
    is_one_file = False

    @property
    def name(self) -> str:
        """What messages call it."""
        return type(self).__name__

    def begin(self, source: Source) -> None:
        """Refuse what cannot be written, before the work."""

    def holds(self, frame: Frame) -> bool:
        """Whether the frame's whole output is there already."""
        return False

    def in_bytes(self, source: Source) -> bool:
        """Whether every frame of a source will be stored in uint8: a program may as well make bytes then."""
        return False

    def stores(self, frame: Frame, size: tuple[int, int]) -> np.dtype[Any]:
        """The type that a frame of this width and height is stored in: uint8, uint16 or float32.

        Called for each frame in order; raises InputError for a size that does not fit.
        """
        return np.dtype(np.float32)

    def prepare(self, frame: Frame, picture: Stored) -> Any:
        """What may run in any thread and order: encoding.  What it returns is what `take` is given."""
        return picture

    def take(self, frame: Frame, prepared: Any) -> None:
        """The next frame, in order and in one thread."""

    def finish(self) -> None:
        """All frames were taken: the output is whole."""

    def abandon(self) -> None:
        """The run was broken off: remove what is not whole."""


@dataclass(frozen=True)
class Outcome:
    """What became of a frame: "written", "kept" (it was there already) or "failed", with the reason."""

    number: int
    name: str
    state: str
    reason: str = ""


@dataclass(frozen=True)
class Summary:
    """What became of a run's frames.

    Attributes
    ----------
    written, kept : how many were made, and how many were there already
    failed : those that could not be made
    stopped : why the run ended before its source did, or the source before its time; empty where all went well
    size : (width, height) of the last picture made
    seconds : from the first frame to the last
    """

    written: int = 0
    kept: int = 0
    failed: tuple[Outcome, ...] = ()
    stopped: str = ""
    size: tuple[int, int] | None = None
    seconds: float = 0.0

    @property
    def whole(self) -> bool:
        """Whether every frame was made."""
        return not self.failed and not self.stopped
