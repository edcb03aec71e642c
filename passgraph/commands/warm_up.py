"""``--warm-up``: the frames before a still, for effects whose passes read earlier frames."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from passgraph.commands.command_graph import Job
from passgraph.commands.sound import audio_picture
from passgraph.effects.effect_table import Effect
from passgraph.errors import InputError
from passgraph.plan.dependencies import read_history
from passgraph.shaders import STEP_S

if TYPE_CHECKING:
    from passgraph.files.audio import Audio

#: Most frames to compute before a still unless --warm-up names more; 30 s at the default duration of a frame.
MOST_BY_DEFAULT = 900
#: Most frames that --warm-up takes.
MOST_FRAMES = 1_000_000

warm_up_option = click.option(
    "--warm-up",
    type=click.IntRange(0, MOST_FRAMES),
    metavar="FRAMES",
    help="Frames to compute before one picture of an effect with history.  [default: those from second 0 to --time; "
    "those of --most-frames]",
)


def warmed_job(
    effect: Effect, parameters: Mapping[str, Any], frames: int | None, audio: Audio | None,
    make: Callable[[dict[str, Any]], Job],
) -> Job:  # fmt: skip
    """Return the job of one picture, with the frames to run before it.

    Its clock begins so much earlier that the picture has the time of ``--time``. A graph without history needs no
    frames.

    Parameters
    ----------
    frames : the value of ``--warm-up``, or None for the default
    make : returns the job for some parameters
    """
    job = make(dict(parameters))
    time, step = _clock(effect, parameters)
    start, count = time, 0
    if read_history(job.outputs.values()):
        count = _default(effect, parameters, time, step) if frames is None else frames
        if time and count > round(time / step):
            raise InputError(
                f"--warm-up {count}: second {time:g} has {round(time / step)} frames before it; give at most that "
                "many, or a later --time"
            )
        if frames is None and count:
            click.echo(
                f"passgraph: {count} frames are computed before this one, for the effect's history; change it with "
                "--warm-up",
                err=True,
            )
        start = time - count * step if time else time
    elif frames:
        raise InputError(f"--warm-up {frames}: {effect.name} reads no earlier frame; leave it out")
    if start != time:
        parameters = {**parameters, "time": start}
        job = make(dict(parameters))
    if audio is None:
        return replace(job, frames_before=count)
    return replace(job, frames_before=count, at=partial(_heard, audio, effect, parameters))


def _clock(effect: Effect, parameters: Mapping[str, Any]) -> tuple[float, float]:
    """Return the time given, 0 if the effect has no clock, and the duration of a frame, in seconds."""
    if effect.frame_time is None:
        return 0.0, STEP_S
    return max(0.0, parameters.get("time", 0.0)), parameters.get(effect.frame_time, STEP_S)


def _default(effect: Effect, parameters: Mapping[str, Any], time: float, step: float) -> int:
    most = parameters.get("most_frames", 1) if any(one.name == "most_frames" for one in effect.parameters) else 1
    return max(min(round(time / step), MOST_BY_DEFAULT) if step > 0 else 0, most - 1)


def _heard(audio: Audio, effect: Effect, parameters: Mapping[str, Any], frame: int) -> dict[str, Any]:
    return {"audio": audio_picture(audio, effect, parameters, frame)}
