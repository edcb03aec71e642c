"""Apply an effect to one picture tile by tile, if the whole picture takes more memory than ``--memory``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import click
import numpy as np
from numpy.typing import NDArray

from passgraph.commands.command_graph import as_distance, effect_output, load_depth, picture_parameters
from passgraph.commands.running import RunOptions
from passgraph.commands.written_files import FLOAT_SUFFIXES
from passgraph.errors import GraphError, InputError
from passgraph.files.stored import as_program_input
from passgraph.graph.targets import Input, InputSpec, named_outputs
from passgraph.image_files import opened_image
from passgraph.pictures import load_stored, metadata_of, save, split_layer
from passgraph.plan.build import build
from passgraph.plan.data import Options, Plan
from passgraph.plan.limits import SHARE, enough, format_bytes, machine_memory
from passgraph.plan.window import footprint
from passgraph.run.caller_arrays import format_of

if TYPE_CHECKING:
    from passgraph.color_tags import ColorSpace, Recoded
    from passgraph.effects.effect_table import Effect
    from passgraph.graph.targets import Target
    from passgraph.image_files import ImageFile
    from passgraph.scene.projection import HardwareDepth
    from passgraph.tiles.grid import Grid, Numbers

#: Files that tiles read from, and write to, in parts.
READ_IN_PARTS, WRITTEN_IN_PARTS = (".tif", ".tiff", ".exr"), (".tif", ".tiff", ".exr")
#: Bytes of a pixel in a graph of many targets. A picture that fits at this size is computed whole without a plan.
MANY_BYTES = 512
#: Bytes of memory for each byte of a result that is saved from an array: itself, and its encoded file.
SAVING = 2.3


@dataclass(frozen=True)
class LargePicture:
    """A picture file that is computed in tiles, with its settings.

    Attributes
    ----------
    size : (width, height) in pixels
    channels, dtype : as tiles read them
    in_parts : True if tiles read parts of the file; else it is held whole, as `passgraph.pictures.load_stored` returns
    linear : decode integers from sRGB
    memory : limit in bytes
    """

    path: Path
    size: tuple[int, int]
    channels: int
    dtype: np.dtype[Any]
    in_parts: bool
    has_alpha: bool
    linear: bool
    memory: int

    @property
    def pixels(self) -> int:
        return self.size[0] * self.size[1]

    @property
    def held_bytes(self) -> int:
        return 0 if self.in_parts else self.pixels * self.channels * self.dtype.itemsize

    def target(self) -> Target:
        """Return the graph's input, as of the whole picture: 16-bit integers in linear light become floats."""
        own = format_of(self.dtype, self.channels, self.linear)
        decoded = self.linear and self.dtype.kind == "u" and not own.srgb
        return Input("frame", format_of(np.dtype(np.float32), self.channels) if decoded else own, self.size)

    def source(self) -> Any:
        """Return what `passgraph.tiled` reads."""
        if self.in_parts:
            return self.path
        stored = load_stored(self.path, linear=self.linear)
        return _Decoded(stored, self.linear) if self.linear and stored.dtype.kind == "u" else stored


class _Decoded:
    """An array whose integers are decoded from sRGB where they are read, unless the program decodes them."""

    def __init__(self, stored: NDArray[Any], linear: bool) -> None:
        self._stored, self._linear, self.shape = stored, linear, stored.shape
        self.dtype = self[:1, :1].dtype

    def __getitem__(self, key: tuple[slice, slice]) -> Numbers:
        return as_program_input(self._stored[key], InputSpec("frame", srgb=True), self._linear)


def large_picture(
    path: Path, linear: bool, memory: int | None, *, takes_gray: bool, alone: bool = False
) -> LargePicture | None:
    """Return a picture that may need tiles; None for one that is small, or whose header cannot be read.

    ``takes_gray``: a gray picture may have one channel; else it is red, green and blue. ``alone``: None too for one of
    several layers, and for one with overscan, which are kept whole.
    """
    limit = int(SHARE * machine_memory()) if memory is None else memory
    file, layer = split_layer(path)
    try:
        with opened_image(file, layer=layer) as image:
            width, height, has_alpha = image.width, image.height, image.has_alpha
            dtype = np.dtype(np.float32) if image.dtype.kind == "f" else image.dtype
            if width * height * MANY_BYTES <= limit or (alone and not _is_alone(image)):
                return None
    except (InputError, OSError):
        return None
    in_parts = file.suffix.lower() in READ_IN_PARTS and not (linear and dtype.kind == "u")
    channels, dtype_of_parts = (_readable_parts(path, takes_gray) if in_parts else None) or (0, dtype)
    return LargePicture(
        path, (width, height), channels or 4, dtype_of_parts, channels > 0, has_alpha, linear, limit
    )  # fmt: skip


def _is_alone(image: ImageFile) -> bool:
    """Return True if an OpenEXR file has one layer, which covers the display window and no more."""
    spec = image.spec
    display = (spec.full_x, spec.full_y, spec.full_width, spec.full_height)
    covers = (spec.x, spec.y, spec.width, spec.height) == display
    return covers and spec.nchannels == image.channels and not image.has_second


def _readable_parts(path: Path, takes_gray: bool) -> tuple[int, np.dtype[Any]] | None:
    """Return the channels and dtype of a file that tiles can read; None if it must be read whole."""
    from passgraph.tiles.sources import open_source

    try:
        source = open_source(path, "input 'frame'", 0)
        try:
            if source.is_grey and not takes_gray:
                return None
            source.read((0, 1, 0, 1))  # its compression may have no decoder
            return source.shape[2], source.dtype
        finally:
            source.close()
    except InputError:
        return None


@dataclass(frozen=True)
class TiledJob:
    """A graph with a large picture and its other inputs, to be computed in tiles."""

    picture: LargePicture
    outputs: dict[str, Target]
    inputs: Mapping[str, Any]
    dtype: np.dtype[Any]

    def run(self, output: Path, run: RunOptions, color: ColorSpace | Recoded | None) -> None:
        """Compute and write the result; tell how."""
        start = perf_counter()
        plan, name = _plan(self.outputs, run), next(iter(self.outputs))
        (width, height), format_ = plan.size, plan.resources[plan.outputs[name]].format
        result_bytes = width * height * format_.channels * self.dtype.itemsize
        held = self.picture.held_bytes + sum(array.nbytes for array in self.inputs.values())
        in_parts = output.suffix.lower() in WRITTEN_IN_PARTS and held + SAVING * result_bytes > self.picture.memory / 2
        if not in_parts:
            held += int(SAVING * result_bytes)
        if held >= self.picture.memory:
            raise self._too_little(held, in_parts)
        if in_parts:
            grid = self._tiled(name, output, run, self.picture.memory - held, dtype=self.dtype, color=color)
        else:
            result = np.empty((height, width, format_.channels), self.dtype)
            grid = self._tiled(name, result, run, self.picture.memory - held)
            save(output, result, like=metadata_of(self.picture.path), color=color)
        click.echo(
            f"{output}: {width}x{height} by {run.backend or 'numpy'} in {len(grid)} tiles of "
            f"{grid.core[0]}x{grid.core[1]}; {perf_counter() - start:.2f} s"
        )

    def _tiled(self, name: str, sink: Any, run: RunOptions, memory: int, **options: Any) -> Grid:
        from passgraph.tiles.grid import TooLittleMemoryError
        from passgraph.tiles.tiled import tiled

        sources = {"frame": self.picture.source(), **self.inputs}
        settings = {"backend": run.backend, "options": Options(math=run.math), "non_finite": run.non_finite, **options}
        try:
            return tiled(self.outputs, sources, {name: sink}, memory, **settings)
        except TooLittleMemoryError as error:
            needed = self.picture.memory - memory + error.needed
            raise InputError(
                f"{self.picture.path}: tiles of one pixel, and what is held whole, take {format_bytes(needed)}, and "
                f"--memory is {format_bytes(self.picture.memory)}; give --memory {enough(needed)}"
            ) from None

    def _too_little(self, held: int, in_parts: bool) -> InputError:
        parts = [] if self.picture.in_parts else ["the picture, whose file is not read in parts"]
        parts += [] if in_parts else ["the result, whose file is not written in parts"]
        mend = "" if in_parts or not self.picture.in_parts else f", or write one of {', '.join(WRITTEN_IN_PARTS)}"
        return InputError(
            f"{self.picture.path}: {' and '.join(parts)}, is held whole; that takes {format_bytes(held)}, and "
            f"--memory is {format_bytes(self.picture.memory)}; give --memory {enough(2 * held)}{mend}"
        )


def tiled_job(
    effect: Effect, picture: LargePicture, depth: Path | None, parameters: dict[str, Any], run: RunOptions,
    dtype: np.dtype[Any], holds: HardwareDepth | None = None,
) -> TiledJob | None:  # fmt: skip
    """Return the job of an effect on a large picture; None if the whole fits into the memory.

    Raises
    ------
    InputError
        If it does not fit and cannot be computed in tiles.
    """
    if not picture.has_alpha:
        effect = effect.for_opaque()
    parameters, inputs = picture_parameters(effect, parameters)
    further = []
    if depth is not None:
        inputs["depth"] = load_depth(depth)
        further.append(as_distance(Input("depth", "r32f", picture.size), holds))

    def outputs_on(read: LargePicture) -> dict[str, Target]:
        return named_outputs(effect_output(effect, [read.target(), *further], parameters))

    plan = _plan(outputs_on(replace(picture, channels=4)), run)  # pictures are loaded with four channels
    needed = (
        plan.bytes + picture.pixels * 4 * picture.dtype.itemsize + int(SAVING * picture.pixels * 4 * dtype.itemsize)
    )
    if needed <= picture.memory:
        return None
    try:
        footprint(plan)
    except GraphError as error:
        raise InputError(
            f"{picture.path}: {picture.size[0]}x{picture.size[1]} pixels take about {format_bytes(needed)}, and "
            f"--memory is {format_bytes(picture.memory)}; {str(error).partition('; ')[0]}. Give --memory "
            f"{enough(needed)}, or a smaller picture"
        ) from None
    return TiledJob(picture, outputs_on(picture), inputs, dtype)


def _plan(outputs: dict[str, Target], run: RunOptions) -> Plan:
    return build(outputs, options=Options(static=False, math=run.math), in_windows=True)


def stored_dtype(picture: Path, output: Path, bits: int) -> np.dtype[Any]:
    """Return the dtype that a result of a picture is stored in."""
    if output.suffix.lower() in FLOAT_SUFFIXES:
        is_half = output.suffix.lower() == ".exr" and (bits == 16 or metadata_of(picture).half)
        return np.dtype(np.float16 if is_half else np.float32)
    return np.dtype(f"u{bits // 8}")


def takes_gray(effect: Effect) -> bool:
    """Return True if an effect gives one channel for one channel, as the command applies it to opaque pictures."""
    return effect.for_opaque().alike
