"""Times of whole frames, and of one frame over another."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from passgraph.run.program import Program
from passgraph.scene import Light

#: Frames before the first timed one.
WARM_UP = 2
#: Radians by which the light turns between frames, so that no pass is skipped as static.
NUDGE = 1e-4


@dataclass(frozen=True)
class FrameTime:
    """Median times over frames, milliseconds.

    Attributes
    ----------
    wall : elapsed time; frames of all programs run in turn, and this is the median of the ratios to the first program's
        frame in the same round, times the median of the first program's frames: a temporary slowdown of the machine
        affects both
    cpu : processor time of this process, all threads together, computed in the same way
    """

    wall: float
    cpu: float


def frame_times(programs: Mapping[str, Program], light: Light, frames: int) -> dict[str, FrameTime]:
    """Run every program once per round, with a moving light; ratios refer to the first program."""

    def run(program: Program, frame: int) -> None:
        program.run(light=nudged(light, frame))
        program.finish()

    return times_in_turn({name: partial(run, program) for name, program in programs.items()}, frames)


def times_in_turn(calls: Mapping[str, Callable[[int], object]], frames: int) -> dict[str, FrameTime]:
    """Make every call once per round, with the round's number; ratios refer to the first call."""
    names = list(calls)
    times: dict[str, list[tuple[float, float]]] = {name: [] for name in names}
    for frame in range(WARM_UP + frames):
        for name, call in calls.items():
            clock, processor = time.perf_counter(), time.process_time()
            call(frame)
            spent = time.perf_counter() - clock, time.process_time() - processor
            if frame >= WARM_UP:
                times[name].append(spent)
    first = times[names[0]]
    return {name: FrameTime(_median(first, times[name], 0), _median(first, times[name], 1)) for name in names}


def _median(first: Sequence[tuple[float, float]], own: Sequence[tuple[float, float]], column: int) -> float:
    ratio = statistics.median(b[column] / max(a[column], 1e-9) for a, b in zip(first, own, strict=True))
    return 1e3 * ratio * statistics.median(a[column] for a in first)


def nudged(light: Light, frame: int) -> Light:
    """Return the light turned or moved by a tiny amount in every other frame."""
    by = NUDGE * (frame % 2)
    if light.kind == "directional":
        return replace(light, direction=tuple(np.add(light.direction, (by, 0.0, 0.0))))
    return replace(light, position=tuple(np.add(light.position, (by, 0.0, 0.0))))
