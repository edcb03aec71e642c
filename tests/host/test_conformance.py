"""The conformance suite in an engine's context whose state is hostile, on pictures that lie as an engine's do."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.backends.base import Backend
from passgraph.backends.gl.textures import Placement, Surface, Texture
from passgraph.backends.registry import open_backend
from passgraph.formats import Format
from passgraph.verify.conformance import Case, judge
from tests.conformance.choice import CASES, first_of_each
from tests.host.application import Application
from tests.host.gl_state import Dump, State, differences
from tests.host.hostile import make_hostile

pytestmark = pytest.mark.gl


class BottomUpHost(pg.gl.Host):
    """Every colour picture has its rows from the bottom up, as an engine's has, so that every pass reads and writes
    such; triangles are drawn into plain ones, as they are for engines."""

    def make(self, format: Format, size: tuple[int, int]) -> Texture:
        made = super().make(format, size)
        if format.is_depth:
            return made
        surface = Surface("texture", made.name)
        return replace(made, placement=Placement(bottom_up=True), surface=surface, sampler=self.copies.sampler)

    def upload(self, storage: Texture, picture: Any) -> None:
        with self.plain((storage,)) as (own,):
            super().upload(own, picture)

    def upload_stored(self, storage: Texture, numbers: Any, format: Format) -> None:
        with self.plain((storage,)) as (own,):
            super().upload_stored(own, numbers, format)

    def download_into(self, storage: Texture, into: Any, format: Format) -> None:
        with self.plain((storage,)) as (own,):
            super().download_into(own, into, format)

    def draw_pass(self, step: Any) -> Any:
        run = super().draw_pass(step)

        def turned(outputs: Sequence[Texture], *rest: Any) -> None:
            with self.plain(outputs) as own:
                run(own, *rest)

        return turned

    @contextmanager
    def plain(self, storages: Sequence[Texture]) -> Iterator[list[Texture]]:
        """In textures with their rows from the top; what is done to those is done to the pictures."""
        turned = {s: s if s.surface is None else pg.gl.Host.make(self, s.format, s.size) for s in storages}
        for storage, own in turned.items():
            if own is not storage:
                self.copies.move(storage, own)
        yield list(turned.values())
        for storage, own in turned.items():
            if own is not storage:
                self.copies.move(own, storage)
                self.release(own)


@pytest.fixture(scope="module", params=["sibling", "guard"])
def engine(request: pytest.FixtureRequest) -> Iterator[tuple[list[Backend], Dump, State]]:
    app = Application()
    with open_backend("reference") as reference, BottomUpHost.current(request.param) as host:
        make_hostile(app)
        dump = Dump(app.gl)
        yield [reference, host], dump, dump()
    app.close()


FIRST = {case.id for case in first_of_each()}
#: Effects read and write pictures as the other cases do; two of them are enough for each day.
LONG = tuple({case.name.split(" ")[0] for case in CASES if case.group == "effects"} - {"black-and-white", "bloom"})


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
def test_every_case_in_an_engines_context(case: Case, engine: tuple[list[Backend], Dump, State]) -> None:
    backends, dump, before = engine
    faults = [str(verdict) for verdict in judge(case, backends) if verdict.outcome != "passed"]
    assert not faults, "\n".join(faults)
    assert not differences(before, dump())


@pytest.mark.parametrize("border", ["clamp", "zero", "repeat", "mirror"])
def test_a_devices_own_filter_finds_pictures_as_they_lie(
    border: str, engine: tuple[list[Backend], Dump, State]
) -> None:
    """Rows from the bottom up; weights of 8 bits each way.  Samplers wrap at the edges of whole textures only."""
    text = "def filtered(color: Image) -> vec4: return color.sample(uv() * 1.5 - 0.25)"
    frame = pg.Input("frame", "rgba32f", (7, 5)).border(border).filter("linear", hardware=True)
    made = pg.kernel(source=text)(frame, into=pg.target("filtered", "rgba32f", (33, 26)))
    given = np.random.default_rng(0).random((5, 7, 4), np.float32)
    found = []
    for backend in engine[0]:
        with pg.compile(made, backend=backend) as program:
            found.append(np.array(program(frame=given)["filtered"]))
    assert 0 < np.abs(found[0] - found[1]).max() <= 2.0**-7
