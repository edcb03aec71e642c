"""Phases of planning return new drafts, and leave those of earlier phases as they are."""

from __future__ import annotations

from dataclasses import FrozenInstanceError, fields

import pytest

import passgraph as pg
from passgraph.plan.collect import collect
from passgraph.plan.data import Options
from passgraph.plan.draft import Draft, Lowered, LoweredPixels
from passgraph.plan.fuse import fuse
from passgraph.plan.limits import Limits
from passgraph.plan.mipmaps import add_levels
from passgraph.plan.specialize import specialize
from passgraph.plan.trim import cull, trim

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


def draft_to_fuse() -> Draft:
    """A pass with a target that nothing reads and an image with levels, and one that reads it at the same pixel."""
    two, twice = (pg.kernel(source=KERNELS, name=name) for name in ("two", "twice"))
    first, _ = two(pg.Input("frame", "rgba8", (8, 4)).mipmaps())
    return specialize(collect({"twice": twice(first, 2.0)}, None, {}), Options(), Limits())


def contents(value: Draft | Lowered) -> dict[str, object]:
    """What a value holds, mappings copied; programs that were lowered are only remembered."""
    held = {f.name: getattr(value, f.name) for f in fields(value) if f.name != "programs"}
    return {name: dict(one) if isinstance(one, dict) else one for name, one in held.items()}


def test_no_phase_changes_the_draft_of_an_earlier_one() -> None:
    draft = draft_to_fuse()
    for phase in (add_levels, cull, trim, cull, fuse):
        before = [(one, contents(one)) for one in (draft, *draft.passes.values())]
        later = phase(draft)
        assert later is not draft
        for one, held in before:
            assert contents(one) == held
        draft = later
    (fused,) = (one for one in draft.passes.values() if one.name == "twice")
    assert isinstance(fused, LoweredPixels) and fused.fused == ("two",)


def test_what_a_phase_made_cannot_be_assigned() -> None:
    draft = draft_to_fuse()
    with pytest.raises(FrozenInstanceError):
        draft.notes = ()  # type: ignore[misc]
    for one in draft.passes.values():
        with pytest.raises(FrozenInstanceError):
            one.slots = ()  # type: ignore[misc]
