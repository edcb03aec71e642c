"""Golden pictures: recorded inputs and outputs of a graph, to compare with its current outputs.

Both the recorded and the current outputs are the reference's, which computes in float64: the same graph gives the same
picture. So no change is permitted, except for a given number of steps. The oracle's bounds for backends would hide
changes, since they are wide where a kernel makes a decision.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.commands.running import file_name
from passgraph.commands.written_files import check_folder
from passgraph.errors import InputError
from passgraph.formats import Format
from passgraph.pictures import save
from passgraph.reading import check_regular, parsed_json, read_text
from passgraph.verify.oracle.pass_bounds import Key, Passes
from passgraph.writing import write_text

MANIFEST = "manifest.json"
MAX_MANIFEST_BYTES = 1 << 24
#: Version of the folder's layout. Version 1 had no formats of outputs and no values.
VERSION = 2
READABLE = (1, 2)

Pictures = Mapping[str, NDArray[Any]]


@dataclass(frozen=True)
class Change:
    """The distance of an output from its recording.

    Attributes
    ----------
    graph, output : names
    unit : the unit of a step: a step of the format, or an ulp of its floats
    share : share of the pixels that changed
    steps : the largest change of a value; infinite if only one of both is NaN
    pixel, channel : (column, row) and channel of that value
    was, now : the recorded and the current value
    columns, rows : first and last column and row with changes
    permitted : permitted steps
    """

    graph: str
    output: str
    unit: str
    share: float
    steps: float
    pixel: tuple[int, int]
    channel: int
    was: float
    now: float
    columns: tuple[int, int]
    rows: tuple[int, int]
    permitted: int

    @property
    def allowed(self) -> bool:
        return self.steps <= self.permitted

    def __str__(self) -> str:
        column, row = self.pixel
        by = f"{self.steps:.0f} {self.unit}" if np.isfinite(self.steps) else "NaN for a number, or the reverse"
        mend = (
            "" if self.allowed else ". Where that is meant, record it anew with --record, or allow it: --golden-steps N"
        )
        return (
            f"{self.graph}: output {self.output} is {'nearly' if self.allowed else 'not'} as recorded: "
            f"{self.share:.3%} of pixels changed, in columns {self.columns[0]} to {self.columns[1]} and rows "
            f"{self.rows[0]} to {self.rows[1]}, by at most {by} at column {column}, row {row}, channel {self.channel}: "
            f"{np.float32(self.was)!s} recorded, {np.float32(self.now)!s} now{mend}"
        )


def record(folder: Path, graph: str, passes: Passes, inputs: Pictures, settings: Mapping[str, str]) -> None:
    """Write a graph's inputs, values and the reference's outputs into a folder, and note them in its manifest."""
    check_folder(folder)
    expected, _ = passes.allowed()
    outputs = {name: expected[_last(passes, name)] for name in passes.plan.outputs}
    files: dict[str, dict[str, str]] = {"inputs": {}, "outputs": {}}
    for kind, pictures in (("inputs", inputs), ("outputs", outputs)):
        for name, picture in pictures.items():
            file = f"{file_name(graph)}-{kind[:-1]}-{file_name(name)}.npy"
            save(folder / file, picture)
            files[kind][name] = file
    known = _manifest(folder) if (folder / MANIFEST).exists() else {}
    formats = {name: passes.plan.resources[resource].format.name for name, resource in passes.plan.outputs.items()}
    known[graph] = {"size": list(passes.plan.size), **files, "formats": formats, "values": dict(settings)}
    write_text(folder / MANIFEST, json.dumps({"version": VERSION, "graphs": known}, indent=1) + "\n")


def recorded_run(folder: Path, graph: str) -> tuple[tuple[int, int], dict[str, NDArray[np.float32]], dict[str, str]]:
    """Return the size of the output, the inputs, and the values as texts of a graph's recording."""
    entry = _entry(folder, graph)
    return (entry["size"][0], entry["size"][1]), _load(folder, entry["inputs"]), dict(entry.get("values", {}))


def changed(folder: Path, graph: str, passes: Passes, permitted: int) -> list[Change]:
    """Return the outputs that differ from their recording in any bit, also those within the permitted steps."""
    differences = []
    entry = _entry(folder, graph)
    expected, _ = passes.allowed()
    for name, was in _load(folder, entry["outputs"]).items():
        if name not in passes.plan.outputs:
            raise InputError(f"{folder}: {graph!r} has no output {name!r} any more; record it anew with --record")
        now, format_ = expected[_last(passes, name)], passes.plan.resources[passes.plan.outputs[name]].format
        before = entry.get("formats", {}).get(name, format_.name)
        if was.shape != now.shape or before != format_.name:
            raise InputError(
                f"{folder}: output {name!r} of {graph!r} was {_said(was, before)}, and is {_said(now, format_.name)} "
                "now; record it anew with --record"
            )
        apart = steps_between(was, now, format_)
        if apart.any():
            differences.append(_change(graph, name, format_, was, now, apart, permitted))
    return differences


def _said(picture: NDArray[Any], format_: str) -> str:
    return f"{picture.shape[1]}x{picture.shape[0]} {format_}"


def _change(
    graph: str, output: str, format_: Format, was: NDArray[Any], now: NDArray[Any], apart: NDArray[np.float64],
    permitted: int,
) -> Change:  # fmt: skip
    row, column, channel = (int(i) for i in np.unravel_index(np.argmax(apart), apart.shape))
    pixels = apart.max(axis=2) > 0
    columns, rows = np.flatnonzero(pixels.any(axis=0)), np.flatnonzero(pixels.any(axis=1))
    most = float(apart.max())
    unit = f"step{'' if most == 1 else 's'} of {format_.name} (1/{format_.steps})" if format_.steps else "ulp"
    return Change(
        graph, output, unit, float(pixels.mean()), most, (column, row), channel,
        float(was[row, column, channel]), float(now[row, column, channel]),
        (int(columns[0]), int(columns[-1])), (int(rows[0]), int(rows[-1])), permitted,
    )  # fmt: skip


def steps_between(one: NDArray[Any], other: NDArray[Any], format_: Format) -> NDArray[np.float64]:
    """Count the stored values of a format between two values; infinite if only one is NaN, 0 if both are.

    >>> from passgraph.formats import FORMATS
    >>> one, other = np.float32([0.0, 1.0, np.nan]), np.float32([2 / 255, 1.0, 1.0])
    >>> steps_between(one, other, FORMATS["r8"]).tolist()
    [2.0, 0.0, inf]
    >>> steps_between(np.float32([-0.0, 1.0]), np.float32([0.0, 1 + 2**-22]), FORMATS["r32f"]).tolist()
    [0.0, 2.0]
    """
    missing = np.isnan(one) != np.isnan(other)
    if format_.steps:
        apart = np.rint(np.abs(one.astype(np.float64) - other.astype(np.float64)) * format_.steps)
    else:
        apart = np.abs(_ordered(one, format_) - _ordered(other, format_)).astype(np.float64)
    return np.where(missing, np.inf, np.where(np.isnan(one), 0.0, apart))


def _ordered(values: NDArray[Any], format_: Format) -> NDArray[np.int64]:
    """Map floats to integers in the same order, with neighbors one apart; both zeros become 0."""
    stored = np.ascontiguousarray(values, format_.number)
    bits = stored.view(f"i{stored.itemsize}").astype(np.int64)
    return np.where(bits < 0, -(bits & ((1 << (8 * stored.itemsize - 1)) - 1)), bits)


def _last(passes: Passes, output: str) -> Key:
    """Return the key of the last step that writes an output."""
    resource = passes.plan.outputs[output]
    number = max(n for n, step in enumerate(passes.plan.steps) if resource in step.writes)
    return 0, number, resource


def _manifest(folder: Path) -> dict[str, Any]:
    path = folder / MANIFEST
    if not path.exists():
        raise InputError(f"{path}: cannot be read (no such file); make it with --record")
    try:
        read = parsed_json(read_text(path, "a manifest", MAX_MANIFEST_BYTES))
    except ValueError as error:
        raise InputError(f"{path}: is not JSON ({error})") from error
    if not isinstance(read, dict) or read.get("version") not in READABLE or not isinstance(read.get("graphs"), dict):
        versions = " or ".join(str(version) for version in READABLE)
        raise InputError(f"{path}: is not a manifest of version {versions}; make it anew with --record")
    graphs: dict[str, Any] = read["graphs"]
    return graphs


def _entry(folder: Path, graph: str) -> dict[str, Any]:
    graphs = _manifest(folder)
    if graph not in graphs:
        raise InputError(f"{folder}: has no record of {graph!r}, only of {', '.join(graphs)}; make it with --record")
    entry = graphs[graph]
    is_complete = isinstance(entry, dict) and all(isinstance(entry.get(n), dict) for n in ("inputs", "outputs"))
    sides = entry.get("size") if is_complete else None
    if not (isinstance(sides, list) and len(sides) == 2 and all(isinstance(side, int) for side in sides)):
        raise InputError(f"{folder / MANIFEST}: the record of {graph!r} is broken; make it anew with --record")
    result: dict[str, Any] = entry
    return result


def _load(folder: Path, files: Mapping[str, str]) -> dict[str, NDArray[np.float32]]:
    pictures = {}
    for name, file in files.items():
        path = folder / Path(file).name  # a manifest may refer only to files in its folder
        try:
            check_regular(path, "a recorded picture")
            pictures[name] = np.load(path, allow_pickle=False)
        except (InputError, OSError, ValueError) as error:
            raise InputError(f"{path}: cannot be read ({error}); make it anew with --record") from error
    return pictures
