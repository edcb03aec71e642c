"""A reader who follows the outputs through ``plan.build``, or a pass through ``compare``, call by call, meets each file
once."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.graph.targets import Outputs
from passgraph.plan.build import build
from passgraph.verify.compare import compare
from tests.corners import placed

root = Path(pg.__file__).resolve().parent
#: Files of nouns, read before: calls into them are answers, not steps of the way.
NOUNS = {
    "arguments.py", "disk_cache.py", "errors.py", "formats.py", "graph/run_values.py", "graph/targets.py",
    "plan/data.py", "plan/draft.py", "records.py",
}  # fmt: skip
#: Sorting is asked for twice, and the files of passes and of inputs too.
MOST = 6
#: Of the way of a pass through ``compare``: what bounds, targets, time and verdicts are.
ORACLES_NOUNS = {
    "verify/report.py",
    *(f"verify/oracle/{name}.py" for name in (
        "allowed", "domain", "interval", "interval_functions", "merge", "stored_bounds", "time_limit",
    )),
}  # fmt: skip
#: A graph is made, run and asked about in one file, and what was found before too; a stage is made and then bounded, of
#: a draw two, over and over; each pass goes the way of the one before it.
MOST_OF_COMPARE = {"pass": 4, "draw": 6, "rich": 6}
half = pg.kernel(source="def half(color: Image, other: Image) -> vec4: return color[0, 0] * 0.5 + other[1, 0]")
zoom = pg.kernel(source="def zoom(color: Image, by: float) -> vec4: return color.sample(uv()) * by")
STAGES = placed("""
def paint(corner: Corner) -> vec4:
    return vec4(0.5)
""")


def rich() -> dict[str, pg.Target]:
    """Static inputs, history, a draw over another, a pass that fuses, one that nothing reads, and run values."""
    stages = {"vertex": pg.vertex(source=STAGES, name="place"), "fragment": pg.fragment(source=STAGES, name="paint")}
    mesh = pg.Mesh.make([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]])
    frame, still = pg.Input("frame", "rgba32f", (8, 4)), pg.Input("still", "rgba32f", (8, 4), static=True)
    kept = pg.target("kept")
    first = half(frame, zoom(still, 2.0, into=pg.target("once")), into=pg.target("first"))
    over = half(first, pg.previous(kept), into=kept)
    small = zoom(over, pg.Value("by", float), into=pg.target("small", scale=0.5))
    color = pg.draw(
        mesh, into=pg.target("color", like=frame), depth=pg.target("depth", "depth32f", like=frame), **stages
    )
    both = half(color, zoom(small, 0.5, into=pg.target("large", like=frame)), into=pg.target("both"))
    again = pg.draw(mesh, into=color, depth=color.depth, **stages)
    return {"out": half(again, both, into=pg.target("out")), "kept": over}


@cache
def counted(file: str) -> str:
    """A file by its place in the package; empty where it counts for nothing."""
    path = Path(file)
    name = path.relative_to(root).as_posix() if path.is_relative_to(root) else ""
    return "" if name in NOUNS or name.startswith("language/") else name


def left_and_entered_again(follow: Callable[[], object]) -> set[tuple[str, str]]:
    """From which file to which that had been left, each pair once."""
    inside: list[str] = []
    met: set[str] = set()
    found: set[tuple[str, str]] = set()

    def note(frame: FrameType, event: str, _: object) -> None:
        if event == "call":
            name = counted(frame.f_code.co_filename)
            if name and name in met and name not in inside:
                found.add((inside[-1] if inside else "", name))
            if name:
                met.add(name)
            inside.append(name)
        elif event == "return" and inside:
            inside.pop()

    before = sys.getprofile()
    sys.setprofile(note)
    try:
        follow()
    finally:
        sys.setprofile(before)
    return found


@pytest.mark.parametrize("kind", MOST_OF_COMPARE)
def test_comparing_is_read_file_by_file(kind: str) -> None:
    frame = pg.Input("frame", "rgba32f", (8, 4))
    mesh = pg.Mesh.make([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]])
    stages = {"vertex": pg.vertex(source=STAGES, name="place"), "fragment": pg.fragment(source=STAGES, name="paint")}
    color, depth = pg.target("color", "rgba32f"), pg.target("depth", "depth32f")
    picture = np.random.default_rng(1).random((4, 8, 4)).astype(np.float32)
    graphs: dict[str, tuple[Outputs, dict[str, Any]]] = {
        "pass": (zoom(frame, 0.5), {"frame": picture}),
        "draw": (pg.draw(mesh, into=color, depth=depth, **stages), {"size": (8, 4)}),
        "rich": (rich(), {"frame": picture, "still": picture, "by": 0.5}),
    }
    outputs, given = graphs[kind]

    def follow() -> None:
        compare(outputs, ["numpy"], **given)

    follow()  # what is loaded and lowered once
    entered = left_and_entered_again(follow)
    found = [way for way in entered if way[1].startswith("verify/") and way[1] not in ORACLES_NOUNS]
    assert ("verify/compare.py", "verify/oracle/backend.py") not in found
    assert len(found) <= MOST_OF_COMPARE[kind], sorted(found)


def test_planning_is_read_file_by_file() -> None:
    outputs = rich()
    build(outputs)  # what is loaded and lowered once
    found = left_and_entered_again(lambda: build(outputs))
    assert ("plan/build.py", "plan/collect.py") not in found
    assert len(found) <= MOST, sorted(found)
