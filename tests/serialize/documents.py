"""Graphs that travel, and ways to spoil a document, for tests."""

from __future__ import annotations

import copy
import pickle
import random
from types import SimpleNamespace
from typing import Any

import numpy as np

import passgraph as pg

SMOOTH = """
@struct
class Light:
    place: vec2
    colors: Array[vec3, 2]

@struct
class Layer:
    picture: Image
    taps: Array[Array[vec2, 2], 2]
    others: Array[Image, 2]

def layered(layers: Array[Layer, 2], skew: mat2x3, grid: Array[Array[int, 2], 3]) -> vec4:
    x = pixel().x
    tap = layers[x].taps[grid[x][1]][x]
    return layers[x].picture[0, 0] + layers[x].others[x - 1].texel(ivec2(x, 0)) + vec4(skew * tap, tap.y)

def smooth(color: Image, dim: Image, light: Light, turn: mat2, taps: Const[int], weights: Array[float, 3]) -> vec4:
    total = vec4(0.0)
    for i in range(taps):
        if i == 5:
            break
        total = total + color[i - 1, 0] * weights[i]
    shift = turn * (uv() - light.place)
    if shift.x > 0.25:
        total = total + dim.sample(shift) + dim.gather(shift, 1) + dim.sample3(vec3(shift, 0.5)) + color.nearest(shift)
    else:
        total = vec4(total.rgb + light.colors[int(shift.y * 2.0)], 1.0)
    total = total + color.sample(shift, 0.7) + color.texel(pixel(), 1) + vec4(float(color.size_of(2).x))
    return total if dim.size.x > 1 else -total
"""


class Light:
    """What a struct parameter is given on the host."""

    place = (0.25, -0.0)
    colors = ((0.5, 0.25, 0.0), (1.0, float("inf"), 0.5))


def graph() -> dict[str, pg.Target]:
    """A graph with every kind of thing that travels: history, two results, sizes of others, run values, a draw."""
    frame, dim = pg.Input("frame"), pg.Input("dim", "r8", (4, 2), static=True, border="mirror", default=_ramp())
    split = pg.kernel(source="def split(a: Image) -> tuple[vec4, float]: return a[0, 0], a[0, 0].r")
    small = pg.target("small", "rgba16f", like=frame, scale=(0.5, 0.75), notes=("half as large",))
    whole, red = split(frame, into=(pg.target("whole", "rgba32f"), pg.target("red", "r32f")), name="split")
    smooth, layered = pg.kernel(source=SMOOTH), pg.kernel(source=SMOOTH, name="layered")
    whole, dim = whole.filter("nearest").mipmaps(), dim.slices(2)
    smoothed = smooth(whole, dim, Light(), ((1.0, 2.0), (3.0, 4.0)), 3, (0.25, 0.5, 0.25), name="smooth")
    blend = pg.kernel(
        source="def blend(a: Image, b: Image, k: float, n: int) -> vec4: return a[0, 0] * k + b[0, 0] * float(n)"
    )
    into = pg.target("trail", "rgba16f")
    share = pg.Value("share", float, default=0.5)
    trail = blend(
        smoothed, pg.previous(into).border("zero"), share, pg.Value("count", int, static=True, default=1), into=into
    )
    shrink = pg.kernel(
        source="def shrink(a: Image, size: ivec2) -> vec4: return a.sample(uv()) * float(size.x)", known_sizes=True
    )
    made = shrink(trail, pg.OUTPUT_SIZE, into=small)
    taps = (np.arange(8.0).reshape(2, 2, 2), ((1, 2), (3, 4)), ((5, 6), (7, 8)))
    layers = [
        SimpleNamespace(picture=whole, taps=taps[0], others=[dim, whole]),
        SimpleNamespace(picture=smoothed, taps=taps[1:], others=(smoothed, dim)),
    ]
    layer = layered(layers, ((1, 2), (3, 4), (5, 6)), [[1, 0], [0, 1], (2, 3)])
    return {
        "layer": layer,
        "trail": trail,
        "first": made,
        "red": red,
        "drawn": _draw(whole),
        "depth": _draw(whole).depth,
    }


def _ramp() -> Any:
    import numpy as np

    return np.arange(8, dtype=np.uint8).reshape(2, 4, 1)


_CACHE: list[pg.Target] = []


def _draw(picture: pg.Target) -> pg.Target:
    """A triangle over another one, blended, with depth and stencil; some fragments are discarded."""
    import numpy as np

    if not _CACHE or _CACHE[0] is not picture:
        text = """
@struct
class Sent:
    position: vec4
    shade: float

def place(vertex: Vertex, shift: vec2, picture: Image) -> Sent:
    bent = shift * picture.sample(vertex.uv, 0.5).r + picture.texel(ivec2(1, 2)).g
    return Sent(vec4(vertex.position.xy + bent, vertex.position.z, 1.0), vertex.uv.x)

def paint(sent: Sent, picture: Image, tint: vec4) -> vec4:
    if sent.shade > 0.9:
        discard()
    return picture.texel(pixel()) * tint * sent.shade if front_facing() else tint
"""
        mesh = pg.Mesh.make(
            positions=np.array([(-1, -1, 0), (1, -1, 0.5), (-1, 1, 0.25)], np.float32), triangles=np.array([(0, 1, 2)]),
            uvs=np.array([(0, 0), (1, 0), (0.5, 1)], np.float32),
        )  # fmt: skip
        depth = pg.target("z", "depth32f_stencil8", scale=1.0)
        given = {
            "vertex": pg.vertex(source=text, name="place"), "fragment": pg.fragment(source=text, name="paint"),
            "values": {"shift": (0.125, 0.0), "picture": picture, "tint": (1.0, 0.5, 0.25, 1.0)},
        }  # fmt: skip
        first = pg.draw(
            mesh, into=pg.target("drawn", "rgba16f", scale=1.0, clear=0.5), depth=depth, name="one", **given
        )
        given["values"] = {**given["values"], "shift": pg.Value("shift", pg.vec2, default=(0.0, 0.25))}
        stencil = pg.Stencil("less_equal", 0, passed="increment")
        again = pg.draw(
            mesh, into=first, depth=first.depth, blend="alpha", stencil=stencil, color_mask=(True, True, False, True),
            polygon_offset=(0.0, 1.0), depth_compare="less_equal", name="two", **given,
        )  # fmt: skip
        _CACHE[:] = [picture, again]
    return _CACHE[1]


#: What a part of a document becomes.
WRONG: tuple[Any, ...] = (
    None, True, False, 0, 1, -1, 2, 7, 255, 2**31, -(2**63), 10**400, 0.5, -0.0, float("nan"), float("inf"), 1e300, "",
    "x", "vec4", "Image", "add", "pixel", "position", "a\n#error b", "\ud800", "x" * 20_000, [], [0], [[]], {},
    {"value": 0}, {"value": "output_size"}, {"float": "7ff8000000000000"}, {"float": "zz"}, {"fields": []},
)  # fmt: skip


def places(part: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """The way to every part of a document."""
    found = [path] if path else []
    for key, inner in part.items() if isinstance(part, dict) else enumerate(part) if isinstance(part, list) else ():
        found += places(inner, (*path, key))
    return found


def spoiled(document: Any, ways: list[tuple[Any, ...]], chance: random.Random) -> Any:
    """The document with one to three parts changed, left out, doubled or exchanged."""
    made = pickle.loads(pickle.dumps(document))  # a quarter of the time of a deep copy
    for _ in range(chance.choice((1, 1, 1, 2, 3))):
        *path, last = chance.choice(ways)
        holder = _at(made, path)
        if holder is None or last not in (holder if isinstance(holder, dict) else range(len(holder))):
            continue
        action = chance.randrange(7)
        if action == 0:
            del holder[last]
        elif action == 1:
            other = _at(made, chance.choice(ways))
            holder[last] = copy.deepcopy(other)
        elif action == 2 and isinstance(holder, list):
            holder.insert(last, copy.deepcopy(holder[last]))
        elif action == 3 and isinstance(holder[last], int) and not isinstance(holder[last], bool):
            holder[last] += chance.choice((-2, -1, 1, 2))
        elif action == 6 and isinstance(holder[last], str) and holder[last]:
            holder[last] = _spoiled_text(holder[last], chance)
        elif action == 4 and isinstance(holder, dict):
            holder["more"] = chance.choice(WRONG)
        else:
            holder[last] = copy.deepcopy(chance.choice(WRONG))
    return made


def _spoiled_text(text: str, chance: random.Random) -> str:
    """The text with a stretch of it left out, doubled, or in the place of another one."""
    start, size = chance.randrange(len(text)), chance.choice((1, 1, 2, 5, 20))
    piece, rest = text[start : start + size], text[start + size :]
    return text[:start] + chance.choice(("", 2 * piece, chance.choice('()[]:.,*-0x\n "#'), rest[:size])) + rest


def _at(document: Any, path: Any) -> Any:
    for key in path:
        known = range(len(document)) if isinstance(document, list) else document if isinstance(document, dict) else ()
        if key not in known:
            return None
        document = document[key]
    return document if isinstance(document, (dict, list)) else None
