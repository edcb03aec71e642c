"""Facts of drivers as data: written, read, and compared with those that passgraph ships."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast, get_args

from passgraph.errors import InputError
from passgraph.reading import parsed_json, read_text
from passgraph.verify.probes.probe import Language

#: Results of drivers that were measured once, one file each.
SHIPPED = Path(__file__).parents[2] / "assets" / "drivers"
MOST_BYTES = 1 << 22


@dataclass(frozen=True)
class Results:
    """The facts of one driver.

    Attributes
    ----------
    backend : as it was opened, such as "opencl:1"
    conditions : device, driver, versions, variables and date (:meth:`passgraph.verify.conditions.Conditions.as_data`)
    facts : by the name of the probe
    conformance : counts of outcomes of the suite in "exact" and "native" math, where it ran
    """

    backend: str
    language: Language
    conditions: dict[str, Any]
    facts: dict[str, str]
    conformance: dict[str, dict[str, int]] = field(default_factory=dict)

    def as_text(self) -> str:
        """Return it as JSON."""
        return json.dumps(vars(self), indent=1, ensure_ascii=False) + "\n"

    @property
    def device(self) -> dict[str, str]:
        ((device,),) = self.conditions["devices"].values()
        return cast("dict[str, str]", device)

    @property
    def title(self) -> str:
        """Return device, driver and version in a line."""
        device = self.device
        return f"{device['name']}; {device['driver']} {device['version']}".strip()


@dataclass(frozen=True)
class Difference:
    """A fact that two drivers do not share; None if one of them lacks it."""

    probe: str
    here: str | None
    there: str | None


def load(path: Path) -> Results:
    """Read the results of a driver.

    Raises
    ------
    InputError
        If the file is no such results.
    """
    try:
        results = Results(**parsed_json(read_text(path, "results of probes", MOST_BYTES)))
        is_whole = (
            results.language in get_args(Language)
            and all(isinstance(fact, str) for fact in results.facts.values())
            and bool(results.title)
        )
    except (TypeError, KeyError, ValueError, AttributeError):
        is_whole = False
    if not is_whole:
        raise InputError(f"{path}: no results of probes; expected a file of: passgraph probe --json FILE.json")
    return results


def shipped() -> dict[str, Results]:
    """Return the results that passgraph ships, by the name of the driver.

    >>> "mesa-22.3-llvmpipe" in shipped()
    True
    """
    return {path.stem: load(path) for path in sorted(SHIPPED.glob("*.json"))}


def differences(here: Results, there: Results) -> Iterator[Difference]:
    """Yield the facts that differ, in the order of the first."""
    for name in dict.fromkeys([*here.facts, *there.facts]):
        one, other = here.facts.get(name), there.facts.get(name)
        if one != other:
            yield Difference(name, one, other)


def nearest(here: Results, known: dict[str, Results]) -> tuple[str, list[Difference]] | None:
    """Return the kept driver of this language that shares most facts, and what differs; None if there is none."""
    found = [(name, list(differences(here, one))) for name, one in known.items() if one.language == here.language]
    return min(found, key=lambda pair: len(pair[1]), default=None)
