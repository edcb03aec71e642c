"""``passgraph apply EFFECT``: an effect on a picture; subcommands are made from the effects' table."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from passgraph.commands.options import (
    backend_option,
    capture_option,
    check_finite_option,
    chosen_effect,
    given_parameters,
    non_finite_option,
    options_of,
    output_option,
)
from passgraph.commands.running import check_outputs, run_and_save
from passgraph.commands.sources import picture_job
from passgraph.effects.registry import EFFECTS, Effect
from passgraph.run.finite_checks import NonFinite


class _Effects(click.Group):
    def list_commands(self, ctx: click.Context) -> list[str]:
        return [effect.name for effect in EFFECTS.values() if effect.takes.startswith("picture")]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        effect = chosen_effect(cmd_name)
        if not effect.takes.startswith("picture"):
            ctx.fail(f"effect {cmd_name!r} takes a {effect.takes}; use: passgraph render --effect {cmd_name}")
        return command_of(effect)


@click.command(cls=_Effects, subcommand_metavar="EFFECT IN -o OUT [OPTIONS]")
def apply() -> None:
    """Apply EFFECT to the picture IN (PNG, JPEG, TIFF, WebP, OpenEXR, npy).

    `passgraph apply EFFECT --help` shows the effect's parameters.
    """


def command_of(effect: Effect) -> click.Command:
    """The subcommand of one effect."""

    @click.command(effect.name, help=f"{effect.summary}  Reads the picture IN.", short_help=effect.summary)
    @click.argument("picture", metavar="IN", type=click.Path(path_type=Path))
    @output_option
    @backend_option
    @capture_option
    @non_finite_option
    @check_finite_option
    @click.option(
        "--linear/--as-stored", default=effect.linear, show_default=True,
        help="Decode 8- and 16-bit pictures from sRGB to linear light first.",
    )  # fmt: skip
    @click.pass_context
    def command(
        ctx: click.Context,
        /,
        picture: Path,
        output: Path,
        backend: str | None,
        capture: Path | None,
        non_finite: NonFinite,
        check_finite: bool,
        linear: bool,
        depth: Path | None = None,
        **_: Any,
    ) -> None:
        check_outputs(output, capture)
        job = picture_job(effect, picture, depth, linear, given_parameters(ctx, effect))
        run_and_save(job, backend, output, capture, non_finite, check_finite)

    if effect.takes == "picture+depth":
        command.params.append(depth_option(required=True))
    command.params += options_of(effect)
    return command


def depth_option(required: bool) -> click.Option:
    return click.Option(
        ["--depth"], required=required, type=click.Path(path_type=Path),
        help="Picture whose red is each pixel's linear depth (EXR or npy, scene units).",
    )  # fmt: skip
