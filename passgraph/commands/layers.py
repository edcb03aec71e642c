"""Layers and overscan of OpenEXR files, from the inputs of a command to its outputs."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import click

from passgraph.commands.clips import Clip, inputs_of, outputs_of
from passgraph.commands.written_files import STREAM, is_several
from passgraph.errors import InputError
from passgraph.files.frame import Source
from passgraph.files.open import open_source
from passgraph.files.sequences import Pictures, ToPictures
from passgraph.image_files import opened_image
from passgraph.pictures import is_exr, load_stored, split_layer


def keeps_layers(clip: Clip) -> bool:
    """Return True if a clip's outputs are OpenEXR files with the layers of its inputs."""
    if not (isinstance(clip.sink, ToPictures) and clip.sink.keep_layers):
        return False
    files = [*inputs_of(clip.source), *(path for path, _ in outputs_of(clip))]
    return isinstance(clip.source, Pictures) and all(map(is_exr, files))


def keeps_of_named(inputs: tuple[str, ...], output: str, layer: str | None, *, warns: bool) -> bool:
    """Return False for the result of a layer that gets no layer's name: it is no color among the input's layers.

    ``warns``: a warning says so.
    """
    named = [path for path in map(Path, inputs) if split_layer(path)[1] is not None and is_exr(path)]
    if not named or layer is not None:
        return True
    if warns and is_exr(Path(output)):
        file, read = split_layer(named[0])
        click.echo(
            f"passgraph: warning: {output}: holds the result alone; to keep the layers of {file}, name that of the "
            f"result: -o {output}:{read}",
            err=True,
        )
    return False


def read_overscan(clips: Iterable[Clip], further: Iterable[Source], stills: Iterable[Path]) -> bool:
    """Have clips whose layers are kept, and the sources beside them, read the overscan; return True if they do.

    ``stills`` are files that the caller reads, and a sequence of depth.
    """
    files = [path for path in stills if not is_several(path)]
    depths = [open_source(path) for path in stills if is_several(path) and path.name != STREAM]
    beside = [source for source in [*further, *depths] if isinstance(source, Pictures)]
    files += [path for source in beside for path in list(source.paths.values())[:1]]
    keeping = [clip.source for clip in clips if keeps_layers(clip) and isinstance(clip.source, Pictures)]
    keeping = [source for source in keeping if reads_overscan(next(iter(source.paths.values())), files)]
    for source in [*keeping, *(beside if keeping else [])]:
        source.overscan = True
    return bool(keeping)


def reads_overscan(frame: Path, further: Iterable[Path]) -> bool:
    """Return True if a frame is read with its overscan; further pictures of its display window's size prevent that."""
    display, whole = (_size(frame, overscan=overscan) for overscan in (False, True))
    if display == whole:
        return True
    plain = next((path for path in further if _size(path, overscan=True) == display != whole), None)
    if plain is not None:
        click.echo(
            f"passgraph: warning: {plain}: has no overscan as {frame} has; that of the result stays as it was", err=True
        )
    return plain is None


def _size(path: Path, *, overscan: bool) -> tuple[int, int]:
    """Return the width and height of a picture file."""
    file, layer = split_layer(path)
    try:
        with opened_image(file, layer=layer, overscan=overscan) as image:
            return image.width, image.height
    except (InputError, OSError):  # npy, or what reading it reports
        picture = load_stored(path)
        return picture.shape[1], picture.shape[0]
