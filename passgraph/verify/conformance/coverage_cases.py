"""Coverage of triangles: each pixel of a closed surface is covered exactly once, for triangles of any shape.

Triangles are counted by adding 1 for each; sums of ones are exact, so most cases have an exact expected result.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.verify.conformance.case import Case, Picture
from passgraph.verify.conformance.case_inputs import Soup, quad, soup, soup_of
from passgraph.verify.conformance.draw_state_cases import over, painted

GROUP = "coverage"
SIZE = (83, 61)
#: A pixel, a column, a row, a tile, and slightly more than a tile.
SIZES = ((1, 1), (1, 7), (65, 1), (64, 64), (129, 3))
#: The rasterizer's guard band (rule 1 of docs/rasterization.md).
GUARD = 8.0


def counted(mesh: Soup, **state: Any) -> Mapping[str, pg.Target]:
    """Count the hits of each pixel, in all channels."""
    return {"hits": painted(mesh, pg.target("hits", "rgba32f"), blend="add", **state)}


def cases() -> Iterator[Case]:
    """Shared edges, slivers, clipping, huge and degenerate triangles."""
    yield from _hit_once()
    yield from _edges_on_centres()
    yield from _clipped()
    yield from _nothing()
    for size in SIZES:
        name = f"size {size[0]}x{size[1]}"
        yield Case(GROUP, name, partial(counted, quad(color=(1, 0.5, 0.25, 1))), size, exact={"hits": _quad_color()})
    half = np.zeros((8, 8, 4), np.float32)
    half[:4] = 1.0
    top = soup_of([[-1, 0, 0], [1, 0, 0], [1, 1, 0], [-1, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    yield Case(GROUP, "row 0 is on top", partial(counted, top, cull="back"), (8, 8), exact={"hits": half})


def _quad_color() -> NDArray[np.float32]:
    return np.array([1, 0.5, 0.25, 1], np.float32)


def _hit_once() -> Iterator[Case]:
    for name, mesh in (
        ("quad", quad()),
        ("fan", fan(400, (0.013, -0.021))),
        # The fan's center lies on a pixel center, and eight of its edges run through pixel centers.
        ("fan on a centre", fan(64, (1 / 83, 1 / 61))),
        ("grid", grid(9, 7, 0.03)),
        ("slivers", slivers(500)),
        ("huge fan", fan(24, (0.1, 0.2), 1e5)),
        ("huge quad", quad(half=1e7)),
        ("leaning floor", leaning_floor()),
    ):
        yield Case(GROUP, f"{name}, every pixel once", partial(counted, mesh), SIZE, exact={"hits": 1.0})


def _edges_on_centres() -> Iterator[Case]:
    # In a picture of 16 x 16 pixels centers lie at odd multiples of 1/16 in clip space.
    step = 1.0 / 16.0
    low, high = -5 * step, 5 * step
    square = [[low, low, 0], [high, low, 0], [high, high, 0], [low, high, 0]]
    rows, columns = np.mgrid[0:16, 0:16]
    # Row r has its center at y = (15 - 2 r) / 16: the top edge is row 5's, the left edge column 5's.
    inside = (rows >= 5) & (rows < 10) & (columns >= 5) & (columns < 10)
    for name, order in (("one diagonal", [[0, 1, 2], [0, 2, 3]]), ("the other", [[0, 1, 3], [1, 2, 3]])):
        for turn in (1, -1):
            triangles = [t[::turn] for t in order]
            yield Case(
                GROUP,
                f"edges on centres, {name}, {'front' if turn > 0 else 'back'}",
                partial(counted, soup_of(square, triangles)),
                (16, 16),
                exact={"hits": spread(inside)},
            )
    spokes = fan(8, (step, step), 4.0, first=0.0)
    yield Case(GROUP, "spokes on centres", partial(counted, spokes), (16, 16), exact={"hits": 1.0})


def spread(hits: NDArray[Any]) -> Picture:
    """Repeat (h, w) in four channels."""
    return np.repeat(hits.astype(np.float32)[:, :, None], 4, axis=2)


def _clipped() -> Iterator[Case]:
    yield Case(GROUP, "through the eye", partial(over, soup(16, 4, 3.0, (-3.0, 3.0)), vertex="lean"), SIZE)
    yield Case(GROUP, "beyond near and far", partial(over, soup(24, 8, 0.8, (-4.0, 4.0))), SIZE)
    for reach in (0.99 * GUARD, 1.01 * GUARD, 1e3):
        mesh = soup_of([[-reach, -reach, 0.2], [reach, -reach, 0.4], [0.1, reach, -0.3]], [[0, 1, 2]], np.eye(4)[:3])
        yield Case(GROUP, f"one triangle reaches to {reach:g}", partial(over, mesh), SIZE)
    # w = 1.5 + x: at x = -1.5 a vertex is at the eye, beyond it behind.
    for x in (-1.4, -1.5, -1.6, -4.0):
        mesh = soup_of([[x, -0.6, 0.1], [0.9, -0.7, 0.2], [0.7, 0.9, -0.1]], [[0, 1, 2]], np.eye(4)[:3])
        yield Case(GROUP, f"a vertex at w = {1.5 + x:g}", partial(over, mesh, vertex="lean"), SIZE)
    behind = soup_of([[-1.6, -0.6, 0.1], [-3.0, -0.7, 0.2], [-2.0, 0.9, -0.1]], [[0, 1, 2]])
    yield Case(GROUP, "all behind the eye", partial(counted, behind, vertex="lean"), SIZE, exact={"hits": 0.0})


def _nothing() -> Iterator[Case]:
    point = soup_of(np.zeros((3, 3)), [[0, 1, 2], [0, 0, 1]])
    line = soup_of([[-0.9, -0.9, 0], [0.9, 0.9, 0], [0.1, 0.1, 0]], [[0, 1, 2], [0, 1, 1]])
    outside = soup_of([[2, 2, 0], [3, 2, 0], [2, 3, 0], [0, 0, 2], [0.5, 0, 2], [0, 0.5, 2]], [[0, 1, 2], [3, 4, 5]])
    # Between the centers of an 8 x 8 picture.
    small = soup_of([[0.01, 0.01, 0], [0.1, 0.01, 0], [0.01, 0.1, 0]], [[0, 1, 2]])
    for name, mesh in (("point", point), ("line", line), ("outside", outside), ("between centres", small)):
        yield Case(GROUP, f"{name}, nothing drawn", partial(counted, mesh), (8, 8), exact={"hits": 0.0})
    culled = partial(counted, quad(), cull="front")
    yield Case(GROUP, "all culled", culled, (8, 8), exact={"hits": 0.0})
    yield Case(GROUP, "one pixel hit by many", partial(counted, same(50)), (8, 8), exact={"hits": 50.0})


def same(count: int) -> Soup:
    """Return one square several times: the result depends on their number, not on their order."""
    one = quad()
    return Soup(one.positions, np.tile(one.triangles, (count, 1)), one.colors)


def fan(count: int, middle: tuple[float, float], reach: float = 3.0, first: float | None = None) -> Soup:
    """Return thin triangles around a point inside the picture; ``first`` spaces them evenly from that angle on."""
    random = np.random.default_rng(count)
    angles = np.sort(random.uniform(0, 2 * np.pi, count))
    if first is not None:
        angles = first + 2 * np.pi * np.arange(count) / count
    rim = np.stack([np.cos(angles) * reach, np.sin(angles) * reach, np.zeros_like(angles)], -1)
    if first is not None:  # on a square, so that the edges run exactly along rows, columns and diagonals
        rim = np.rint(rim / np.abs(rim).max(axis=1, keepdims=True) * reach)
    rim[:, :2] += middle
    k = np.arange(count)
    return soup_of([[*middle, 0.0], *rim], np.stack([np.zeros_like(k), 1 + k, 1 + (k + 1) % count], -1))


def grid(columns: int, rows: int, jitter: float) -> Soup:
    """Return a grid larger than the picture, its inner vertices displaced a little."""
    random = np.random.default_rng(1)
    x, y = np.meshgrid(np.linspace(-1.1, 1.1, columns), np.linspace(-1.1, 1.1, rows))
    points = np.stack([x, y, np.zeros_like(x)], -1)
    points[1:-1, 1:-1, :2] += random.uniform(-jitter, jitter, (rows - 2, columns - 2, 2))
    at = np.arange(rows * columns).reshape(rows, columns)
    corners = [at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]]
    a, b, c, d = (corner.ravel() for corner in corners)
    return soup_of(points, np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]))


def slivers(count: int) -> Soup:
    """Return strips far thinner than a pixel, side by side over the whole picture."""
    x = np.sort(np.concatenate([[-1.1, 1.1], np.random.default_rng(2).uniform(-1.1, 1.1, count)]))
    low = np.stack([x, np.full_like(x, -1.1), np.zeros_like(x)], -1)
    high = np.stack([x + 0.05 * np.sin(40 * x), np.full_like(x, 1.1), np.zeros_like(x)], -1)
    high[[0, -1], 0] = low[[0, -1], 0]
    high[:, 0] = np.sort(high[:, 0])
    k = np.arange(len(x) - 1)
    n = len(x)
    return soup_of(
        np.concatenate([low, high]),
        np.concatenate([np.stack([k, k + 1, n + k + 1], -1), np.stack([k, n + k + 1, n + k], -1)]),
    )


def leaning_floor() -> Soup:
    """Return a grid that lies half behind the eye, so that clipped edges are shared too."""
    return grid(24, 6, 0.02)
