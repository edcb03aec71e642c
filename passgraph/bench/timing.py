"""Frame times: whole, pass by pass, and of uploads and readback."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from passgraph.backends.base import Backend, Block, DeviceInfo, DrawRunner, FloatBlock, PixelRunner
from passgraph.formats import Format
from passgraph.graph.draw_state import Geometry
from passgraph.plan.data import DrawStep, PixelStep
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

    def runs(program: Program) -> Callable[[int], None]:
        def run(frame: int) -> None:
            program.run(light=nudged(light, frame))
            program.finish()

        return run

    return times_in_turn({name: runs(program) for name, program in programs.items()}, frames)


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


@dataclass
class Tally:
    """Seconds of every call, by kind."""

    passes: dict[str, list[float]] = field(default_factory=dict)
    uploads: list[float] = field(default_factory=list)
    downloads: list[float] = field(default_factory=list)

    def clear(self) -> None:
        self.passes.clear()
        self.uploads.clear()
        self.downloads.clear()


class Stopwatch(Backend):
    """A backend that waits for each pass of another backend and times it."""

    name = "stopwatch"

    def __init__(self, inner: Backend) -> None:
        self.inner, self.tally = inner, Tally()

    @classmethod
    def devices(cls) -> list[DeviceInfo]:
        return []

    def _timed(self, call: Callable[[], Any], into: list[float]) -> Any:
        self.inner.finish()
        begin = time.perf_counter()
        result = call()
        self.inner.finish()
        into.append(time.perf_counter() - begin)
        return result

    def make(self, format: Format, size: tuple[int, int]) -> Any:
        return self.inner.make(format, size)

    def upload(self, storage: Any, picture: FloatBlock) -> None:
        self._timed(lambda: self.inner.upload(storage, picture), self.tally.uploads)

    def download(self, storage: Any) -> FloatBlock:
        values: FloatBlock = self._timed(lambda: self.inner.download(storage), self.tally.downloads)
        return values

    def copy(self, source: Any, destination: Any) -> None:
        self._timed(lambda: self.inner.copy(source, destination), self.tally.passes.setdefault("copy", []))

    def geometry(self, mesh: Geometry) -> Any:
        return self._timed(lambda: self.inner.geometry(mesh), self.tally.uploads)

    def pixel_pass(self, step: PixelStep) -> PixelRunner:
        run = self.inner.pixel_pass(step)

        def timed(outputs: Sequence[Any], images: Sequence[Any], block: Block) -> None:
            self._timed(lambda: run(outputs, images, block), self.tally.passes.setdefault(step.name, []))

        return timed

    def draw_pass(self, step: DrawStep) -> DrawRunner:
        run = self.inner.draw_pass(step)

        def timed(
            outputs: Sequence[Any], depth: Any, images: Sequence[Any], geometry: Any, vertex: Block, fragment: Block
        ) -> None:
            into = self.tally.passes.setdefault(step.name, [])
            self._timed(lambda: run(outputs, depth, images, geometry, vertex, fragment), into)

        return timed

    def finish(self) -> None:
        self.inner.finish()

    def release(self, storage: Any) -> None:
        self.inner.release(storage)

    def release_geometry(self, geometry: Any) -> None:
        self.inner.release_geometry(geometry)

    def close(self) -> None:
        """Do nothing: the other backend belongs to its owner."""


@dataclass(frozen=True)
class PassTimes:
    """Milliseconds of each pass, with a wait after each; their sum is longer than a frame without waits.

    Attributes
    ----------
    passes : by name, in order; draws of one name are summed
    upload : textures and meshes, once
    read_back : download of the picture
    """

    passes: dict[str, float]
    upload: float
    read_back: float


def pass_times(compiled: Callable[[Backend], Program], backend: Backend, light: Light, frames: int) -> PassTimes:
    """Return the times of each pass of one program, medians over the frames."""
    watch = Stopwatch(backend)
    with compiled(watch) as program:
        program.run(light=nudged(light, 0))
        program.read()
        upload, read_back = sum(watch.tally.uploads), sum(watch.tally.downloads)
        rounds: list[dict[str, float]] = []
        for frame in range(1, frames + 1):
            watch.tally.clear()
            program.run(light=nudged(light, frame))
            rounds.append({name: sum(spent) for name, spent in watch.tally.passes.items()})
    names = list(dict.fromkeys(name for each in rounds for name in each))
    medians = {name: 1e3 * statistics.median(each.get(name, 0.0) for each in rounds) for name in names}
    return PassTimes(medians, 1e3 * upload, 1e3 * read_back)
