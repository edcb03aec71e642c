"""``passgraph backends``: list the available backends, and how to install the others."""

from __future__ import annotations

import click

from passgraph.backends.base import DeviceInfo
from passgraph.errors import PassgraphError


@click.command()
def backends() -> None:
    """Show every backend with its devices, drivers and versions, or what installs what is missing."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    from passgraph.backends.registry import backend_class, backend_names
    from passgraph.backends.webgpu import chromium

    table = Table()
    for heading in ("backend", "device", "driver", "version"):
        table.add_column(heading, overflow="fold")
    missing: list[str] = []
    found: dict[str, list[DeviceInfo]] = {}
    for name in backend_names():
        try:
            found[name] = backend_class(name).devices()
        except PassgraphError as error:
            found[name] = [DeviceInfo("", "", "", str(error))]
        if name == "webgpu":
            found["webgpu:chromium"] = [chromium.device_info()]
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
