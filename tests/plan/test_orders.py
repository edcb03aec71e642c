"""Orders: what is gained in memory, that it is the most for trees, and that planning loads no networkx."""

from __future__ import annotations

import random
import subprocess
import sys
from collections.abc import Sequence

import networkx as nx
import pytest

import passgraph as pg
from passgraph.effects import Vsm, soft_shadow
from passgraph.graph.targets import Target, TargetSpec
from passgraph.plan.build import build
from passgraph.plan.data import Options
from tests.corners import placed

SCRIPT = """
import sys
import passgraph as pg
add = pg.kernel(source="def add(a: Image, b: Image) -> vec4: return a[1, 0] + b[0, 1]")
frame = pg.Input("frame", "rgba32f", (64, 48))
wide = [add(frame, frame, into=pg.target(f"wide{k}", "rgba32f")) for k in range(3)]
last = add(add(wide[0], wide[1], into=pg.target("first", "rgba32f")), wide[2], into=pg.target("last", "rgba8"))
with pg.compile(last, backend="null") as program:
    print(len(program.plan.steps), "networkx" in sys.modules)
"""
GATHER = {
    0: pg.kernel(source="def made() -> vec4: return vec4(0.5)"),
    1: pg.kernel(source="def one(a: Image) -> vec4: return a[1, 0]"),
    2: pg.kernel(source="def two(a: Image, b: Image) -> vec4: return a[1, 0] + b[0, 1]"),
    3: pg.kernel(source="def three(a: Image, b: Image, c: Image) -> vec4: return a[1, 0] + b[0, 1] + c[0, 0]"),
}
BYTES = {"rgba8": 4, "rgba16f": 8, "rgba32f": 16}
SIZE = (8, 4)


def test_planning_loads_no_networkx() -> None:
    made = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=True)
    assert made.stdout.split() == ["5", "False"]


def tree(chance: random.Random, passes: int) -> Target:
    """Passes of which each has one reader, in formats of different sizes."""
    loose: list[Target] = []
    for number in range(passes):
        count = len(loose) if number == passes - 1 else chance.randint(0, min(3, len(loose)))
        while count > 3:
            loose.append(GATHER[2](loose.pop(0), loose.pop(0), into=pg.target(f"joined{count}", "rgba8", SIZE)))
            count = len(loose)
        read = [loose.pop(chance.randrange(len(loose))) for _ in range(count)]
        loose.append(GATHER[count](*read, into=pg.target(f"t{number}", chance.choice([*BYTES]), SIZE)))
    return loose[0]


def most_held(sequence: Sequence[str], graph: nx.DiGraph, sizes: dict[str, int]) -> int:
    """Bytes a pixel that are held at once: each from where it is written to where it is read last."""
    last = {name: max([sequence.index(reader) for reader in graph[name]], default=len(sequence)) for name in sequence}
    return max(
        sum(sizes[name] for place, name in enumerate(sequence[: step + 1]) if place <= step <= last[name])
        for step in range(len(sequence))
    )


@pytest.mark.parametrize("seed", range(12))
def test_no_order_of_a_tree_needs_less(seed: int) -> None:
    out = tree(random.Random(seed), 7)
    passes = [node for node, kind in pg.graph(out).nodes(data="kind") if kind == "pass"]
    names = {node: node.into[0].name for node in passes}
    graph = nx.DiGraph((names[t.made_by], names[node]) for node in passes for t in node.images.values())
    graph.add_nodes_from(names.values())
    sizes = {node.into[0].name: BYTES[node.into[0].format.name] for node in passes}
    plan = build({"out": out}, options=Options(fuse=False))
    written = {resource.id: resource.name for resource in plan.resources}
    found = most_held([written[step.writes[0]] for step in plan.steps], graph, sizes)
    assert found == min(most_held(order, graph, sizes) for order in nx.all_topological_sorts(graph))


def test_lights_follow_each_other() -> None:
    """Of each light the maps are looked up and given back before those of the next are drawn."""
    scene = pg.Scene.shipped()
    lights = pg.Scene(scene.nodes, scene.camera, scene.lights * 4)
    picture = soft_shadow(lights, filter=Vsm())
    ordered, written = (
        build({"picture": picture}, (64, 36), options=Options(order=order, static=False)) for order in (True, False)
    )
    assert ordered.bytes < 0.8 * written.bytes


MARK = placed("""
def paint(corner: Corner) -> vec4:
    return vec4(0.5)
""")


@pytest.mark.parametrize("ordered", [True, False])
def test_two_draws_over_one_content_take_copies(ordered: bool) -> None:
    mesh = pg.Mesh.make([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]])
    stages = {"vertex": pg.vertex(source=MARK, name="place"), "fragment": pg.fragment(source=MARK, name="paint")}
    add = pg.kernel(source="def add(a: Image, b: Image) -> vec4: return a[0, 0] + b[0, 0]")
    base = pg.draw(mesh, into=pg.target("base"), **stages)
    assert isinstance(base.spec, TargetSpec)
    over = [pg.draw(mesh, into=base, name=f"over{k}", **stages) for k in range(2)]
    with pg.compile(add(*over), backend="null", size=(8, 8), options=Options(order=ordered)) as program:
        assert sum("copied base" in note for note in program.plan.notes) == 2
