"""``passgraph render``: render a scene with an effect."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

import click

from passgraph.commands.command_graph import RENDER_SIZE, Job, accepts, run_values, scene_job
from passgraph.commands.frames import complain_of, summary_line
from passgraph.commands.options import (
    EffectCommand,
    backend_option,
    capture_option,
    check_finite_option,
    complete_effect,
    given_parameters,
    math_option,
    profile_option,
    size_option,
)
from passgraph.commands.running import (
    RunOptions,
    check_one_picture,
    check_outputs,
    frame_progress,
    program_of,
    progress,
    run_and_save,
)
from passgraph.commands.scene_view import VIEW_FIELDS, Seen, View, refuse_view, seen_by, view_options
from passgraph.commands.written_files import FLOAT_SUFFIXES, check_path, check_picture_path, rate_of
from passgraph.errors import InputError
from passgraph.files.names import Pattern, is_film, is_video
from passgraph.files.open import open_film
from passgraph.files.run import frames
from passgraph.files.sequences import Numbers
from passgraph.graph.targets import MAX_SIDE, Target
from passgraph.image_formats import WRITABLE
from passgraph.language.native import Math

if TYPE_CHECKING:
    from passgraph.effects.effect_table import Effect
    from passgraph.scene import Camera


Antialias = Literal["fxaa", "smaa", "ssaa4", "none"]


def chosen(antialias: Antialias | None, display: bool) -> Antialias:
    """Return the antialiasing mode, or the default; FXAA and SMAA of light beyond 1 are errors."""
    if antialias in ("fxaa", "smaa") and not display:
        raise InputError(
            f"--antialias {antialias} smooths pictures for display, and the result is HDR; use --antialias ssaa4, or "
            "--display"
        )
    return antialias or ("fxaa" if display else "none")


def sampled_size(antialias: Antialias, size: tuple[int, int]) -> tuple[int, int]:
    """Return the size at which a scene is drawn."""
    if antialias != "ssaa4":
        return size
    width, height = size[0] * 2, size[1] * 2
    if max(width, height) > MAX_SIDE:
        raise InputError(
            f"--antialias ssaa4 draws {size[0]}x{size[1]} at {width}x{height}, and a side has at most {MAX_SIDE} "
            "pixels; use --antialias fxaa, or a smaller --size"
        )
    return width, height


def smoothed(job: Job, antialias: Antialias, display: bool, is_transparent: bool) -> Job:
    """Return the job with antialiased outputs; with ssaa4, they have half the width and height of the drawing."""
    if antialias == "none":
        return job
    outputs = {name: _smooth(output, antialias, display, is_transparent) for name, output in job.outputs.items()}
    return replace(job, outputs=outputs)


def _smooth(output: Target, antialias: Antialias, display: bool, is_transparent: bool) -> Target:
    if antialias == "ssaa4":
        from passgraph.effects.antialias.supersampled import supersampled

        return supersampled(output, display, straight=is_transparent)
    smooth: Callable[..., Target]
    if antialias == "smaa":
        from passgraph.effects.antialias.smaa import smaa as smooth
    else:
        from passgraph.effects.antialias.fxaa import fxaa as smooth
    if not is_transparent:
        return smooth(output)
    from passgraph.effects.pictures.alpha import on_straight_alpha

    return on_straight_alpha(smooth)(output)


def holds_alpha(output: Path) -> bool:
    """Return True if a picture or an animation of this name can have alpha; videos keep a background."""
    suffix = output.suffix.lower()
    return not is_video(output) if is_film(output) else suffix in WRITABLE and 4 in WRITABLE[suffix].channels


def check_turntable(output: Path, capture: Path | None, profile: bool, rate: Fraction | None) -> None:
    """Raise InputError for a turntable that cannot be written, before anything is computed."""
    text = os.fspath(output)
    check_one_picture(capture, profile, "--turntable makes several")
    if rate is not None and not is_film(output):
        raise InputError(f"--rate is for videos, and {text} is none; leave it out, or name one: -o turn.mp4")
    if is_film(output):
        check_path(output)
    elif Pattern.is_in(text):
        check_picture_path(Pattern(text).path(1))
    else:
        raise InputError(
            f"{text}: is one picture, and --turntable makes several; give a numbered sequence (-o turn.%04d.png) or a "
            "video (-o turn.mp4), or an animation (-o turn.gif)"
        )


def run_turntable(job: Job, cameras: Sequence[Camera], output: Path, run: RunOptions, rate: Fraction | None) -> int:
    """Run a job once for each camera and write its first output; return the exit status. ``rate`` is a video's.

    Raises
    ------
    InputError
        The graph's camera is not a run value, or frames cannot be written.
    """
    taken = {value.name for value in run_values(job.outputs)}
    if "camera" not in taken:
        raise InputError("--turntable: this effect takes no camera with each run, so that it cannot go round the scene")

    def values(number: int) -> dict[str, Any]:
        seen = {"camera": cameras[number - 1], "previous_camera": cameras[max(number - 2, 0)]}
        return job.given | {name: camera for name, camera in seen.items() if name in taken}

    with program_of(job.outputs, job.size, run, as_stored=False) as program:
        with frame_progress(str(output), len(cameras), complain_of) as step:
            summary = frames(
                program,
                Numbers(len(cameras)),
                output if rate is None else open_film(output, rate),
                watch=step,
                values=values,
            )
        click.echo(summary_line(str(output), summary, program.backend.name))
    return 0 if summary.whole else 1


class RenderCommand(EffectCommand):
    default_effect = "soft-shadow"
    takes = ("scene", "world2d")


@click.command(cls=RenderCommand)
@click.argument("scene", required=False, type=click.Path(path_type=Path), shell_complete=complete_effect)
@click.option("--effect", "-e", default="soft-shadow", show_default=True, help="Effect that renders the scene.")
@backend_option
@math_option
@size_option(RENDER_SIZE)
@view_options
@click.option("--rate", metavar="NUMBER", help="Frames per second of a turntable's video.  [default: 25]")
@click.option(
    "--antialias",
    type=click.Choice(get_args(Antialias)),
    help="Antialiasing: fxaa or smaa (sharper) in the finished picture, or ssaa4 by four samples per pixel, at "
    "four times the work.  [default: fxaa for display, none for HDR]",
)
@click.option(
    "--output", "-o", required=True, type=click.Path(path_type=Path),
    help="Picture to write: .png .jpg .tif .webp (8 bit), .exr .npy (float32).",
)  # fmt: skip
@capture_option
@check_finite_option
@profile_option
@click.pass_context
def render(
    ctx: click.Context,
    /,
    scene: Path | None,
    effect: str,
    backend: str | None,
    math: Math,
    size: tuple[int, int],
    rate: str | None,
    antialias: Antialias | None,
    output: Path,
    capture: Path | None,
    check_finite: bool,
    profile: bool,
    **rest: Any,
) -> int:
    """Render SCENE (.glb .gltf .obj .off .ply .stl; .json for light2d) with an effect.

    Without SCENE, the scene that comes with passgraph is rendered. By default, the camera shows the whole scene, and a
    scene without a floor gets one. Files .exr and .npy get the HDR result, without the display transform.
    """
    assert isinstance(ctx.command, EffectCommand)
    renderer = ctx.command.effect_of(ctx)
    assert renderer is not None
    parameters = given_parameters(ctx)
    in_floats = output.suffix.lower() in FLOAT_SUFFIXES
    if in_floats and accepts(renderer, "display"):
        parameters.setdefault("display", False)
    display = bool(parameters.get("display", not in_floats))
    smoothing = chosen(antialias, display)
    view = View(**{name: value for name, value in rest.items() if name in VIEW_FIELDS})
    has_background = view.ground != "none" or "background" in parameters
    if not has_background and accepts(renderer, "background_alpha") and holds_alpha(output):
        parameters.setdefault("background_alpha", 0.0)
    a_second = None if rate is None else rate_of(rate)
    if view.turntable:
        check_turntable(output, capture, profile, a_second)
    elif a_second is not None:
        raise InputError("--rate is for the video of a --turntable, and this is one picture; leave it out")
    else:
        check_outputs(output, capture)
    with progress("reading the scene"):
        job, seen = _job_of(renderer, scene, view, size, sampled_size(smoothing, size), parameters)
    job = smoothed(job, smoothing, display, parameters.get("background_alpha", 1.0) < 1.0)
    status = 0
    if view.turntable:
        cameras = () if seen is None else seen.cameras
        run = RunOptions(backend, check_finite=check_finite, math=math)
        status = run_turntable(job, cameras, output, run, a_second)
    else:
        run_and_save(job, output, RunOptions(backend, capture, check_finite, profile, math=math))
    for line in () if seen is None else seen.lines:
        click.echo(line)
    return status


def _job_of(
    renderer: Effect, scene: Path | None, view: View, size: tuple[int, int], drawn: tuple[int, int],
    parameters: dict[str, Any],
) -> tuple[Job, Seen | None]:  # fmt: skip
    """Return the job of a renderer and the view of its scene; a flat world has one view."""
    if renderer.takes == "world2d":
        refuse_view(view, renderer.name)
        # the targets of a world have their own sizes; only the output has the requested size
        return replace(scene_job(renderer, scene, drawn, parameters), size=size), None
    seen = seen_by(view, scene, size)
    return scene_job(renderer, scene, drawn, parameters, seen.scene), seen
