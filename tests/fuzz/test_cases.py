"""Random cases on every backend: a bounded part with fixed seeds in each run, and every failure that was ever found."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from passgraph.backends.base import Backend
from passgraph.backends.registry import open_backend
from passgraph.errors import InputError
from passgraph.verify.fuzz import search
from passgraph.verify.fuzz.cases import Tally, load, save
from passgraph.verify.fuzz.search import outcome
from tests.conftest import present_devices

REGRESSIONS = sorted((Path(__file__).parent / "regressions").glob("*.json"))
#: How many of each kind a run takes: what two cores compile in less than a minute.
BOUNDED = {"kernels": 10, "native": 10, "graphs": 3, "draws": 6, "variants": 6}


@contextmanager
def opened(*names: str) -> Iterator[list[Backend]]:
    """Open some devices together: the oracle's work on a case is done once for all of them."""
    with ExitStack() as stack:
        yield [stack.enter_context(open_backend(name)) for name in present_devices(*names)]


@pytest.fixture(scope="module")
def backends() -> Iterator[list[Backend]]:
    with opened() as backends:
        yield backends


#: webgpu has cases of its own: about one kernel in five hundred has sums of products that its driver rounds otherwise
#: (docs/limits.md), and none of these.
ON_DEVICES = [("gl", "opencl", "numpy"), ("webgpu",)]


@pytest.mark.sampled
@pytest.mark.parametrize("names", ON_DEVICES, ids=" ".join)
@pytest.mark.parametrize("kind", BOUNDED)
def test_random_cases_are_within_bounds(kind: str, names: tuple[str, ...]) -> None:
    tally = Tally()
    with opened(*names) as backends:
        failure = search.batch(search.strategies()[kind], backends, 1, tally, BOUNDED[kind])
    assert failure is None, f"{failure.why}\n{failure.case}"
    # Some are made up twice, and a graph may be refused.
    for backend in backends:
        assert tally.verdicts[backend.name] >= BOUNDED[kind] / 2


@pytest.mark.parametrize("path", REGRESSIONS, ids=lambda path: path.stem)
def test_what_failed_once_fails_no_more(path: Path, backends: list[Backend]) -> None:
    tally = Tally()
    assert outcome(load(path), backends, tally) == ""
    assert not tally.refused


def test_there_are_regressions() -> None:
    assert REGRESSIONS


# Files


CASE = {"kind": "kernel", "text": "def k(c: Image) -> vec4:\n    return c[0, 0]\n", "format": "rgba32f",
        "border": "clamp", "special": True, "seed": 3}  # fmt: skip


def test_a_saved_case_is_read_back(tmp_path: Path) -> None:
    path = save(CASE, "because", tmp_path / "new")
    assert load(path) == CASE
    assert '"    return c[0, 0]"' in path.read_text(), "lines of a kernel can be read"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "cannot be read as a case"),
        ("[" * 5_000_000, "cannot be read as a case: nested too deeply"),
        ("[1]", "holds no case"),
        ('{"kind": "spell"}', "a case is of kind kernel, variant, graph, draw, got 'spell'"),
        ('{"kind": "kernel"}', "the kernel case cannot be read: KeyError 'text'"),
        ('{"kind": "graph", "steps": [["copy"]], "outputs": []}', "the graph case cannot be read: TypeError"),
        ('{"kind": "draw", "draws": [{}]}', "the draw case cannot be read: KeyError"),
    ],
)
def test_what_is_no_case_is_refused(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "case.json"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        outcome(load(path), [])


def test_text_of_a_case_is_never_executed(tmp_path: Path) -> None:
    made = tmp_path / "made"
    tally = Tally()
    text = f"def k(c: Image) -> vec4:\n    open({str(made)!r}, 'w')\n    return c[0, 0]\n"
    assert outcome({**CASE, "text": text}, [], tally) == ""
    assert tally.refused == 1
    assert not made.exists()
