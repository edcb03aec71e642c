"""The table of all probes."""

from __future__ import annotations

from passgraph.verify.probes.arithmetic import ARITHMETIC
from passgraph.verify.probes.functions import FUNCTIONS
from passgraph.verify.probes.pictures import PICTURES
from passgraph.verify.probes.probe import Language, Probe

#: Beginnings of facts that no specification allows.
FAULTS = ("error: ", "ends the process", "hangs")
PROBES: dict[str, Probe] = {probe.name: probe for probe in (*ARITHMETIC, *PICTURES, *FUNCTIONS)}


def conforms(name: str, language: Language, fact: str) -> bool:
    """Return True if a specification allows a fact; the lack of a feature is no fault.

    >>> conforms("high-words", "glsl", "4294967294, 0"), conforms("high-words", "glsl", "4294967294, 4294967294")
    (False, True)
    """
    if fact.startswith(FAULTS):
        return False
    said = PROBES[name].said.get(language)
    return said is None or fact.startswith("no ") or said.allows(fact)
