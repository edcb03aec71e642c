"""``passgraph conform``: run the conformance suite on a backend."""

from __future__ import annotations

import json
import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, get_args

import click

from passgraph.commands.options import BackendType, FiniteRange, math_option
from passgraph.commands.running import progress
from passgraph.commands.written_files import check_path
from passgraph.errors import InputError
from passgraph.language.native import Math
from passgraph.writing import made_folder, write_text

if TYPE_CHECKING:
    from passgraph.verify.conformance import SuiteReport
    from passgraph.verify.conformance.case import Case
    from passgraph.verify.conformance.kept_results import KeptReport
    from passgraph.verify.conformance.suite import Progress

#: Kinds of changes in the order of their counts, and how many cases with another error are shown.
KINDS, MOST_ERRORS = ("new failure", "known failure", "mended", "good", "not run"), 20


@click.command()
@click.option("--backend", "-b", type=BackendType(), help="Backend to test: built in, or of an installed package.")
@click.option("--group", "-g", "groups", multiple=True, help="Run only this group of cases; may be repeated.")
@click.option(
    "--only", multiple=True, metavar="CASE", help="Run only this case, group/name; * is any text; may be repeated."
)
@click.option("--skip", multiple=True, metavar="CASE", help="Leave out this case, as for --only; may be repeated.")
@click.option("--quick", is_flag=True, help="Run fewer cases: skip those that resemble others.")
@click.option(
    "--most-seconds",
    type=FiniteRange(0.0, min_open=True),
    metavar="N",
    help="Begin no case after this time. Those that resemble no other run first, in turns of the groups.",
)
@click.option(
    "--repeat",
    type=click.IntRange(1, 1000),
    default=1,
    show_default=True,
    metavar="N",
    help="Run each case so often; it is flaky if the outcomes differ.",
)
@click.option(
    "--baseline",
    type=click.Path(path_type=Path),
    metavar="FILE.json",
    help="Results of an earlier run (--json): only failures that are new there count.",
)
@click.option(
    "--compare",
    nargs=2,
    type=click.Path(path_type=Path),
    metavar="A.json B.json",
    help="Compare the results of two runs case by case, and run none.",
)
@click.option(
    "--export-repro",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Write each failed pixel pass, and on gl each draw, as a folder that repeats it without passgraph, for a "
    "report to the driver's authors.",
)
@math_option
@click.option(
    "--functions", is_flag=True, help="Measure the error of each function (exp, sin …) in ULP instead of running cases."
)
@click.option(
    "--every",
    "names",
    multiple=True,
    metavar="NAME",
    help="Measure this function of one number over all 2³² float32 arguments, which takes minutes; may be repeated; "
    "'all' measures each. Ctrl-C prints what was found.",
)
@click.option("--report", type=click.Path(path_type=Path), metavar="FILE.html", help="Write a report with pictures.")
@click.option(
    "--json", "json_path", type=click.Path(path_type=Path), metavar="FILE.json", help="Write all results as data."
)
def conform(
    backend: str | None, groups: tuple[str, ...], only: tuple[str, ...], skip: tuple[str, ...], quick: bool,
    most_seconds: float | None, repeat: int, baseline: Path | None, compare: tuple[Path, Path] | None,
    export_repro: Path | None, math: Math,
    functions: bool, names: tuple[str, ...], report: Path | None, json_path: Path | None,
) -> int:  # fmt: skip
    """Run the conformance suite on a backend: every operation, format, draw state and effect, on small pictures.

    Each render target of each pass must lie within the bounds that follow from the rounding of operations and
    formats. A case is vacuous, and does not pass, if rounding leaves too many of its pixels undecided. It is
    unsupported, which is no fault, if the device lacks what it takes.

    Exit status: 0 every case passes, 1 some do not, 2 an error. With --baseline, 1 if some fail that did not fail so
    there; with --compare, 1 if some fail in B that did not fail so in A. With --every, 1 if a result is outside its
    bounds.
    """
    from passgraph.verify.conformance import cases, kept_results, run
    from passgraph.verify.conformance.selection import most_telling_first, selected

    of_cases = bool(
        groups or only or skip or quick or most_seconds or repeat > 1 or baseline or json_path or export_repro
    )
    if compare is not None:
        if backend is not None or of_cases or functions or names:
            raise InputError("--compare reads two reports and runs nothing; leave out all options but --report")
        return _compare(*compare, report)
    if backend is None:
        raise click.MissingParameter(param_type="option", param_hint="'--backend' / '-b'")
    if functions or names:
        option = "--functions" if functions else "--every"
        if of_cases or report is not None:
            raise InputError(f"{option} measures functions and runs no cases; leave out options of cases and reports")
        if functions and names:
            raise InputError("--functions takes samples, and --every all arguments; leave out one")
        return _measure_every(backend, math, names) if names else _measure_functions(backend, math)
    for path in (report, json_path):
        if path is not None:
            check_path(path)
    if export_repro is not None:
        made_folder(export_repro)
    known = None if baseline is None else kept_results.load(baseline)
    chosen = selected(cases(groups or None, quick=quick), only, skip)
    if most_seconds is not None:
        chosen = most_telling_first(chosen)
    with _bar(len(chosen)) as on_case:
        result = run(backend, chosen, math=math, repeat=repeat, most_seconds=most_seconds, progress=on_case)
    _show(result)
    if report is not None:
        from passgraph.verify.conformance.page import html_of

        write_text(report, html_of(result))
        click.echo(f"{report}: written")
    if json_path is not None:
        write_text(json_path, kept_results.json_of(result))
        click.echo(f"{json_path}: written")
    if export_repro is not None:
        _export(result, chosen, backend, math, export_repro)
    if known is None:
        return 0 if result.passed else 1
    now = kept_results.kept(json.loads(kept_results.json_of(result)), result.backend)
    return _show_changes(known, now, str(baseline))


def _export(report: SuiteReport, cases: list[Case], backend: str, math: Math, folder: Path) -> None:
    """Write a reproduction of each case that diverged."""
    from passgraph.backends.registry import open_backend
    from passgraph.verify.conformance.judging import Judge
    from passgraph.verify.reproduction import folder_name, write_reproduction

    diverged = {verdict.id for verdict in report.verdicts if verdict.divergence is not None}
    with open_backend(backend) as opened:
        for case in (case for case in cases if case.id in diverged):
            place = folder / folder_name(case.id)
            why = write_reproduction(Judge(case, math=math).passes, opened, place)
            click.echo(f"{case.id}: no reproduction: {why}" if why else f"{place}: written; run reproduce.py there")


def _compare(one: Path, other: Path, report: Path | None) -> int:
    """Print what differs between two reports, and write the page that has every case."""
    from passgraph.verify.conformance import kept_results

    if report is not None:
        check_path(report)
    before, after = kept_results.load(one), kept_results.load(other)
    click.echo(f"A: {before.title}\nB: {after.title}")
    status = _show_changes(before, after, "A")
    if report is not None:
        from passgraph.verify.conformance.page import compared_html

        write_text(report, compared_html(before, after))
        click.echo(f"{report}: written")
    return status


def _show_changes(before: KeptReport, after: KeptReport, first: str) -> int:
    """Print the conditions and the cases that differ, and return 1 if a failure is new."""
    from passgraph.verify.conformance.kept_results import changes, other_conditions

    for name, one, other in other_conditions(before, after):
        click.echo(f"{name}: {other}, in {first} {one}")
    found = changes(before, after)
    for kind in ("new failure", "mended"):
        for change in found:
            if change.kind == kind:
                click.echo(f"{kind}: {change.case}: {change.after}, in {first} {change.before or 'not run'}")
    moved = [change for change in found if change.is_difference and change.before and change.after]
    for change in sorted(moved, key=lambda change: -change.growth)[:MOST_ERRORS]:
        if change.kind in ("good", "known failure"):
            click.echo(f"other error: {change.case}: {change.after}, in {first} {change.before}")
    counts = Counter(change.kind for change in found)
    click.echo(", ".join(f"{counts[kind]} {kind}" for kind in KINDS if counts[kind]) or "no cases")
    return 1 if counts["new failure"] else 0


def _measure_functions(backend: str, math: Math) -> int:
    """Print the errors of each function, then its results for zeros, a denormal, infinities and NaN."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    from passgraph.backends.registry import open_backend
    from passgraph.verify.function_errors import SPECIAL, measure_functions

    table, special = Table(box=box.SIMPLE_HEAD), Table(box=box.SIMPLE_HEAD)
    table.add_column("function")
    for heading in ("largest error, ULP", "median", "at"):
        table.add_column(heading, justify="right")
    table.add_column("promised")
    special.add_column("result of")
    for argument in SPECIAL:
        special.add_column(f"{argument:g}", justify="right")
    with open_backend(backend) as opened, progress("measuring") as say:
        for found in measure_functions(opened, math):
            say(f"measuring {found.name}")
            at = ", ".join(f"{x:.6g}" for x in found.worst_at)
            table.add_row(found.name, f"{found.worst:.2f}", f"{found.typical:.2f}", at, found.promised)
            if found.special:
                special.add_row(found.name, *(f"{result:g}" for _, result in found.special))
    if not table.row_count:
        raise _has_none(backend)
    Console(highlight=False, soft_wrap=True).print(table, special)
    return 0


def _has_none(backend: str) -> InputError:
    return InputError(f"{backend} computes all functions alike in exact and native math; leave out --math")


def _measure_every(backend: str, math: Math, names: tuple[str, ...]) -> int:
    """Print the largest error of each function over all arguments; on Ctrl-C, over those measured until then."""
    from passgraph.backends.registry import open_backend
    from passgraph.verify.every_argument import ARGUMENTS, OF_ONE_NUMBER, EveryError, measure_every
    from passgraph.verify.function_errors import measurable

    outside, found = 0, EveryError("", math, "")
    try:
        with open_backend(backend) as opened, progress("measuring") as say:
            if not (known := measurable(opened, math, OF_ONE_NUMBER)):
                raise _has_none(backend)
            for name in known if "all" in names else names:
                for found in measure_every(opened, name, math):
                    say(f"measuring {name}", found.count, ARGUMENTS)
                click.echo(str(found))
                outside += found.outside
    except KeyboardInterrupt:
        if 0 < found.count < ARGUMENTS:
            click.echo(str(found))
        raise
    return 1 if outside else 0


@contextmanager
def _bar(count: int) -> Iterator[Progress]:
    """Show progress on stderr: a bar on a terminal, else a line for each group of cases."""
    if not sys.stderr.isatty():
        begun = set[str]()

        def name_group(number: int, case: Case, state: object) -> None:
            if case.group not in begun:
                begun.add(case.group)
                click.echo(f"passgraph: {case.group} (case {number + 1} of {count})", err=True)

        yield name_group
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TextColumn("{task.description}", markup=False)
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=count)
        yield lambda number, case, state: bar.update(task, completed=number, description=case.id)


def _show(report: SuiteReport) -> None:
    """Print a table of groups, then a line for each case that is unsupported or did not pass."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    from passgraph.verify.conformance.judging import Outcome

    table = Table(box=box.SIMPLE_HEAD)
    table.add_column("group")
    for heading in ("cases", "passed", "most ambiguous", "mean", "least told", "seconds"):
        table.add_column(heading, justify="right")
    for group in report.groups:
        table.add_row(
            group.group, str(group.cases), str(group.passed), f"{group.most_ambiguous:.2%}",
            f"{group.mean_ambiguous:.2%}", f"{group.least_told:.1%}", f"{group.seconds:.1f}",
        )  # fmt: skip
    console = Console(highlight=False, soft_wrap=True)
    console.print(table)
    unsupported = [verdict for verdict in report.verdicts if verdict.outcome == "unsupported"]
    for verdict in (*unsupported, *report.faults):
        console.print(str(verdict), markup=False)
    counts: dict[str, int] = {name: report.count(name) for name in get_args(Outcome)}
    if report.not_run:
        counts["not run"] = len(report.not_run)
    text = ", ".join(f"{count} {name}" for name, count in counts.items() if count)
    if report.conditions is not None:
        console.print(f"{report.conditions.device}; passgraph {report.conditions.environment.passgraph}", markup=False)
    console.print(f"{report.backend}: {text or 'no case ran'}", markup=False)
