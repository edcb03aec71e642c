"""Random draws: triangle soups with all states of :mod:`passgraph.graph.draw_state`, drawn over each other."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from hypothesis import strategies as st

from passgraph.backends.base import Backend
from passgraph.formats import format_named
from passgraph.graph.draw_state import COMPARE, CULL, EQUATIONS, FACTORS, STENCIL_OPERATIONS, Blend, Stencil
from passgraph.graph.drawing import draw
from passgraph.graph.targets import Input, Target, target
from passgraph.language.kernel import Kernel, kernel_from_text
from passgraph.scene.meshes import Mesh
from passgraph.verify.corner_kernels import CORNER_KERNELS
from passgraph.verify.fuzz.cases import Case, Tally, judged, run, same_bits

KERNELS = f"""{CORNER_KERNELS}
def moved(vertex: Vertex, waves: Image) -> Corner:
    by = waves.texel(ivec2(vertex.color.xy * 20.0) - 2).xy - 0.5
    return Corner(vec4(vertex.position.xy + by, vertex.position.z, 1.0), vertex.color)

def facing(corner: Corner) -> vec4:
    return vec4(corner.color.rgb, 1.0) if front_facing() else vec4(fragment_depth())

def steps(corner: Corner) -> vec4:
    total = vec4(0.0)
    for i in range(4):
        if corner.color.r * 4.0 < float(i):
            break
        total += corner.color * 0.25
    return total

def slopes(corner: Corner) -> vec4:
    c = corner.color
    v = vec4(dfdx(c.r), dfdy(c.g), fwidth(c.b * c.a), dfdx(dfdy(c.a * c.r)))
    if c.r + dfdx(c.g) < 0.75:
        w = c * c.g if c.b < 0.5 else vec4(fragment_depth())
        v += dfdx(w) - dfdy(w.yzwx)
    return v + float(pixel().x % 2) * dfdy(fragment_depth())
"""
VERTEX, FRAGMENT = ("place", "lean", "moved"), ("paint", "holes", "facing", "steps", "slopes")
#: Vertex displacements that float32 and half floats hold exactly.
_PARTS = (np.random.default_rng(8).integers(0, 65, (13, 17, 4)) / 64).astype(np.float32)
WAVES = Input("waves", "rgba16f", default=_PARTS).border("repeat")
FORMATS = ("rgba32f", "rgba16f", "rgba8", "rgba16")
SIZES = ((21, 17), (1, 1), (33, 2), (64, 9))
#: Half the side of a triangle's box: ordinary triangles, slivers and dots, and ones that leave the picture on all
#: sides.
EXTENTS = (0.5, 0.05, 3.0, 30.0)


def soup(count: int, seed: int, extent: float, steps: int) -> Mesh:
    """Return triangles of both windings at random positions; ``steps`` puts corners on a grid, for ties of edges and
    depths."""
    random = np.random.default_rng(seed)
    corners = random.uniform(-1, 1, (count, 1, 2)) + random.uniform(-extent, extent, (count, 3, 2))
    z = random.uniform(-0.9, 0.9, (count, 1, 1)) + random.uniform(-0.2, 0.2, (count, 3, 1)) * min(extent, 2.0)
    positions = np.concatenate([corners, z], -1).reshape(-1, 3)
    if steps:
        positions = np.round(positions * steps) / steps
    colors = random.integers(0, 17, (count * 3, 4)) / 16
    return Mesh.make(
        positions.astype(np.float32), np.arange(count * 3).reshape(-1, 3), colors=colors.astype(np.float32)
    )


def stage(kind: Literal["vertex", "fragment"], name: str) -> Kernel:
    return Kernel(kernel_from_text(KERNELS, name), kind)


@st.composite
def states(draw: st.DrawFn) -> dict[str, Any]:
    """Return the state of one draw, without its targets."""
    factor, operation = st.sampled_from(FACTORS), st.sampled_from(STENCIL_OPERATIONS)
    byte = st.sampled_from((0, 1, 2, 3, 0xF0, 0xFF))
    blends = st.fixed_dictionaries({
        "source": factor, "destination": factor, "equation": st.sampled_from(EQUATIONS),
        "source_alpha": st.none() | factor, "destination_alpha": st.none() | factor,
        "equation_alpha": st.none() | st.sampled_from(EQUATIONS),
    })  # fmt: skip
    stencils = st.fixed_dictionaries({
        "compare": st.sampled_from(("always", *COMPARE)), "reference": byte, "read_mask": byte, "write_mask": byte,
        "fail": operation, "depth_fail": operation, "passed": operation,
    })  # fmt: skip
    return {
        "count": draw(st.integers(1, 12)),
        "seed": draw(st.integers(0, 99)),
        "extent": draw(st.sampled_from(EXTENTS)),
        "steps": draw(st.sampled_from((0, 8, 3))),
        "vertex": draw(st.sampled_from(VERTEX)),
        "fragment": draw(st.sampled_from(FRAGMENT)),
        "cull": draw(st.sampled_from(CULL)),
        "depth_compare": draw(st.sampled_from(("less", *COMPARE))),
        "depth_write": draw(st.booleans()),
        "blend": draw(st.none() | blends),
        "stencil": draw(st.none() | stencils),
        "color_mask": draw(st.sampled_from(([True] * 4, [True, False, True, False], [False] * 4))),
        "polygon_offset": draw(st.sampled_from(([0.0, 0.0], [0.0, 4.0], [1.5, 0.0], [-2.0, -8.0]))),
    }


@st.composite
def draws(draw: st.DrawFn) -> Case:
    """Generate one to three draws over each other: a case of kind ``draw``."""
    return {
        "kind": "draw",
        "draws": draw(st.lists(states(), min_size=1, max_size=3)),
        "format": draw(st.sampled_from(FORMATS)),
        "depth": draw(st.sampled_from((None, "depth32f", "depth32f_stencil8"))),
        "size": list(draw(st.sampled_from(SIZES))),
        "clear": draw(st.sampled_from((0.0, 0.25, 1.0))),
    }


def drawn(case: Case) -> dict[str, Target]:
    """Return the last draw's targets."""
    depth_format = case["depth"]
    color: Any = target("color", case["format"], clear=case["clear"])
    depth: Any = target("depth", depth_format) if depth_format else None
    stencils = depth_format is not None and format_named(depth_format).stencil
    for number, state in enumerate(case["draws"]):
        mesh = soup(state["count"], state["seed"], state["extent"], state["steps"])
        waves = {"waves": WAVES} if state["vertex"] == "moved" else {}
        color = draw(
            mesh, vertex=stage("vertex", state["vertex"]), fragment=stage("fragment", state["fragment"]), into=color,
            depth=depth, stencil=Stencil(**state["stencil"]) if stencils and state["stencil"] else None,
            blend=Blend(**state["blend"]) if state["blend"] else None, cull=state["cull"],
            depth_compare=state["depth_compare"], depth_write=state["depth_write"],
            color_mask=tuple(state["color_mask"]), polygon_offset=tuple(state["polygon_offset"]), name=f"draw{number}",
            values=waves,
        )  # fmt: skip
        depth = color.depth if depth_format else None
    return {"color": color} | ({"depth": depth} if depth is not None else {})


def draw_outcome(case: Case, outputs: dict[str, Target], backends: list[Backend], tally: Tally) -> str:
    """Return the oracle's verdict, then check a second run: pixels must not depend on timing."""
    size = (case["size"][0], case["size"][1])
    why = judged(outputs, backends, tally, size=size)
    if why:
        return why
    for backend in backends:
        one, other = (run(outputs, backend, size) for _ in range(2))
        if not all(same_bits(one[name], other[name]) for name in one):
            return f"{backend.name}: two runs differ"
    return ""
