"""How a case of a suite went, and what it needs to run: arguments from the suite's flat list of uniforms."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, Literal

import numpy as np

from passgraph.backends.base import Backend
from passgraph.errors import PassgraphError

#: The open backends that a case runs on, by name.
Backends = Mapping[str, Backend | str]


@dataclass(frozen=True)
class Judgment:
    """``accepted`` is a text that must be refused, and is not."""

    verdict: Literal["right", "refused", "wrong", "accepted"]
    reason: str = ""

    @classmethod
    def refused(cls, error: PassgraphError) -> Judgment:
        """Return the judgment of a case that passgraph refuses, with the first line of its reason."""
        return cls("refused", str(error).splitlines()[0].split(": ", 1)[-1])


def components_of(type_: str) -> int:
    """Return how many numbers a scalar, vector or matrix has.

    >>> [components_of(name) for name in ("float", "ivec3", "mat2", "mat2x3")]
    [1, 3, 4, 6]
    """
    if type_.startswith("mat"):
        columns, _, rows = type_[3:].partition("x")
        return int(columns) * int(rows or columns)
    return int(type_[-1]) if type_[-1].isdigit() else 1


def argument_of(type_: Any, values: dict[str, tuple[float, ...]], name: str) -> Any:
    """Return the argument of a uniform; ``values`` has paths such as ``s.a`` and ``s[1]``. What it lacks is 0."""
    text = str(type_)
    if hasattr(type_, "fields"):
        return SimpleNamespace(**{key: argument_of(kind, values, f"{name}.{key}") for key, kind in type_.fields})
    if text.startswith("Array"):
        return [argument_of(type_.element, values, f"{name}[{k}]") for k in range(type_.length)]
    numbers: tuple[Any, ...] = values.get(name, (0.0,) * components_of(text))
    if text.startswith("mat"):
        return np.array(numbers).reshape(int(text[3]), -1).T
    kind: Any = bool if text.startswith(("bool", "bvec")) else int if text.startswith(("int", "ivec", "u")) else float
    numbers = tuple(kind(number) for number in numbers)
    return numbers[0] if len(numbers) == 1 else numbers


def arguments_of(kernel: Any, values: dict[str, tuple[float, ...]]) -> dict[str, Any]:
    """Return the arguments of a kernel's uniforms; those that the suite leaves alone keep their initial value."""
    return {
        p.name: argument_of(p.type, values, p.name)
        for p in kernel.parameters
        if not p.has_default or any(re.match(re.escape(p.name) + r"(?![\w])", name) for name in values)
    }


def numbers_of(judgments: dict[str, Judgment], sample: str) -> dict[str, Any]:
    """Return the numbers that are kept: of each verdict, and of refusals by reason; names of wrong cases.

    ``sample`` : which of a suite's cases were judged
    """
    verdicts = Counter(judgment.verdict for judgment in judgments.values())
    reasons = Counter(judgment.reason[:60] for judgment in judgments.values() if judgment.verdict == "refused")
    return {
        "cases": sample,
        **{verdict: verdicts.get(verdict, 0) for verdict in ("right", "refused", "wrong", "accepted")},
        "reasons": dict(sorted(reasons.items(), key=lambda item: (-item[1], item[0]))),
        "names of wrong": sorted(name for name, judgment in judgments.items() if judgment.verdict == "wrong"),
    }
