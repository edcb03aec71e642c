"""``passgraph probe``: measure facts about drivers, and compare them with those of known drivers."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from passgraph.commands.options import backends_option
from passgraph.commands.written_files import check_path
from passgraph.errors import DeviceMissingError, InputError
from passgraph.writing import made_folder, write_text

if TYPE_CHECKING:
    from passgraph.verify.probes.kept import Results

#: Backends with probes of devices.
DEVICES = ("gl", "opencl", "webgpu")


@click.command()
@backends_option
@click.option(
    "--json", "json_path", type=click.Path(path_type=Path), metavar="FILE.json",
    help="Write the facts of one backend as data.",
)  # fmt: skip
@click.option(
    "--export-repro", type=click.Path(path_type=Path), metavar="DIR",
    help="Write each result that is outside of the specification as a folder that shows it without passgraph.",
)  # fmt: skip
def probe(backends: tuple[str, ...], json_path: Path | None, export_repro: Path | None) -> int:
    """Measure what a driver does where specifications leave a choice, and where drivers go wrong.

    About a hundred small shaders or kernels show products that are rounded once, denormals, NaN, division by zero,
    conversions, rounding of stored colors, filters, blending, edges of triangles, and errors of functions. Each fact
    stands beside what the specification says, and beside the drivers that are known, so that you see whether a
    difference comes from your driver. Takes less than a minute for each device.

    Exit status: 0 each fact conforms to the specification, 1 some do not, 2 an error.
    """
    from passgraph.commands.running import progress
    from passgraph.verify.probes.measuring import measure

    if json_path is not None:
        if len(backends) != 1:
            raise InputError(f"--json writes one backend; got {len(backends)}. Choose it: --backend gl")
        check_path(json_path)
    if export_repro is not None:
        made_folder(export_repro)
    found = []
    for name in backends or DEVICES:
        try:
            with progress(f"probing {name}") as say:
                found.append(measure(name, lambda fact, name=name, say=say: say(f"probing {name}: {fact}")))  # type: ignore[misc]
        except DeviceMissingError as error:
            if backends:
                raise
            click.echo(f"{name}: missing: {' '.join(str(error).split())}")
    if not found:
        raise InputError("no device is here to be probed; see: passgraph backends")
    outside = [_show(results) for results in found]
    if export_repro is not None:
        for results, names in zip(found, outside, strict=True):
            _export(results, names, export_repro)
    if json_path is not None:
        write_text(json_path, found[0].as_text())
        click.echo(f"{json_path}: written")
    return 1 if any(outside) else 0


def _export(results: Results, names: list[str], folder: Path) -> None:
    """Write a reproduction of each probe whose fact does not conform."""
    from passgraph.verify.probes.reproduction import write_reproduction

    for name in names:
        place = folder / f"{results.backend.replace(':', '-')}-{name}"
        why = write_reproduction(name, results, place)
        click.echo(f"{name}: no reproduction: {why}" if why else f"{place}: written; run reproduce.py there")


def _show(results: Results) -> list[str]:
    """Print the facts of one device, and return the probes whose facts the specification does not allow."""
    from passgraph.commands.tables import marked, show_table
    from passgraph.verify.probes.kept import nearest, shipped
    from passgraph.verify.probes.table import PROBES, conforms

    known = shipped()
    alike = [one for one in known.values() if one.language == results.language]
    rows: dict[str, list[list[object]]] = {}
    outside = []
    for name, fact in results.facts.items():
        probe = PROBES[name]
        said = probe.said.get(results.language)
        if not (passed := conforms(name, results.language, fact)):
            outside.append(name)
        shared = sum(one.facts.get(name) == fact for one in alike)
        row = [
            probe.asks.replace("`", ""),
            marked(fact, passed),
            said.text if said else "",
            f"{shared} of {len(alike)}",
        ]
        rows.setdefault(probe.part, []).append(row)
    click.echo(f"{results.backend}: {results.title}")
    for part, lines in rows.items():
        show_table(part, ("", "here", "specification"), ("known drivers alike",), lines)  # type: ignore[arg-type]
    for name in outside:
        said = PROBES[name].said[results.language]
        click.echo(f"outside of the specification: {name}: {results.facts[name]}; {said.section}: {said.text}")
    if (closest := nearest(results, known)) is not None:
        driver, differing = closest
        click.echo(f"nearest known driver: {driver}; {len(differing) or 'no'} facts differ")
        for one in differing:
            click.echo(f"  {one.probe}: {one.here or 'not measured'}, there {one.there or 'not measured'}")
    return outside
