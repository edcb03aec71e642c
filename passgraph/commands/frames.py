"""Run an effect on many frames: compile it, show progress, print a summary."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import field, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from passgraph.commands.clips import Clip, outputs_of
from passgraph.commands.command_graph import as_distance, effect_output, in_bytes
from passgraph.commands.parameter_options import Changing
from passgraph.commands.running import RunOptions, frame_progress, program_of
from passgraph.commands.sound import audio_picture
from passgraph.commands.written_files import tell_of_lost_layers
from passgraph.effects.effect_table import Effect
from passgraph.errors import InputError, on_one_line
from passgraph.files.film import Film
from passgraph.files.flow import Values
from passgraph.files.frame import Frame, Outcome, Source, Stored, Summary
from passgraph.files.frame_range import FrameRange
from passgraph.files.pipe import Pipe, ToPipe
from passgraph.files.remote import connected
from passgraph.files.run import frames
from passgraph.files.sequences import Pictures, ToPictures
from passgraph.files.stored import with_channels
from passgraph.graph.targets import OPEN_SRGB, Input, Target, named_outputs
from passgraph.pictures import scaled
from passgraph.records import dataclass
from passgraph.run.program import Program

if TYPE_CHECKING:
    from passgraph.files.audio import Audio
    from passgraph.scene.projection import HardwareDepth


@dataclass(frozen=True)
class Settings(RunOptions):
    """The options of a command that runs a graph over frames."""

    linear: bool = False
    jobs: int | None = None
    resume: bool = False
    scheduler: str | None = None
    select: FrameRange | None = None
    proxy: int = 1


@dataclass
class FramesJob:
    """An effect on frames of any size: its output, and its other inputs and run values."""

    effect: Effect
    parameters: dict[str, Any]
    depth: Source | None = None
    given: dict[str, Any] = field(default_factory=dict)
    holds: HardwareDepth | None = None
    changing: Changing | None = None
    size: tuple[int, int] | None = None  # of pictures that are generated from parameters alone
    pictures: dict[str, Source] = field(default_factory=dict)  # parameters that are frames too, in step
    audio: Audio | None = None

    @property
    def makes_all(self) -> bool:
        """True if its pictures are generated from parameters alone."""
        return self.effect.takes == "nothing"

    def output(self, *, as_read: bool, as_bytes: bool, linear: bool) -> dict[str, Target]:
        """Return the graph's first output; frames have four channels, in their own dtype if ``as_read``, else float32.

        ``linear``: the program decodes 8-bit frames from sRGB, as for one picture.
        """
        open_format = OPEN_SRGB if linear else None
        targets = [] if self.makes_all else [Input("frame", open_format if as_read else "rgba32f")]
        if self.depth is not None:
            targets.append(as_distance(Input("depth", "r32f"), self.holds))

        def apply_effect(changing: Mapping[str, Any]) -> Any:
            return effect_output(self.effect, targets, {**self.parameters, **changing})

        outputs = named_outputs(apply_effect({}) if self.changing is None else self.changing.graph(apply_effect))
        first = dict(list(outputs.items())[:1])
        return in_bytes(first) if as_bytes else first

    def sources(self, clip: Clip) -> Source | dict[str, Source]:
        """Return the sources of a clip's frames, by input."""
        if self.makes_all:
            return clip.source
        depth = {} if self.depth is None else {"depth": self.depth}
        return {"frame": clip.source, **depth, **self.pictures}

    def values(self, clip: Clip) -> Values:
        """Return the run values of a clip."""
        values = self.given if self.changing is None else self.changing.values(clip.source, clip.rate, self.given)
        if self.audio is None:
            return values
        audio, first = self.audio, clip.source.first if isinstance(clip.source, Pictures) else 1

        def at(number: int) -> dict[str, Any]:
            known = values(number) if callable(values) else values
            times = {**self.parameters, **known}
            return {**known, "audio": audio_picture(audio, self.effect, times, number - first, clip.rate)}

        return at


class Converted:
    """A source of further frames with converted pixels: `red_of` for depth in red, or `colors_of`."""

    def __init__(self, source: Source, convert: Callable[[Stored], Stored]) -> None:
        self.source, self.name, self.count, self._convert = source, source.name, source.count, convert
        self.endless = getattr(source, "endless", False)

    def __iter__(self) -> Iterator[Frame]:
        for frame in self.source:
            light = partial(self._converted, frame, True)
            yield replace(frame, read=partial(self._converted, frame, False), read_light=light)

    def _converted(self, frame: Frame, linear: bool) -> Stored:
        return self._convert(frame.pixels(linear=linear))


def red_of(picture: Stored) -> Stored:
    """Return red as float32, (h, w, 1)."""
    return scaled(picture[:, :, :1])


def colors_of(picture: Stored) -> Stored:
    """Return a picture as `passgraph.load` does: float32, (h, w, 4)."""
    return scaled(with_channels(picture, 4))


def velocity_of(picture: Stored, scale: float) -> Stored:
    """Return a velocity in pixels of another size, as float32, (h, w, 4)."""
    return colors_of(picture) * np.float32(scale)


def run_clips(job: FramesJob, clips: list[Clip], settings: Settings, broken: list[str]) -> int:
    """Run every clip; return the exit status. ``broken`` has the errors of sources that could not be opened."""
    for message in broken:
        _complain(message)
    is_whole, program = not broken, None
    if settings.scheduler is not None:
        click.echo(f"passgraph: connecting to {settings.scheduler}", err=True)
    client = None if settings.scheduler is None else connected(settings.scheduler)
    try:
        for clip in clips:
            if program is None or program.has_history:  # history must not continue from another clip
                if program is not None:
                    program.close()
                program = _compiled(job, settings, clips)
            is_whole &= _run_clip(program, job, clip, settings, len(clips) > 1, client)
    finally:
        if program is not None:
            program.close()
        if client is not None:
            client.close()
    return 0 if is_whole else 1


def _compiled(job: FramesJob, settings: Settings, clips: list[Clip]) -> Program:
    # Values that are not finite are reported for formats that cannot store them, which needs float results.
    finite = settings.non_finite == "error" and not settings.check_finite
    as_bytes = finite and all(clip.sink.in_bytes(clip.source) for clip in clips)
    # Raw pixels may be gray or RGB, and effects read colors with alpha.
    as_read = not any(isinstance(clip.source, Pipe) and clip.source.raw for clip in clips)
    outputs = job.output(as_read=as_read, as_bytes=as_bytes, linear=settings.linear)
    return program_of(outputs, job.size, settings, as_stored=as_bytes)


def _run_clip(
    program: Program, job: FramesJob, clip: Clip, settings: Settings, is_one_of_many: bool, client: Any
) -> bool:
    name = clip.sink.name
    values, done = job.values(clip), 0

    def watch(outcome: Outcome) -> None:
        nonlocal done
        done += outcome.state != "failed"
        step(outcome)

    with frame_progress(clip.source.name, clip.source.count, complain_of) as step, _interrupted(lambda: done, clip):
        try:
            summary = frames(
                program, job.sources(clip), clip.sink, values=values, jobs=settings.jobs, linear=settings.linear,
                resume=settings.resume, same_size=not job.pictures, watch=watch, client=client,
                select=settings.select, proxy=settings.proxy,
            )  # fmt: skip
        except InputError as error:
            if not is_one_of_many:
                raise
            summary = Summary(stopped=str(error))
    if isinstance(clip.sink, ToPictures):
        tell_of_lost_layers(clip.sink.without_layers)
    if summary.stopped:
        _complain(summary.stopped)
    elif summary.kept and not summary.written and (clip.sink.is_one_file or summary.kept == 1):
        _say(clip, f"{name if clip.sink.is_one_file else outputs_of(clip)[0][0]}: is there already")
        return summary.whole
    _say(clip, summary_line(name, summary, program.backend.name))
    return summary.whole


@contextmanager
def _interrupted(done: Any, clip: Clip) -> Iterator[None]:
    """Print a summary of the finished work on Ctrl-C."""
    try:
        yield
    except KeyboardInterrupt:
        count = clip.source.count
        total = f" of {count}" if count else ""
        left = clip.sink.left if isinstance(clip.sink, Film) else None
        kept = f"{left} has them, and --resume goes on from it" if left else "they are whole"
        if clip.sink.is_one_file and not left:
            kept = f"{clip.sink.name} is not written"
        raise KeyboardInterrupt(f"after {done()}{total} frames of {clip.source.name}; {kept}") from None


def summary_line(name: str, summary: Summary, backend: str) -> str:
    """
    >>> summary_line("out", Summary(written=300, size=(64, 48), seconds=12.0), "numpy")
    'out: 300 frames 64x48 by numpy in 12.0 s (25.0 a second)'
    """
    size = f" {summary.size[0]}x{summary.size[1]}" if summary.size else ""
    rate = f" ({summary.written / summary.seconds:.1f} a second)" if summary.written and summary.seconds else ""
    line = f"{name}: {_frames(summary.written)}{size} by {backend} in {summary.seconds:.1f} s{rate}"
    if summary.kept:
        line += f", {_frames(summary.kept)} there already"
    if summary.remade:
        line += f", {_frames(summary.remade)} replaced (made otherwise, or not whole)"
    if summary.failed:
        line += f", {_frames(len(summary.failed))} failed"
    if summary.stopped:
        line += ", ended early"
    return line


def _frames(count: int) -> str:
    return f"{count} frame" if count == 1 else f"{count} frames"


def _say(clip: Clip, line: str) -> None:
    click.echo(line, err=isinstance(clip.sink, ToPipe))


def complain_of(outcome: Outcome) -> str:
    """Return the message for a frame that failed."""
    text = outcome.reason if outcome.reason.startswith(outcome.name) else f"{outcome.name}: {outcome.reason}"
    return f"passgraph: error: {on_one_line(text)}"


def _complain(message: str) -> None:
    click.echo(f"passgraph: error: {on_one_line(message)}", err=True)
