"""``passgraph plan``: explain the plan of an effect: steps, their order and memory, and the reasons."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from passgraph.commands.command_graph import RENDER_SIZE, subject, subject_options
from passgraph.commands.options import EffectCommand
from passgraph.commands.written_files import check_path
from passgraph.plan.data import Options
from passgraph.writing import write_text


@click.command(cls=EffectCommand)
@subject_options("Effect to plan", RENDER_SIZE)
@click.option("--svg", type=click.Path(path_type=Path), metavar="FILE", help="Draw the plan as SVG.")
@click.option(
    "--off",
    multiple=True,
    type=click.Choice(["cull", "fuse", "order", "alias", "static"]),
    help="Switch off an optimization; may be repeated.",
)
@click.pass_context
def plan(ctx: click.Context, /, svg: Path | None, off: tuple[str, ...], **_: Any) -> None:
    """Explain the plan of an effect: the order of steps, their memory, and what is culled, fused or aliased.

    No driver is needed and nothing runs.  Pictures keep their own size.
    """
    from passgraph.plan.build import build

    if svg is not None:
        check_path(svg)
    job = subject(ctx)
    built = build(job.outputs, job.size, None, Options.without(*off))
    click.echo(built.explain())
    if svg is not None:
        write_text(svg, built.svg())
        click.echo(f"{svg}: drawn")
