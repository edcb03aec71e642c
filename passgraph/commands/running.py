"""Compile and run a job: progress, timing, errors, captured passes and the written picture."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, Self

import click
import numpy as np
from numpy.typing import NDArray

from passgraph.commands.command_graph import Job, in_bytes
from passgraph.commands.options import check_computes
from passgraph.commands.written_files import (
    FLOAT_SUFFIXES,
    check_bits,
    check_folder,
    check_picture_path,
    tell_of_lost_layers,
)
from passgraph.errors import InputError
from passgraph.language.native import Math
from passgraph.pictures import fits_layers, in_layer, metadata_of, save, viewable
from passgraph.plan.data import Options, Step
from passgraph.quantise import integers_of
from passgraph.records import dataclass
from passgraph.run.caller_arrays import room_of
from passgraph.run.compile import compile
from passgraph.run.finite_checks import NonFinite

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from passgraph.color_tags import ColorSpace, Recoded
    from passgraph.files.frame import Outcome
    from passgraph.graph.targets import Target
    from passgraph.run.program import Program


@contextmanager
def progress(first: str) -> Iterator[Callable[..., None]]:
    """Show a progress bar with a text; yield a function that changes the text, and the count done and in all."""
    if not sys.stderr.isatty():
        yield lambda *_: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    columns = TextColumn("{task.description}", markup=False), BarColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(first, total=None)

        def say(text: str, done: int = 0, count: int | None = None) -> None:
            bar.reset(task, description=text, completed=done, total=count)

        yield say


@contextmanager
def frame_progress(
    name: str, count: int | None, complaint: Callable[[Outcome], str]
) -> Iterator[Callable[[Outcome], None]]:
    """Show a progress bar with frames a second and the time left; yield a function to call after each frame.

    ``complaint`` returns the message for a failed frame, which is printed also without a terminal. A log gets a line
    every `LOG_SECONDS`.
    """
    if not sys.stderr.isatty():
        yield _Logged(name, count, complaint).step
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, Task, TextColumn
    from rich.progress import TimeRemainingColumn as TimeLeft
    from rich.text import Text

    class Rate(ProgressColumn):
        def render(self, task: Task) -> Text:
            return Text(f"{task.speed:.1f} frames/s" if task.speed else "")

    console = Console(stderr=True)
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), Rate(), TimeLeft())
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task(name, total=count)

        def step(outcome: Outcome) -> None:
            if outcome.state == "failed":
                console.print(complaint(outcome), markup=False, highlight=False, soft_wrap=True)
            bar.advance(task)

        yield step


#: Seconds between lines of progress in a log.
LOG_SECONDS = 10.0


class _Logged:
    """Progress of frames as lines of a log; work that ends sooner gets none."""

    def __init__(self, name: str, count: int | None, complaint: Callable[[Outcome], str]) -> None:
        self.name, self.count, self.complaint = name, count, complaint
        self.begin = self.said = perf_counter()
        self.done = 0

    def step(self, outcome: Outcome) -> None:
        self.done += 1
        if outcome.state == "failed":
            click.echo(self.complaint(outcome), err=True)
        now = perf_counter()
        if now - self.said < LOG_SECONDS:
            return
        self.said, rate = now, self.done / (now - self.begin)
        of = f" of {self.count}" if self.count else ""
        left = f", {_time((self.count - self.done) / rate)} left" if self.count else ""
        click.echo(f"{self.name}: {self.done}{of} frames, {rate:.1f} frames/s{left}", err=True)


class Capture:
    """An observer of a program's steps that writes each target into a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.count = folder, 0
        self.lines: list[str] = []

    def __call__(self, step: Step, pictures: dict[str, NDArray[np.float32]]) -> None:
        self.count += 1
        for target, picture in pictures.items():
            stem = f"{self.count:02}-{file_name(step.name)}-{file_name(target)}"
            view, shown = viewable(picture)
            save(self.folder / f"{stem}.png", view)
            save(self.folder / f"{stem}.npy", picture)
            self.lines.append(f"  {stem}.png  {picture.shape[1]}x{picture.shape[0]}, {shown}")

    def report(self) -> None:
        click.echo(f"{len(self.lines)} targets in {self.folder} (exact values in the npy files):")
        click.echo("\n".join(self.lines))


def file_name(name: str) -> str:
    """
    >>> file_name("shadow map/0")
    'shadow_map_0'
    """
    return "".join(c if c.isascii() and (c.isalnum() or c in "_.-") else "_" for c in name)


def check_one_picture(capture: Path | None, profile: bool, why: str, warm_up: int | None = None) -> None:
    """Raise InputError for options that need a single picture; ``why`` says why there are several."""
    if capture is not None:
        raise InputError(f"--capture shows the passes of one picture, and {why}; leave out one")
    if profile:
        raise InputError(f"--profile times the passes on one picture, and {why}; leave out one")
    if warm_up is not None:
        raise InputError(f"--warm-up runs frames before one picture, and {why}; leave out one")


def check_outputs(output: Path, capture: Path | None, bits: int = 8) -> None:
    """Raise InputError for outputs that cannot be written, before anything is computed."""
    check_picture_path(output)
    check_bits(output, bits)
    if capture is not None:
        check_folder(capture)


@dataclass(frozen=True)
class RunOptions:
    """The options of a command that runs a graph once."""

    #: A backend's name; None takes that of the environment, or the first available.
    backend: str | None = None
    #: A folder for pictures of all targets.
    capture: Path | None = None
    #: As for :func:`passgraph.compile`.
    check_finite: bool = False
    #: Run several more times, and print the time of each pass.
    profile: bool = False
    #: As for :func:`passgraph.compile`.
    non_finite: NonFinite = "error"
    #: As in :class:`passgraph.Options`.
    math: Math = "exact"
    #: As for :func:`passgraph.compile`, in bytes.
    memory: int | None = None

    @property
    def needs_whole_picture(self) -> bool:
        """Return True if passes are looked at one by one, which tiles do not allow."""
        return self.capture is not None or self.profile or self.check_finite

    @classmethod
    def from_options(cls, options: Mapping[str, Any]) -> Self:
        """Take the options of a command line."""
        return cls(**{field.name: options[field.name] for field in fields(cls) if field.name in options})


@dataclass(frozen=True)
class Layers:
    """How layers of OpenEXR files are written."""

    #: The layer that a result becomes.
    into: str | None = None
    #: Keep the other layers of the source.
    kept: bool = False


def program_of(
    outputs: dict[str, Target], size: tuple[int, int] | None, run: RunOptions, *, as_stored: bool,
    each_pass: bool = False,
) -> Program:  # fmt: skip
    """Compile a graph for a command.

    ``as_stored``: results are in the formats of their targets. ``each_pass``: every pass runs, and keeps its target.
    """
    options = Options(fuse=not each_pass, alias=not each_pass, math=run.math)
    program = compile(
        outputs, run.backend, size, options, non_finite=run.non_finite,
        check_finite=run.check_finite, results="stored" if as_stored else "float32", memory=run.memory,
    )  # fmt: skip
    try:
        check_computes(type(program.backend))  # the backend may come from the environment
    except BaseException:
        program.close()
        raise
    return program


def run_and_save(
    job: Job,
    output: Path,
    run: RunOptions,
    bits: int = 8,
    like: Path | None = None,
    color: ColorSpace | Recoded | None = None,
    layers: Layers | None = None,
) -> None:
    """Run a job once and write its first output.

    ``bits``: 8 or 16 a channel, for formats that have both. ``like``: the source picture file, whose metadata is kept.
    ``color``: the color space of the output, if it is not the source's. ``layers``: those of an OpenEXR file.
    """
    observer = None if run.capture is None else Capture(run.capture)
    # Values that are not finite are reported for formats that cannot store them, which needs float results.
    keeps_more = output.suffix.lower() in FLOAT_SUFFIXES or bits == 16
    in_whole = not (observer or run.check_finite or keeps_more) and job.holds_bytes
    outputs = in_bytes(job.outputs) if in_whole else job.outputs
    with progress("compiling") as say:
        start = perf_counter()
        with program_of(outputs, job.size, run, as_stored=in_whole, each_pass=observer is not None) as program:
            compiled = perf_counter()
            array = _output_of(program, next(iter(outputs)), job, observer, say)
            ran = perf_counter()
            name = program.backend.name
            if run.profile:
                say(f"timing each pass on {name}")
                times = program.profile(**job.given_at(job.frames_before))
        say(f"writing {output}")
        is_whole = array.dtype.kind == "u" or output.suffix.lower() in FLOAT_SUFFIXES
        stored = array if is_whole else integers_of(array, np.dtype(f"u{bits // 8}"), str(output))
        float_bits = bits if bits > 8 and output.suffix.lower() in FLOAT_SUFFIXES else None
        kept = None if like is None else metadata_of(like)
        layers = layers or Layers()
        layers_of = like if layers.kept else None
        if layers_of is not None and not fits_layers(stored, layers_of):
            tell_of_lost_layers([output])
            layers_of = None
        named = in_layer(output, layers.into)
        save(named, stored, like=kept, bits=float_bits, color=color, layers_of=layers_of)
    height, width = array.shape[:2]
    looking = " (with capture)" if observer is not None else ""
    click.echo(
        f"{output}: {width}x{height} by {name}; compile {_time(compiled - start)}, run {_time(ran - compiled)}{looking}"
    )
    if observer is not None:
        observer.report()
    if run.profile:
        click.echo(str(times))


def _output_of(
    program: Program, wanted: str, job: Job, observer: Capture | None, say: Callable[[str], None]
) -> NDArray[Any]:
    """Run the program and return an output, after the device has finished."""
    say(f"running on {program.backend.name}")
    room = room_of(program.plan, program.settings()["results"], [wanted])
    for number in range(job.frames_before):
        say(f"frame {number + 1} of the {job.frames_before} before it, on {program.backend.name}")
        program.run(**job.given_at(number))
    program.run(observer, into=room, **job.given_at(job.frames_before))
    program.finish()
    return room[wanted]


def _time(seconds: float) -> str:
    return f"{seconds * 1e3:.1f} ms" if seconds < 1 else f"{seconds:.2f} s"
