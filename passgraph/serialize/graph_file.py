"""Graphs as JSON files."""

from __future__ import annotations

import json
import os
from typing import Any

from passgraph.arguments import path as checked_path
from passgraph.errors import InputError
from passgraph.graph.targets import Outputs, Target
from passgraph.serialize.decode import from_data
from passgraph.serialize.encode import to_data
from passgraph.writing import NewFile

#: Largest file that is read: the arrays of a graph, at most 256 MiB, as text, and as much again of everything else.
MAX_BYTES = 3 * 2**28


def save_graph(file: str | os.PathLike[str], outputs: Outputs, /, **constants: object) -> None:
    """Write a graph to a JSON file, which `load_graph` reads without the code that made it.

    Parameters
    ----------
    file : path that ends in ``.json``; an earlier file is replaced once the new one is complete
    outputs : one target, several, or ``{name: target}``, as for `passgraph.compile`
    constants : run values to replace by numbers, such as ``camera=``; see `passgraph.to_data`

    Raises
    ------
    GraphError
        For values that cannot be serialized, as `passgraph.to_data`.
    InputError
        For a path of another kind, or that cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import passgraph as pg
    >>> dim = pg.kernel(source="def dim(color: Image, by: float) -> vec4: return color[0, 0] * by")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     pg.save_graph(Path(folder) / "dim.json", dim(pg.Input("frame"), pg.Value("by", default=0.5)))
    ...     outputs = pg.load_graph(Path(folder) / "dim.json")
    >>> with pg.compile(outputs, backend="reference") as program:
    ...     program(frame=[[[1.0, 0.5, 0.0, 1.0]]])["dim"][0, 0].tolist()
    [0.5, 0.25, 0.0, 0.5]
    """
    path = checked_path(file, "save_graph: file")
    if path.suffix.lower() != ".json":
        raise InputError(f"{path}: graphs are written as JSON; expected a name that ends in .json")
    text = json.dumps(to_data(outputs, **constants), separators=(",", ":"), allow_nan=False)
    with NewFile(path) as new_file:
        new_file.temporary.write_text(text, encoding="utf-8")
        new_file.complete()


def load_graph(file: str | os.PathLike[str], /) -> dict[str, Target]:
    """Read the targets that `save_graph` wrote, by name, for `passgraph.compile`.

    The file may be untrusted: it is parsed and checked, never executed; see `passgraph.from_data`.

    Raises
    ------
    InputError
        For a file that is missing, too large, no JSON, or no graph of this version; the message names the place.

    Examples
    --------
    See `save_graph`.
    """
    path = checked_path(file, "load_graph: file")
    try:
        with path.open("rb") as stream:
            content = stream.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:  # ValueError: a null byte
        raise InputError(f"{path}: cannot be read ({getattr(error, 'strerror', None) or error})") from None
    if len(content) > MAX_BYTES:
        raise InputError(f"{path}: larger than the {MAX_BYTES >> 20} MiB of the largest graph")
    try:
        data: Any = json.loads(content)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: its JSON cannot be read ({str(error)[:80]})") from None
    try:
        return from_data(data)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
