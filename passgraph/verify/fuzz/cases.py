"""A fuzz case as plain data (JSON); its verdict comes from the oracle, or from bit equality.

A case of kind ``kernel`` has the text of a kernel, ``variant`` two equivalent texts, ``graph`` and ``draw``
descriptions.  Texts are parsed, never executed.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any, TypeAlias

import numpy as np

from passgraph.backends.base import Backend
from passgraph.errors import InputError
from passgraph.graph.calls import kernel
from passgraph.graph.targets import Input, Target, target
from passgraph.reading import parsed_json, read_text
from passgraph.run.compile import compile as compile_graph
from passgraph.verify.compare import compare
from passgraph.verify.fuzz.random_kernels import PARAMETERS, SIDE, Picture, values
from passgraph.writing import write_text

#: A case as data.
Case: TypeAlias = dict[str, Any]

MAX_CASE_BYTES = 1 << 24
#: Backends that compile without contraction, so rewritten code gives the same bits.
EXACT = ("numpy", "opencl", "reference")


@dataclass
class Tally:
    """Counts of cases by kind, verdicts by backend, and how vague the bounds were."""

    cases: Counter[str] = field(default_factory=Counter)
    verdicts: Counter[str] = field(default_factory=Counter)
    refused: int = 0  # cases rejected by the language or the graph
    targets: int = 0
    vague: float = 0.0  # sum over targets of the share of ambiguous pixels

    def __str__(self) -> str:
        cases = ", ".join(f"{count} {kind}s" for kind, count in sorted(self.cases.items())) or "nothing"
        on = ", ".join(f"{name} {count}" for name, count in sorted(self.verdicts.items())) or "none"
        refused = f" ({self.refused} refused)" if self.refused else ""
        vague = f"; {self.vague / self.targets:.1%} of pixels ambiguous" if self.targets else ""
        return f"{cases}{refused}; verdicts: {on}{vague}"


def case_key(case: Case) -> str:
    """Return ten digits that depend on the content."""
    import hashlib

    return hashlib.sha256(json.dumps(case, sort_keys=True).encode()).hexdigest()[:10]


def save(case: Case, why: str, folder: Path, conditions: Sequence[Mapping[str, Any]] = ()) -> Path:
    """Write a case into a folder, named by its content, with texts split into lines for readability.

    ``conditions`` : devices, versions and options on which it failed
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{case['kind']}-{case_key(case)}.json"
    lines = {k: v.splitlines() if k in ("text", "other") else v for k, v in case.items()}
    write_text(path, json.dumps({**lines, "why": why, "conditions": list(conditions)}, indent=1) + "\n")
    return path


def load(path: Path) -> dict[str, Any]:
    """Read a case from its file."""
    try:
        case = parsed_json(read_text(path, "a case", MAX_CASE_BYTES))
    except (InputError, ValueError) as error:
        raise InputError(f"{path} cannot be read as a case: {error}") from error
    if not isinstance(case, dict):
        raise InputError(f"{path} holds no case")
    for told in ("why", "conditions"):
        case.pop(told, None)
    return {k: "\n".join([*v, ""]) if k in ("text", "other") and isinstance(v, list) else v for k, v in case.items()}


# Kernels

#: Slices of the volume that kernels read.
SLICES = 4


def pictures_of(case: Case) -> dict[str, Picture]:
    """Return the inputs of a kernel: ``c`` as large as the target, ``d`` of another size, ``e`` a volume."""
    seed, special, side = case["seed"], case["special"], case.get("side", SIDE)
    volume = values(seed + 200, (5, 3 * SLICES), special)
    return {"c": values(seed, (side, side), special), "d": values(seed + 100, (37, 21), special), "e": volume}


def output_of(case: Case, text: str) -> Target:
    """Return the pass of a kernel case, with ``text`` as its kernel."""
    own_kernel = kernel(source=text, name="k").with_math(case.get("math", "exact"))
    # Default filter: linear.
    read = {name: Input(name).border(case["border"]).filter(case.get("filter", "linear")) for name in ("c", "d", "e")}
    inputs = {"c": read["c"], "d": read["d"].mipmaps(), "e": read["e"].slices(SLICES)}
    arguments: dict[str, Any] = {}
    for parameter in own_kernel.parameters:
        value = PARAMETERS[parameter.name][1]
        arguments[parameter.name] = _argument(parameter.name if value is None else value, inputs)
    out: Target = own_kernel(**arguments, into=target("out", case["format"], like=arguments["c"]))
    return out


def _argument(value: Any, inputs: dict[str, Target]) -> Any:
    """Return a parameter's value: pictures by name, structs as objects with fields."""
    if isinstance(value, str):
        return inputs[value]
    if isinstance(value, dict):
        return SimpleNamespace(**{name: _argument(part, inputs) for name, part in value.items()})
    return [_argument(part, inputs) for part in value] if isinstance(value, tuple) else value


def inputs_of(case: Case, out: Target) -> dict[str, Picture]:
    assert out.made_by is not None
    read = {image.name for image in out.made_by.images.values()}
    return {name: picture for name, picture in pictures_of(case).items() if name in read}


def kernel_outcome(case: Case, out: Target, backends: list[Backend], tally: Tally) -> str:
    """Return the oracle's verdict on a kernel."""
    return judged({"out": out}, backends, tally, **inputs_of(case, out))


def judged(outputs: dict[str, Target], backends: list[Backend], tally: Tally, **inputs: Any) -> str:
    """Return the oracle's verdict on a graph: the first divergence, or an empty string."""
    report = compare(outputs, backends, **inputs)
    for backend in report.backends:
        tally.verdicts[backend.name] += 1
        for one in backend.targets:
            tally.targets += 1
            tally.vague += one.ambiguous + one.unpromised
        if backend.failed:
            return f"{backend.name} failed: {backend.failed}"
        if backend.first_divergence is not None:
            return f"{backend.name}: {backend.first_divergence}"
    return ""


def run(
    outputs: dict[str, Target], backend: Backend, size: tuple[int, int] | None, **inputs: Any
) -> dict[str, Picture]:
    """Run a graph once; non-finite inputs are allowed."""
    with compile_graph(outputs, backend, size, non_finite="keep") as program:
        return dict(program(**inputs))


def same_bits(one: Picture, other: Picture) -> bool:
    """Return True if values are equal; NaNs are equal, and zeros of either sign."""
    return bool(np.array_equal(one, other, equal_nan=True))
