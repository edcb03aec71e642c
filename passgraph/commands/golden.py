"""Recorded pictures: what a graph gave once, with what it was given, to be held against what it gives now."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.commands.capture import file_name
from passgraph.commands.files import check_folder, write_text
from passgraph.errors import InputError
from passgraph.reading import check_regular, read_text
from passgraph.verify.conformance.judging import Divergence, Judge, divergence
from passgraph.verify.oracle.backend import outside

MANIFEST = "manifest.json"
MAX_MANIFEST_BYTES = 1 << 24
#: Of the layout of the folder.
VERSION = 1

Pictures = Mapping[str, NDArray[Any]]


def record(folder: Path, graph: str, judge: Judge, inputs: Pictures) -> None:
    """Write a graph's inputs and the reference's outputs into a folder, and note them in its manifest."""
    from passgraph.pictures import save

    check_folder(folder)
    files: dict[str, dict[str, str]] = {"inputs": {}, "outputs": {}}
    for kind, pictures in (("inputs", inputs), ("outputs", _outputs(judge))):
        for name, picture in pictures.items():
            file = f"{file_name(graph)}-{kind[:-1]}-{file_name(name)}.npy"
            save(folder / file, picture)
            files[kind][name] = file
    known = _manifest(folder) if (folder / MANIFEST).exists() else {}
    known[graph] = {"size": list(judge.passes.plan.size), **files}
    write_text(folder / MANIFEST, json.dumps({"version": VERSION, "graphs": known}, indent=1) + "\n")


def recorded_inputs(folder: Path, graph: str) -> tuple[tuple[int, int], dict[str, NDArray[np.float32]]]:
    """Size of the output and the inputs that a graph was recorded with."""
    entry = _entry(folder, graph)
    return (entry["size"][0], entry["size"][1]), _load(folder, entry["inputs"])


def changed(folder: Path, graph: str, judge: Judge) -> list[Divergence]:
    """Recorded outputs that a conforming backend would not compute from this graph any more."""
    found = []
    expected, allowed = judge.passes.allowed(True)
    for name, picture in _load(folder, _entry(folder, graph)["outputs"]).items():
        if name not in judge.passes.plan.outputs:
            raise InputError(f"{folder}: {graph!r} has no output {name!r} any more; record it anew with --record")
        key = _last(judge, name)
        bounds, now = allowed[key].values, expected[key]
        if picture.shape != now.shape:
            raise InputError(f"{folder}: output {name!r} was {picture.shape}, and is {now.shape} now")
        beyond = outside(picture, bounds)
        if beyond.any():
            where = f"recorded output {name} of {graph}"
            found.append(divergence(where, picture, now, bounds.lo, bounds.hi, beyond))
    return found


def _last(judge: Judge, output: str) -> tuple[int, int, int]:
    """The key of the last step that writes an output."""
    resource = judge.passes.plan.outputs[output]
    number = max(n for n, step in enumerate(judge.passes.plan.steps) if resource in step.writes)
    return 0, number, resource


def _outputs(judge: Judge) -> dict[str, NDArray[Any]]:
    expected, _ = judge.passes.allowed(True)
    return {name: expected[_last(judge, name)] for name in judge.passes.plan.outputs}


def _manifest(folder: Path) -> dict[str, Any]:
    path = folder / MANIFEST
    if not path.exists():
        raise InputError(f"{path}: cannot be read (no such file); make it with --record")
    try:
        read = json.loads(read_text(path, "a manifest", MAX_MANIFEST_BYTES))
    except ValueError as error:
        raise InputError(f"{path}: is not JSON ({error})") from error
    if not isinstance(read, dict) or read.get("version") != VERSION or not isinstance(read.get("graphs"), dict):
        raise InputError(f"{path}: is not a manifest of version {VERSION}; make it anew with --record")
    graphs: dict[str, Any] = read["graphs"]
    return graphs


def _entry(folder: Path, graph: str) -> dict[str, Any]:
    graphs = _manifest(folder)
    if graph not in graphs:
        raise InputError(f"{folder}: has no record of {graph!r}, only of {', '.join(graphs)}; make it with --record")
    entry: dict[str, Any] = graphs[graph]
    return entry


def _load(folder: Path, files: Mapping[str, str]) -> dict[str, NDArray[np.float32]]:
    made = {}
    for name, file in files.items():
        path = folder / Path(file).name  # a manifest names files of its own folder only
        try:
            check_regular(path, "a recorded picture")
            made[name] = np.load(path, allow_pickle=False)
        except (InputError, OSError, ValueError) as error:
            raise InputError(f"{path}: cannot be read ({error}); make it anew with --record") from error
    return made
