"""Options that commands share, and options for the parameters of effects."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click
from click.core import ParameterSource
from click.shell_completion import CompletionItem

from passgraph.arguments import near
from passgraph.commands.named import is_named, named_effect
from passgraph.effects.effect_table import EFFECTS, Effect, by_family
from passgraph.errors import BackendError, InputError, PassgraphError
from passgraph.graph.targets import MAX_SIDE
from passgraph.language.native import MATH
from passgraph.run.finite_checks import CHOICES

if TYPE_CHECKING:
    from passgraph.backends.base import Backend
    from passgraph.effects.parameters import Parameter

Decorated = TypeVar("Decorated", bound=Callable[..., Any])


class SizeType(click.ParamType[tuple[int, int]]):
    """WIDTHxHEIGHT in pixels."""

    name = "WxH"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int]:
        width, _, height = str(value).lower().replace("×", "x").partition("x")
        if not (width.isascii() and width.isdigit() and height.isascii() and height.isdigit()):
            self.fail(f"{value!r} is not a size; write width x height in pixels, such as 1280x720", param, ctx)
        # A number with more digits than the limit is too large, and int() raises for thousands of digits.
        if len(width) > 9 or len(height) > 9 or not (1 <= int(width) <= MAX_SIDE and 1 <= int(height) <= MAX_SIDE):
            self.fail(f"{value!r}: each side must be 1 to {MAX_SIDE} pixels", param, ctx)
        return int(width), int(height)


class WholeRange(click.IntRange):
    """Integers in a range; help omits an unlimited one."""

    def _describe_range(self) -> str:
        return "" if self.min is None and self.max is None else super()._describe_range()


class FiniteRange(click.FloatRange):
    """Finite numbers in a range; help omits an unlimited one."""

    def _describe_range(self) -> str:
        return "" if self.min is None and self.max is None else super()._describe_range()

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        try:
            float(value)
        except ValueError:
            count = 1 if param is None else param.nargs
            hint = f"; {count} numbers are written with spaces between them" if count > 1 else ""
            self.fail(f"{value!r} is not a valid float{hint}", param, ctx)
        number = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value} is not a finite number", param, ctx)
        return number


class BackendType(click.ParamType[str]):
    """A backend's name, with an optional device after a colon; validated without importing the backend."""

    name = "NAME[:DEVICE]"

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        from passgraph.backends.registry import backend_names

        return [CompletionItem(name) for name in backend_names() if name.startswith(incomplete)]

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        from passgraph.backends.registry import backend_class

        try:
            check_computes(backend_class(str(value).partition(":")[0]))
        except PassgraphError as error:
            self.fail(str(error), param, ctx)
        return str(value)


def check_computes(backend: type[Backend]) -> None:
    """Raise an error for a backend that computes no pictures, since commands would write or judge blank ones."""
    if not backend.computes:
        raise BackendError(
            f"backend {backend.name} runs nothing and makes no pictures; use numpy, gl, opencl or reference, or to see "
            "what would run: passgraph plan"
        )


def together(*options: Callable[[Decorated], Decorated]) -> Callable[[Decorated], Decorated]:
    """Return a decorator that adds several options to a command, in the order of its help."""

    def decorate(command: Decorated) -> Decorated:
        for option in reversed(options):
            command = option(command)
        return command

    return decorate


def size_option(default: tuple[int, int] | None = None) -> Callable[[Decorated], Decorated]:
    text = f"{default[0]}x{default[1]}" if default else None
    return click.option(
        "--size",
        type=SizeType(),
        default=text,
        show_default=True,
        help="Width and height of the picture in pixels.",
    )


backend_option = click.option(
    "--backend",
    "-b",
    type=BackendType(),
    help="numpy (the default), gl, webgpu, opencl, opencl:1 (a device by number or part of its name), reference.",
)
#: That of commands that test backends.
backends_option = click.option(
    "--backend",
    "-b",
    "backends",
    multiple=True,
    type=BackendType(),
    help="Backend to test; may be repeated.  [default: all available]",
)


math_option = click.option(
    "--math",
    type=click.Choice(MATH),
    default="exact",
    show_default=True,
    help="Functions such as exp and sin, products in sums, and filters: alike on every backend, or the device's "
    "own (native), faster on most and less exact.",
)


capture_option = click.option(
    "--capture",
    type=click.Path(path_type=Path),
    metavar="FOLDER",
    help="Write the result of every pass: as PNG to look at, and as npy with the exact values.",
)


profile_option = click.option("--profile", is_flag=True, help="Time each pass separately, in a few more runs.")


non_finite_option = click.option(
    "--non-finite",
    type=click.Choice(CHOICES),
    default="error",
    show_default=True,
    help="NaN and infinity in the input: an error, replace them (by 0 and the largest number), or keep them.",
)


check_finite_option = click.option(
    "--check-finite",
    is_flag=True,
    help="Find the first pass and pixel that produce NaN or infinity; slow.",
)


# Effects' parameters


def flag_of(parameter: Parameter) -> str:
    """
    >>> flag_of(EFFECTS["gaussian-blur"].parameter("radius_px"))
    '--radius-px'
    """
    return "--" + parameter.name.replace("_", "-")


#: Prefix of options for parameters with the name of a command's own option.
PREFIX = "kernel_"


class EffectOption(click.Option):
    """An effect's parameter."""

    def __init__(self, parameter: Parameter, **settings: Any) -> None:
        super().__init__(**settings)
        self.parameter = parameter


def option_of(parameter: Parameter, kind: type[EffectOption] = EffectOption) -> EffectOption:
    """Return the option of a parameter, with range, unit and default."""
    flag, settings, limits = flag_of(parameter), dict[str, Any](), parameter.range
    if parameter.type == "bool":
        flag = f"{flag}/--no-{flag[2:]}"
    elif parameter.type == "choice":
        settings["type"] = click.Choice(parameter.choices)
    elif parameter.type == "picture":
        settings |= {"type": click.Path(path_type=Path), "metavar": "FILE"}
    elif parameter.type == "text":
        settings |= {"type": str, "metavar": "NAME"}
    elif parameter.value_type is not None:
        from passgraph.commands.input_values import TypedValue

        settings |= {"type": TypedValue(parameter.value_type), "metavar": str(parameter.value_type).upper()}
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
        settings["show_default"] = _shown_default(default, "," if parameter.value_type else " ")
    text = parameter.help[:1].upper() + parameter.help[1:]
    unit = f" ({limits.unit})" if limits.unit else ""
    if default is not None or not parameter.required:
        settings["default"] = default
    settings |= {"param_decls": [flag, parameter.name], "help": text + unit, "required": parameter.required}
    return kind(parameter, **settings)


def _shown_default(default: object, between: str) -> str | bool:
    """Return the default as help shows it; True leaves it to click."""
    from passgraph.commands.input_values import written_value

    return written_value(default).replace(",", between) if isinstance(default, tuple) else True


def _as(number: Callable[[float], Any], limit: float | None) -> Any:
    return None if limit is None else number(limit)


#: Keys in a command's context: the text that names an effect, and the effect.
_NAMED, _CHOSEN = "passgraph.named", "passgraph.effect"


class EffectCommand(click.Command):
    """A command whose ``--effect`` adds the options of that effect's parameters.

    If there is no default effect, the first argument that names one (or a user's file) selects it too. Help shows the
    options of the selected effect, and the names of the others.
    """

    #: The default effect.
    default_effect: str | None = None
    #: The arguments that name an effect, for help.
    naming: str = "--effect NAME"
    #: Kinds of inputs of the command's effects.
    takes: tuple[str, ...] = ("picture", "picture+depth", "nothing", "scene", "world2d")

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        named = self._named(args)
        if named is None and self.default_effect is None:
            at = next((at for at, argument in enumerate(args) if is_named(argument)), None)
            if at is None and args[1:] and args[0].replace("-", "").isidentifier() and not Path(args[0]).exists():
                at = 0  # the first of several arguments must be an effect, so this is a misspelled name
            if at is not None:
                named = args[at]
                args = ["--effect", named, *args[:at], *args[at + 1 :]]
        self.choose(ctx, named)
        return super().parse_args(ctx, args)

    def choose(self, ctx: click.Context, named: str | None) -> None:
        """Set the effect whose options the command has."""
        ctx.meta[_NAMED] = named
        if named is not None or self.default_effect is not None:
            ctx.meta[_CHOSEN] = self._chosen(named or str(self.default_effect))

    def _named(self, args: Sequence[str]) -> str | None:
        """Return the value of --effect, before the options are parsed."""
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

    def _chosen(self, name: str) -> Effect:
        effect = named_effect(name)
        if effect.takes not in self.takes:
            known = ", ".join(e.name for e in self.effects())
            raise InputError(f"effect {name!r} takes a {effect.takes}; this command has {known}")
        return effect

    @staticmethod
    def effect_of(ctx: click.Context) -> Effect | None:
        """Return the named or default effect; a user's file is read once."""
        found: Effect | None = ctx.meta.get(_CHOSEN)
        return found

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        own = super().get_params(ctx)
        effect = self.effect_of(ctx)
        return own if effect is None else [*own, *options_beside(own, effect)]

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        options = [p for p in super().get_params(ctx) if isinstance(p, click.Option)]
        own = [record for p in options if (record := p.get_help_record(ctx)) is not None]
        with formatter.section("Options"):
            formatter.write_dl(own)
        effect = self.effect_of(ctx)
        if effect is not None:
            rows = [record for o in options_of(effect) if (record := o.get_help_record(ctx)) is not None]
            if rows:
                with formatter.section(f"Parameters of {effect.name}"):
                    formatter.write_dl(rows)
        if not ctx.meta.get(_NAMED):
            # Help for the parameters of all effects would take a second to import, and four screens.
            formatter.write_paragraph()
            formatter.write_text(f"Effects; {ctx.command_path} {self.naming} --help shows the parameters of one:")
            for family, effects in by_family(self.effects()).items():
                with formatter.section(family):
                    formatter.write_dl([(effect.name, effect.summary) for effect in effects])


def complete_effect(ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Return the names of effects that begin so; without one, the shell completes the name of a file."""
    names = [name for name in EFFECTS if name.startswith(incomplete)]
    return [CompletionItem(name) for name in names] or [CompletionItem(incomplete, type="file")]


def effect_option(what: str) -> Callable[[Decorated], Decorated]:
    return click.option(
        "--effect",
        "-e",
        metavar="EFFECT|FILE.py[:NAME]",
        expose_value=False,
        shell_complete=complete_effect,
        help=f"{what}: an effect by name, or one (or a kernel) of a file of yours; the first argument may name it too.",
    )


def named_or_refused(ctx: click.Context, source: Path | None) -> Effect:
    """Return the effect of a command without a default effect; raise a usage error if none is named."""
    effect = EffectCommand.effect_of(ctx)
    if effect is None:
        hint = "" if source is None else near(str(source), list(EFFECTS))
        raise click.UsageError(
            f"Missing option '--effect' / '-e', or the name of an effect or FILE.py in front{hint}", ctx
        )
    return effect


def options_of(effect: Effect, kind: type[EffectOption] = EffectOption) -> list[EffectOption]:
    return [option_of(parameter, kind) for parameter in effect.parameters]


def options_beside(
    own: Sequence[click.Parameter], effect: Effect, kind: type[EffectOption] = EffectOption
) -> list[EffectOption]:
    """Return the options of an effect's parameters, for a command with options of its own.

    A parameter with the name of a command's option gets a prefix: ``--kernel-rate``.
    """
    taken = {name for param in own for name in (*param.opts, *param.secondary_opts, param.name)}
    options: list[EffectOption] = []
    for option in options_of(effect, kind):
        parameter = option.parameter
        while taken.intersection((*option.opts, *option.secondary_opts, option.name)):
            option = option_of(replace(option.parameter, name=PREFIX + option.parameter.name), kind)
        option.parameter = parameter
        options.append(option)
    return options


def given_parameters(ctx: click.Context) -> dict[str, Any]:
    """Return the parameters given on the command line; the effect chooses its own defaults for the others."""
    options = {p.name: p.parameter.name for p in ctx.command.get_params(ctx) if isinstance(p, EffectOption) and p.name}
    return {
        name: ctx.params[option]
        for option, name in options.items()
        if ctx.get_parameter_source(option) is not ParameterSource.DEFAULT
    }
