"""How draws are compiled on OpenCL; what they do is in tests/cross."""

from __future__ import annotations

import pytest

import passgraph as pg
from passgraph.backends.opencl.draw_source import DrawLayouts, draw_sources
from passgraph.backends.opencl.storage import ImageLayout
from passgraph.plan.data import DrawStep

pytestmark = pytest.mark.opencl
KERNELS = """
class Plain:
    position: vec4

class Many:
    position: vec4
    one: vec4
    two: vec4
    rest: vec2

def flat(v: Vertex) -> Plain: return Plain(vec4(v.position, 1.0))
def white(p: Plain) -> vec4: return vec4(1.0)
def wide(v: Vertex) -> Many: return Many(vec4(v.position, 1.0), v.color, v.color * 2.0, v.position.xy)
def tens(m: Many) -> tuple[vec4, vec4, vec4]: return m.one, m.two, vec4(m.rest, m.rest)
"""


def test_draws_of_every_kind_share_what_makes_triangles() -> None:
    """Compilers take half a second for it."""
    mesh = pg.Mesh.make([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]])
    flat, wide = (pg.vertex(source=KERNELS, name=name) for name in ("flat", "wide"))
    white, tens = (pg.fragment(source=KERNELS, name=name) for name in ("white", "tens"))
    three = tuple(pg.target(name, "rgba8", (300, 70)) for name in "abc")
    depth = pg.target("depth", "depth32f", (16, 12))
    kinds = (
        pg.draw(mesh, vertex=flat, fragment=white, into=pg.target("color", "rgba32f", (16, 12))),
        pg.draw(mesh, vertex=wide, fragment=tens, into=three)[0],
        pg.draw(mesh, vertex=flat, depth=depth, cull="back", polygon_offset=(1.0, 2.0)),
    )
    texts = set()
    for target in kinds:
        with pg.compile(target, backend="null") as program:
            (step,) = (step for step in program.plan.steps if isinstance(step, DrawStep))
        layouts = [ImageLayout.tight(format_, step.size) for format_ in step.output_formats]
        sources = draw_sources(step, DrawLayouts((), (), tuple(layouts), False, False), 32, serial=True, constant=True)
        texts.add(sources["pg_count", "pg_setup", "pg_scan", "pg_fill"].text)
    assert len(texts) == 1
