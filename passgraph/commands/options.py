"""Options that commands share, and those made from the effects' table of parameters."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click
from click.core import ParameterSource

from passgraph.arguments import near
from passgraph.effects.registry import EFFECTS, Effect
from passgraph.errors import BackendError, InputError, PassgraphError
from passgraph.graph.targets import MAX_SIDE
from passgraph.run.finite_checks import CHOICES

if TYPE_CHECKING:
    from passgraph.backends.base import Backend
    from passgraph.effects.parameters import Parameter

Decorated = TypeVar("Decorated", bound=Callable[..., Any])


class SizeType(click.ParamType[tuple[int, int]]):
    """WIDTHxHEIGHT in pixels."""

    name = "WxH"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int]:
        if isinstance(value, tuple):
            return value
        width, _, height = str(value).lower().replace("×", "x").partition("x")
        if not (width.isascii() and width.isdigit() and height.isascii() and height.isdigit()):
            self.fail(f"{value!r} is not a size; write width x height in pixels, such as 1280x720", param, ctx)
        # More digits than the limit has cannot fit, and int() refuses thousands of them.
        if len(width) > 9 or len(height) > 9 or not (1 <= int(width) <= MAX_SIDE and 1 <= int(height) <= MAX_SIDE):
            self.fail(f"{value!r}: each side must be 1 to {MAX_SIDE} pixels", param, ctx)
        return int(width), int(height)


class WholeRange(click.IntRange):
    """Whole numbers in a range, which may be all of them: help then says nothing of it."""

    def _describe_range(self) -> str:
        return "" if self.min is None and self.max is None else super()._describe_range()


class FiniteRange(click.FloatRange):
    """Numbers in a range, none of them infinite or NaN; of all finite ones help says nothing."""

    def _describe_range(self) -> str:
        return "" if self.min is None and self.max is None else super()._describe_range()

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        number = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value} is not a finite number", param, ctx)
        return number


class BackendType(click.ParamType[str]):
    """A backend by name, with a device behind a colon; known ones that compute pictures, before anything is loaded."""

    name = "NAME[:DEVICE]"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        from passgraph.backends.registry import backend_class

        try:
            check_computes(backend_class(str(value).partition(":")[0]))
        except PassgraphError as error:
            self.fail(str(error), param, ctx)
        return str(value)


def check_computes(backend: type[Backend]) -> None:
    """Refuse a backend that makes no pictures: commands would write, or judge, blank ones."""
    if not backend.computes:
        raise BackendError(
            f"backend {backend.name} runs nothing and makes no pictures; use numpy, gl, opencl or reference, or to see "
            "what would run: passgraph plan"
        )


def size_option(default: tuple[int, int] | None = None) -> Callable[[Decorated], Decorated]:
    text = f"{default[0]}x{default[1]}" if default else None
    return click.option(
        "--size", type=SizeType(), default=text, show_default=True,
        help="Width and height of the picture in pixels.",
    )  # fmt: skip


def backend_option(command: Decorated) -> Decorated:
    return click.option(
        "--backend", "-b", type=BackendType(),
        help="numpy (the default), gl, opencl, opencl:1 (a device by number or part of its name), reference.",
    )(command)  # fmt: skip


def capture_option(command: Decorated) -> Decorated:
    return click.option(
        "--capture", type=click.Path(path_type=Path), metavar="FOLDER",
        help="Write what every pass wrote: a PNG to look at and the exact values as npy.",
    )(command)  # fmt: skip


def non_finite_option(command: Decorated) -> Decorated:
    return click.option(
        "--non-finite", type=click.Choice(CHOICES), default="error", show_default=True,
        help="NaN and infinity in the input: an error, replaced (by 0 and the largest number), or kept.",
    )(command)  # fmt: skip


def check_finite_option(command: Decorated) -> Decorated:
    return click.option(
        "--check-finite", is_flag=True,
        help="Name the first pass and pixel that make NaN or infinity; slow.",
    )(command)  # fmt: skip


def output_option(command: Decorated) -> Decorated:
    return click.option(
        "--output", "-o", required=True, type=click.Path(path_type=Path),
        help="Picture to write: .png .jpg .tif .webp (8 bit), .exr .npy (float32).",
    )(command)  # fmt: skip


# Effects' parameters


def flag_of(parameter: Parameter) -> str:
    """
    >>> flag_of(EFFECTS["gaussian-blur"].parameter("radius_px"))
    '--radius-px'
    """
    return "--" + parameter.name.replace("_", "-")


def option_of(parameter: Parameter) -> click.Option:
    """A parameter as an option with range, unit and default."""
    flag, settings, limits = flag_of(parameter), dict[str, Any](), parameter.range
    if parameter.type == "bool":
        flag = f"{flag}/--no-{flag[2:]}"
    elif parameter.type == "choice":
        settings["type"] = click.Choice(parameter.choices)
    elif parameter.type == "picture":
        settings |= {"type": click.Path(path_type=Path), "metavar": "FILE"}
    elif parameter.type == "int":
        settings["type"] = WholeRange(_as(int, limits.low), _as(int, limits.high), min_open=limits.above)
    else:
        settings["type"] = FiniteRange(_as(float, limits.low), _as(float, limits.high), min_open=limits.above)
    if parameter.type == "rgb":
        settings |= {"nargs": 3, "metavar": "R G B"}
    elif parameter.type in ("int", "float"):
        settings["metavar"] = "NUMBER"
    default = parameter.default
    if default is not None:
        settings["show_default"] = " ".join(f"{v:g}" for v in default) if isinstance(default, tuple) else True
    text = parameter.help[:1].upper() + parameter.help[1:]
    unit = f" ({limits.unit})" if limits.unit else ""
    return click.Option([flag, parameter.name], default=default, help=text + unit, **settings)


def _as(number: Callable[[float], Any], limit: float | None) -> Any:
    return None if limit is None else number(limit)


def chosen_effect(name: str) -> Effect:
    """The effect of this name; the message for another one has the nearest."""
    if name not in EFFECTS:
        raise InputError(f"there is no effect {name!r}{near(name, list(EFFECTS))}; there are {', '.join(EFFECTS)}")
    return EFFECTS[name]


class EffectCommand(click.Command):
    """A command whose ``--effect`` decides which further options there are.

    With an effect given, help and parsing know that effect's parameters; help without one shows those of
    every effect.
    """

    #: Effect where none is given.
    default_effect: str | None = None
    #: What its effects are applied to.
    takes: tuple[str, ...] = ("picture", "picture+depth", "scene", "world2d")

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        ctx.meta["passgraph.effect"] = self._named(args)
        return super().parse_args(ctx, args)

    def _named(self, args: Sequence[str]) -> str | None:
        """The value of --effect, found before the options are known."""
        found = None
        for at, argument in enumerate(args):
            if argument == "--":
                break
            if argument in ("--effect", "-e") and at + 1 < len(args):
                found = args[at + 1]
            elif argument.startswith("--effect="):
                found = argument.partition("=")[2]
        return found

    def effects(self) -> list[Effect]:
        return [effect for effect in EFFECTS.values() if effect.takes in self.takes]

    def effect_of(self, ctx: click.Context) -> Effect | None:
        name = ctx.meta.get("passgraph.effect") or self.default_effect
        if name is None:
            return None
        effect = chosen_effect(name)
        if effect.takes not in self.takes:
            known = ", ".join(e.name for e in self.effects())
            raise InputError(f"effect {name!r} takes a {effect.takes}; this command has {known}")
        return effect

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        own = super().get_params(ctx)
        effect = self.effect_of(ctx)
        taken = {name for param in own for name in param.opts}
        return own if effect is None else [*own, *(o for o in options_of(effect) if not taken & set(o.opts))]

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        options = [p for p in super().get_params(ctx) if isinstance(p, click.Option)]
        own = [record for p in options if (record := p.get_help_record(ctx)) is not None]
        with formatter.section("Options"):
            formatter.write_dl(own)
        named = ctx.meta.get("passgraph.effect")
        for effect in [chosen_effect(named)] if named else self.effects():
            rows = [record for o in options_of(effect) if (record := o.get_help_record(ctx)) is not None]
            if rows:
                with formatter.section(f"Parameters of --effect {effect.name}"):
                    formatter.write_dl(rows)


def options_of(effect: Effect) -> list[click.Option]:
    return [option_of(parameter) for parameter in effect.parameters]


def given_parameters(ctx: click.Context, effect: Effect) -> dict[str, Any]:
    """Parameters that were written on the command line; what is left out stays the effect's own choice."""
    sources = {p.name: ctx.get_parameter_source(p.name) for p in effect.parameters}
    return {name: ctx.params[name] for name, source in sources.items() if source is not ParameterSource.DEFAULT}
