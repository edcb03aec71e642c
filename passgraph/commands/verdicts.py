"""Common part of ``check`` and ``compare``: the limit of undecided pixels, and verdicts in words."""

from __future__ import annotations

from collections.abc import Sequence

import click

from passgraph.commands.options import FiniteRange
from passgraph.verify.report import MOST_AMBIGUOUS, Report

most_ambiguous_option = click.option(
    "--most-ambiguous", type=FiniteRange(0.0, 1.0), default=MOST_AMBIGUOUS, show_default=True, metavar="SHARE",
    help="Largest share of ambiguous pixels (rounding can change a decision); above it, a target is undecided.",
)  # fmt: skip
most_seconds_option = click.option(
    "--most-seconds",
    type=FiniteRange(0.0),
    metavar="SECONDS",
    help="Time limit of the search for bounds; the rest is undecided. The reference itself runs to its end.  "
    "[default: no limit]",
)


def say_equality(report: Report, name: str = "") -> None:
    """Print whether backends give the same bits."""
    if report.equality:
        click.echo(f"{name}{': ' if name else ''}{report.equality}")


def say_non_finite(report: Report, name: str, allowed: bool) -> bool:
    """Print the first NaN or infinity that the reference computes too; return False if it is not allowed.

    Values that overflow only when they are stored pass, since generated pictures have highlights that few effects
    expect.
    """
    targets = [target for backend in report.ran for target in backend.targets if target.non_finite is not None]
    for target in targets[:1]:
        assert target.non_finite is not None
        passes = allowed or not target.non_finite.causes
        where = f"{name}: pass {target.step}, target {target.target}"
        mend = "" if passes else "; where it is meant to be so: --allow-nan"
        click.echo(f"{where}: {target.non_finite}{mend}")
        return passes
    return True


def say_faults(report: Report, name: str = "", files: Sequence[str] = ()) -> None:
    """Print why backends did not pass, once for the same reason of several backends; errors keep their lines."""
    who: dict[str, list[str]] = {}
    for backend in report.backends:
        if not backend.missing:
            for fault in backend.faults:
                who.setdefault(fault, []).append(backend.name)
    for fault, names in who.items():
        click.echo(f"{name}{' on ' if name else ''}{', '.join(names)}: {fault}")
    targets = [target for backend in report.backends for target in backend.targets]
    if files and any(target.other_kind for target in targets):
        click.echo(
            f"What was made for {', '.join(files)} holds 0 to 1, highlights up to 10,000, and a row of zeros; where "
            "yours does not, give a picture: --input NAME=FILE"
        )
    if any(target.undecided for target in targets):
        click.echo(
            "Undecided is no pass: keep the kernel off such decisions, or give it pictures that do (--input); where it "
            "is meant to be so: --most-ambiguous SHARE"
        )
