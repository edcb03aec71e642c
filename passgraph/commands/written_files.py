"""Files on the command line: classify them, and check that they can be written before anything is computed."""

from __future__ import annotations

import os
from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING

import click

from passgraph.arguments import parsed_fraction, shown
from passgraph.color_tags import ColorSpace, Recoded
from passgraph.errors import InputError, reason
from passgraph.files.animation import is_animated
from passgraph.files.film import LEAST_RATE, MOST_RATE
from passgraph.files.names import Pattern, has_wildcard, is_film, is_video, unread_files
from passgraph.files.sequences import source_metadata
from passgraph.image_formats import NO_TAGS, WRITABLE, unstated
from passgraph.pictures import check_holds_bits, format_of_suffix, holds_several, split_layer
from passgraph.writing import NewFile

if TYPE_CHECKING:
    from passgraph.files.frame import Source
    from passgraph.files.sequences import ToPictures


#: Suffixes of float formats, which hold linear light, also beyond 1.
FLOAT_SUFFIXES = tuple(suffix for suffix, kind in WRITABLE.items() if kind.is_float)
#: Standard input or output.
STREAM = "-"


def is_one_picture(inputs: tuple[str, ...], output: str) -> bool:
    """Return True for one input picture file and one output picture file."""
    if len(inputs) != 1 or inputs[0] == STREAM or output == STREAM or is_folder(output):
        return False
    path = Path(inputs[0])
    # A single # may be part of the name, as in a#1.png.
    numbered = Pattern.is_in(output) and ("##" in output or "%" in output)
    if numbered or is_film(Path(output)) or is_video(path):
        return False
    if is_animated(path) and not Path(output).suffix:
        return False  # its frames go into a folder
    if path.is_dir():
        # Its pictures go into a folder or are numbered; for other outputs the error expects a picture.
        return bool(Path(output).suffix) and not Pattern.is_in(output)
    return os.path.lexists(path) or not (Pattern.is_in(inputs[0]) or has_wildcard(inputs[0]))


def is_several(path: Path) -> bool:
    """Return True if a picture parameter names frames: a stream, a folder, a sequence, a video or an animation."""
    text = os.fspath(path)
    if os.path.lexists(path):
        return path.is_dir() or is_video(path) or is_animated(path)
    return text == STREAM or Pattern.is_in(text) or has_wildcard(text) or is_video(path)


def is_folder(output: str) -> bool:
    return output.endswith(("/", os.sep)) or (output != STREAM and Path(output).is_dir())


def tell_of_several(paths: Iterable[Path]) -> None:
    """Warn about files with several pictures, of which only the first is read."""
    if found := [path for path in paths if path.is_file() and (is_animated(path) or holds_several(path))]:
        more = len(found) - 1
        rest_text = f", and so {'does 1 other' if more == 1 else f'do {more} others'}" if more else ""
        mend = "; for all of them: -o out.gif, out.mp4 or out/" if is_animated(found[0]) else ""
        click.echo(
            f"passgraph: warning: {found[0]}: holds several pictures{rest_text}; the first is read{mend}", err=True
        )


def tell_of_unread(folder: Path) -> None:
    """Warn about pictures in a folder whose formats are not read, since they are skipped."""
    if found := unread_files(folder):
        more = len(found) - 1
        rest_text = f" and {more} other{'s' if more > 1 else ''} in that folder" if more else ""
        click.echo(
            f"passgraph: warning: {found[0]}{rest_text}: left out, pictures of such a format are not read; "
            "convert them to PNG or OpenEXR",
            err=True,
        )


def tell_of_lost_bits(sink: ToPictures, source: Source) -> None:
    """Warn if 16-bit pictures are written in an 8-bit format."""
    if loss := sink.lost_bits(source):
        click.echo(f"passgraph: warning: {loss}", err=True)


def tell_of_lost_space(path: Path, space: ColorSpace | Recoded | None, source: Source) -> None:
    """Warn if an output cannot state the color space of the results, which is by default that of the source."""
    if space is None:
        stated = source_metadata(source).space
        space = None if stated in ("", NO_TAGS) else ColorSpace(stated, stated)
    if not isinstance(space, ColorSpace):
        return
    if is_video(path):
        loss = "" if space.codes else f"videos state no color space {space.name}; its color tags are left out"
    elif is_film(path):
        loss = "" if space.is_srgb else f"animations state no color space {space.name}; readers take them as sRGB"
    else:
        loss = unstated(format_of_suffix(path), space)
    if loss:
        click.echo(f"passgraph: warning: {path}: {loss}", err=True)


def tell_of_lost_layers(paths: list[Path]) -> None:
    """Warn about OpenEXR files without the layers of their inputs, which have another size."""
    if paths:
        more = f", as {len(paths) - 1} more have" if len(paths) > 1 else ""
        click.echo(
            f"passgraph: warning: {min(paths)}: has another size than its input{more}; other layers are left out",
            err=True,
        )


def check_bits(path: Path, bits: int) -> None:
    """Raise InputError for bits a channel that a format of pictures does not hold."""
    if bits > 8:
        check_holds_bits(path, bits)
    if bits == 32 and path.suffix.lower() not in FLOAT_SUFFIXES:
        raise InputError(f"{path}: --bits 32 is for floats ({' '.join(FLOAT_SUFFIXES)}); give 8 or 16, or write those")


def check_picture_path(path: Path) -> None:
    """Raise InputError if a picture cannot be written to a path."""
    format_of_suffix(path)
    check_path(path)


def check_path(path: Path) -> None:
    """Raise InputError if a file cannot be created; tries it with a temporary file."""
    with NewFile(path) as probe:
        probe.temporary.touch(exist_ok=False)


def check_no_video(*options: object) -> None:
    """Raise InputError for options of videos if none is written."""
    if any(options):
        raise InputError("--rate, --codec and --codec-option are for videos, and none is written; name one: -o out.mp4")


def check_folder(path: Path) -> None:
    """Create a folder for files, or raise InputError."""
    try:
        path.mkdir(exist_ok=True)
    except OSError as error:
        raise InputError(f"{path}: cannot be made a folder ({reason(error)}); make its parent first") from error
    check_path(path / "probe")


def check_apart(inputs: Iterable[Path], outputs: Iterable[tuple[Path, str]]) -> None:
    """Raise InputError for outputs that are inputs, also through links, and for two outputs of the same name."""
    read = {identity: path for path in inputs for identity in _identities(split_layer(path)[0])}
    written: dict[object, str] = {}
    for path, what in outputs:
        for identity in _identities(path):
            if identity in read:
                raise InputError(f"{path}: would overwrite the input {read[identity]}; give the output another name")
        name = os.path.realpath(path)
        if name in written:
            raise InputError(f"{path}: {written[name]} and {what} would both be written to it; run them apart")
        written[name] = what


def _identities(path: Path) -> list[object]:
    """Return keys that identify a file: its resolved path, and its inode if it exists."""
    try:
        status = os.stat(path)
    except (OSError, ValueError):
        return [os.path.realpath(path)]
    return [os.path.realpath(path), (status.st_dev, status.st_ino)]


def rate_of(text: str) -> Fraction:
    """Parse frames a second: 25, 23.976, 30000/1001."""
    try:
        rate = parsed_fraction(text)
    except ValueError:
        rate = Fraction(0)
    if not LEAST_RATE <= rate <= MOST_RATE:
        raise InputError(
            f"--rate {shown(text)}: expected frames a second from {LEAST_RATE} to {MOST_RATE}, such as 25 or 30000/1001"
        )
    return rate
