"""``passgraph inspect``: every value of every line of a kernel at one pixel."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from passgraph.commands.compare import job_of
from passgraph.commands.options import EffectCommand, effect_option, given_parameters, named_or_refused, size_option
from passgraph.commands.running import progress
from passgraph.commands.sources import RENDER_SIZE


class PixelType(click.ParamType[tuple[int, int]]):
    """X,Y."""

    name = "X,Y"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int]:
        if isinstance(value, tuple):
            return value
        x, comma, y = str(value).partition(",")
        if not (comma and all(side.isascii() and side.isdigit() and len(side) < 10 for side in (x, y))):
            self.fail(f"{value!r} is not X,Y, a pixel's column and row from the top left, such as 120,45", param, ctx)
        return int(x), int(y)


@click.command(cls=EffectCommand)
@click.argument("source", metavar="[SCENE_OR_PICTURE]", required=False, type=click.Path(path_type=Path))
@effect_option("What is looked into")
@click.option("--at", required=True, type=PixelType(), help="The pixel: column and row, 0,0 at the top left.")
@click.option(
    "--pass",
    "step",
    metavar="NAME",
    help="A pass or a draw, as `passgraph plan` names it; NAME 2 is the second of that name.  [default: last]",
)
@size_option(RENDER_SIZE)
@click.option("--depth", type=click.Path(path_type=Path), help="Depth picture, for effects that take one.")
@click.option("--linear", is_flag=True, help="Decode 8- and 16-bit pictures from sRGB to linear light first.")
@click.pass_context
def inspect(
    ctx: click.Context,
    /,
    source: Path | None,
    at: tuple[int, int],
    step: str | None,
    size: tuple[int, int],
    depth: Path | None,
    linear: bool,
    **_: Any,
) -> None:
    """Show every value of every line of a kernel at one pixel, in float64, by the reference.

    Branches are shown with whether they hold, loops with their first and last trips.  Of a draw: which triangles cover
    the pixel, in order, with their depths and which tests they pass; then the fragment kernel's lines for the visible
    one and a few others, with what the vertex kernel gave for their corners.

    Passes before the one that is looked into run on the reference too, which takes its time on large pictures.
    Pictures keep their own size.
    """
    from passgraph.run.compile import compile

    chosen = named_or_refused(ctx, source)
    with progress("reading") as say:
        job = job_of(chosen, source, size, depth, linear, given_parameters(ctx))
        say("computing what the pass reads")
        with compile(job.outputs, "reference", job.size) as program:
            found = program.inspect(*at, step, **job.given)
    click.echo(str(found))
