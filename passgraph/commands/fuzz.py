"""``passgraph fuzz``: test every backend with random kernels, graphs and draws for a given time."""

from __future__ import annotations

import secrets
import sys
from contextlib import suppress
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING

import click

from passgraph.backends.base import Backend
from passgraph.commands.input_values import opened
from passgraph.commands.options import FiniteRange, backends_option
from passgraph.commands.written_files import check_folder
from passgraph.errors import DeviceMissingError, InputError
from passgraph.writing import made_folder

if TYPE_CHECKING:
    from passgraph.verify.conditions import Conditions
    from passgraph.verify.fuzz.cases import Case
    from passgraph.verify.fuzz.search import Failure

INSTALL = "pip install 'passgraph[fuzz]'"
#: Kinds of cases; ``variants`` are rewritten kernels that must give the same results.
KINDS = ("kernels", "native", "graphs", "draws", "variants")


@click.command()
@click.option(
    "--minutes", type=FiniteRange(0.0, 10_000.0), default=1.0, show_default=True, metavar="N",
    help="Time for new cases; shrinking a failure may take two minutes more.",
)  # fmt: skip
@click.option(
    "--seed",
    type=click.IntRange(0, 2**31),
    help="Random seed; the same seed gives the same cases in the same order.  [default: another one each time]",
)
@backends_option
@click.option(
    "--what",
    type=click.Choice((*KINDS, "all")),
    default="all",
    show_default=True,
    help="Kind of cases: native kernels call the device's own functions; variants are kernels in rewritten forms.",
)
@click.option(
    "--failures", type=click.Path(path_type=Path), default=Path("fuzz-failures"), show_default=True,
    metavar="FOLDER", help="Folder for shrunk failures.",
)  # fmt: skip
@click.option(
    "--export-repro", type=click.Path(path_type=Path), metavar="DIR",
    help="Write each failed pixel pass as a folder that repeats it without passgraph.",
)  # fmt: skip
@click.option(
    "--replay",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Run this file, or all of a folder, again instead.",
)
def fuzz(
    minutes: float, seed: int | None, backends: tuple[str, ...], what: str, failures: Path, export_repro: Path | None,
    replay: Path | None,
) -> int:  # fmt: skip
    """Test backends with random kernels, graphs and draws, against the float64 reference.

    Every target of every pass must lie within the bounds of rounding. Rewritten kernels, optimizations and second
    runs must give the same bits. A failure is shrunk to the smallest case that fails, and written to a file of plain
    data; its texts are parsed and never executed.

    Exit status: 0 nothing found, 1 a failure, 2 an error.
    """
    try:
        import passgraph.verify.fuzz.search  # noqa: F401
    except ImportError as error:
        raise DeviceMissingError(f"fuzzing needs hypothesis ({error}); install it: {INSTALL}") from None
    if export_repro is not None:
        made_folder(export_repro)
    with opened(backends) as devices:
        if replay is not None:
            return _replay(replay, devices, export_repro)
        if seed is None:
            seed = secrets.randbelow(2**31)
        click.echo(f"seed {seed}; again: --seed {seed}")
        is_new = not failures.exists()
        check_folder(failures)  # before the long run
        try:
            kinds = KINDS if what == "all" else (what,)
            return _hunt(kinds, devices, seed, minutes * 60, failures, export_repro)
        finally:
            if is_new:
                with suppress(OSError):  # it has failures
                    failures.rmdir()


def _hunt(
    kinds: tuple[str, ...], backends: list[Backend], seed: int, seconds: float, folder: Path, repro: Path | None
) -> int:
    """Run batches of each kind in turn; write each distinct failure once."""
    from passgraph.verify.conditions import Conditions
    from passgraph.verify.fuzz import search
    from passgraph.verify.fuzz.cases import Tally

    strategies, tally, found = search.strategies(), Tally(), set[str]()
    until, number = monotonic() + seconds, 0
    while monotonic() < until:
        for kind in kinds:
            one = search.batch_seed(seed, number)
            failure = search.batch(strategies[kind], backends, one, tally, search.BATCH[kind], until)
            number += 1
            if failure is not None:
                conditions = [Conditions.now(backend, seed=seed) for backend in backends]
                found.add(_written(failure, folder, backends, conditions))
                if repro is not None:
                    _export(failure.case, backends, repro)
            _say(f"{tally}; {len(found)} found")
    if sys.stderr.isatty():
        click.echo(err=True)
    click.echo(f"{tally}; {len(found)} found, seed {seed}")
    return 1 if found else 0


def _written(failure: Failure, folder: Path, backends: list[Backend], conditions: list[Conditions]) -> str:
    """Write a failure, and return a message with the command that repeats it."""
    from passgraph.verify.fuzz.cases import save

    path = save(failure.case, failure.why, folder, [one.as_data() for one in conditions])
    names = " ".join(f"--backend {backend.name}" for backend in backends)
    click.echo(f"\n{failure.why}\n  again: passgraph fuzz --replay {path} {names}")
    return path.name


def _export(case: Case, backends: list[Backend], folder: Path) -> None:
    """Write a reproduction for each backend on which a case is outside of its bounds."""
    from passgraph.verify.fuzz.cases import case_key
    from passgraph.verify.fuzz.search import passes_of
    from passgraph.verify.reproduction import write_reproduction

    passes, name = passes_of(case), f"{case['kind']}-{case_key(case)}"
    for backend in backends:
        place = folder / f"{name}-{backend.name}"
        try:
            why = "it is a draw" if passes is None else write_reproduction(passes, backend, place)
        except InputError:
            raise  # the folder cannot be written
        except Exception as error:  # of a backend that raises
            why = f"it raised {type(error).__name__}"
        click.echo(f"{name}: no reproduction on {backend.name}: {why}" if why else f"{place}: written")


def _replay(path: Path, backends: list[Backend], repro: Path | None) -> int:
    from passgraph.verify.fuzz.cases import load
    from passgraph.verify.fuzz.search import outcome

    files = sorted(path.glob("*.json")) if path.is_dir() else [path]
    failed = 0
    for file in files:
        case = load(file)
        why = outcome(case, backends)
        failed += bool(why)
        click.echo(f"{file.name}: {why or 'as it should be'}")
        if why and repro is not None:
            _export(case, backends, repro)
    click.echo(f"{len(files)} run again, {failed} failed")
    return 1 if failed else 0


def _say(line: str) -> None:
    """Print progress: on a terminal a line that is overwritten, else a line each."""
    if sys.stderr.isatty():
        click.echo(f"\r\033[K{line[:200]}", err=True, nl=False)
    else:
        click.echo(line, err=True)
