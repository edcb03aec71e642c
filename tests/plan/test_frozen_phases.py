"""Phases of planning make new passes and leave those of earlier phases as they are."""

from __future__ import annotations

from dataclasses import FrozenInstanceError, fields

import pytest

import passgraph as pg
from passgraph.plan.collect import collect
from passgraph.plan.data import Options
from passgraph.plan.fuse import fuse
from passgraph.plan.mipmaps import add_levels
from passgraph.plan.specialize import specialize
from passgraph.plan.trim import cull, trim
from passgraph.plan.work import Lowered, LoweredPixels, Work

KERNELS = """
@struct
class Two:
    first: vec4
    second: vec4

def two(frame: Image) -> Two:
    return Two(frame[0, 0], frame.sample(uv(), lod=1.0))

def twice(first: Image, factor: float) -> vec4:
    return factor * first[0, 0]
"""


def work_to_fuse() -> Work:
    """A pass with a target that nothing reads and an image with levels, and one that reads it at the same pixel."""
    two, twice = (pg.kernel(source=KERNELS, name=name) for name in ("two", "twice"))
    first, _ = two(pg.Input("frame", "rgba8", (8, 4)).mipmaps())
    work = collect({"twice": twice(first, 2.0)}, None, {}, Options())
    specialize(work)
    return work


def contents(work: Work) -> list[tuple[Lowered, dict[str, object]]]:
    """The passes with what each holds, mappings copied."""
    return [
        (one, {f.name: dict(v) if isinstance(v := getattr(one, f.name), dict) else v for f in fields(one)})
        for one in work.passes.values()
    ]


def test_no_phase_changes_a_pass_of_an_earlier_one() -> None:
    work = work_to_fuse()
    for phase in (add_levels, cull, trim, cull, lambda work: fuse(work, work.limits)):
        before = contents(work)
        phase(work)
        for one, held in before:
            assert {f.name: getattr(one, f.name) for f in fields(one)} == held
    (fused,) = (one for one in work.passes.values() if one.name == "twice")
    assert isinstance(fused, LoweredPixels) and fused.fused == ("two",)


def test_what_a_phase_made_cannot_be_assigned() -> None:
    for one in work_to_fuse().passes.values():
        with pytest.raises(FrozenInstanceError):
            one.slots = ()  # type: ignore[misc]
