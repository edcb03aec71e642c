"""Orders from disk: what networkx ordered once is ordered alike without it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import passgraph as pg
from passgraph.plan.data import Options

SCRIPT = """
import sys
import passgraph as pg
add = pg.kernel(source="def add(a: Image, b: Image) -> vec4: return a[1, 0] + b[0, 1]")
frame = pg.Input("frame", "rgba32f", (int(sys.argv[1]), 48))
wide = [add(frame, frame, name=f"wide{k}", into=pg.target(f"wide{k}", "rgba32f")) for k in range(3)]
first = add(wide[0], wide[1], name="first", into=pg.target("first", "rgba32f"))
last = add(first, wide[2], name="last", into=pg.target("last", "rgba8"))
with pg.compile(last, backend="null") as program:
    print(*(step.name for step in program.plan.steps), "networkx" in sys.modules)
"""


def run(size: int, cache: Path) -> list[str]:
    environment = {**os.environ, "PASSGRAPH_CACHE": str(cache)}
    made = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(size)], env=environment, capture_output=True, text=True, check=True
    )
    return made.stdout.split()


def test_a_second_process_orders_alike_without_networkx(tmp_path: Path) -> None:
    *names, loaded = run(64, tmp_path)
    assert loaded == "True"
    # Whatever the size: only the memory of targets hangs on it.
    assert run(64, tmp_path) == run(100, tmp_path) == [*names, "False"]
    for path in (tmp_path / "orders").iterdir():
        path.write_bytes(path.read_bytes()[:-1])
    assert run(64, tmp_path) == [*names, "True"]


MARK = """
class Corner:
    position: vec4

def place(vertex: Vertex) -> Corner:
    return Corner(vec4(vertex.position, 1.0))

def paint(corner: Corner) -> vec4:
    return vec4(0.5)
"""


@pytest.mark.parametrize("ordered", [True, False])
def test_copies_are_remembered_with_the_order(ordered: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two draws over one content: one of them takes a copy, in every run alike."""
    monkeypatch.setenv("PASSGRAPH_CACHE", str(tmp_path))
    mesh = pg.Mesh.make([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]])
    stages = {"vertex": pg.vertex(source=MARK, name="place"), "fragment": pg.fragment(source=MARK, name="paint")}
    add = pg.kernel(source="def add(a: Image, b: Image) -> vec4: return a[0, 0] + b[0, 0]")
    base = pg.draw(mesh, into=pg.target("base"), name="base", **stages)
    over = [pg.draw(mesh, into=base, name=f"over{k}", **stages) for k in range(2)]
    plans = []
    for _ in range(2):
        with pg.compile(add(*over), backend="null", size=(8, 8), options=Options(order=ordered)) as program:
            plans.append(([step.name for step in program.plan.steps], program.plan.notes))
    assert plans[0] == plans[1]
    assert sum("copied base" in note for note in plans[0][1]) == 2
    assert list((tmp_path / "orders").iterdir())
