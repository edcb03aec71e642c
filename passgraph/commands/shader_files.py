"""Shader files on the command line: their parameters are options, their pictures files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from passgraph.cached import cached_property
from passgraph.effects.effect_table import Effect
from passgraph.errors import InputError
from passgraph.graph.run_values import FILLED_IN
from passgraph.graph.targets import PixelPass, Target, named_outputs
from passgraph.language import ir
from passgraph.plan.dependencies import passes_behind
from passgraph.ranges import Range
from passgraph.records import dataclass

if TYPE_CHECKING:
    from passgraph.effects.parameters import Parameter, ParameterType
    from passgraph.shaders.containers.effect import ShaderEffect, ShaderParameter


def read_as_volumes(program: ir.TypedKernel) -> list[str]:
    """Return the images that a kernel reads as volumes."""
    read = ir.expressions(*program.body, *(result.value for result in program.results))
    return list(dict.fromkeys(one.image for one in read if isinstance(one, ir.Property) and one.name == "slices"))


def flat_volumes(outputs: Iterable[Any]) -> list[str]:
    """Return the names of pictures without slices that the targets' passes read as volumes."""
    passes = [node for node in passes_behind(list(outputs)) if isinstance(node, PixelPass)]
    return [name for one in passes for name in read_as_volumes(one.kernel.program) if one.images[name].slice_count == 1]


#: Names of the commands' own options, arguments and inputs; a shader's parameter of such a name gets `PREFIX`.
RESERVED = frozenset(
    {
        "alpha", "as_stored", "at", "audio", "backend", "backends", "bits", "capture", "channel", "check_finite",
        "codec", "codec_option", "color_config", "contact_sheet", "depth", "depth_buffer", "drop_layers", "effect",
        "frame", "frames", "from_space", "h", "help", "inputs", "jobs", "keep_layers", "layer", "linear", "math",
        "memory", "most_ambiguous", "most_seconds", "no_sound", "non_finite", "off", "orbit", "output", "pass", "plane",
        "profile", "program", "proxy", "rate", "raw", "resume", "scheduler", "sheet", "size", "sound", "source", "step",
        "svg", "to_space", "warm_up", "web",
    }
)  # fmt: skip
PREFIX = "shader_"


@dataclass(frozen=True)
class ShaderFileEffect(Effect):
    """A shader file as an effect: its first image is the picture, its other images and its parameters are options."""

    @property
    def shader(self) -> ShaderEffect:
        return cast("ShaderEffect", self.function)

    @cached_property
    def own_names(self) -> dict[str, str]:
        """Return the names of options, with underscores → the shader's own names."""
        names: dict[str, str] = {}
        for name in (*self.shader.images[1:], *self.shader.parameters):
            option = name
            while option in RESERVED or option in names or option.removeprefix("no_") in names:
                option = PREFIX + option
            names[option] = name
        return names

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        declared = self.shader.parameters
        return tuple(
            _said(option, declared[name]) if name in declared else _picture(option)
            for option, name in self.own_names.items()
        )

    @property
    def linear(self) -> bool:
        return False

    @property
    def frame_time(self) -> str | None:
        declared = self.shader.parameters
        times = (o for o, name in self.own_names.items() if name in declared and declared[name].is_frame_time)
        return next(times, None)

    @property
    def signals(self) -> tuple[str, ...]:
        return self.shader.signals

    def build(self, *pictures: Any, **parameters_: Any) -> Any:
        return self._of_pictures(
            self.shader(*pictures, **{self.own_names.get(name, name): value for name, value in parameters_.items()})
        )

    def on_inputs(self) -> Mapping[str, Target]:
        """Apply the shader to inputs by its own names; parameters are run values, unless sizes depend on them."""
        import passgraph as pg

        settable = self.shader.parameters.keys() - FILLED_IN.keys() - set(self.shader.constants)
        values: dict[str, Any] = {
            n: pg.Value(n, default=p.default) for n, p in self.shader.parameters.items() if n in settable
        }
        return named_outputs(self._of_pictures(self.shader(*map(pg.Input, self.shader.images), **values)))

    def _of_pictures(self, outputs: Any) -> Any:
        """Return the outputs; raise InputError if a picture is read as a volume."""
        for volume in flat_volumes([outputs]):
            raise InputError(
                f"{self.path}: {volume!r} is a sampler3D, and the command line has pictures only; in Python "
                f"pg.load_shader({self.path!r}) takes a target that says how many slices it has, "
                f"{volume}=table.slices(33)"
            )
        return outputs


def effects_of_shader(path: Path) -> Mapping[str, Effect]:
    """Parse a shader file, without running it, and return its effect by name."""
    from passgraph.shaders.shader_file import load_shader

    shader = load_shader(path)
    takes: Any = "picture" if shader.images else "nothing"
    return {shader.name: ShaderFileEffect(shader.name, str(path), takes, shader.summary, shader)}


def _picture(name: str) -> Parameter:
    from passgraph.effects.parameters import Parameter

    return Parameter(name, "picture", None, Range(), "picture; left out, black and transparent")


def _said(name: str, parameter: ShaderParameter) -> Parameter:
    """Return a shader's parameter for the command line."""
    from passgraph.effects.parameters import Parameter

    default, text = parameter.default, parameter.label
    if parameter.is_frame_time:
        text += "; left out, by the rate of a video"
    if parameter.choices:
        chosen = next((label for label, number in parameter.choices.items() if number == default), None)
        return Parameter(name, "choice", chosen, Range(), text, tuple(parameter.choices))
    known: dict[str, ParameterType] = {"float": "float", "int": "int", "bool": "bool"}
    kind = known.get(str(parameter.type), "value")
    if kind == "float":
        default = float(str(np.float32(default)))  # 0.1, not all digits of the nearest float32
    low, high = parameter.low, parameter.high
    is_range = kind in ("float", "int") and (low is None or high is None or low < high)
    if not is_range and (low is not None or high is not None):
        text = f"{text} (from {low} to {high})".strip()
    limits = Range(low, high) if is_range else Range()
    return Parameter(name, kind, default, limits, text, value_type=parameter.type if kind == "value" else None)
