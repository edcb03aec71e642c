"""Record a range of frames to a video or an animation, as `passgraph apply` writes them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

from passgraph.arguments import shown
from passgraph.errors import InputError
from passgraph.files.film import check_rate
from passgraph.files.frame import Frame, Outcome, Source, Stored
from passgraph.files.open import open_film
from passgraph.files.run import frames
from passgraph.files.sequences import Numbers
from passgraph.graph.run_values import FRAME_INDEX
from passgraph.plan.dependencies import inputs_behind
from passgraph.run.compile import compile
from passgraph.viewer.debugger import View

#: Most frames of a recording, and the largest number of one.
MOST_FRAMES, MOST_NUMBER = 100_000, (1 << 31) - 1
#: Suffixes of a recording.
SUFFIXES = (".mp4", ".mkv", ".webm", ".gif", ".webp")
#: A function from a frame's number, counted from 0, to its inputs.
Inputs = Callable[[int], Mapping[str, Any]]


class _Pictures:
    """A source of the pictures of an input, one for each frame."""

    name = "frames"

    def __init__(self, read: Callable[[int], Stored], numbers: range) -> None:
        self._read, self._numbers, self.count = read, numbers, len(numbers)

    def __iter__(self) -> Iterator[Frame]:
        for place, number in enumerate(self._numbers, 1):
            yield Frame.from_picture(place, f"frame {number + 1}", self._read(number))


def record(
    view: View, inputs: Inputs, first: int, last: int, rate: Fraction, path: Path, is_closed: Callable[[], bool]
) -> None:
    """Run the view for a range of frames, with history from its initial values, and write the target to a file.

    Parameters
    ----------
    view : the target, its first backend, and its run inputs
    inputs : pictures of each frame
    first, last : frame numbers from 0, both included
    rate : frames a second
    path : a video or an animation
    is_closed : asked after each frame; True ends the recording

    Raises
    ------
    InputError
        For an invalid range, rate or suffix, for a frame that fails, and for a recording that was ended.
    """
    if path.suffix not in SUFFIXES:
        raise InputError(f"record: {path.suffix!r} is no video; expected one of {' '.join(SUFFIXES)}")
    if not 0 <= first <= last < first + MOST_FRAMES or last > MOST_NUMBER:
        got = f"from {shown(first)} to {shown(last)}"
        raise InputError(f"record: expected 1 to {MOST_FRAMES} frames from 0 to {MOST_NUMBER}, got {got}")
    check_rate(rate, "record")
    outputs = {"target": view.target}
    run_inputs = view.run_inputs_of(outputs)
    known = {**run_inputs, **inputs(first)}
    names = [name for name in inputs_behind([view.target]) if name in known]  # others have a default
    source_input = next(iter(names), "")

    def values(place: int) -> dict[str, Any]:
        number = first + place - 1
        time = {name: number for name in (FRAME_INDEX.name,) if name in run_inputs}
        pictures = {name: picture for name, picture in inputs(number).items() if name in names}
        return {name: value for name, value in {**run_inputs, **pictures, **time}.items() if name != source_input}

    def watch(_: Outcome) -> None:
        if is_closed():
            raise InputError("record: the view was closed")

    source: Source | dict[str, Source] = Numbers(last - first + 1)
    if names:
        pictures = _Pictures(lambda number: {**run_inputs, **inputs(number)}[source_input], range(first, last + 1))
        source = {source_input: pictures}
    with compile(outputs, view.backends[0] or None, view.drawing.size, non_finite="keep") as program:
        summary = frames(program, source, open_film(path, rate), values=values, jobs=1, watch=watch)
    if not summary.whole:
        raise InputError(summary.stopped or str(summary.failed[0].reason))
