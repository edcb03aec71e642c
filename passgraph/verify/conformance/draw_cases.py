"""Draws beyond single states: thousands of ordered triangles, discard without a stencil, blends without alpha, pictures
and parameters of both stages.

Colors are small whole numbers and triangles cover whole pixels, so every result is exact.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.effects.surfaces.marks import points
from passgraph.graph.draw_state import Blend, Stencil
from passgraph.verify.conformance.case import Case, Picture, whole_numbers
from passgraph.verify.conformance.case_inputs import Soup, quad, soup
from passgraph.verify.conformance.draw_state_cases import SIZE, STENCIL_DEPTH, painted

GROUP = "draws"
SMALL = (16, 8)
#: Twice as many triangles are more than any backend sets up in one batch.
SQUARES = 2500

KERNELS = """
class Corner:
    position: vec4
    color: vec4

def place(vertex: Vertex, shift: vec2, height: float) -> Corner:
    return Corner(vec4(vertex.position.xy + shift, height, 1.0), vertex.color)

def mixed(corner: Corner, far: Image, near: Image, gain: float) -> vec4:
    p = pixel()
    return near.texel(p + ivec2(-1, 0)) * 10.0 + far.texel(ivec2(p.y, p.x)) * gain + corner.color

class Many:
    position: vec4
    normal: vec3
    uv: vec2
    color: vec4
    tangent: vec4

def scattered(vertex: Vertex, far: Image, cloud: Image, gain: float) -> Corner:
    n = int(vertex.instance)
    there = cloud.texel(ivec2(n % cloud.size.x, n // cloud.size.x))
    place = (there.xy + vertex.uv) / vec2(output_size()) * 2.0 - 1.0
    return Corner(vec4(place, 0.0, 1.0), vec4(there.z, vertex.instance, there.w, gain + far.texel(ivec2(0)).x))

def beside_cloud(corner: Corner, cloud: Image, far: Image) -> vec4:
    return corner.color + far.texel(pixel()) + cloud.texel(ivec2(0, 0)).xxxx

def every(vertex: Vertex) -> Many:
    return Many(vec4(vertex.position, 1.0), vertex.normal, vertex.uv, vertex.color, vertex.tangent)

def shown(many: Many) -> tuple[vec4, vec4, vec4]:
    return vec4(many.normal, many.uv.y), many.color, vec4(many.tangent.wzy, many.uv.x)
"""


#: Name, stencil operation that is applied three times, initial value, and result.
STENCILS = (
    ("increment", Stencil(passed="increment"), 254, 255),
    ("increment_wrap", Stencil(passed="increment_wrap"), 254, 1),
    ("decrement", Stencil(passed="decrement"), 1, 0),
    ("increment where 4 bits are written", Stencil(passed="increment", write_mask=0x0F), 0xAE, 0xA1),
    ("invert where 4 bits are tested", Stencil("equal", 0xF5, 0x0F, passed="invert"), 0xA5, 0x5A),
)

#: States that must not leak into the next draw.
LEFT: dict[str, dict[str, Any]] = {
    "a blend": {"blend": "add"},
    "a mask": {"color_mask": (True, False, True, False)},
    "culling": {"cull": "front"},
    "an offset": {"polygon_offset": (0.0, 4000.0)},
    "depth kept": {"depth_write": False},
    "a stencil that fails": {"stencil": Stencil("never", fail="increment")},
    "a narrow stencil mask": {"stencil": Stencil("always", passed="invert", write_mask=0x0F)},
}
_BEYOND = (2.0, -1.0, 3.0, 0.0)
_PLAIN = (1.0, 2.0, 3.0, 4.0)


def cases() -> Iterator[Case]:
    """Yield each case, with its exact result if it is known."""
    for name, blend in (("the last of thousands", None), ("thousands blended in order", _OVER)):
        exact = {"color": _summed(SQUARES, blend)}
        yield Case(GROUP, name, partial(_squares, blend), SMALL, exact=exact, quick=blend is None)
    yield Case(GROUP, "discard without a stencil", discarding, SIZE)
    for name, stencil, start, end in STENCILS:
        graph = partial(_counted, stencil, start, end)
        yield Case(GROUP, f"stencil {name} three times from {start}", graph, SMALL, exact={"color": 2.0})
    for form in ("r32f", "rg32f", "rgb32f"):
        channels = len(form) - 3
        for source, destination, factors in (
            ("destination_alpha", "source_alpha", (1, 1)),
            ("one_minus_destination_alpha", "destination_alpha", (0, 1)),
            ("source_alpha", "one_minus_source_alpha", (1, 0)),
        ):
            name = f"blend {source}, {destination} into {form}"
            mixed = np.array([factors[0] * 5 + factors[1] * 3] * channels, np.float32)
            graph = partial(_opaque, form, Blend(source, destination))
            yield Case(GROUP, name, graph, SMALL, exact={"color": mixed})
    frame = {"far": whole_numbers(SMALL[::-1], 4), "near": whole_numbers(SMALL, 4)}
    yield Case(GROUP, "pictures and parameters", pictures, SMALL, (frame,), exact={"color": _pictured(**frame)})
    frame = {"cloud": _CLOUD, "far": whole_numbers(SMALL, 4)}
    yield Case(GROUP, "scatter", scatter, SMALL, (frame,), exact={"color": _scattered(frame["far"])})
    # 0.2 is a whole number of steps of 1/255 and of 1/65535, 0.25 a half float.
    clamped = (1.0, 0.0, 1.0, 0.0)
    for form, base, times in (("rgba8", 0.2, clamped), ("rgba16", 0.2, clamped),
                                ("rgba16f", 0.25, _BEYOND), ("rgba32f", 0.25, _BEYOND)):  # fmt: skip
        product = np.float32(base) * np.array(times, np.float32)
        graph = partial(_product, form, base)
        yield Case(GROUP, f"blend from beyond [0, 1] into {form}", graph, SMALL, exact={"color": product})
    for units, edge in ((5e7, 1.0), (-5e7, 0.0)):
        for name, counted in (("", None), (", counted", Stencil(passed="increment"))):
            graph = partial(_offset, units, counted)
            yield Case(GROUP, f"offset beyond {edge:g}{name}", graph, SMALL, exact={"depth": np.array(edge)})
    for name, state in LEFT.items():
        expected = {"plain": np.array(_PLAIN), "depth": np.array(0.5), "marked": np.array(9.0)}
        yield Case(GROUP, f"a plain draw behind one with {name}", partial(_behind, state), SMALL, exact=expected)
    names = ("normal and uv", "color", "tangent")
    first = np.array([1, 2, 3, 5]), np.array([6, 7, 8, 9]), np.array([13, 12, 11, 4])
    yield Case(GROUP, "every attribute", attributes, SMALL, exact=dict(zip(names, first, strict=True)))


#: Replaces the destination where the source's alpha is 1, and adds to it where it is 0.
_OVER = Blend("one", "one_minus_source_alpha")


def _places(count: int) -> NDArray[np.int64]:
    """Return columns and rows, (count, 2)."""
    return np.random.default_rng(8).integers(0, SMALL, (count, 2))


def _colours(count: int) -> NDArray[np.float32]:
    colours = np.random.default_rng(6).integers(0, 50, (count, 4)).astype(np.float32)
    colours[:, 3] = np.arange(count) % 3 == 0
    return colours


def _squares(blend: Blend | None) -> Mapping[str, pg.Target]:
    """Cover one pixel with each pair of triangles."""
    corners = _places(SQUARES)[:, None, :] + np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
    clip = corners / np.array(SMALL) * 2.0 - 1.0
    # Row 0 is on top.
    positions = np.concatenate([clip * (1, -1), np.zeros((SQUARES, 4, 1))], axis=-1).reshape(-1, 3).astype(np.float32)
    first = 4 * np.arange(SQUARES)[:, None]
    triangles = (first + np.array([0, 1, 2, 0, 2, 3])).reshape(-1, 3).astype(np.int32)
    mesh = Soup(positions, triangles, np.repeat(_colours(SQUARES), 4, axis=0))
    return {"color": painted(mesh, pg.target("color", "rgba32f"), blend=blend)}


def _summed(count: int, over: Blend | None) -> Picture:
    """Return the last color of each pixel, or its colors blended in order."""
    picture = np.zeros((SMALL[1], SMALL[0], 4), np.float32)
    for (column, row), colour in zip(_places(count), _colours(count), strict=True):
        picture[row, column] = colour + (0 if over is None else picture[row, column] * (1 - colour[3]))
    return picture


def discarding() -> Mapping[str, pg.Target]:
    """Test that discarded fragments leave the depth unchanged; the next draw shows it."""
    color = painted(soup(12, 5), pg.target("color", "rgba32f"), depth=pg.target("depth", "depth32f"), name="base")
    holes = painted(soup(24, 11), color, depth=color.depth, fragment="holes", name="holes")
    behind = painted(quad(0.5, (1, 0, 0, 1)), holes, depth=holes.depth, name="behind")
    return {"color": behind, "depth": behind.depth}


def _behind(state: Mapping[str, Any]) -> Mapping[str, pg.Target]:
    """Draw in a state, then draw plainly with a new depth target; a last draw tests that target's clears."""
    first = painted(
        quad(0.5, (5, 6, 7, 8)),
        pg.target("color", "rgba32f"),
        depth=pg.target("first depth", STENCIL_DEPTH),
        name="first",
        **state,
    )
    plain = painted(
        quad(color=_PLAIN), first, depth=pg.target("depth", STENCIL_DEPTH), clear_stencil=0xA5, name="plain"
    )
    mark = quad(0.5, (9, 9, 9, 9))
    marked = painted(
        mark, plain, depth=plain.depth, depth_compare="always", depth_write=False, stencil=Stencil("equal", 0xA5),
        name="mark",
    )  # fmt: skip
    copy = pg.kernel(source="def copy(a: Image) -> vec4: return a[0, 0]")
    return {"plain": copy(plain, into=pg.target("plain", "rgba32f")), "depth": plain.depth, "marked": marked}


def _counted(stencil: Stencil, start: int, end: int) -> Mapping[str, pg.Target]:
    """Draw where the stencil holds the expected value."""
    one = quad()
    thrice = Soup(one.positions, np.tile(one.triangles, (3, 1)), one.colors)
    depth = pg.target("depth", "depth32f_stencil8")
    counted = painted(
        thrice, pg.target("color", "rgba32f"), depth=depth, stencil=stencil, clear_stencil=start,
        depth_compare="always", name="counted",
    )  # fmt: skip
    test = Stencil("equal", reference=end)
    mark = quad(color=(2, 2, 2, 2))
    return {"color": painted(mark, counted, depth=counted.depth, stencil=test, depth_compare="always", name="mark")}


def _opaque(form: str, blend: Blend) -> Mapping[str, pg.Target]:
    """A target without alpha counts as opaque, before and after a draw."""
    fragment = ("one", "two", "three")[len(form) - 4]
    base = painted(quad(color=(3, 3, 3, 0.5)), pg.target("color", form), fragment=fragment, name="base")
    return {"color": painted(quad(color=(5, 5, 5, 0.5)), base, fragment=fragment, blend=blend, name="over")}


def _offset(units: float, stencil: Stencil | None) -> Mapping[str, pg.Target]:
    """Test that depth stays within [0, 1] under an offset of several times that range."""
    color = painted(
        quad(), pg.target("color", "rgba8"), depth=pg.target("depth", STENCIL_DEPTH), depth_compare="always",
        polygon_offset=(0.0, units), stencil=stencil,
    )  # fmt: skip
    return {"depth": color.depth, "color": color}


def _product(form: str, number: float) -> Mapping[str, pg.Target]:
    """Blend into a target that holds at most 1: the blended value is clamped too."""
    base = painted(quad(color=(number,) * 4), pg.target("color", form), name="base")
    return {"color": painted(quad(color=_BEYOND), base, blend=Blend("destination_color", "zero"), name="over")}


def pictures() -> Mapping[str, pg.Target]:
    """Read two pictures in another order than they are passed, and use parameters in both stages."""
    color = pg.draw(
        quad(half=2.0, color=(1, 2, 3, 4)), vertex=pg.vertex(source=KERNELS, name="place"),
        fragment=pg.fragment(source=KERNELS, name="mixed"), into=pg.target("color", "rgba32f"), name="mixed",
        far=pg.Input("far"), near=pg.Input("near"), gain=100.0, shift=(0.25, -0.5), height=0.5,
    )  # fmt: skip
    return {"color": color}


#: Columns and rows of points, in pixels from the bottom left, and colors.
_CLOUD = np.array(
    [[[0, 0, 3, 1], [5, 2, 4, 2], [15, 7, 5, 3]], [[7, 3, 6, 4], [5, 2, 7, 5], [-9, 0, 8, 6]]], np.float32
)


def scatter() -> Mapping[str, pg.Target]:
    """Draw points at positions that a vertex kernel reads from a picture; both stages read it, fragments read a second
    one."""
    color = pg.draw(
        points(_CLOUD.shape[0] * _CLOUD.shape[1]), vertex=pg.vertex(source=KERNELS, name="scattered"),
        fragment=pg.fragment(source=KERNELS, name="beside_cloud"), into=pg.target("color", "rgba32f"), name="scatter",
        cloud=pg.Input("cloud"), far=pg.Input("far", "rgba16f"), gain=9.0,
    )  # fmt: skip
    return {"color": color}


def _scattered(far: Picture) -> Picture:
    expected = np.zeros((SMALL[1], SMALL[0], 4), np.float32)
    for number, (x, y, blue, alpha) in enumerate(_CLOUD.reshape(-1, 4)):
        if x >= 0:
            row, column = SMALL[1] - 1 - int(y), int(x)
            expected[row, column] = far[row, column] + np.array([blue, number, alpha, 9 + far[0, 0, 0]])
    return expected


def _pictured(far: Picture, near: Picture) -> Picture:
    moved = near[:, np.maximum(np.arange(near.shape[1]) - 1, 0)]
    expected: Picture = moved * 10.0 + far.transpose(1, 0, 2) * 100.0 + np.array([1, 2, 3, 4], np.float32)
    return expected


class _Dressed:
    """A square with every attribute, the same at all corners."""

    positions = quad(half=2.0).positions
    triangles = quad().triangles
    normals = np.tile(np.array([1, 2, 3], np.float32), (4, 1))
    uvs = np.tile(np.array([4, 5], np.float32), (4, 1))
    colors = np.tile(np.array([6, 7, 8, 9], np.float32), (4, 1))
    tangents = np.tile(np.array([10, 11, 12, 13], np.float32), (4, 1))


def attributes() -> Mapping[str, pg.Target]:
    """Pass thirteen scalars from vertex to fragment kernel."""
    names = ("normal and uv", "color", "tangent")
    kernels: dict[str, Any] = {
        "vertex": pg.vertex(source=KERNELS, name="every"),
        "fragment": pg.fragment(source=KERNELS, name="shown"),
    }
    targets = pg.draw(_Dressed(), into=tuple(pg.target(name, "rgba32f") for name in names), **kernels)
    return dict(zip(names, targets, strict=True))
