"""Apply an effect to one picture or many, or generate pictures with one that reads none."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from passgraph.commands import mattes
from passgraph.commands.clips import (
    Writing,
    check_clips,
    check_writing,
    clips_of,
    depth_of,
    frames_beside,
    goes_into_folder,
    inputs_in_layer,
    inputs_of,
    sources_of,
)
from passgraph.commands.color_spaces import space_of_results, take_color_spaces
from passgraph.commands.command_graph import (
    generator_job,
    picture_job,
    picture_parameters,
    pictures_beside,
    velocity_scale,
)
from passgraph.commands.frames import Converted, FramesJob, Settings, colors_of, red_of, run_clips, velocity_of
from passgraph.commands.large_picture import large_picture, stored_dtype, takes_gray, tiled_job
from passgraph.commands.layers import keeps_of_named, read_overscan, reads_overscan
from passgraph.commands.options import flag_of
from passgraph.commands.parameter_options import Changing, check_no_ramps
from passgraph.commands.previews import check_frames, evenly, scaled_parameters
from passgraph.commands.running import Layers, RunOptions, check_one_picture, check_outputs, run_and_save
from passgraph.commands.sound import keeps_time, open_audio, split_sound
from passgraph.commands.stack_planes import apply_to_stack
from passgraph.commands.warm_up import warmed_job
from passgraph.commands.written_files import (
    STREAM,
    check_apart,
    check_no_video,
    is_one_picture,
    is_several,
    rate_of,
    tell_of_lost_bits,
    tell_of_lost_space,
    tell_of_several,
)
from passgraph.effects.effect_table import Effect
from passgraph.errors import InputError
from passgraph.files.film import RATE
from passgraph.files.frame import Source
from passgraph.files.frame_range import FrameRange
from passgraph.files.names import Pattern, is_film, is_video
from passgraph.files.pipe import Raw
from passgraph.files.sequences import Held, Numbers, Pictures, Repeated, ToPictures, bits_of
from passgraph.graph.targets import Input
from passgraph.pictures import is_exr, split_layer
from passgraph.records import dataclass

if TYPE_CHECKING:
    from fractions import Fraction

    from passgraph.files.audio import Audio
    from passgraph.scene.projection import HardwareDepth


def apply_effect(
    effect: Effect, parameters: dict[str, Any], /, inputs: tuple[str, ...], output: str, depth: Path | None = None,
    depth_buffer: HardwareDepth | None = None, audio: Path | None = None, **options: Any,
) -> int:  # fmt: skip
    """Apply an effect to one picture or many."""
    sound = open_audio(effect, split_sound(effect, inputs, audio)[1])
    file, options["output_layer"] = split_layer(Path(output))
    output = output if options["output_layer"] is None else str(file)
    if options["output_layer"] is not None and not is_exr(file):
        raise InputError(f"{output}: has no layers; give {output}, or an OpenEXR file (.exr)")
    inputs = inputs_in_layer(inputs, options.pop("layer"))
    options["keep_layers"] &= keeps_of_named(inputs, output, options["output_layer"], warns=effect.name != mattes.NAME)
    effect = take_color_spaces(effect, inputs, output, options)
    options["color"] = space_of_results(effect, parameters, inputs, output, options["linear"])
    frames, proxy, sheet = options["frames"], options["proxy"] or 1, options["sheet"]
    options["select"], number = (frames, None) if isinstance(frames, FrameRange) else (None, frames)
    options |= {"proxy": proxy, "keep_layers": options["keep_layers"] and proxy == 1}
    parameters = scaled_parameters(effect, parameters, proxy)
    sources = FrameSources(inputs, number, depth=depth, depth_buffer=depth_buffer, audio=sound)
    is_single = is_one_picture(inputs, output) and number is None and not pictures_beside(effect, parameters)
    if is_single and frames is not None:
        raise InputError(
            f"--frames FIRST-LAST: {inputs[0]} is one picture; give a sequence, or a NUMBER of frames to make"
        )
    # What made an output is recorded of frames only.
    if is_single and proxy == 1 and sheet is None and not options["resume"]:
        check_no_ramps(effect, parameters)
        if options["scheduler"] is not None:
            raise InputError("--scheduler is for many frames; one picture is computed here: leave it out")
        return apply_to_one(effect, sources, Path(output), parameters, options)
    check_one_picture(
        options["capture"],
        options["profile"],
        "--proxy and --contact-sheet make frames" if is_single else "there are several frames here",
        options["warm_up"],
    )
    return apply_to_many(effect, sources, output, parameters, options)


def generate(
    effect: Effect, parameters: dict[str, Any], /, inputs: tuple[str, ...], output: Path, size: tuple[int, int],
    **options: Any,
) -> int:  # fmt: skip
    """Generate one picture or many with an effect that reads none."""
    inputs, audio = split_sound(effect, inputs, options.pop("audio", None))
    capture, sound = options["capture"], open_audio(effect, audio)
    if inputs:
        raise InputError(
            f"{inputs[0]}: {effect.name} reads no picture, it makes its own; leave that out, and say how large: "
            f"--size {size[0]}x{size[1]}"
        )
    if isinstance(options["frames"], FrameRange):
        raise InputError(f"--frames FIRST-LAST: {effect.name} reads no frames; give the NUMBER of frames to make")
    if options["frames"] is not None or (sound is not None and is_film(output)):
        check_one_picture(capture, options["profile"], "--frames makes several pictures", options["warm_up"])
        sources = FrameSources((), options["frames"], size, audio=sound)
        return apply_to_many(effect, sources, str(output), parameters, options)
    check_no_ramps(effect, parameters)
    if is_film(output) or Pattern.is_in(str(output)):
        raise InputError(f"{output}: holds frames; say how many: --frames 100")
    check_no_video(options["rate"], options["codec"], options["codec_option"])
    bits = options["bits"] or 8
    check_outputs(output, capture, bits)
    job = warmed_job(
        effect, parameters, options["warm_up"], sound, lambda given: generator_job(effect, None, size, given)
    )
    run_and_save(job, output, RunOptions.from_options(options), bits)
    return 0


def apply_to_one(
    effect: Effect, read: FrameSources, output: Path, parameters: dict[str, Any], options: dict[str, Any]
) -> int:
    """Apply an effect to one picture file."""
    picture, depth = Path(read.inputs[0]), read.depth
    check_apart([picture, *([depth] if depth else [])], [(output, str(picture))])
    check_no_video(options["rate"], options["codec"], options["codec_option"])
    sink = ToPictures({1: output}, options["bits"])
    bits = sink.bits or bits_of(output, picture)
    check_outputs(output, options["capture"], bits)
    tell_of_lost_bits(sink, Pictures([picture]))
    tell_of_lost_space(output, options["color"], Pictures([picture]))
    run = RunOptions.from_options(options)
    chosen = options["channel"], options["plane"]
    is_plain = depth is None and read.audio is None and options["bits"] is None and not run.needs_whole_picture
    if is_plain and apply_to_stack(effect, picture, output, parameters, run, options["linear"], *chosen):
        return 0
    tell_of_several([picture])
    keeps = options["keep_layers"] and is_exr(picture) and is_exr(output)
    layers = Layers(options["output_layer"], keeps)
    if read.audio is None and not run.needs_whole_picture and layers.into is None:
        large = large_picture(picture, options["linear"], run.memory, takes_gray=takes_gray(effect), alone=keeps)
        dtype = stored_dtype(picture, output, bits)
        tiles = large and tiled_job(effect, large, depth, parameters, run, dtype, read.depth_buffer)
        if tiles:
            tiles.run(output, run, options["color"])
            return 0
    further = [path for path in parameters.values() if isinstance(path, Path)]
    overscan = keeps and reads_overscan(picture, [*further, *([depth] if depth else [])])
    job = warmed_job(
        effect, parameters, options["warm_up"], read.audio,
        lambda given: picture_job(
            effect, picture, depth, options["linear"], given, read.depth_buffer, overscan=overscan
        ),
    )  # fmt: skip
    run_and_save(job, output, run, bits, picture, options["color"], layers)
    return 0


@dataclass(frozen=True)
class FrameSources:
    """The sources of the frames of a run."""

    inputs: tuple[str, ...]
    #: Number of frames to generate from one picture, or from none.
    frames: int | None = None
    #: (width, height) in pixels of pictures that are generated from parameters alone.
    size: tuple[int, int] | None = None
    depth: Path | None = None
    depth_buffer: HardwareDepth | None = None
    audio: Audio | None = None


def apply_to_many(
    effect: Effect, read: FrameSources, output: str, arguments: dict[str, Any], options: dict[str, Any]
) -> int:
    """Apply an effect to many pictures, or to anything else than one picture file."""
    writing, broken = writing_of(options, _copied_sound(effect, arguments, read.audio, options)), list[str]()
    sources = _repeated(effect, read, output, writing.rate) or list(sources_of(read.inputs, writing.raw, broken))
    if not sources:
        raise InputError(broken[0])
    _check_further_pictures(effect, read.inputs, output)
    clips = clips_of(sources, output, writing)
    for clip in clips:
        check_frames(clip, options.get("select"))
    if writing.sheet is not None:
        options["select"] = evenly(clips[0].source, options["select"], writing.sheet[0] * writing.sheet[1])
    check_writing(writing, clips)
    companions = pictures_beside(effect, arguments)
    stills = [path for path in arguments.values() if isinstance(path, Path) and path not in companions.values()]
    opened = {name: frames_beside(path, clips, writing.raw) for name, path in companions.items()}
    depth = [] if read.depth is None else [read.depth]
    overscan = read_overscan(clips, list(opened.values()), [*stills, *depth])
    depths = None if read.depth is None else depth_of(read.depth, clips, overscan=overscan)
    further = [*opened.values(), *([depths] if depths else [])]
    if not any(getattr(source, "has_alpha", True) for source in [*sources, *opened.values(), Pictures(stills)]):
        effect = effect.for_opaque()
    sounds = [] if read.audio is None else [read.audio.path]
    check_clips(clips, output, [*stills, *sounds, *(path for source in further for path in inputs_of(source))])
    tell_of_several(path for clip in clips if isinstance(clip.source, Pictures) for path in inputs_of(clip.source))
    changing = Changing.taken_from(effect, arguments)
    parameters, constants = picture_parameters(
        effect,
        {n: value for n, value in arguments.items() if n not in companions},
        overscan=overscan,
        proxy=options.get("proxy", 1),
    )
    parameters |= {name: Input(name, "rgba32f") for name in opened}
    depth_source = None if depths is None else Converted(depths, red_of)
    pictures = {
        name: Converted(Held(source, _warn), colors_of if scale == 1 else partial(velocity_of, scale=scale))
        for name, source in opened.items()
        for scale in [velocity_scale(name, options.get("proxy", 1))]
    }
    job = FramesJob(
        effect, parameters, depth_source, constants, read.depth_buffer, changing, read.size, dict(pictures), read.audio
    )
    return run_clips(job, clips, Settings.from_options(options), broken)


def _warn(line: str) -> None:
    click.echo(f"passgraph: warning: {line}", err=True)


def _repeated(effect: Effect, read: FrameSources, output: str, rate: Fraction | None) -> list[Source]:
    """Return a picture repeated for the number of frames, or frames without pictures; empty if frames are read.

    A video of sound lasts as long as the sound if no number is given.
    """
    inputs, frames = read.inputs, read.frames
    is_still = not inputs or (len(inputs) == 1 and not is_several(Path(inputs[0])))
    if frames is None and read.audio is not None and is_still and is_film(Path(output)):
        frames = read.audio.frame_count(float(rate or RATE))
    if frames is None:
        return []
    if effect.takes == "nothing":
        return [Numbers(frames)]
    path = Path(inputs[0])
    if len(inputs) != 1 or inputs[0] == STREAM or not split_layer(path)[0].is_file() or is_video(path):
        raise InputError(f"--frames {frames}: is for one picture, and {' '.join(inputs)} is none; leave it out")
    return [Repeated(path, frames)]


def _copied_sound(
    effect: Effect, parameters: dict[str, Any], audio: Audio | None, options: dict[str, Any]
) -> bool | Path:
    """Return the file whose sound is copied into a video: that of --audio if it keeps time, else the input's (True)."""
    sound: bool = options.get("sound", True)
    return audio.path if sound and audio is not None and keeps_time(effect, parameters) else sound


def _check_further_pictures(effect: Effect, inputs: tuple[str, ...], output: str) -> None:
    """Raise InputError with the right option for a second picture given as an input."""
    further = [flag_of(parameter) for parameter in effect.parameters if parameter.type == "picture"]
    one_file = not (goes_into_folder(output) or Pattern.is_in(output) or is_film(Path(output)) or output == STREAM)
    if further and one_file and len(inputs) > 1:
        raise InputError(
            f"{output}: is one picture, and {len(inputs)} are read as frames; what {effect.name} takes beside a "
            f"picture is an option: {inputs[0]} {further[0]} {inputs[1]}"
        )


def writing_of(options: dict[str, Any], sound: bool | Path) -> Writing:
    """Return the output settings from a command's options."""
    raw, rate = options.get("raw"), options["rate"]
    codec_options = {}
    for text in options["codec_option"]:
        key, equals, value = text.partition("=")
        if not (key and equals):
            raise InputError(f"--codec-option {text!r}: expected KEY=VALUE, such as crf=23")
        codec_options[key] = value
    return Writing(
        None if raw is None else Raw.parsed(raw), None if rate is None else rate_of(rate), options["codec"],
        codec_options, sound, options["bits"], options.get("color"), options.get("keep_layers", False),
        options.get("output_layer"), options.get("sheet"),
    )  # fmt: skip
