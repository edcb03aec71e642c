"""``passgraph render``: a scene with an effect to a picture."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from passgraph.commands.files import FLOAT_SUFFIXES, rate_of
from passgraph.commands.options import (
    EffectCommand,
    backend_option,
    capture_option,
    check_finite_option,
    given_parameters,
    output_option,
    profile_option,
    size_option,
)
from passgraph.commands.progress import progress
from passgraph.commands.running import check_outputs, run_and_save
from passgraph.commands.smoothing import Antialias, antialias_option, chosen, sampled_size, smoothed
from passgraph.commands.sources import RENDER_SIZE, Job, accepts, job_of_scene, world_job
from passgraph.commands.view import VIEW_FIELDS, Seen, View, refuse_view, seen_by, view_options
from passgraph.errors import InputError

if TYPE_CHECKING:
    from passgraph.effects.registry import Effect


class RenderCommand(EffectCommand):
    default_effect = "soft-shadow"
    takes = ("scene", "world2d")


@click.command(cls=RenderCommand)
@click.argument("scene", required=False, type=click.Path(path_type=Path))
@click.option("--effect", "-e", default="soft-shadow", show_default=True, help="What renders it.")
@backend_option
@size_option(RENDER_SIZE)
@view_options
@click.option("--rate", metavar="NUMBER", help="Frames a second of a turntable's video.  [default: 25]")
@antialias_option
@output_option
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

    Without SCENE it is the one that comes with passgraph.

    Into .exr and .npy goes the HDR result, without the transform for display.
    Where nothing is said, the camera stands so that what is in SCENE fills the picture, and what has no floor gets one.
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
    a_second = None if rate is None else rate_of(rate)
    if view.turntable:
        from passgraph.commands.turntable import check_turntable

        check_turntable(output, capture, profile, a_second)
    elif a_second is not None:
        raise InputError("--rate is for the video of a --turntable, and this is one picture; leave it out")
    else:
        check_outputs(output, capture)
    with progress("reading the scene"):
        job, seen = _job_of(renderer, scene, view, size, sampled_size(smoothing, size), parameters)
    job = smoothed(job, smoothing, display)
    status = 0
    if view.turntable:
        from passgraph.commands.turntable import run_turntable

        cameras = () if seen is None else seen.cameras
        status = run_turntable(job, cameras, backend, output, rate=a_second, check_finite=check_finite)
    else:
        run_and_save(job, backend, output, capture, check_finite=check_finite, profile=profile)
    for line in () if seen is None else seen.lines:
        click.echo(line)
    return status


def _job_of(
    renderer: Effect, scene: Path | None, view: View, size: tuple[int, int], drawn: tuple[int, int],
    parameters: dict[str, Any],
) -> tuple[Job, Seen | None]:  # fmt: skip
    """What is rendered, and how its scene is looked at; a flat world is looked at in one way."""
    if renderer.takes == "world2d":
        refuse_view(view, renderer.name)
        # a world's targets say how large they are: the output is all that takes the size asked for
        return replace(world_job(renderer, scene, drawn, parameters), size=size), None
    seen = seen_by(view, scene, size)
    return job_of_scene(renderer, seen.scene, drawn, parameters), seen
