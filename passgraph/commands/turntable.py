"""``passgraph render --turntable``: one program, a frame for each camera."""

from __future__ import annotations

import os
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING

import click

from passgraph.commands.files import check_path, check_picture_path
from passgraph.commands.frames import complain_of, summary_line
from passgraph.commands.options import check_computes
from passgraph.commands.progress import frame_progress
from passgraph.commands.running import check_one_picture
from passgraph.commands.sources import Job, run_values
from passgraph.errors import InputError

if TYPE_CHECKING:
    from passgraph.scene import Camera


def check_turntable(output: Path, capture: Path | None, profile: bool, rate: Fraction | None) -> None:
    """Refuse what cannot be written before the long work."""
    from passgraph.frames.names import Pattern, is_film

    text = os.fspath(output)
    check_one_picture(capture, profile, "--turntable makes several")
    if rate is not None and not is_film(output):
        raise InputError(f"--rate is for videos, and {text} is none; leave it out, or name one: -o turn.mp4")
    if is_film(output):
        check_path(output)
    elif Pattern.is_in(text):
        check_picture_path(Pattern(text).path(1))
    else:
        raise InputError(
            f"{text}: is one picture, and --turntable makes several; give a numbered sequence (-o turn.%04d.png) or a "
            "video (-o turn.mp4), or an animation (-o turn.gif)"
        )


def run_turntable(
    job: Job, cameras: Sequence[Camera], backend: str | None, output: Path, *, rate: Fraction | None, check_finite: bool
) -> int:
    """Run a job once for each camera and write its first output; the exit status.  ``rate``: of a video.

    Raises
    ------
    InputError
        The graph does not take its camera anew with each run, or frames cannot be written.
    """
    from passgraph.frames.open import open_film
    from passgraph.frames.pictures import Numbers
    from passgraph.frames.run import frames
    from passgraph.run.compile import compile

    if all(value.name != "camera" for value in run_values(job.outputs)):
        raise InputError("--turntable: this effect takes no camera with each run, so that it cannot go round the scene")
    with compile(job.outputs, backend, job.size, check_finite=check_finite) as program:
        check_computes(type(program.backend))
        with frame_progress(str(output), len(cameras), complain_of) as step:
            summary = frames(
                program, Numbers(len(cameras)), output if rate is None else open_film(output, rate), watch=step,
                values=lambda number: {**job.given, "camera": cameras[number - 1]},
            )  # fmt: skip
        click.echo(summary_line(str(output), summary, program.backend.name))
    return 0 if summary.whole else 1
