"""``passgraph inspect``: show the values of every line of a kernel at a pixel."""

from __future__ import annotations

from typing import Any

import click

from passgraph.commands.command_graph import RENDER_SIZE, subject, subject_options
from passgraph.commands.options import EffectCommand
from passgraph.commands.running import progress


class PixelType(click.ParamType[tuple[int, int]]):
    """X,Y."""

    name = "X,Y"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int]:
        x, comma, y = str(value).partition(",")
        if not (comma and all(side.isascii() and side.isdigit() and len(side) < 10 for side in (x, y))):
            self.fail(f"{value!r} is not X,Y, a pixel's column and row from the top left, such as 120,45", param, ctx)
        return int(x), int(y)


@click.command(cls=EffectCommand)
@subject_options("Effect to inspect", RENDER_SIZE)
@click.option("--at", required=True, type=PixelType(), help="Column and row of the pixel; 0,0 is at the top left.")
@click.option(
    "--pass",
    "step",
    metavar="NAME",
    help="Pass or draw by its name in `passgraph plan`; NAME 2 is the second of that name.  [default: the last]",
)
@click.pass_context
def inspect(ctx: click.Context, /, at: tuple[int, int], step: str | None, **_: Any) -> None:
    """Show the values of every line of a kernel at one pixel, computed by the reference in float64.

    Branches show if they are taken, loops their first and last trips. For a draw, the triangles that cover the pixel
    are listed in order, with their depths and the tests that they pass. The fragment kernel's lines follow for the
    visible triangle and a few others, with the results of the vertex kernel for their corners.

    Earlier passes run on the reference too, which is slow on large pictures. Pictures keep their own size.
    """
    from passgraph.run.compile import compile

    with progress("reading") as say:
        job = subject(ctx)
        say("computing what the pass reads")
        with compile(job.outputs, "reference", job.size) as program:
            found = program.inspect(*at, step, **job.given)
    click.echo(str(found))
