"""Programs as folders: written by ``passgraph export --program``, run without the code that made them."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from passgraph.arguments import flag
from passgraph.errors import InputError, PassgraphError
from passgraph.graph.run_values import OUTPUT_SIZE, is_computed_from_size, sources_of
from passgraph.graph.targets import Outputs, checked_size, named_outputs
from passgraph.plan.data import Options
from passgraph.plan.dependencies import inputs_behind, passes_behind
from passgraph.reading import parsed_json, read_bytes
from passgraph.run.compile import compile
from passgraph.run.finite_checks import NonFinite
from passgraph.run.program import Program
from passgraph.run.result import Results
from passgraph.serialize import from_data, to_data
from passgraph.serialize.reader import MOST_ARRAY_BYTES, MOST_PARTS, VALUE_TYPES, described
from passgraph.writing import made_folder, write_text

if TYPE_CHECKING:
    from passgraph.backends.base import Backend

#: The one file of the folder.
FILE = "program.json"
#: Version of the file; the graph in it has a version of its own.
VERSION = 1
#: Most bytes of the file besides its arrays: a graph's parts of 64 characters each; and with arrays, in base64.
MOST_TEXT = 64 * MOST_PARTS
MOST_BYTES = MOST_ARRAY_BYTES * 4 // 3 + MOST_TEXT
#: An array: a quote that is not escaped begins or ends a text, so that no part of another text looks like one.
_ARRAY = re.compile(rb'(?<!\\)"[A-Za-z0-9+/=]{1024,}"')
_ENTRIES = ("passgraph", "version", "size", "resizable", "math", "graph")


def export_program(
    outputs: Outputs, folder: str | os.PathLike[str], /, *, size: tuple[int, int], options: Options | None = None,
    **given: object,
) -> Path:  # fmt: skip
    """Write a graph as a folder that `passgraph.load_program` runs.

    Parameters
    ----------
    outputs : one target, several, or ``{name: target}``, as for `passgraph.compile`
    folder : is created; a program that it has is replaced
    size : (width, height) of the output in pixels, for graphs without an input to give, and for those in which a Python
        function computes a value from the size; these run at this size only
    options : the math of its kernels is that of the program
    given : run values that become constants, such as ``camera=``; those of classes, such as cameras, are constants
        anyway, by default their default

    Returns
    -------
    Path
        The file that was written.

    Raises
    ------
    GraphError
        For a graph that cannot be serialized; see `passgraph.to_data`.
    InputError
        For a folder that cannot be written.
    """
    named, chosen = named_outputs(outputs), checked_size(size, "the output")
    nodes = passes_behind(list(named.values()))
    fixed = any(is_computed_from_size(node.values) for node in nodes)
    sources = [source for node in nodes for source in sources_of(node.values)]
    objects = {s.name: s.default for s in sources if s.type not in VALUE_TYPES.values() and s.default is not None}
    has_open = any(spec.default is None for spec in inputs_behind(list(named.values())).values())
    graph = to_data(named, **{**objects, **given, **({OUTPUT_SIZE.name: chosen} if fixed else {})})
    document = {
        "passgraph": "program", "version": VERSION, "size": list(chosen) if fixed or not has_open else None,
        "resizable": not fixed, "math": (options or Options()).math, "graph": graph,
    }  # fmt: skip
    place = made_folder(Path(folder))
    write_text(place / FILE, json.dumps(document, separators=(",", ":"), allow_nan=False))
    return place / FILE


def load_program(
    folder: str | os.PathLike[str],
    backend: str | Backend | None = None,
    size: tuple[int, int] | None = None,
    *,
    non_finite: NonFinite = "error",
    check_finite: bool = False,
    results: Results = "float32",
    memory: int | str | None = None,
) -> Program:
    """Compile the program of a folder that ``passgraph export EFFECT --program FOLDER`` wrote.

    The code that made the program is not needed.  The folder may be untrusted: its one file, ``program.json``, is
    parsed and checked, never executed, and refers to no other file; see `passgraph.from_data`.

    Parameters
    ----------
    folder
        With the file ``program.json``.
    size
        (width, height) of the output in pixels; default: that of the export if the program takes no input, else
        that of the first input.
    backend, non_finite, check_finite, results, memory
        As for `passgraph.compile`.

    Returns
    -------
    Program
        Takes the inputs and run values of the effect by name, such as ``program(frame=picture, strength=0.5)``.

    Raises
    ------
    InputError
        For a folder without a program, a damaged or larger file, one of another version, or a size that the program
        does not have.
    GraphError, KernelError, BackendError, DeviceMissingError
        As for `passgraph.compile`.

    Examples
    --------
    >>> import tempfile
    >>> import numpy as np
    >>> import passgraph as pg
    >>> from passgraph.files.program_folder import export_program
    >>> dim = pg.kernel(source="def dim(color: Image, by: float) -> vec4: return color[0, 0] * by")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = export_program(dim(pg.Input("frame"), pg.Value("by", default=0.5)), folder, size=(64, 48))
    ...     program = pg.load_program(folder)
    >>> program(frame=np.ones((1, 1, 4), np.float32), by=0.25)["dim"][0, 0, 0].item()
    0.25
    """
    try:
        path = Path(folder) / FILE
    except TypeError:
        raise InputError(f"folder: expected the path of an exported program, got {described(folder)}") from None
    document = _document(path)
    try:
        outputs, options = from_data(document["graph"]), Options(math=document["math"])
        stored = None if document["size"] is None else checked_size(document["size"], "size")
        resizable = flag(document["resizable"], "resizable")
    except PassgraphError as error:
        raise InputError(f"{path}: {error}") from None
    wanted = stored if size is None else checked_size(size, "the output")
    if wanted != stored and not resizable:
        raise InputError(
            f"{path}: runs at size {stored} only, got {wanted}; leave out size, or export again with --size"
        )
    return compile(
        outputs, backend, wanted, options,
        non_finite=non_finite, check_finite=check_finite, results=results, memory=memory,
    )  # fmt: skip


def _document(path: Path) -> Mapping[str, Any]:
    """Return the object in the file, with all entries; their contents are not checked, but for those read here."""
    data = read_bytes(path, "the file of a program (passgraph export EFFECT --program FOLDER)", MOST_BYTES)
    # Checked before objects of it take memory: one character beyond ASCII makes a text four times as large.
    if sum(map(data.count, (b",", b"[", b"{"))) > 2 * MOST_PARTS:
        raise InputError(f"{path}: has more than {2 * MOST_PARTS} parts; expected the program of an export")
    text_bytes = len(data) - sum(len(match[0]) for match in _ARRAY.finditer(data))
    if text_bytes > MOST_TEXT:
        raise InputError(
            f"{path}: has {text_bytes} bytes besides its arrays; expected the program of an export, at most {MOST_TEXT}"
        )
    try:
        text = data.decode("ascii")
        del data
        document = parsed_json(text, _no_constant)
    except ValueError:
        raise InputError(f"{path}: is no JSON; expected the file of an export, unchanged. Export again") from None
    if not isinstance(document, dict) or document.get("passgraph") != "program":
        raise InputError(
            f"{path}: is no program; expected what passgraph export --program wrote, got {described(document)}"
        )
    if type(document.get("version")) is not int or document["version"] != VERSION:
        raise InputError(
            f"{path}: version {described(document.get('version'))}; this passgraph reads version {VERSION}. Install "
            "the passgraph that wrote it, or export again"
        )
    if sorted(document) != sorted(_ENTRIES):
        raise InputError(f"{path}: expected the entries {', '.join(_ENTRIES)}, got {', '.join(sorted(document))[:200]}")
    return document


def _no_constant(name: str) -> None:
    raise ValueError(name)
