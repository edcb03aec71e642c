"""A range of frames as a video or an animated picture, written as `passgraph apply` writes them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

import passgraph as pg
from passgraph.errors import InputError
from passgraph.files.frame import Frame, Source, Stored
from passgraph.files.open import open_film
from passgraph.files.run import frames
from passgraph.files.sequences import Numbers
from passgraph.plan.dependencies import inputs_behind
from passgraph.viewer.debugger import View

#: Most frames of one recording, most of them a second, and suffixes that it may have.
MOST_FRAMES, MOST_RATE = 100_000, 1000
SUFFIXES = (".mp4", ".mkv", ".webm", ".gif", ".webp")
#: Inputs of a frame by its number, counted from 0.
Inputs = Callable[[int], Mapping[str, Any]]


class _Pictures:
    """One input, a picture for each frame."""

    name = "frames"

    def __init__(self, read: Callable[[int], Stored], numbers: range) -> None:
        self._read, self._numbers, self.count = read, numbers, len(numbers)

    def __iter__(self) -> Iterator[Frame]:
        for place, number in enumerate(self._numbers, 1):
            yield Frame.of(place, f"frame {number + 1}", self._read(number))


def record(view: View, inputs: Inputs, first: int, last: int, rate: Fraction, path: Path) -> None:
    """Run what is on screen from a frame to a later one, history from its initial value, and write its target.

    Parameters
    ----------
    view : the target, its first backend, and what runs are given
    inputs : pictures of each frame
    first, last : counted from 0, both included
    rate : frames a second
    path : of a video or an animated picture

    Raises
    ------
    InputError
        For a range or a suffix that cannot be, and for a frame that fails.
    """
    if path.suffix not in SUFFIXES:
        raise InputError(f"record: {path.suffix!r} is no video; expected one of {' '.join(SUFFIXES)}")
    if not 0 <= first <= last < first + MOST_FRAMES:
        raise InputError(f"record: expected 1 to {MOST_FRAMES} frames, got from {first} to {last}")
    if not 0 < rate <= MOST_RATE:
        raise InputError(f"record: expected up to {MOST_RATE} pictures a second, more than 0, got {rate}")
    outputs, names = {"target": view.target}, inputs_behind([view.target])
    given, fed = view.given_to(outputs), next(iter(names), "")

    def values(place: int) -> dict[str, Any]:
        number = first + place - 1
        time = {name: number for name in (pg.FRAME_INDEX.name,) if name in given}
        brought = {name: picture for name, picture in inputs(number).items() if name in names}
        return {name: value for name, value in {**given, **brought, **time}.items() if name != fed}

    source: Source | dict[str, Source] = Numbers(last - first + 1)
    if names:
        pictures = _Pictures(lambda number: {**given, **inputs(number)}[fed], range(first, last + 1))
        source = {fed: pictures}
    with pg.compile(outputs, view.backends[0] or None, view.drawing.size, non_finite="keep") as program:
        summary = frames(program, source, open_film(path, rate), values=values, jobs=1)
    if not summary.whole:
        raise InputError(summary.stopped or str(summary.failed[0].reason))
