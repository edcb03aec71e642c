"""``passgraph apply`` on more than one picture file: what is read and written, and the run."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from passgraph.commands.clips import (
    Writing,
    check_clips,
    check_writing,
    clips_of,
    depth_of,
    frames_beside,
    goes_into_folder,
    inputs_of,
    sources_of,
)
from passgraph.commands.files import STREAM, rate_of, tell_of_several
from passgraph.commands.frames import Converted, FramesJob, Settings, colors_of, red_of, run_clips
from passgraph.commands.options import flag_of
from passgraph.commands.over_frames import Changing
from passgraph.commands.sources import picture_parameters, pictures_beside
from passgraph.effects.registry import Effect
from passgraph.errors import InputError
from passgraph.frames.frame import Source
from passgraph.frames.names import Pattern, is_film, is_video
from passgraph.frames.pictures import Held, Numbers, Pictures, Repeated
from passgraph.frames.pipe import Raw
from passgraph.graph.targets import Input

if TYPE_CHECKING:
    from passgraph.scene.hardware_depth import HardwareDepth


def apply_to_many(
    effect: Effect, inputs: tuple[str, ...], output: str, given: dict[str, Any], writing: Writing, settings: Settings,
    *, frames: int | None, size: tuple[int, int] | None = None, depth: Path | None = None,
    holds: HardwareDepth | None = None,
) -> int:  # fmt: skip
    """Whatever is not one picture file to one; ``size`` of pictures that are made of parameters alone."""
    broken: list[str] = []
    sources = _repeated(effect, inputs, frames) or list(sources_of(inputs, writing.raw, broken))
    if not sources:
        raise InputError(broken[0])
    _check_further_pictures(effect, inputs, output)
    clips = clips_of(sources, output, writing)
    check_writing(writing, clips)
    depths = None if depth is None else depth_of(depth, clips)
    beside = pictures_beside(effect, given)
    stills = [path for path in given.values() if isinstance(path, Path) and path not in beside.values()]
    opened = {name: frames_beside(path, clips, writing.raw) for name, path in beside.items()}
    further = [*opened.values(), *([depths] if depths else [])]
    check_clips(clips, output, [*stills, *(path for source in further for path in inputs_of(source))])
    tell_of_several(path for clip in clips if isinstance(clip.source, Pictures) for path in inputs_of(clip.source))
    changing = Changing.of(effect, given)
    parameters, constants = picture_parameters(effect, {n: value for n, value in given.items() if n not in beside})
    parameters |= {name: Input(name, "rgba32f") for name in opened}
    depth_source = None if depths is None else Converted(depths, red_of)
    pictures = {name: Converted(Held(source, _warn), colors_of) for name, source in opened.items()}
    job = FramesJob(effect, parameters, depth_source, constants, holds, changing, size, dict(pictures))
    return run_clips(job, clips, settings, broken)


def _warn(line: str) -> None:
    click.echo(f"passgraph: warning: {line}", err=True)


def _repeated(effect: Effect, inputs: tuple[str, ...], frames: int | None) -> list[Source]:
    """One picture as so many frames, or as many without a picture; empty where frames are read."""
    if frames is None:
        return []
    if effect.takes == "nothing":
        return [Numbers(frames)]
    path = Path(inputs[0])
    if len(inputs) != 1 or inputs[0] == STREAM or not path.is_file() or is_video(path):
        raise InputError(f"--frames {frames}: is for one picture, and {' '.join(inputs)} is none; leave it out")
    return [Repeated(path, frames)]


def _check_further_pictures(effect: Effect, inputs: tuple[str, ...], output: str) -> None:
    """Tell who names two pictures for an effect of two where the second goes."""
    further = [flag_of(parameter) for parameter in effect.parameters if parameter.type == "picture"]
    one_file = not (goes_into_folder(output) or Pattern.is_in(output) or is_film(Path(output)) or output == STREAM)
    if further and one_file and len(inputs) > 1:
        raise InputError(
            f"{output}: is one picture, and {len(inputs)} are read as frames; what {effect.name} takes beside a "
            f"picture is an option: {inputs[0]} {further[0]} {inputs[1]}"
        )


def writing_of(
    rate: str | None, codec: str | None, codec_option: Sequence[str], bits: str | None, raw: str | None = None,
    sound: bool = True,
) -> Writing:  # fmt: skip
    """How outputs are written, from the options of these names."""
    layout = None if raw is None else Raw.parsed(raw)
    a_second = None if rate is None else rate_of(rate)
    codec_options = {}
    for text in codec_option:
        key, equals, value = text.partition("=")
        if not (key and equals):
            raise InputError(f"--codec-option {text!r}: expected KEY=VALUE, such as crf=23")
        codec_options[key] = value
    return Writing(layout, a_second, codec, codec_options, sound, None if bits is None else int(bits))
