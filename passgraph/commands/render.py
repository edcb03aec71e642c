"""``passgraph render``: a scene with an effect to a picture."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from passgraph.commands.files import FLOAT_SUFFIXES
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
from passgraph.commands.sources import RENDER_SIZE, accepts, scene_job, world_job


class RenderCommand(EffectCommand):
    default_effect = "soft-shadow"
    takes = ("scene", "world2d")


@click.command(cls=RenderCommand)
@click.argument("scene", required=False, type=click.Path(path_type=Path))
@click.option("--effect", "-e", default="soft-shadow", show_default=True, help="What renders it.")
@backend_option
@size_option(RENDER_SIZE)
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
    antialias: Antialias | None,
    output: Path,
    capture: Path | None,
    check_finite: bool,
    profile: bool,
    **_: Any,
) -> None:
    """Render SCENE (.glb .gltf .obj .off .ply .stl; .json for light2d) with an effect.

    Without SCENE it is the one that comes with passgraph.

    Into .exr and .npy goes the HDR result, without the transform for display.
    """
    assert isinstance(ctx.command, EffectCommand)
    renderer = ctx.command.effect_of(ctx)
    assert renderer is not None
    check_outputs(output, capture)
    parameters = given_parameters(ctx)
    in_floats = output.suffix.lower() in FLOAT_SUFFIXES
    if in_floats and accepts(renderer, "display"):
        parameters.setdefault("display", False)
    display = bool(parameters.get("display", not in_floats))
    smoothing = chosen(antialias, display)
    with progress("reading the scene"):
        drawn = sampled_size(smoothing, size)
        if renderer.takes == "world2d":
            # a world's targets say how large they are: the output is all that takes the size asked for
            job = replace(world_job(renderer, scene, drawn, parameters), size=size)
        else:
            job = scene_job(renderer, scene, drawn, parameters)
    job = smoothed(job, smoothing, display)
    run_and_save(job, backend, output, capture, check_finite=check_finite, profile=profile)
