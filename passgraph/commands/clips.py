"""Turn command-line inputs and outputs into sources and sinks of frames, and check them before anything is computed."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import field
from fractions import Fraction
from glob import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from passgraph.color_tags import ColorSpace, Recoded
from passgraph.commands.written_files import (
    STREAM,
    check_apart,
    check_bits,
    check_folder,
    check_no_video,
    check_path,
    check_picture_path,
    is_folder,
    tell_of_lost_bits,
    tell_of_lost_space,
    tell_of_unread,
)
from passgraph.errors import InputError
from passgraph.files.animation import Animation, is_animated
from passgraph.files.animation_sink import ToAnimation
from passgraph.files.contact_sheet import ToContactSheet
from passgraph.files.film import Film, rate_given
from passgraph.files.frame import Sink, Source
from passgraph.files.names import Pattern, folder_files, glob_files, has_wildcard, is_film, is_video, missing_numbers
from passgraph.files.open import open_source
from passgraph.files.pipe import Pipe, Raw, ToPipe
from passgraph.files.sequences import Pictures, Repeated, Still, ToPictures
from passgraph.files.video import INTERLACED, Video
from passgraph.files.video_sink import ToVideo
from passgraph.gain_map import HDR
from passgraph.image_formats import WRITABLE
from passgraph.pictures import in_layer, split_layer
from passgraph.reading import check_regular
from passgraph.records import dataclass

if TYPE_CHECKING:
    from passgraph.scene import HardwareDepth


class DepthBuffer(click.ParamType):  # type: ignore[type-arg]  # generic in newer clicks only
    """NEAR:FAR, optionally followed by ``,reversed`` or ``,orthographic``."""

    name = "depth buffer"
    words = ("reversed", "orthographic")

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> HardwareDepth:
        from passgraph.scene import HardwareDepth

        if isinstance(value, HardwareDepth):
            return value
        planes, *words = str(value).split(",")
        near, colon, far = planes.partition(":")
        try:
            if not colon or any(word not in self.words for word in words):
                raise ValueError
            return HardwareDepth(float(near), float(far), "reversed" in words, "orthographic" in words)
        except (ValueError, InputError) as error:
            why = f" ({error})" if isinstance(error, InputError) else ""
            self.fail(
                f"{value!r}: expected NEAR:FAR with 0 < NEAR < FAR, then ,reversed or ,orthographic where it is so, "
                f"such as 0.1:1000 or 0.1:inf,reversed{why}",
                param,
                ctx,
            )


def depth_buffer_option() -> click.Option:
    return click.Option(
        ["--depth-buffer"],
        type=DepthBuffer(),
        metavar="NEAR:FAR[,reversed][,orthographic]",
        help="The depth is an engine's buffer, from 0 to 1 (16-bit PNG too); FAR may be inf. Left out, a distance.",
    )


def depth_option(required: bool) -> click.Option:
    return click.Option(
        ["--depth"],
        required=required,
        type=click.Path(path_type=Path),
        help="Picture whose red is each pixel's linear depth (EXR or npy, scene units), or a sequence of them.",
    )


@dataclass(frozen=True)
class Writing:
    """Output settings from the command line."""

    raw: Raw | None = None
    rate: Fraction | None = None
    codec: str | None = None
    codec_options: dict[str, str] = field(default_factory=dict)
    sound: bool | Path = True
    bits: int | None = None
    color: ColorSpace | Recoded | None = None
    #: Whether other layers of OpenEXR files are kept, and the layer that results become.
    keep_layers: bool = False
    layer: str | None = None
    #: Columns and rows of a contact sheet.
    sheet: tuple[int, int] | None = None

    def pictures(self, paths: Mapping[int, Path] | Pattern) -> ToPictures:
        return ToPictures(paths, self.bits, self.color, keep_layers=self.keep_layers, layer=self.layer)

    def film(self, path: Path) -> Film:
        if not is_video(path):
            return ToAnimation(path, rate=self.rate, color=self.color)
        return ToVideo(
            path, rate=self.rate, codec=self.codec, options=self.codec_options, sound=self.sound, color=self.color
        )


@dataclass(frozen=True)
class Clip:
    """The source of one clip, in which history continues, and its sink."""

    source: Source
    sink: Sink

    @property
    def rate(self) -> Fraction | None:
        """Frames a second; None for pictures."""
        return self.sink.rate_for(self.source) if isinstance(self.sink, Film) else rate_given(self.source)


def sources_of(inputs: Iterable[str], raw: Raw | None, broken: list[str]) -> Iterator[Source]:
    """Yield the sources in order; consecutive pictures form one. Errors of unreadable videos go to ``broken``."""
    loose = list[Path]()
    for text in inputs:
        path, layer = split_layer(Path(text))
        is_moving = is_video(path) or is_animated(path)
        if text != STREAM and not path.is_dir() and os.path.lexists(path) and not is_moving:
            loose.append(in_layer(path, layer))
            continue
        yield from _together(loose)
        loose = []
        if text == STREAM:
            yield Pipe(sys.stdin.buffer, raw)
        elif path.is_dir():
            tell_of_unread(path)
            yield from _mixed(folder_files(path), text, broken)
        elif not os.path.lexists(path) and Pattern.is_in(text):
            files = {number: in_layer(file, layer) for number, file in _numbered(os.fspath(path)).items()}
            yield from _mixed(list(files.values()), text, broken) if is_video(path) else [Pictures(files, text)]
        elif has_wildcard(text):
            yield from _mixed([in_layer(file, layer) for file in glob_files(os.fspath(path))], text, broken)
        elif is_moving:
            yield from _mixed([path], text, broken)
        else:
            check_regular(path, "a picture file")  # raises InputError, since the file is missing
    yield from _together(loose)


def inputs_in_layer(inputs: tuple[str, ...], layer: str | None) -> tuple[str, ...]:
    """Return INPUT… with the layer of ``--layer``, as in shot.exr:diffuse; folders become their files with layers.

    >>> inputs_in_layer(("shot.%04d.exr",), "diffuse")
    ('shot.%04d.exr:diffuse',)
    """
    if layer is None:
        return inputs
    names = "*.jpg" if layer == HDR else "*.exr"
    files = [os.path.join(escape(text), names) if Path(text).is_dir() else text for text in inputs]
    for file in files:
        if split_layer(Path(f"{file}:{layer}"))[1] != layer:
            raise InputError(
                f"--layer {layer}: is for OpenEXR files (.exr), and hdr for JPEG files (.jpg), got {file}; leave it out"
            )
    return tuple(f"{file}:{layer}" for file in files)


def _together(paths: list[Path]) -> Iterator[Source]:
    if paths:
        for path in paths:
            check_regular(split_layer(path)[0], "a picture file")
        yield Pictures(paths)


def _mixed(paths: list[Path], name: str, broken: list[str]) -> Iterator[Source]:
    """Yield the pictures among files as one source, then each video and animation."""
    moving = {path: Video if is_video(path) else Animation for path in paths if is_video(path) or is_animated(path)}
    pictures = [path for path in paths if path not in moving]
    if pictures:
        yield Pictures(pictures, name)
    for path, opened in moving.items():
        try:
            yield opened(path)
        except InputError as error:
            broken.append(str(error))


def _numbered(text: str) -> dict[int, Path]:
    files = Pattern(text).files()
    missing = missing_numbers(files)
    if missing:
        click.echo(f"passgraph: warning: {text}: frames {missing} are not there", err=True)
    return files


def clips_of(sources: list[Source], output: str, writing: Writing) -> list[Clip]:
    """Pair each source with its output."""
    if writing.sheet is not None:
        if len(sources) != 1:
            raise InputError(f"{output}: --contact-sheet shows one sequence or video, and there are {len(sources)}")
        return [Clip(sources[0], ToContactSheet(Path(output), writing.sheet[0]))]
    if goes_into_folder(output):
        return [Clip(source, _into_folder(source, Path(output), writing)) for source in sources]
    if len(sources) != 1 and not (Pattern.is_in(output) and all(isinstance(s, Pictures) for s in sources)):
        what = " and ".join(source.name for source in sources[:2]) + (" and others" if len(sources) > 2 else "")
        raise InputError(f"{output}: {what} would all be written to it; give a folder: -o out/")
    return [Clip(source, _sink(source, output, writing)) for source in sources]


def _sink(source: Source, output: str, writing: Writing) -> Sink:
    if output == STREAM:
        if sys.stdout.isatty():
            raise InputError("pictures are not written to a terminal; send the output on, as in: -o - | ffplay -")
        return ToPipe(sys.stdout.buffer, writing.raw, color=writing.color)
    if Pattern.is_in(output):
        return writing.pictures(Pattern(output))
    if is_film(Path(output)):
        return writing.film(Path(output))
    if isinstance(source, Pictures) and source.count == 1:
        return writing.pictures(dict.fromkeys(source.paths, Path(output)))
    count = f"{source.count} frames" if source.count else "frames"
    raise InputError(
        f"{output}: is one picture, and there are {count} of {source.name}; give a folder (-o out/), a numbered "
        "sequence (-o out.%04d.png), a video (-o out.mp4) or an animation (-o out.gif)"
    )


def _into_folder(source: Source, folder: Path, writing: Writing) -> Sink:
    """Return a sink that writes the same names into a folder; formats that cannot be written become PNG."""
    if isinstance(source, (Animation, Repeated)):
        path = folder / _written_name(source.path if isinstance(source, Animation) else source.paths[1])
        return writing.pictures(Pattern(os.fspath(path.with_name(f"{path.stem}.%04d{path.suffix}"))))
    if isinstance(source, Pictures):
        return writing.pictures({number: folder / _written_name(path) for number, path in source.paths.items()})
    if isinstance(source, Video):
        return writing.film(folder / source.path.name)
    raise InputError(f"{folder}: nothing names the files of {source.name}; give numbers: -o {folder}/%04d.png")


def _written_name(path: Path) -> str:
    file, _ = split_layer(path)
    return file.name if file.suffix.lower() in WRITABLE else f"{file.stem}.png"


def goes_into_folder(output: str) -> bool:
    """Return True if an output is a folder, or will be one: a name without a suffix."""
    return is_folder(output) or (not Path(output).suffix and output != STREAM and not Pattern.is_in(output))


def inputs_of(source: Source) -> list[Path]:
    if isinstance(source, Pictures):
        return list(source.paths.values())
    return [source.path] if isinstance(source, (Animation, Video)) else []


def outputs_of(clip: Clip) -> list[tuple[Path, str]]:
    """Return the known output files of a clip, each with its purpose."""
    if isinstance(clip.sink, (Film, ToContactSheet)):
        return [(clip.sink.path, clip.source.name)]
    if isinstance(clip.sink, ToPictures) and isinstance(clip.source, Pictures):
        paths = clip.sink.paths
        return [
            (paths.path(number) if isinstance(paths, Pattern) else paths[number], os.fspath(path))
            for number, path in clip.source.paths.items()
        ]
    if isinstance(clip.sink, ToPictures) and isinstance(clip.sink.paths, Pattern):
        return [(clip.sink.paths.path(1), clip.source.name)]
    return []


def check_writing(writing: Writing, clips: list[Clip]) -> None:
    """Raise InputError for options that apply to none of the clips."""
    films = [clip for clip in clips if isinstance(clip.sink, Film)]
    if not films:
        check_no_video(writing.rate)
    if not any(isinstance(clip.sink, ToVideo) for clip in films):
        check_no_video(writing.codec, writing.codec_options)
    if writing.rate and any(isinstance(clip.source, (Animation, Video)) for clip in films):
        raise InputError("--rate is for videos made of pictures; frames of a video keep their times; leave it out")
    if writing.bits in (16, 32):
        paths = [path for clip in clips if isinstance(clip.sink, ToPictures) for path, _ in outputs_of(clip)]
        if not paths:
            raise InputError("--bits is for picture files, and none is written; name some: -o out.%04d.png")
        for path in paths:
            check_bits(path, writing.bits)
    for clip in clips:
        if isinstance(clip.sink, ToPictures):
            tell_of_lost_bits(clip.sink, clip.source)
            if outputs := outputs_of(clip):
                tell_of_lost_space(outputs[0][0], writing.color, clip.source)
        if isinstance(clip.sink, Film):
            tell_of_lost_space(clip.sink.path, writing.color, clip.source)
        if isinstance(clip.source, Video) and clip.source.is_interlaced:
            click.echo(f"passgraph: warning: {clip.source.path}: {INTERLACED}", err=True)
    if writing.raw and not any(isinstance(clip.source, Pipe) or isinstance(clip.sink, ToPipe) for clip in clips):
        raise InputError("--raw is for streams, and none is read or written; name one: -o -")


def check_clips(clips: list[Clip], output: str, more_inputs: Iterable[Path] = ()) -> None:
    """Raise InputError for an output that cannot be written, that is an input, or that has the name of another.

    The folder of several pictures is made if its parent is there.

    ``more_inputs`` are further files that are read.
    """
    inputs = {path for clip in clips for path in inputs_of(clip.source)} | set(more_inputs)
    check_apart(inputs, [out for clip in clips for out in outputs_of(clip)])
    if goes_into_folder(output):
        check_folder(Path(output))
    elif output != STREAM and Pattern.is_in(output):
        check_folder(Path(output).parent)
    for clip in clips:
        if isinstance(clip.sink, Film):
            check_path(clip.sink.path)
        elif outputs := outputs_of(clip):
            check_picture_path(outputs[0][0])
            for suffix in {path.suffix: path for path, _ in outputs}.values():
                check_picture_path(suffix)


def depth_of(path: Path, clips: list[Clip], *, overscan: bool = False) -> Source:
    """Return the source of depth: one picture for all frames, or a sequence in step with them."""
    file, _ = split_layer(path)
    if file.is_dir() or not os.path.lexists(file) or is_video(file):
        return frames_beside(path, clips, overscan=overscan)
    return Still(path, overscan=overscan)


def frames_beside(path: Path, clips: list[Clip], raw: Raw | None = None, *, overscan: bool = False) -> Source:
    """Return the source of frames in step with those of the only clip."""
    text = os.fspath(path)
    if len(clips) != 1 and not is_video(path):
        raise InputError(f"{text}: goes with one sequence, and there are {len(clips)} inputs; run them apart")
    if text != STREAM:
        source = open_source(path)
        if isinstance(source, Pictures):
            source.overscan = overscan
        return source
    if isinstance(clips[0].source, Pipe):
        raise InputError("-: standard input is INPUT already; give another one of the two by a file")
    return Pipe(sys.stdin.buffer, raw)
