"""Which suites there are, where their checkouts lie, and a run of one on a backend."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from tests.suites import khronos, piglit
from tests.suites.judgment import Judgment

#: The numbers of the last run of each suite on each backend.
NUMBERS = Path(__file__).parent / "numbers.json"
KHRONOS, PIGLIT = "PASSGRAPH_VK_GL_CTS", "PASSGRAPH_PIGLIT"


@dataclass(frozen=True)
class Suite:
    """A part of a suite: the environment variable that names its checkout, and its cases, judged one by one.

    ``runs`` : False if its cases are only compiled, so that the backend does not matter
    """

    variable: str
    judged: Callable[[Path, str], Iterator[tuple[str, Judgment]]]
    runs: bool = True


def _khronos_values(checkout: Path, backend: str) -> Iterator[tuple[str, Judgment]]:
    for case in khronos.cases_of(checkout):
        if case.is_in_reach and not case.is_invalid:
            yield case.name, khronos.judge(case, backend)


def _khronos_invalid(checkout: Path, backend: str) -> Iterator[tuple[str, Judgment]]:
    for case in khronos.cases_of(checkout):
        if case.is_in_reach and case.is_invalid:
            yield case.name, khronos.judge(case, backend)


def _piglit_drawn(checkout: Path, backend: str) -> Iterator[tuple[str, Judgment]]:
    for case in piglit.cases_of(checkout):
        yield case.name, piglit.judge(case, backend)


def _piglit_compiled(checkout: Path, backend: str) -> Iterator[tuple[str, Judgment]]:
    for name, text, is_valid in piglit.texts_of(checkout):
        yield name, piglit.judge_text(text, is_valid)


SUITES = {
    "khronos, with values": Suite(KHRONOS, _khronos_values),
    "khronos, invalid": Suite(KHRONOS, _khronos_invalid, runs=False),
    "piglit, drawn": Suite(PIGLIT, _piglit_drawn),
    "piglit, compiled": Suite(PIGLIT, _piglit_compiled, runs=False),
}


def judged(name: str, backend: str) -> dict[str, Judgment] | None:
    """Return the judgment of each case of a suite; None where the environment names no checkout of it."""
    checkout = os.environ.get(SUITES[name].variable)
    return dict(SUITES[name].judged(Path(checkout), backend)) if checkout else None
