"""``passgraph compare``: compare every backend with the reference, pass by pass."""

from __future__ import annotations

from typing import Any

import click

from passgraph.commands.command_graph import subject, subject_options
from passgraph.commands.options import EffectCommand, backends_option, math_option
from passgraph.commands.running import progress
from passgraph.commands.tables import marked, show_table
from passgraph.commands.verdicts import most_ambiguous_option, most_seconds_option, say_equality, say_faults
from passgraph.language.native import Math
from passgraph.verify.compare import compare as compare_backends
from passgraph.verify.report import BackendReport, Report

#: Default size. The reference evaluates each operation with intervals and for each outcome of decisions, so large
#: pictures take minutes.
COMPARE_SIZE = (160, 90)


@click.command(cls=EffectCommand)
@subject_options("Effect to compute", COMPARE_SIZE)
@backends_option
@math_option
@most_ambiguous_option
@most_seconds_option
@click.pass_context
def compare(
    ctx: click.Context, /, backends: tuple[str, ...], math: Math, most_ambiguous: float, most_seconds: float | None,
    **_: Any,
) -> int:  # fmt: skip
    """Compare each render target of an effect on every backend with the float64 reference.

    Each pass reads the reference's pictures, so a difference belongs to that pass. Bounds follow from the rounding of
    each operation and format. A pixel is ambiguous if rounding can change a decision (a comparison, the choice of a
    texel); too many ambiguous pixels leave the target undecided. NaN and infinity fail where the reference has
    numbers. Pictures keep their own size.

    Exit status: 0 everything passes, 1 a backend diverges, fails or is undecided, 2 an error.
    """
    with progress("reading") as say:
        job = subject(ctx)
        report = compare_backends(
            job.outputs, backends or None, size=job.size, math=math, progress=say, most_ambiguous=most_ambiguous,
            most_seconds=most_seconds, **job.given,
        )  # fmt: skip
    show(report)
    return 0 if report.passed else 1


def show(report: Report) -> None:
    """Print if backends give the same bits, and for each backend a table and its verdict."""
    say_equality(report)
    for backend in report.backends:
        if backend.missing:
            click.echo(f"{backend.name}: missing: {' '.join(backend.missing.split())}")
        elif backend.targets:
            _show_table(backend)
        if backend.passed:
            click.echo(f"{backend.name}: within bounds\n")
    say_faults(report)
    if all(backend.missing for backend in report.backends):
        click.echo("no backend is here to be compared; see: passgraph backends")


def _show_table(backend: BackendReport) -> None:
    numbers = ("max error", "RMSE", "differing", "of its bound", "ambiguous", "outside", "adds up to", "verdict")
    rows = [
        (
            t.step, f"{t.target} ({t.format.name})", f"{t.max_error:.3g}", f"{t.rmse:.3g}", f"{t.differing:.2%}",
            f"{t.bound_share:.1%}", f"{t.ambiguous:.3%}", f"{t.outside:.3%}", f"{t.accumulated_max:.3g}",
            marked(t.verdict, t.passed),
        )
        for t in backend.targets
    ]  # fmt: skip
    show_table(f"{backend.name} against the reference", ("pass", "target"), numbers, rows)
