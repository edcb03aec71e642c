"""``passgraph apply EFFECT``: apply an effect to pictures, sequences and videos; a subcommand for each effect."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

from passgraph.commands import mattes
from passgraph.commands.apply_effect import apply_effect, generate
from passgraph.commands.color_spaces import color_space_options
from passgraph.commands.command_graph import (
    RENDER_SIZE,
)
from passgraph.commands.named import named_effect
from passgraph.commands.options import (
    Decorated,
    backend_option,
    capture_option,
    check_finite_option,
    given_parameters,
    math_option,
    non_finite_option,
    options_beside,
    profile_option,
    size_option,
    together,
)
from passgraph.commands.parameter_options import FramesOption
from passgraph.commands.previews import FramesToMake, preview_options
from passgraph.commands.sound import audio_options
from passgraph.commands.stack_planes import stack_options
from passgraph.commands.warm_up import warm_up_option
from passgraph.effects.effect_table import EFFECTS, Effect, by_family
from passgraph.files.frame import MOST_JOBS
from passgraph.plan.limits import bytes_of

if TYPE_CHECKING:
    pass


INPUTS = "Reads each INPUT: a picture, folder, wildcard, numbered sequence, video, animation, or - (a stream)."
OUTPUT = (
    "A picture (.png .jpg .tif .webp .bmp .tga .jxl .ppm .dpx, .exr .hdr .pfm .npy in floats), a folder, a numbered "
    "sequence (out.%04d.png), a video (.mp4 .mov .mkv .webm), an animation (.gif .apng), or - for a stream."
)
OUTPUT_OF_NOTHING = (
    "Picture to write: .png .jpg .tif .webp (8 bits), .exr .npy (float32). "
    "With --frames: a sequence, a video or a .gif."
)


def frames_option(subject: str) -> Callable[[Decorated], Decorated]:
    return click.option(
        "--frames",
        type=FramesToMake(),
        metavar="NUMBER|FIRST-LAST[xSTEP]",
        help=f"Number of frames made of {subject}, for parameters that change (NUMBER..NUMBER) and effects with time; "
        "or the frames of INPUT to write, such as 1001-1100x2.",
    )


bits_option = click.option(
    "--bits",
    type=click.Choice(["8", "16", "32"]),
    callback=lambda _, __, bits: bits and int(bits),
    help="Bits per channel: .png .tif .jxl 8 or 16, .exr 16 (half) or 32.  [default: as the input; else 8, .exr 32]",
)


keep_layers_option = click.option(
    "--keep-layers/--drop-layers",
    default=True,
    show_default=True,
    help="From .exr to .exr: keep other layers and parts, the data window and the attributes of INPUT.",
)


memory_option = click.option(
    "--memory",
    metavar="SIZE",
    callback=lambda _, __, size: size and bytes_of(size),
    help="Limit for pictures, such as 2GB. One picture that takes more is computed in tiles.  [default: half of the "
    "machine's]",
)


video_options = together(
    click.option("--rate", metavar="NUMBER", help="Frames per second of a video made of pictures.  [default: 25]"),
    click.option("--codec", metavar="NAME", help="Encoder of videos, such as libx265.  [default: that of the source]"),
    click.option(
        "--codec-option",
        multiple=True,
        metavar="KEY=VALUE",
        help="Option of the encoder, such as crf=23; may be repeated.",
    ),
)


class _Effects(click.Group):
    def list_commands(self, ctx: click.Context) -> list[str]:
        return [effect.name for effect in EFFECTS.values() if effect.takes.startswith("picture")]

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        return super().shell_complete(ctx, incomplete) or [CompletionItem(incomplete, type="file")]

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands like click, without importing each effect."""
        for family, effects in by_family(EFFECTS[name] for name in self.list_commands(ctx)).items():
            with formatter.section(family):
                formatter.write_dl([(effect.name, effect.summary) for effect in effects])
        with formatter.section("Layers of OpenEXR files"):
            formatter.write_dl([(mattes.NAME, mattes.SUMMARY)])

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name == mattes.NAME:
            return matte_command()
        effect = named_effect(cmd_name)
        if effect.takes not in ("picture", "picture+depth", "nothing"):
            ctx.fail(f"effect {cmd_name!r} takes a {effect.takes}; use: passgraph render --effect {cmd_name}")
        return command_of(effect)


@click.command(cls=_Effects, subcommand_metavar="EFFECT|FILE[:NAME] INPUT... -o OUTPUT [OPTIONS]")
def apply() -> None:
    """Apply an effect to pictures, sequences and videos.

    EFFECT is a built-in effect, or several that run one after another: "bloom, tone-map, vignette". FILE is a Python
    file of yours with an effect or kernel (it is run), or a shader file (ISF .fs, gl-transitions and Shadertoy .glsl,
    exports .json, mpv .hook, libretro .glslp, .frag with the .vert beside it; it is parsed and not run).

    Each INPUT is a picture (PNG, JPEG, TIFF, WebP, OpenEXR, npy), a folder of them, a quoted wildcard ("*.png"), a
    numbered sequence (shot.%04d.exr or shot.####.exr), a video, an animation (GIF, APNG, WebP), or - for PNG pictures
    on standard input.

    Numeric parameters may change over the frames: --progress 0..1 goes from 0 at the first frame to 1 at the last.

    OPTIONS are the parameters of EFFECT and those of every effect, such as --backend, --frames, --bits, --linear,
    --resume and --profile. `passgraph apply EFFECT --help` and `passgraph apply FILE.py --help` list them.
    """


def command_of(effect: Effect) -> click.Command:
    """Return the subcommand of an effect."""
    if effect.takes == "nothing":
        return generator_command(effect)

    @click.command(effect.name, help=f"{effect.summary}  {INPUTS}", short_help=effect.summary)
    @click.argument("inputs", metavar="INPUT...", nargs=-1, required=True, type=click.Path())
    @click.option("--output", "-o", required=True, type=click.Path(), help=OUTPUT)
    @backend_option
    @math_option
    @click.option(
        "--jobs",
        "-j",
        type=click.IntRange(1, MOST_JOBS),
        metavar="NUMBER",
        help="Threads that read and write frames.  [default: one per core, at most 8]",
    )
    @click.option(
        "--scheduler",
        metavar="ADDRESS",
        help="Compute frames on the workers of a dask scheduler, such as tcp://host:8786.",
    )
    @click.option(
        "--resume",
        is_flag=True,
        help="Keep outputs that are complete and were made of the same: graph, values, inputs and version.",
    )
    @click.option(
        "--layer",
        metavar="NAME",
        help="Layer of OpenEXR files, as in INPUT:NAME; or hdr: of JPEG files with a gain map.",
    )
    @keep_layers_option
    @click.option(
        "--raw", metavar="WxH:LAYOUT@RATE", help="Format of raw pixels in streams (-), such as 640x480:rgb24@25."
    )
    @bits_option
    @memory_option
    @stack_options
    @video_options
    @frames_option("one picture")
    @warm_up_option
    @click.option("--sound/--no-sound", default=True, show_default=True, help="Copy a video's sound and subtitles.")
    @capture_option
    @non_finite_option
    @check_finite_option
    @profile_option
    @click.option(
        "--linear/--as-stored",
        default=effect.linear,
        show_default=True,
        help="Give EFFECT linear light: decode 8- and 16-bit pictures from sRGB, and encode 8- and 16-bit results.",
    )
    @color_space_options(effect)
    @click.pass_context
    def command(ctx: click.Context, /, **options: Any) -> int:
        return apply_effect(effect, given_parameters(ctx), **options)

    command.params += preview_options()
    if effect.takes == "picture+depth":
        from passgraph.commands.clips import depth_buffer_option, depth_option

        command.params += [depth_option(required=effect.needs_depth), depth_buffer_option()]
    if "audio" in effect.signals:
        command.params += audio_options(with_sound=False)
    command.params += options_beside(command.params, effect, FramesOption)
    return command


def matte_command() -> click.Command:
    """Return the subcommand that extracts mattes: an effect whose pictures are layers of its input."""
    command = command_of(mattes.MatteEffect.of(1, ()))
    own = {"layer", "linear", "color_config", "from_space", "to_space", "alpha"}
    command.params = [*mattes.matte_options(), *(one for one in command.params if one.name not in own)]

    def callback(inputs: tuple[str, ...], names: Any, picks: Any, which: str | None, **options: Any) -> int:
        effect, layers, further = mattes.matte_of(inputs, names, picks, which)
        options |= {"layer": None, "linear": False, "color_config": None, "from_space": None, "to_space": None}
        return apply_effect(effect, further, inputs=layers, alpha=effect.alpha, **options)

    command.callback = callback
    return command


def generator_command(effect: Effect) -> click.Command:
    """Return the subcommand of an effect that generates its picture from parameters alone."""

    @click.command(effect.name, help=f"{effect.summary}  Reads no picture.")
    @click.argument("inputs", metavar="", nargs=-1, type=click.Path())
    @click.option("--output", "-o", required=True, type=click.Path(path_type=Path), help=OUTPUT_OF_NOTHING)
    @backend_option
    @math_option
    @size_option(RENDER_SIZE)
    @frames_option("it")
    @warm_up_option
    @bits_option
    @video_options
    @capture_option
    @check_finite_option
    @profile_option
    @click.pass_context
    def command(ctx: click.Context, /, **options: Any) -> int:
        return generate(effect, given_parameters(ctx), **options)

    if "audio" in effect.signals:
        command.params += audio_options(with_sound=True)
    command.params += options_beside(command.params, effect, FramesOption)
    return command
