"""Derivatives over quads; numbers are whole, so every difference is exact.

A draw computes its pixel position from perspective-correct varyings; helper pixels next to a triangle reveal theirs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.verify.conformance.case import Case, Picture, graph_of, whole_numbers

GROUP = "derivatives"
SIZE = (23, 17)


def _grown(values: Callable[[int, int], NDArray[Any]], axis: int) -> NDArray[Any]:
    """Return the odd pixel's value minus the even one's; ``values`` takes the bits to change in x and y."""
    bits = (1 - axis, axis)
    here, there = values(0, 0), values(*bits)
    odd = np.indices(here.shape[:2])[1 - axis] % 2 == 1
    return np.asarray(np.where(odd[..., None], here - there, there - here))


def _of_all(a: Picture, x: NDArray[Any], y: NDArray[Any]) -> NDArray[Any]:
    return _each(lambda x_bit, y_bit: _chosen(a, x ^ x_bit, y ^ y_bit))


def _chosen(a: Picture, across: NDArray[Any], down: NDArray[Any]) -> NDArray[Any]:
    """Return the values that pixels compute, with branches that depend on the pixel."""

    def at(dx: int, dy: int) -> Picture:
        inside: Picture = a[np.clip(down + dy, 0, a.shape[0] - 1), np.clip(across + dx, 0, a.shape[1] - 1)]
        return inside

    t = at(0, 0)
    v = np.where(t[..., :1] > 3, t[..., [1, 2, 3, 0]] + at(1, -1), t * (across + 3 * down)[..., None])
    for _ in range(5):
        v = np.where(v[..., 1:2] > 20, v, v + t[..., [3, 2, 1, 0]])
    return v


def _each(value: Callable[[int, int], NDArray[Any]]) -> NDArray[Any]:
    """Return one derivative of each channel."""
    across, down = _grown(value, 0), _grown(value, 1)
    both = _grown(lambda x_bit, y_bit: _grown(lambda bit, _: value(bit ^ x_bit, y_bit), 0), 1)
    parts = (across[..., 0], down[..., 1], abs(across[..., 2]) + abs(down[..., 2]), both[..., 3])
    return np.stack(parts, axis=-1)


def _in_a_loop(a: Picture, x: NDArray[Any], y: NDArray[Any]) -> NDArray[Any]:
    """Compute the result of a loop: both pixels of a difference follow this pixel's control flow, with their own
    values."""

    def at(columns: NDArray[Any]) -> Picture:
        inside: Picture = a[y, np.clip(columns, 0, a.shape[1] - 1)]
        return inside

    here, there, total = at(x), at(x ^ 1), np.zeros(a.shape)
    left = np.zeros(x.shape, np.bool_)
    for i in range(3):
        left = left | (here[..., 0] > 9)
        goes = (~left & (y % 3 != i))[..., None]
        here, there = here + goes * at(x + i), there + goes * at((x ^ 1) + i)
        total = total + goes * np.where((x % 2 == 1)[..., None], here - there, there - here)
    return total


#: Name → kernel, and a function that computes its result from the picture (h, w, 4) and its columns and rows.
KERNELS: dict[str, tuple[str, Callable[[Picture, NDArray[Any], NDArray[Any]], NDArray[Any]]]] = {
    "of what pixels choose": (
        """
def run(color: Image) -> vec4:
    t = color[0, 0]
    v = t * float(pixel().x + 3 * pixel().y)
    if t.x > 3.0:
        v = t.yzwx + color[1, -1]
    for i in range(5):
        if v.y > 20.0:
            break
        v += t.wzyx
    return vec4(dfdx(v.x), dfdy(v.y), fwidth(v.z), dfdy(dfdx(v.w)))
""",
        _of_all,
    ),
    "in a loop": (
        """
def run(color: Image) -> vec4:
    v, total = color[0, 0], vec4(0.0)
    for i in range(3):
        if v.x > 9.0:
            break
        if pixel().y % 3 != i:
            v += color[i, 0]
            total += dfdx(v)
    return total
""",
        _in_a_loop,
    ),
}

#: Pixel positions are passed multiplied by w, and w too; the ratio of the interpolated values is the pixel position.
#: Depth and 1 / w are planes that also determine column and row.
DRAWN = """
class Seen:
    position: vec4
    at: vec2
    w: float

def place(vertex: Vertex) -> Seen:
    w, size = vertex.uv.x, vec2(output_size())
    at = (vertex.position.xy * vec2(0.5, -0.5) + 0.5) * size
    return Seen(vec4(vertex.position, 1.0) * w, at * w, w)

def run(seen: Seen, color: Image) -> vec4:
    p = ivec2(floor(seen.at / seen.w))
    deep, near = round(fragment_depth() * 256.0 - 68.5), round(128.0 / seen.w - 17.5)
    t = color.texel(p)
    v = t * float(p.x + 3 * p.y)
    if t.x > 3.0:
        v = t.yzwx + color.texel(p + ivec2(1, -1))
    for i in range(5):
        if v.y > 20.0:
            break
        v += t.wzyx
    return vec4(dfdx(v.x + deep * deep), dfdy(v.y * deep), fwidth(v.z + near * near), dfdy(dfdx(v.w)))
"""
#: Distance in pixels of the drawn square from the edges of the picture.
MARGIN = (2, 1)


def _drawn(a: Picture, x: NDArray[Any], y: NDArray[Any]) -> NDArray[Any]:
    """Compute :data:`DRAWN`; zeros where there is no triangle."""

    def value(x_bit: int, y_bit: int) -> NDArray[Any]:
        across, down = x ^ x_bit, y ^ y_bit
        (r, g, b, alpha), deep, near = (
            np.moveaxis(_chosen(a, across, down), -1, 0),
            across + 8.0 * down,
            across + 2.0 * down,
        )
        return np.stack([r + deep * deep, g * deep, b + near * near, alpha], axis=-1)

    inside = (abs(x - (SIZE[0] - 1) / 2) < SIZE[0] / 2 - MARGIN[0]) & (
        abs(y - (SIZE[1] - 1) / 2) < SIZE[1] / 2 - MARGIN[1]
    )
    return np.where(inside[..., None], _each(value), 0.0)


def _square() -> pg.Mesh:
    """Return two triangles; depth grows by 1/256 a column and 8/256 a row, 1 / w by 1/128 and 2/128."""
    across, down = (np.array([m, size - m]) for m, size in zip(MARGIN, SIZE, strict=True))
    at = np.array([(x, y) for y in down for x in across], np.float64)
    depth = (at @ [1.0, 8.0] + 64.0) / 256.0
    places = at / SIZE * [2.0, -2.0] + [-1.0, 1.0]
    return pg.Mesh.make(
        np.column_stack([places, 2.0 * depth - 1.0]),
        [[0, 1, 2], [2, 1, 3]],
        uvs=np.column_stack([128.0 / (at @ [1.0, 2.0] + 16.0), np.zeros(4)]),
    )


def cases() -> Iterator[Case]:
    """Yield each kernel with its expected result; width and height are odd."""
    y, x = np.mgrid[0 : SIZE[1], 0 : SIZE[0]]
    picture = whole_numbers(SIZE, 9)
    for name, (text, expected) in KERNELS.items():
        exact = {"result0": np.asarray(expected(picture, x, y), np.float32)}
        yield Case(GROUP, name, partial(graph_of, text), SIZE, ({"color": picture},), exact=exact)
    exact = {"result0": np.asarray(_drawn(picture, x, y), np.float32)}
    yield Case(GROUP, "beside a triangle", _draw, SIZE, ({"color": picture},), exact=exact)


def _draw() -> Mapping[str, pg.Target]:
    place, run = pg.vertex(source=DRAWN, name="place"), pg.fragment(source=DRAWN, name="run")
    images = {"color": pg.Input("color")}
    into = pg.target("result0", "rgba32f")
    return {"result0": pg.draw(_square(), vertex=place, fragment=run, into=into, values=images)}
