"""Which suites there are, where their checkouts lie, and a run of one on backends."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from zlib import crc32

from passgraph.backends.registry import open_backend
from tests.suites import khronos, piglit
from tests.suites.judgment import Backends, Judgment

#: The numbers of the last run of each suite on each backend.
NUMBERS = Path(__file__).parent / "numbers.json"
KHRONOS, PIGLIT = "PASSGRAPH_VK_GL_CTS", "PASSGRAPH_PIGLIT"
BACKENDS = ("reference", "numpy", "gl", "webgpu", "opencl")
#: The key of the numbers of suites that are only compiled: what refuses a text comes before any backend.
COMPILED = "any"
#: On these backends, one case in so many runs: PoCL takes 0.4 s for a kernel.
SAMPLED = {"opencl": 5}

Judge = Callable[[Backends], dict[str, Judgment]]


@dataclass(frozen=True)
class Suite:
    """A part of a suite: the environment variable that names its checkout, and its cases.

    ``runs`` : False if its cases are only compiled
    """

    variable: str
    cases: Callable[[Path], Iterator[tuple[str, Judge]]]
    runs: bool = True

    @property
    def backends(self) -> tuple[str, ...]:
        """Return the keys of its numbers."""
        return BACKENDS if self.runs else (COMPILED,)


def _khronos(checkout: Path, *, invalid: bool) -> Iterator[tuple[str, Judge]]:
    for case in khronos.cases_of(checkout):
        if case.is_in_reach and case.is_invalid == invalid:
            yield case.name, partial(khronos.judge, case)


def _piglit_drawn(checkout: Path) -> Iterator[tuple[str, Judge]]:
    for case in piglit.cases_of(checkout):
        yield case.name, partial(piglit.judge, case)


def _piglit_compiled(checkout: Path) -> Iterator[tuple[str, Judge]]:
    for name, text, is_valid in piglit.texts_of(checkout):
        yield name, partial(_compiled, text, is_valid)


def _compiled(text: str, is_valid: bool, backends: Backends) -> dict[str, Judgment]:
    return dict.fromkeys(backends, piglit.judge_text(text, is_valid))


SUITES = {
    "khronos, with values": Suite(KHRONOS, partial(_khronos, invalid=False)),
    "khronos, invalid": Suite(KHRONOS, partial(_khronos, invalid=True), runs=False),
    "piglit, drawn": Suite(PIGLIT, _piglit_drawn),
    "piglit, compiled": Suite(PIGLIT, _piglit_compiled, runs=False),
}


def judged(name: str, backends: Sequence[str]) -> dict[str, dict[str, Judgment]] | None:
    """Return the judgment of each case of a suite by backend; None where the environment names no checkout of it.

    A case is parsed once, and each backend is opened once.
    """
    suite, checkout = SUITES[name], os.environ.get(SUITES[name].variable)
    if not checkout:
        return None
    found: dict[str, dict[str, Judgment]] = {backend: {} for backend in backends}
    with ExitStack() as stack:
        opened: Backends = {b: stack.enter_context(open_backend(b)) if suite.runs else b for b in backends}
        for case, judge in suite.cases(Path(checkout)):
            for backend, judgment in judge({b: at for b, at in opened.items() if _is_sampled(case, b)}).items():
                found[backend][case] = judgment
    return found


def _is_sampled(case: str, backend: str) -> bool:
    """Return True if a case runs on a backend; by its name, so that a suite that grows keeps its sample."""
    return crc32(case.encode()) % SAMPLED.get(backend, 1) == 0


def sample_of(backend: str) -> str:
    """Return what the numbers of a backend say about their sample.

    >>> sample_of("gl"), sample_of("opencl")
    ('all', 'one in 5, by the CRC-32 of its name')
    """
    return f"one in {SAMPLED[backend]}, by the CRC-32 of its name" if backend in SAMPLED else "all"
