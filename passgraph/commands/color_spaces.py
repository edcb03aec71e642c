"""``--from-space`` and ``--to-space``: color spaces of pictures around an effect, which works in scene-linear light."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from passgraph.commands.options import Decorated
from passgraph.commands.written_files import FLOAT_SUFFIXES
from passgraph.effects.effect_table import Effect
from passgraph.errors import InputError
from passgraph.graph.targets import Target

if TYPE_CHECKING:
    from passgraph.effects.parameters import Parameter

#: Aliases in OpenColorIO's built-in configs: what float files and others hold where nothing is said.
LINEAR, ENCODED = "lin_rec709", "srgb_tx"


def color_space_options(command: Decorated) -> Decorated:
    """The two options and the config that they look in."""
    for option in (
        click.option(
            "--to-space", metavar="NAME",
            help="Color space to write, of an OpenColorIO config.  [default: that of --from-space]",
        ),
        click.option(
            "--from-space", metavar="NAME",
            help="Color space of INPUT, of an OpenColorIO config; the effect gets scene-linear light.  "
            "[default, with --to-space: linear Rec. 709 for float files, sRGB for others]",
        ),
        click.option("--color-config", metavar="FILE", help="OpenColorIO config, or ocio://NAME.  [default: $OCIO]"),
    ):  # fmt: skip
        command = option(command)
    return command


def take_color_spaces(effect: Effect, inputs: tuple[str, ...], options: dict[str, Any]) -> Effect:
    """Return the effect between its color transforms, as ``options`` say; they lose the options of this module.

    Pictures are then read as they are stored: their color space says how they are decoded.
    """
    source, result, config = (options.pop(name) for name in ("from_space", "to_space", "color_config"))
    if source is None and result is None:
        if config is not None:
            raise InputError("--color-config goes with --from-space or --to-space")
        return effect
    if source is None:
        from passgraph.pictures import split_layer

        file, _ = split_layer(Path(inputs[0]))
        source = LINEAR if file.suffix.lower() in FLOAT_SUFFIXES else ENCODED
    options["linear"] = False
    return ConvertedEffect(
        effect.name, effect.path, effect.takes, effect.summary, effect.loaded,
        effect=effect, source=source, result=result or source, config=config,
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class ConvertedEffect(Effect):
    """An effect whose picture comes in the space ``source`` and leaves in ``result``; it sees scene-linear light."""

    effect: Effect
    source: str
    result: str
    config: str | None

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return self.effect.parameters

    @property
    def frame_time(self) -> str | None:
        return self.effect.frame_time

    def made(self, *taken: Any, **given: Any) -> Any:
        from passgraph.effects import color_transform

        frame, *rest = taken
        light = color_transform(frame, src=self.source, dst="scene_linear", config=self.config, name="to_scene_linear")
        made = self.effect.made(light, *rest, **given)
        if not isinstance(made, Target):
            raise InputError(f"--to-space: {self.name} makes several pictures; leave out the color spaces")
        name = f"{made.name}_in_space"
        return color_transform(made, src="scene_linear", dst=self.result, config=self.config, name=name)
