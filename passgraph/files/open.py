"""Open sources and sinks by path."""

from __future__ import annotations

import os
from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path

from passgraph import arguments
from passgraph.errors import InputError
from passgraph.files.animation import Animation, is_animated
from passgraph.files.animation_sink import ToAnimation
from passgraph.files.film import Film
from passgraph.files.frame import Sink, Source
from passgraph.files.names import Pattern, folder_files, glob_files, has_wildcard, is_film, is_picture, is_video
from passgraph.files.sequences import Pictures, ToPictures
from passgraph.files.video import Video
from passgraph.files.video_sink import ToVideo
from passgraph.pictures import in_layer, split_layer


def open_source(path: str | os.PathLike[str]) -> Source:
    """Open a video, an animation, a numbered sequence, the pictures of a folder or a wildcard, or one picture."""
    file, layer = split_layer(arguments.path(path, "a source of frames"))
    text, name = os.fspath(file), os.fspath(path)
    if is_video(file):
        return Video(file)
    if is_animated(file):
        return Animation(file)
    if file.is_dir():
        return Pictures(only_pictures(folder_files(file), text), text)
    if os.path.lexists(file):
        return Pictures([in_layer(file, layer)])
    if Pattern.is_in(text):
        return Pictures({number: in_layer(frame, layer) for number, frame in Pattern(text).files().items()}, name)
    if has_wildcard(text):
        return Pictures([in_layer(frame, layer) for frame in only_pictures(glob_files(text), text)], name)
    return Pictures([in_layer(file, layer)])


def only_pictures(paths: Iterable[Path], where: str) -> list[Path]:
    """Return the pictures among files, without the videos."""
    pictures = [path for path in paths if is_picture(path)]
    if not pictures:
        raise InputError(f"{where}: has no pictures; name its videos one by one")
    return pictures


def open_film(path: Path, rate: Fraction | None = None) -> Film:
    """Open a video or an animation for writing; ``rate`` is the frames a second of sources without times."""
    return ToVideo(path, rate=rate) if is_video(path) else ToAnimation(path, rate=rate)


def open_sink(path: str | os.PathLike[str]) -> Sink:
    """Open a video, an animation, or a numbered sequence of pictures for writing."""
    file = arguments.path(path, "where frames go")
    if is_film(file):
        return open_film(file)
    if Pattern.is_in(os.fspath(path)):
        return ToPictures(Pattern(os.fspath(path)))
    raise InputError(
        f"{file}: expected a numbered sequence such as shot.%04d.png, or a video such as shot.mp4, or shot.gif; for "
        "other names give ToPictures({1: path, ...})"
    )
