"""Turn command-line arguments into a graph and its inputs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click
import numpy as np
from numpy.typing import NDArray

from passgraph.commands.options import (
    Decorated,
    effect_option,
    given_parameters,
    named_or_refused,
    size_option,
    together,
)
from passgraph.commands.written_files import is_several
from passgraph.effects.effect_table import Effect
from passgraph.errors import InputError
from passgraph.graph.calls import kernel
from passgraph.graph.run_values import Value, sources_of
from passgraph.graph.targets import Input, InputSpec, Target, named_outputs, target
from passgraph.language import Image, vec2, vec3, vec4
from passgraph.pictures import load, load_stored
from passgraph.proxies import sampled
from passgraph.records import dataclass
from passgraph.run.caller_arrays import format_of
from passgraph.signatures import signature

if TYPE_CHECKING:
    from passgraph.scene import Scene
    from passgraph.scene.projection import HardwareDepth

#: Default size of rendered pictures.
RENDER_SIZE = (1280, 720)


@dataclass(frozen=True)
class Job:
    """A graph, its output's size, and the inputs and values of a run.

    Attributes
    ----------
    frames_before : runs before the one whose results are wanted, for a graph with history
    at : what only one run is given, by its number from 0
    """

    outputs: dict[str, Target]
    size: tuple[int, int]
    given: dict[str, Any] = field(default_factory=dict)
    frames_before: int = 0
    at: Callable[[int], Mapping[str, Any]] = lambda number: {}

    def given_at(self, number: int) -> dict[str, Any]:
        """Return the inputs and values of a run."""
        return {**self.given, **self.at(number)}

    @property
    def holds_bytes(self) -> bool:
        """True if all input pictures have 8 bits a channel."""
        pictures = [value for value in self.given.values() if isinstance(value, np.ndarray)]
        return bool(pictures) and all(picture.dtype == np.uint8 for picture in pictures)


def subject_options(what: str, size: tuple[int, int]) -> Callable[[Decorated], Decorated]:
    """Return the options of a command on an effect and its input; `subject` makes its job."""
    return together(
        click.argument("source", metavar="[SCENE_OR_PICTURE]", required=False, type=click.Path(path_type=Path)),
        effect_option(what),
        size_option(size),
        click.option("--depth", type=click.Path(path_type=Path), help="Depth picture, for effects that need one."),
        click.option("--linear", is_flag=True, help="Decode 8- and 16-bit pictures from sRGB to linear light first."),
    )


def subject(ctx: click.Context) -> Job:
    """Return the job of a command with `subject_options`: its effect on a scene, a flat world or a picture."""
    source, size, parameters = ctx.params["source"], ctx.params["size"], given_parameters(ctx)
    effect = named_or_refused(ctx, source)
    if effect.takes in ("scene", "world2d"):
        return scene_job(effect, source, size, parameters)
    if effect.takes == "nothing":
        return generator_job(effect, source, size, parameters)
    if source is None:
        raise InputError(f"effect {effect.name} needs a picture: name a file")
    return picture_job(effect, source, ctx.params["depth"], ctx.params["linear"], parameters)


def picture_job(
    effect: Effect, path: Path, depth: Path | None, linear: bool, parameters: dict[str, Any],
    holds: HardwareDepth | None = None, *, overscan: bool = False,
) -> Job:  # fmt: skip
    """Return the job of an effect on a picture file.

    ``holds`` is the encoding of ``depth`` from an engine's buffer; ``overscan`` as for `passgraph.load`.
    """
    pictures = {"frame": load_frame(path, linear, overscan=overscan)}
    if effect.needs_depth or (effect.takes == "picture+depth" and depth is not None):
        if depth is None:
            raise InputError(f"effect {effect.name} needs --depth FILE: linear depth of each pixel of {path}")
        pictures["depth"] = load_depth(depth, overscan=overscan)
        if pictures["depth"].shape[:2] != pictures["frame"].shape[:2]:
            sizes = [_size_text(pictures[name]) for name in ("depth", "frame")]
            raise InputError(f"{depth}: is {sizes[0]} pixels, and {path} is {sizes[1]}")
    elif depth is not None:
        raise InputError(f"effect {effect.name} takes no --depth")
    return job_of_pictures(effect, pictures, linear, parameters, holds, overscan=overscan)


def job_of_pictures(
    effect: Effect,
    pictures: Mapping[str, NDArray[Any]],
    linear: bool,
    parameters: dict[str, Any],
    holds: HardwareDepth | None = None,
    *,
    overscan: bool = False,
) -> Job:
    """Return the job of an effect on a picture "frame" and its "depth"; opaque pictures need no alpha handling."""
    parameters, more_pictures = picture_parameters(effect, parameters, overscan=overscan)
    if all(map(is_opaque, [pictures["frame"], *more_pictures.values()])):
        effect = effect.for_opaque()
    targets = [input_of("frame", pictures["frame"], linear)]
    if "depth" in pictures:
        targets.append(as_distance(input_of("depth", pictures["depth"]), holds))
    height, width = pictures["frame"].shape[:2]
    return Job(
        named_outputs(effect_output(effect, targets, parameters)), (width, height), {**pictures, **more_pictures}
    )


def generator_job(effect: Effect, path: Path | None, size: tuple[int, int] | None, parameters: dict[str, Any]) -> Job:
    """Return the job of an effect that generates its picture from parameters alone."""
    if path is not None:
        raise InputError(f"effect {effect.name} takes no picture, got {path}; it makes one of --size")
    parameters, pictures = picture_parameters(effect, parameters)
    return Job(named_outputs(effect.build(**parameters)), size or RENDER_SIZE, pictures)


def as_distance(depth: Target, holds: HardwareDepth | None) -> Target:
    """Return distances for effects: a depth as it is, or converted from an engine's buffer."""
    if holds is None:
        return depth
    from passgraph.effects.surfaces.engine_depth import distances

    return distances(depth, holds)


def pictures_beside(effect: Effect, parameters: dict[str, Any]) -> dict[str, Path]:
    """Return the picture parameters that name sequences or videos, read in step with the input."""
    named = {p.name: parameters.get(p.name) for p in effect.parameters if p.type == "picture"}
    return {name: path for name, path in named.items() if isinstance(path, Path) and is_several(path)}


def picture_parameters(
    effect: Effect, parameters: dict[str, Any], *, overscan: bool = False, proxy: int = 1
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Replace picture files among the parameters by graph inputs; return the parameters, and the pictures by name."""
    replaced, given = dict(parameters), dict[str, Any]()
    for parameter in effect.parameters:
        if parameter.type == "picture" and parameters.get(parameter.name) is not None:
            picture = sampled(load(parameters[parameter.name], overscan=overscan), proxy)
            given[parameter.name] = picture * np.float32(velocity_scale(parameter.name, proxy))
            replaced[parameter.name] = input_of(parameter.name, given[parameter.name])
    return replaced, given


def velocity_scale(parameter: str, proxy: int) -> float:
    """Return the factor of a picture parameter for a proxy: that of a velocity, whose values are pixels, is 1/proxy."""
    return 1 / proxy if parameter.endswith("velocity") else 1.0


def effect_output(effect: Effect, targets: list[Target], parameters: dict[str, Any]) -> Any:
    """Call an effect; an input that is returned unchanged gets a copy pass."""
    result = effect.build(*targets, **parameters)
    if isinstance(result, Target) and result.made_by is None:
        # For example, a blur of radius 0 returns its input.
        return kernel(source="def unchanged(color: Image) -> vec4: return color[0, 0]")(result)
    return result


def scene_job(
    effect: Effect, path: Path | None, size: tuple[int, int] | None, parameters: dict[str, Any],
    scene: Scene | None = None,
) -> Job:  # fmt: skip
    """Return the job of an effect on a scene, or on the flat world of a JSON file.

    ``scene`` is one that is loaded already; without a path it is the shipped one.
    """
    size = size or RENDER_SIZE
    if effect.takes == "world2d":
        from passgraph.effects.light2d import World2D

        world = World2D.shipped() if path is None else World2D.load(path)
        return Job(named_outputs(effect.build(world, size, **parameters)), size)
    scene = scene or load_scene(path)
    outputs = named_outputs(effect.build(scene, **parameters))
    return Job(outputs, size, values_of(scene, outputs))


def load_scene(path: Path | None, *, up: Literal["y", "z"] | None = None, ground: bool | None = None) -> Scene:
    """Load a scene file with the arguments of `passgraph.Scene.load`, or the shipped scene, which takes none."""
    from passgraph.scene import Scene

    if path is None and up is not None:
        raise InputError("--up is for files, and the scene that comes with passgraph has y up; leave it out")
    scene = Scene.shipped() if path is None else Scene.load(path, ground=ground, up=up)
    for line in scene.warnings:
        click.echo(f"passgraph: warning: {line}", err=True)
    return scene


def values_of(scene: Scene, outputs: dict[str, Target]) -> dict[str, Any]:
    """Return a scene's own camera and lights for run values without a default."""
    known: dict[str, Any] = {"camera": scene.camera, "previous_camera": scene.camera, "lights": scene.lights}
    known |= {f"light{i}": light for i, light in enumerate(scene.lights)}
    if scene.lights:
        known["light"] = scene.lights[0]
    return {
        source.name: known[source.name]
        for source in run_values(outputs)
        if source.default is None and source.name in known
    }


def run_values(outputs: dict[str, Target]) -> Iterator[Value]:
    """Yield the run values of a graph, perhaps repeatedly."""
    from passgraph.graph.calls import graph

    for node, kind in graph(*outputs.values()).nodes(data="kind"):
        if kind == "pass":
            yield from sources_of(node.values)


@kernel
def one_channel(color: Image) -> float:
    return color[0, 0].r


@kernel
def two_channels(color: Image) -> vec2:
    return color[0, 0].rg


@kernel
def three_channels(color: Image) -> vec3:
    return color[0, 0].rgb


@kernel
def four_channels(color: Image) -> vec4:
    return color[0, 0]


#: Kernels that copy a picture, by its channels. Not from text, which would import the compiler.
_COPIES = (one_channel, two_channels, three_channels, four_channels)


def in_bytes(outputs: dict[str, Target]) -> dict[str, Target]:
    """Convert outputs to 8 bits by a further pass, which is fused into the last one."""
    converted = {}
    for name, output in outputs.items():
        channels = output.spec.format.channels if output.spec.format else 4
        converted[name] = _COPIES[channels - 1](output, into=target(f"{name} in bytes", f"{'rgba'[:channels]}8"))
    return converted


def load_frame(path: Path, linear: bool, *, overscan: bool = False) -> NDArray[Any]:
    """Load a picture in its file's dtype; as float32 if it must be decoded and no sRGB format exists for it."""
    return as_frame(load_stored(path, linear=linear, overscan=overscan), linear)


def as_frame(picture: NDArray[Any], linear: bool) -> NDArray[Any]:
    """Convert a picture as stored in its file to the input "frame"."""
    from passgraph.files.stored import as_program_input

    return as_program_input(picture, InputSpec("frame", srgb=True), linear)


def load_depth(path: Path, *, overscan: bool = False) -> NDArray[np.float32]:
    """Load linear depth, (height, width, 1)."""
    return load(path, overscan=overscan)[:, :, :1]


def is_opaque(picture: NDArray[Any]) -> bool:
    """Return True if a picture has no alpha, or one of 1 everywhere.

    >>> is_opaque(np.full((2, 3, 4), 255, np.uint8)), is_opaque(np.zeros((2, 3, 4), np.float32))
    (True, False)
    >>> is_opaque(np.zeros((2, 3, 3), np.uint8))
    True
    """
    if picture.shape[-1] != 4:
        return int(picture.shape[-1]) != 2
    if picture.dtype.kind == "f":
        return not bool((picture[..., 3] != 1.0).any())
    # Alpha is a pixel's highest byte or word; comparing one integer a pixel takes a third of the time.
    pixels = picture.view(np.dtype(f"<u{4 * picture.itemsize}"))
    return bool(pixels.min() >= np.iinfo(picture.dtype).max << (24 * picture.itemsize))


def input_of(name: str, picture: NDArray[Any], linear: bool = False) -> Target:
    height, width, channels = picture.shape
    return Input(name, format_of(picture.dtype, channels, linear), (width, height))


def _size_text(picture: NDArray[Any]) -> str:
    return f"{picture.shape[1]}x{picture.shape[0]}"


def accepts(effect: Effect, parameter: str) -> bool:
    """Return True if an effect's function has a keyword, also one that its parameter table does not list."""
    return parameter in signature(effect.function).parameters
