"""Draw states: culling, depth, stencil, blending, masks, offsets, clears, discard, several targets."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import lru_cache, partial
from typing import Any

import passgraph as pg
from passgraph.formats import FORMATS
from passgraph.graph.draw_state import BLENDS, COMPARE, CULL, EQUATIONS, FACTORS, STENCIL_OPERATIONS, Blend, Stencil
from passgraph.language.kernel import Kernel
from passgraph.verify.conformance.case import Case
from passgraph.verify.conformance.case_inputs import Soup, quad, soup
from passgraph.verify.corner_kernels import CORNER_KERNELS

GROUP = "draw states"
#: Larger than a tile, and not a multiple of one.
SIZE = (83, 61)
STENCIL_DEPTH = "depth32f_stencil8"

KERNELS = f"""{CORNER_KERNELS}
def one(corner: Corner) -> float:
    return corner.color.r

def two(corner: Corner) -> vec2:
    return corner.color.rg

def three(corner: Corner) -> vec3:
    return corner.color.rgb

def bright(corner: Corner) -> vec4:
    return corner.color * 3.0 - 1.0

def several(corner: Corner) -> tuple[vec4, float, vec4]:
    return corner.color, 1.0 if front_facing() else 0.25, vec4(fragment_depth(), uv(), 1.0)
"""
_VERTEX = ("place", "lean")


@lru_cache
def stage(name: str) -> Kernel:
    """Return one of the kernels above."""
    decorate = pg.vertex if name in _VERTEX else pg.fragment
    kernel: Kernel = decorate(source=KERNELS, name=name)
    return kernel


def painted(mesh: Soup, into: Any, *, vertex: str = "place", fragment: str | None = "paint", **state: Any) -> Any:
    """Return a draw with kernels given by name."""
    return pg.draw(
        mesh, vertex=stage(vertex), fragment=None if fragment is None else stage(fragment), into=into, **state
    )


def over(mesh: Soup, form: str = "rgba32f", fragment: str = "paint", **state: Any) -> Mapping[str, pg.Target]:
    """Return a cleared draw that increments the stencil, and a draw over it in the state under test."""
    channels = FORMATS[form].channels
    base = painted(
        soup(12, seed=5), pg.target("color", form, clear=0.25), fragment=("one", "two", "three", "paint")[channels - 1],
        depth=pg.target("depth", STENCIL_DEPTH), name="base", stencil=Stencil(passed="increment"),
    )  # fmt: skip
    drawn = painted(mesh, base, fragment=fragment, depth=base.depth, name="over", **state)
    return {"color": drawn, "depth": drawn.depth}


def stencil_seen(mesh: Soup, **state: Any) -> Mapping[str, pg.Target]:
    """Show the resulting stencil by draws that test for each value."""
    seen = over(mesh, **state)["color"]
    for value in range(6):
        # 6 stands for what wraps or saturates: 255 and its neighbors.
        test = Stencil("equal", reference=value) if value < 5 else Stencil("less_equal", reference=5)
        mark = quad(color=(value / 4, 1 - value / 4, 0.5, 1))
        seen = painted(
            mark, seen, depth=seen.depth, name=f"mark {value}", depth_compare="always", depth_write=False, stencil=test
        )
    return {"color": seen, "depth": seen.depth}


def _case(name: str, **state: Any) -> Case:
    mesh = state.pop("mesh", None) or soup(24, seed=11)
    return Case(GROUP, name, partial(over, mesh, **state), SIZE)


def cases() -> Iterator[Case]:
    """Yield cases for every value of every state, each draw over another."""
    for cull in CULL:
        for vertex in _VERTEX:
            yield _case(f"cull {cull}, {vertex}", cull=cull, vertex=vertex)
    for compare in COMPARE:
        for write in (True, False):
            name = f"depth {compare}, {'written' if write else 'kept'}"
            yield _case(name, depth_compare=compare, depth_write=write)
    yield from _stencils()
    yield from _blends()
    for mask in ((True, False, True, False), (False, False, False, False), (False, True, True, True)):
        letters = "".join(letter if kept else "-" for letter, kept in zip("rgba", mask, strict=True))
        yield _case(f"mask {letters}", color_mask=mask)
    for offset in ((0.0, 4000.0), (1.5, 0.0), (-2.0, -8000.0)):
        yield _case(f"polygon offset {offset[0]:g}, {offset[1]:g}", polygon_offset=offset, depth_compare="less_equal")
    stencil = Stencil("always", passed="increment", depth_fail="zero")
    yield Case(GROUP, "discard", partial(stencil_seen, soup(24, 11), fragment="holes", stencil=stencil), SIZE)
    # In order, fragment by fragment, with the range of w of "cull none, lean".
    yield Case(GROUP, "discard, lean", partial(over, soup(24, 11), fragment="holes", vertex="lean"), SIZE)
    yield Case(GROUP, "several targets", several_targets, SIZE)
    yield Case(GROUP, "depth only", lambda: {"depth": _depth_only()}, SIZE)
    yield Case(GROUP, "clears", clears, SIZE)
    for form in FORMATS.values():
        if not form.is_depth:
            yield Case(GROUP, f"draw into {form.name}", partial(into_format, form.name), SIZE)


def _stencils() -> Iterator[Case]:
    for compare in COMPARE:
        stencil = Stencil(compare, reference=1, read_mask=3, passed="invert")
        yield Case(GROUP, f"stencil {compare}", partial(stencil_seen, soup(24, 11), stencil=stencil), SIZE)
    moments = ("fail", "depth_fail", "passed")
    for number, operation in enumerate(STENCIL_OPERATIONS):
        for moment in moments:
            stencil = Stencil("less_equal", reference=2, write_mask=0x0F, **{moment: operation})  # type: ignore[arg-type]
            graph = partial(stencil_seen, soup(24, 11), stencil=stencil)
            # A short run has each operation in one moment, and in each moment a third of the operations.
            quick = moment == moments[number % len(moments)]
            yield Case(GROUP, f"stencil {operation} on {moment}", graph, SIZE, quick=quick)


def _overflowing() -> dict[str, pg.Target]:
    once = painted(quad(color=(40000.0, 65504.0, 65519.0, 1.0)), pg.target("color", "rgba16f"), blend="add", name="one")
    return {"color": painted(quad(color=(40000.0, 10.0, 0.0, 1.0)), once, blend="add", name="two")}


def _blends() -> Iterator[Case]:
    for factor in FACTORS:
        blend = Blend(factor, "one_minus_source_alpha", source_alpha="one", destination_alpha=factor)
        yield _case(f"blend factor {factor}", blend=blend, depth_compare="always", mesh=soup(8, 9))
    for equation in EQUATIONS:
        blend = Blend("source_alpha", "destination_color", equation)
        yield _case(f"blend equation {equation}", blend=blend, depth_compare="always", mesh=soup(8, 9))
    for name in BLENDS:
        yield _case(f"blend {name}", blend=name, mesh=soup(8, 9))
    for form in ("rgba8", "rgba16f", "rgba16"):
        # Few layers: each adds a rounding error, and too many 8-bit steps would make the bounds vague.
        graph = partial(over, soup(3, 3), form=form, blend="alpha")
        yield Case(GROUP, f"blend into {form}", graph, SIZE)
    yield Case(GROUP, "blend past the largest half", _overflowing, SIZE)


def several_targets() -> Mapping[str, pg.Target]:
    """Return three targets of three formats; the second blends and the third is masked."""
    into = pg.target("color", "rgba32f"), pg.target("facing", "r8"), pg.target("where", "rgba16f")
    color, facing, where = painted(
        soup(24, 2), into, vertex="lean", fragment="several", depth=pg.target("depth", "depth32f"),
        blend=(None, "max", None), color_mask=((True,) * 4, (True,) * 4, (True, True, False, True)),
    )  # fmt: skip
    return {"color": color, "facing": facing, "where": where, "depth": color.depth}


def _depth_only() -> pg.Target:
    depth: pg.Target = painted(soup(24, 2), None, vertex="lean", fragment=None, depth=pg.target("depth", "depth32f"))
    return depth


def clears() -> Mapping[str, pg.Target]:
    """Clear colors, depth and stencil to different values, with little drawn over them."""
    color = painted(
        soup(2, 3, 0.3),
        pg.target("color", "rgba8", clear=(0.2, 0.4, 0.6, 1.0)),
        clear_stencil=3,
        depth=pg.target("depth", STENCIL_DEPTH, clear=0.5),
        stencil=Stencil("equal", reference=3, passed="invert"),
    )
    marked = painted(
        quad(color=(1, 0, 0, 1)), color, depth=color.depth, depth_compare="always", depth_write=False,
        stencil=Stencil("equal", reference=0xFC), name="mark",
    )  # fmt: skip
    return {"color": marked, "depth": marked.depth}


def into_format(form: str) -> Mapping[str, pg.Target]:
    """Test that a draw quantizes like a pixel pass, with values below, in and above [0, 1]."""
    fragment = {1: "one", 2: "two", 3: "three", 4: "bright"}[FORMATS[form].channels]
    return {"color": painted(soup(16, 7), pg.target("color", form, clear=0.4), fragment=fragment)}
