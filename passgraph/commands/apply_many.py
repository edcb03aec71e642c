"""``passgraph apply`` on more than one picture file: what is read and written, and the run."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from passgraph.commands.clips import (
    Writing,
    check_clips,
    check_writing,
    clips_of,
    depth_of,
    inputs_of,
    sources_of,
)
from passgraph.commands.files import rate_of
from passgraph.commands.frames import FramesJob, RedOf, Settings, run_clips
from passgraph.commands.sources import picture_parameters
from passgraph.effects.registry import Effect
from passgraph.errors import InputError
from passgraph.frames.pipe import Raw

if TYPE_CHECKING:
    from passgraph.scene.hardware_depth import HardwareDepth


def apply_to_many(
    effect: Effect, inputs: tuple[str, ...], output: str, depth: Path | None, holds: HardwareDepth | None,
    given: dict[str, Any], options: dict[str, Any],
) -> int:  # fmt: skip
    """Whatever is not one picture file to one."""
    writing, broken = writing_of(options), list[str]()
    sources = list(sources_of(inputs, writing.raw, broken))
    if not sources:
        raise InputError(broken[0])
    clips = clips_of(sources, output, writing)
    check_writing(writing, clips)
    depths = None if depth is None else depth_of(depth, clips)
    pictures = [path for path in given.values() if isinstance(path, Path)]
    check_clips(clips, output, [*pictures, *(inputs_of(depths) if depths else [])])
    parameters, constants = picture_parameters(effect, given)
    job = FramesJob(effect, parameters, None if depths is None else RedOf(depths), constants, holds)
    settings = Settings(
        options["backend"], options["linear"], options["jobs"], options["resume"], options["non_finite"],
        options["check_finite"], options["scheduler"],
    )  # fmt: skip
    return run_clips(job, clips, settings, broken)


def writing_of(options: dict[str, Any]) -> Writing:
    """How outputs are written, from the options."""
    raw = None if options["raw"] is None else Raw.parsed(options["raw"])
    rate = None if options["rate"] is None else rate_of(options["rate"])
    codec_options = {}
    for text in options["codec_option"]:
        key, equals, value = text.partition("=")
        if not (key and equals):
            raise InputError(f"--codec-option {text!r}: expected KEY=VALUE, such as crf=23")
        codec_options[key] = value
    return Writing(raw, rate, options["codec"], codec_options, options["sound"])
