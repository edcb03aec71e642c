"""``passgraph backends``: list the available backends, and how to install the others."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from passgraph.backends.base import DeviceInfo


@click.command()
@click.option(
    "--json", "json_path", type=click.Path(path_type=Path), metavar="FILE.json",
    help="Write devices, and versions of Python, the system and libraries, as data.",
)  # fmt: skip
def backends(json_path: Path | None) -> None:
    """Show every backend with its devices, drivers and versions, or what installs what is missing.

    passgraph --version --verbose shows versions of Python, the system and libraries, too.
    """
    from passgraph.environment import devices, environment
    from passgraph.writing import write_text

    if json_path is None:
        show_devices(devices())
        return
    found = environment()
    show_devices(found.devices)
    write_text(json_path, json.dumps(found.as_data(), indent=1) + "\n")
    click.echo(f"{json_path}: written")


def show_devices(found: Mapping[str, Sequence[DeviceInfo]]) -> None:
    """Print a table of the devices of each backend; and for those without one, a line that says why."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    table = Table()
    for heading in ("backend", "device", "driver", "version"):
        table.add_column(heading, overflow="fold")
    missing: list[str] = []
    for name, devices in found.items():
        for number, device in enumerate(devices):
            if device.missing:
                missing.append(f"{name}: {' '.join(device.missing.split())}")
            else:
                label = f"{name}:{number}" if len(devices) > 1 else name
                table.add_row(*(escape(text) for text in (label, device.name, device.driver, device.version)))
    console = Console(highlight=False, soft_wrap=True)
    console.print(table)
    for line in missing:
        click.echo(f"missing: {line}")


def show_versions() -> None:
    """Print everything that results depend on, for a report of an error."""
    from passgraph.environment import environment

    found = environment()
    click.echo(f"python: {found.python}\nsystem: {found.system}\ncpu: {found.cpu}")
    for name, version in found.libraries.items():
        click.echo(f"{name}: {version}")
    for name, devices in found.devices.items():
        for device in devices:
            text = "; ".join(filter(None, (device.name, device.driver, device.version)))
            click.echo(f"backend {name}: {' '.join(device.missing.split()) or text}")
