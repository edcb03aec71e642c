"""``passgraph check --error-map FILE.exr``: a result and the bounds of each of its pixels, as a picture."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from passgraph.commands.written_files import check_path
from passgraph.errors import InputError

if TYPE_CHECKING:
    from passgraph.verify.oracle.pass_bounds import Passes

error_map_option = click.option(
    "--error-map",
    type=click.Path(path_type=Path),
    metavar="FILE.exr",
    help="Write the result, and the bounds of each pixel from the inputs on as its layers low, high and width.",
)


def check_error_map(path: Path | None, graphs: Mapping[str, Mapping[str, Any]]) -> None:
    """Raise InputError for a file that cannot be written, and for several results."""
    if path is None:
        return
    if path.suffix.lower() != ".exr":
        raise InputError(f"--error-map {path}: bounds are layers of an OpenEXR file; give one that ends in .exr")
    check_path(path)
    if len(graphs) != 1:
        raise InputError(f"--error-map is for one graph, and there are {', '.join(graphs)}; name one: FILE:NAME")
    (outputs,) = graphs.values()
    if len(outputs) != 1:
        raise InputError(f"--error-map is for one result, and there are {', '.join(outputs)}; name one: FILE:NAME")


def write_error_map(path: Path, passes: Passes) -> None:
    """Write the reference's result with its bounds, and print the widest one."""
    from passgraph.verify.error_bars import bounds_of

    ((name, found),) = bounds_of(passes).items()
    resource = passes.plan.outputs[name]
    reference = {key[2]: picture for key, picture in passes.allowed()[0].items()}[resource]
    found.save(path, reference)
    finite = found.width[np.isfinite(found.width)]
    widest = float(finite.max()) if finite.size else float("inf")
    unbounded = found.width.size - finite.size
    without = f"; {unbounded} of {found.width.size} numbers have no bound" if unbounded else ""
    click.echo(f"{path}: {name} with its bounds, at most {widest:.3g} wide{without}")
