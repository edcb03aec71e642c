"""``passgraph apply EFFECT``: an effect on pictures, sequences, videos; subcommands come from the effects' table."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from passgraph.commands.files import check_apart, is_one_picture
from passgraph.commands.named import named_effect
from passgraph.commands.options import (
    backend_option,
    capture_option,
    check_finite_option,
    given_parameters,
    non_finite_option,
    options_beside,
    output_option,
    profile_option,
    size_option,
)
from passgraph.commands.running import check_outputs, run_and_save
from passgraph.commands.sources import RENDER_SIZE, generator_job, picture_job
from passgraph.effects.registry import EFFECTS, Effect
from passgraph.errors import InputError
from passgraph.frames.frame import MOST_JOBS

if TYPE_CHECKING:
    from passgraph.scene.hardware_depth import HardwareDepth

INPUTS = "Reads each INPUT: a picture, folder, wildcard, numbered sequence, video, or - (a stream)."
OUTPUT = (
    "A picture (.png .jpg .tif .webp in 8 bits, .exr .npy float32), a folder, a numbered sequence (out.%04d.png), a "
    "video (.mp4 .mov .mkv .webm), or - for a stream."
)


class _Effects(click.Group):
    def list_commands(self, ctx: click.Context) -> list[str]:
        return [effect.name for effect in EFFECTS.values() if effect.takes.startswith("picture")]

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """What click does, without loading each effect."""
        with formatter.section("Effects"):
            formatter.write_dl([(name, EFFECTS[name].summary) for name in self.list_commands(ctx)])

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        effect = named_effect(cmd_name)
        if effect.takes not in ("picture", "picture+depth", "nothing"):
            ctx.fail(f"effect {cmd_name!r} takes a {effect.takes}; use: passgraph render --effect {cmd_name}")
        return command_of(effect)


@click.command(cls=_Effects, subcommand_metavar="EFFECT|FILE[:NAME] INPUT... -o OUTPUT [OPTIONS]")
def apply() -> None:
    """Apply EFFECT to pictures, sequences and videos; or an effect or kernel of FILE.py, a file of yours (it is run);
    or a shader file (.fs of ISF, .glsl of gl-transitions, .frag), which is only parsed.

    Each INPUT is a picture (PNG, JPEG, TIFF, WebP, OpenEXR, npy), a folder of them, a quoted wildcard ("*.png"), a
    numbered sequence (shot.%04d.exr or shot.####.exr), a video, or - for PNG pictures on standard input.

    `passgraph apply EFFECT --help` shows the effect's parameters, and `passgraph apply FILE.py --help` those of yours.
    """


def command_of(effect: Effect) -> click.Command:
    """The subcommand of one effect."""
    if effect.takes == "nothing":
        return generator_command(effect)

    @click.command(effect.name, help=f"{effect.summary}  {INPUTS}", short_help=effect.summary)
    @click.argument("inputs", metavar="INPUT...", nargs=-1, required=True, type=click.Path())
    @click.option("--output", "-o", required=True, type=click.Path(), help=OUTPUT)
    @backend_option
    @click.option(
        "--jobs", "-j", type=click.IntRange(1, MOST_JOBS), metavar="NUMBER",
        help="Threads that read and write frames; left out, one a core, at most 8.",
    )  # fmt: skip
    @click.option(
        "--scheduler", metavar="ADDRESS",
        help="Frames are computed by the workers of a dask scheduler, such as tcp://host:8786.",
    )  # fmt: skip
    @click.option("--resume", is_flag=True, help="Leave out what is there already, whole and newer than its input.")
    @click.option("--raw", metavar="WxH:LAYOUT@RATE", help="Streams (-) are raw pixels, such as 640x480:rgb24@25.")
    @click.option("--rate", metavar="NUMBER", help="Frames a second of a video made of pictures.  [default: 25]")
    @click.option("--codec", metavar="NAME", help="Encoder of videos, such as libx265; left out, the source's.")
    @click.option("--codec-option", multiple=True, metavar="KEY=VALUE", help="Option of the encoder, such as crf=23.")
    @click.option("--sound/--no-sound", default=True, show_default=True, help="Copy a video's sound and subtitles.")
    @capture_option
    @non_finite_option
    @check_finite_option
    @profile_option
    @click.option(
        "--linear/--as-stored", default=effect.linear, show_default=True,
        help="Decode 8- and 16-bit pictures from sRGB to linear light first.",
    )  # fmt: skip
    @click.pass_context
    def command(
        ctx: click.Context,
        /,
        inputs: tuple[str, ...],
        output: str,
        capture: Path | None,
        depth: Path | None = None,
        depth_buffer: HardwareDepth | None = None,
        **options: Any,
    ) -> int:
        given = given_parameters(ctx)
        if is_one_picture(inputs, output):
            if options["scheduler"] is not None:
                raise InputError("--scheduler is for many frames; one picture is computed here: leave it out")
            return apply_to_one(effect, Path(inputs[0]), Path(output), capture, depth, depth_buffer, given, options)
        if capture is not None:
            raise InputError("--capture shows the passes of one picture; name one picture and one output")
        if options["profile"]:
            raise InputError("--profile times the passes on one picture; name one picture and one output")
        from passgraph.commands.apply_many import apply_to_many

        return apply_to_many(effect, inputs, output, depth, depth_buffer, given, options)

    if effect.takes == "picture+depth":
        from passgraph.commands.depth import depth_buffer_option, depth_option

        command.params += [depth_option(required=True), depth_buffer_option()]
    command.params += options_beside(command.params, effect)
    return command


def generator_command(effect: Effect) -> click.Command:
    """The subcommand of an effect that makes its picture of parameters alone."""

    @click.command(effect.name, help=f"{effect.summary}  Makes its picture without another.")
    @output_option
    @backend_option
    @size_option(RENDER_SIZE)
    @capture_option
    @check_finite_option
    @profile_option
    @click.pass_context
    def command(
        ctx: click.Context,
        /,
        output: Path,
        backend: str | None,
        size: tuple[int, int],
        capture: Path | None,
        check_finite: bool,
        profile: bool,
        **_: Any,
    ) -> int:
        check_outputs(output, capture)
        job = generator_job(effect, None, size, given_parameters(ctx))
        run_and_save(job, backend, output, capture, check_finite=check_finite, profile=profile)
        return 0

    command.params += options_beside(command.params, effect)
    return command


def apply_to_one(
    effect: Effect, picture: Path, output: Path, capture: Path | None, depth: Path | None,
    holds: HardwareDepth | None, given: dict[str, Any], options: dict[str, Any],
) -> int:  # fmt: skip
    """One picture file to one."""
    from passgraph.frames.pictures import is_made

    check_apart([picture, *([depth] if depth else [])], [(output, str(picture))])
    check_outputs(output, capture)
    if options["resume"] and is_made(output, [picture]):
        click.echo(f"{output}: is there already")
        return 0
    job = picture_job(effect, picture, depth, options["linear"], given, holds)
    run_and_save(
        job, options["backend"], output, capture, options["non_finite"], options["check_finite"], options["profile"]
    )
    return 0
