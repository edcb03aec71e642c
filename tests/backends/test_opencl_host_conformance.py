"""The conformance suite on a caller's queue, with every picture as a caller's may lie."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

import passgraph as pg
from passgraph.backends.base import Backend
from passgraph.backends.opencl.storage import ImageLayout, Storage
from passgraph.backends.opencl.transfers import move
from passgraph.backends.registry import open_backend
from passgraph.formats import Format
from passgraph.hosts.opencl import Host
from passgraph.verify.conformance import Case, judge
from tests.conformance.choice import CASES, first_of_each
from tests.conftest import require

cl = pytest.importorskip("pyopencl")
pytestmark = pytest.mark.opencl


class Elsewhere(Host):
    """Every colour picture has its rows from the bottom up, apart from each other, behind other numbers, and its
    channels in reverse: so does each pass read and write them."""

    def make(self, format: Format, size: tuple[int, int]) -> Storage:
        if format.is_depth:
            return super().make(format, size)
        (width, height), channels = size, format.channels
        row, number = width * (channels + 1) + 3, format.bits // 8
        buffer = self.allocate((height * row + 5) * number, "a picture that lies elsewhere")
        self.fill(buffer, (height * row + 5) * number)
        order = tuple(reversed(range(channels)))
        return Storage(ImageLayout(format, size, 5 + (height - 1) * row, -row, channels + 1, order), buffer)

    def _through_plain(self, storage: Storage, fill: Any) -> None:
        plain = Host.make(self, storage.format, storage.size)
        fill(plain)
        move(self, plain, storage)
        self.release(plain)

    def upload(self, storage: Storage, picture: Any) -> None:
        self._through_plain(storage, lambda plain: Host.upload(self, plain, picture))

    def upload_stored(self, storage: Storage, numbers: Any, format: Format) -> None:
        self._through_plain(storage, lambda plain: Host.upload_stored(self, plain, numbers, format))


@pytest.fixture(scope="module")
def backends() -> Iterator[list[Backend]]:
    require("opencl")
    queue = cl.CommandQueue(cl.create_some_context(interactive=False))
    with open_backend("reference") as reference, Elsewhere(queue) as host:
        yield [reference, host]


#: What compiles for long on PoCL; the same kernels are in the others.
#: Effects read and write pictures as the other cases do.
LONG = tuple({case.name.split(" ")[0] for case in CASES if case.group == "effects"} - {"black-and-white"})
FIRST = {case.id for case in first_of_each()}


@pytest.mark.sampled
@pytest.mark.parametrize(
    "case",
    [
        pytest.param(case, marks=[pytest.mark.slow] if case.name.startswith(LONG) or case.id not in FIRST else [])
        for case in CASES
        if case.quick
    ],
    ids=lambda case: case.id,
)
def test_every_case_on_pictures_that_lie_elsewhere(case: Case, backends: list[Backend]) -> None:
    faults = [str(verdict) for verdict in judge(case, backends) if verdict.outcome != "passed"]
    assert not faults, "\n".join(faults)


def test_the_pictures_do_lie_elsewhere(backends: list[Backend]) -> None:
    made = backends[1].make(pg.formats.FORMATS["rgba8"], (3, 2))
    assert made.layout.row < 0
    backends[1].release(made)
