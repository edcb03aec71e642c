"""Planner optimizations: intermediate results, aliased memory, static passes, draws over content that is read later.

Numbers are small and whole, so results are exact with every optimization on.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

import passgraph as pg
from passgraph.verify.conformance import reduction_cases
from passgraph.verify.conformance.case import Case, whole_numbers
from passgraph.verify.conformance.case_inputs import quad
from passgraph.verify.conformance.draw_state_cases import painted
from passgraph.verify.conformance.sequence_cases import SIZE, called, shift

GROUP = "plans"
#: More equal passes than a backend compiles separately.
ROW = 12


def _shifted(picture: Any, into: str) -> pg.Target:
    """Return a pass that reads next to its pixel, so it is never fused with its producer."""
    return called("shift", picture.border("zero"), into=into)


def row() -> dict[str, pg.Target]:
    """Return passes of one kernel with different parameters, and one with a derived parameter."""
    frame = pg.Input("frame", "rgba32f", SIZE)
    targets = {}
    for k in range(ROW):
        one, other = f"{67 + 2 * k}.0", f"{301 + 2 * k}.0"
        text = f"def scaled(c: Image) -> vec4: return c[0, 0] * {one} + (max({one}, {other}) + 2.0)"
        targets[f"row {k}"] = pg.kernel(source=text)(frame, into=pg.target(f"row {k}", "rgba32f"), name=f"row {k}")
    return targets


def cases() -> Iterator[Case]:
    """Yield each case with its exact result after the last frame."""
    frames = tuple({"frame": whole_numbers(SIZE, seed)} for seed in range(3))
    total = np.sum([frame["frame"] for frame in frames], axis=0)
    yield Case(GROUP, "history that is no result", hidden_history, SIZE, frames, exact={"out": shift(shift(total))})
    lone = whole_numbers(SIZE, 0)
    wanted = {"half way": lone * 2.0, "out": lone * 2.0 + lone}
    yield Case(GROUP, "a result on the way", on_the_way, SIZE, frames[:1], exact=wanted)
    tables = {"one": whole_numbers(SIZE, 5), "two": whole_numbers(SIZE, 6)}
    changing: tuple[Mapping[str, Any], ...] = tuple(
        {**tables, "frame": whole_numbers(SIZE, seed), "factor": float(seed + 1)} for seed in range(3)
    )
    last = frames[-1]["frame"]
    apart = shift(shift(tables["one"]) + last) + shift(shift(tables["two"]))
    yield Case(
        GROUP, "static pictures kept apart", kept_apart, SIZE, _without(changing, "factor"), exact={"out": apart}
    )
    scaled = shift(tables["one"] * 3.0) + last
    yield Case(GROUP, "a value that is not static", not_static, SIZE, _without(changing, "two"), exact={"out": scaled})
    still = _without(_without(changing, "factor"), "two")
    late = tables["one"] * 2.0 + last
    yield Case(GROUP, "history of what never changes", static_history, SIZE, still, exact={"late": late})
    one, two = tables["one"], tables["two"]
    new_picture = ({"table": one, "factor": 2.0}, {"table": two, "factor": 2.0})
    yield Case(GROUP, "only a static picture changes", baked, SIZE, new_picture, exact={"out": shift(two * 2.0)})
    new_value = ({"table": one, "factor": 2.0}, {"table": one, "factor": 3.0})
    yield Case(GROUP, "only a static value changes", baked, SIZE, new_value, exact={"out": shift(one * 3.0)})
    wanted = {f"row {k}": lone * (67.0 + 2 * k) + (303.0 + 2 * k) for k in range(ROW)}
    yield Case(GROUP, "passes that differ in numbers", row, SIZE, frames[:1], exact=wanted)
    yield Case(GROUP, "drawn over while still needed", needed_later, SIZE, exact={"sum": 3.0, "again": 2.0})
    yield Case(GROUP, "drawn over twice", branching, SIZE, exact={"first": 1.0, "left": 2.0, "right": 4.0})
    yield from reduction_cases.cases()


def _without(frames: tuple[Mapping[str, Any], ...], name: str) -> tuple[Mapping[str, Any], ...]:
    return tuple({key: value for key, value in frame.items() if key != name} for frame in frames)


def hidden_history() -> Mapping[str, pg.Target]:
    """History that the next frame reads; later passes must not reuse its memory."""
    spec = pg.target("sum", "rgba32f")
    added = called("add", pg.previous(spec), pg.Input("frame"), into=spec)
    return {"out": _shifted(_shifted(added, "between"), "out")}


def on_the_way() -> Mapping[str, pg.Target]:
    """An intermediate result that is also an output, although it could be fused."""
    frame = pg.Input("frame")
    half_way = called("scale", frame, into="half way", factor=2.0)
    return {"half way": half_way, "out": called("add", half_way, frame, into="out")}


def kept_apart() -> Mapping[str, pg.Target]:
    """Keep apart two static pictures that are read at different times of each frame."""
    frame = pg.Input("frame")
    one = _shifted(pg.Input("one", static=True), "baked one")
    added = _shifted(called("add", one, frame, into="added"), "beside")
    two = _shifted(_shifted(pg.Input("two", static=True), "baked two"), "baked three")
    return {"out": called("add", added, two, into="out")}


def not_static() -> Mapping[str, pg.Target]:
    """A static picture multiplied by a number that changes with each frame."""
    scaled = called("scale", pg.Input("one", static=True), into="scaled", factor=pg.Value("factor", float))
    return {"out": called("add", _shifted(scaled, "beside"), pg.Input("frame"), into="out")}


def static_history() -> Mapping[str, pg.Target]:
    """A pass of static inputs with history, so its picture alternates between two allocations."""
    now = called("scale", pg.Input("one", static=True), into="now", factor=2.0)
    late = called("add", pg.previous(now), pg.Input("frame"), into="late")
    return {"late": late, "now": now}


def baked() -> Mapping[str, pg.Target]:
    """A graph of static passes only."""
    factor = pg.Value("factor", float, static=True)
    return {"out": _shifted(called("scale", pg.Input("table", static=True), into="scaled", factor=factor), "out")}


def needed_later() -> Mapping[str, pg.Target]:
    """A pass that reads the content before and after a draw."""
    first = painted(quad(), pg.target("hits", "rgba32f"), blend="add", name="first")
    again = painted(quad(), first, blend="add", name="again")
    return {"sum": called("add", first, again, into="sum"), "again": again}


def branching() -> Mapping[str, pg.Target]:
    """Start two draws from one picture, which is also a result."""
    first = painted(quad(), pg.target("hits", "rgba32f"), blend="add", name="first")
    left = painted(quad(), first, blend="add", name="left")
    right = painted(quad(color=(3, 3, 3, 3)), first, blend="add", name="right")
    return {"first": first, "left": left, "right": right}
