"""Which cases run when: the first of each group and effect in a quick run, others in a whole one."""

from __future__ import annotations

from passgraph.backends.base import Backend
from passgraph.verify.conformance import Case, cases, judge

CASES = list(cases())


def assert_all_conform(case: Case, backends: list[Backend]) -> None:
    faults = [str(verdict) for verdict in judge(case, backends) if verdict.outcome != "passed"]
    assert not faults, "\n".join(faults)


def first_of_each() -> list[Case]:
    """Of each group the first short case, and of the effects that of each effect."""
    found: dict[str, Case] = {}
    for case in filter(lambda case: case.quick, CASES):
        kind = case.name.split(" ")[0] if case.group == "effects" else ""
        found.setdefault(f"{case.group}/{kind}", case)
    return list(found.values())
