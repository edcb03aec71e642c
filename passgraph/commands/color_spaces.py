"""``--from-space``, ``--to-space`` and ``--alpha``: color spaces of files, and colors and alpha for the effect."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import click

from passgraph.color_tags import ColorSpace, Recoded
from passgraph.commands.options import Decorated, together
from passgraph.commands.written_files import FLOAT_SUFFIXES
from passgraph.effects.checked import Alpha
from passgraph.effects.effect_table import Effect, making_one
from passgraph.errors import InputError
from passgraph.gain_map import HDR
from passgraph.graph.targets import Target
from passgraph.pictures import metadata_of, split_layer
from passgraph.records import dataclass

if TYPE_CHECKING:
    from passgraph.effects.parameters import Parameter

#: Default color spaces of float files and of others, by their aliases in OpenColorIO's built-in configs.
LINEAR, ENCODED = "lin_rec709", "srgb_tx"


def color_space_options(effect: Effect) -> Callable[[Decorated], Decorated]:
    """Return the options for color spaces, their config, and alpha."""
    return together(
        click.option("--color-config", metavar="FILE", help="OpenColorIO config, or ocio://NAME.  [default: $OCIO]"),
        click.option(
            "--from-space", metavar="NAME",
            help="Color space of INPUT, by its OpenColorIO name; the effect gets scene-linear light.  "
            "[default, with --to-space: linear Rec. 709 for float files, sRGB for others]",
        ),
        click.option(
            "--to-space", metavar="NAME",
            help="Color space of the output, by its OpenColorIO name.  [default: that of --from-space]",
        ),
        click.option(
            "--alpha", type=click.Choice(get_args(Alpha)), default=effect.alpha, show_default=True,
            help="Input of EFFECT: color times alpha (the result is divided again), color as it is, or color without "
            "alpha, which the result gets back.",
        ),
    )  # fmt: skip


def take_color_spaces(effect: Effect, inputs: tuple[str, ...], output: str, options: dict[str, Any]) -> Effect:
    """Return the effect with the conversions in ``options``; removes this module's options from them.

    With color spaces, pictures are read without sRGB decoding, since their color space defines it. Without, results of
    effects on linear light are encoded for integer files.
    """
    alpha, source, result, config = (options.pop(key) for key in ("alpha", "from_space", "to_space", "color_config"))
    if source is None and result is None:
        if config is not None:
            raise InputError("--color-config goes with --from-space or --to-space")
        encoded = options["linear"] and not _holds_floats(output, inputs)
        return with_straight_alpha(effect, alpha, encoded, additive=_is_additive(inputs))
    if source is None:
        file, layer = split_layer(Path(inputs[0]))
        source = LINEAR if file.suffix.lower() in FLOAT_SUFFIXES or layer == HDR else ENCODED
    options["linear"] = False
    return _converted(
        effect, alpha, source=source, result=result or source, config=config, additive=_is_additive(inputs)
    )


def _is_additive(inputs: tuple[str, ...]) -> bool:
    """Return True if color where alpha is 0 is light that is added: in OpenEXR files."""
    return bool(inputs) and all(split_layer(Path(path))[0].suffix.lower() == ".exr" for path in inputs)


def space_of_results(
    effect: Effect, parameters: Mapping[str, Any], inputs: tuple[str, ...], output: str, linear: bool
) -> ColorSpace | Recoded | None:
    """Return the color space of an effect's results, for color tags; None if it is that of the inputs.

    ``linear`` is the option of that name: pictures of integers are decoded from sRGB, and results encoded.
    """
    space = effect.result_space(parameters)
    if space is not None or not linear or not inputs:
        return space
    source, layer = split_layer(Path(inputs[0]))
    stated = ColorSpace("", metadata_of(Path(inputs[0])).space).transfer
    was_light = source.suffix.lower() in FLOAT_SUFFIXES or layer == HDR or stated == "lin"
    if _holds_floats(output, inputs):
        return None if was_light else Recoded("lin")
    return Recoded("srgb") if was_light or stated not in ("", "srgb") else None


def with_straight_alpha(effect: Effect, alpha: Alpha, encoded: bool, *, additive: bool = False) -> Effect:
    """Return the effect with straight alpha outside; if ``encoded``, its result is encoded as sRGB.

    ``additive``: color where alpha is 0 is light that is added.
    """
    encoded = encoded and not effect.encodes
    is_as_it_is = not encoded and alpha == "straight"
    return effect if is_as_it_is else _converted(effect, alpha, encoded=encoded, additive=additive)


def _holds_floats(output: str, inputs: tuple[str, ...]) -> bool:
    """Return True if the output files hold floats; files in a folder have the formats of the inputs."""
    suffix = Path(output).suffix or Path(inputs[0]).suffix
    return suffix.lower() in FLOAT_SUFFIXES


def _converted(effect: Effect, alpha: Alpha, **conversions: Any) -> ConvertedEffect:
    return ConvertedEffect(
        effect.name, effect.path, effect.takes, effect.summary, effect.loaded,
        effect=effect, effect_alpha=alpha, **conversions,
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class ConvertedEffect(Effect):
    """An effect with conversions from color space ``source`` and to ``result``, with straight alpha outside.

    With color spaces the effect gets scene-linear light, and alpha as in ``effect_alpha``. ``encoded``: the result is
    encoded as sRGB. ``additive``: color where alpha is 0 is light that is added.
    """

    effect: Effect
    effect_alpha: Alpha
    source: str | None = None
    result: str | None = None
    config: str | None = None
    encoded: bool = False
    additive: bool = False

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return self.effect.parameters

    @property
    def frame_time(self) -> str | None:
        return self.effect.frame_time

    @property
    def signals(self) -> tuple[str, ...]:
        return self.effect.signals

    def result_space(self, parameters: Mapping[str, Any]) -> ColorSpace | None:
        if self.source is None or self.result is None:
            return self.effect.result_space(parameters)
        from passgraph.effects.color.color_transform import space_between

        return space_between(self.source, self.result, self.config)

    def for_opaque(self) -> Effect:
        if self.effect_alpha != self.effect.alpha:
            return self  # its result may be transparent though its input is opaque
        return replace(self, effect_alpha="straight") if self.source is not None or self.encoded else self.effect

    def build(self, *pictures: Any, **parameters: Any) -> Any:
        from passgraph.effects.pictures.alpha import on_straight_alpha

        one_target = making_one(self.effect, "leave out --alpha, --from-space and --to-space")
        on_straight = on_straight_alpha(one_target, self.effect_alpha, additive=self.additive)
        if self.encoded:
            from passgraph.effects.pictures.decoded import encoded

            result = (
                self.effect.build(*pictures, **parameters)
                if self.effect_alpha == "straight"
                else on_straight(*pictures, **parameters)
            )
            return encoded(result) if isinstance(result, Target) else result
        if self.source is None:
            return on_straight(*pictures, **parameters)
        from passgraph.effects import color_transform

        frame, *rest = pictures
        light = color_transform(frame, src=self.source, dst="scene_linear", config=self.config, name="to_scene_linear")
        result = on_straight(light, *rest, **parameters)
        name = f"{result.name}_in_space"
        return color_transform(result, src="scene_linear", dst=self.result, config=self.config, name=name)
