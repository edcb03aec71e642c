"""Tables of the lights that reach each tile of a picture, and of the edges that may occlude them; built on the host."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.effects.checked import checked
from passgraph.effects.light2d.penumbra import ROW_BITS, tile_light
from passgraph.effects.light2d.world import (
    Float64,
    Light2D,
    Outlines,
    Point,
    Wall,
    Window,
    distance_to_edges,
    outlines_of,
)
from passgraph.effects.quantities import Color
from passgraph.language import vec4

#: Most loop iterations of a kernel; walking through edges takes lights · (2 · edges + 1) · edges.
TRIPS = 1 << 16


def most_edges(lights: int) -> int:
    """Return the most edges that may occlude each light of a tile in one pass.

    >>> [most_edges(lights) for lights in (1, 31, 64)]
    [180, 32, 22]
    """
    return int((-1.0 + sqrt(1.0 + 8.0 * TRIPS / lights)) / 4.0)


#: Most lights with edges in front of them in one tile, for passes with many lights and for those with many edges.
LAYERS = (31, 1)
#: Rows of 1024 texels: the largest picture that every common OpenGL 3.3 driver supports.
MAX_TABLE_ROWS = 1 << 14
#: Most lights without edges in front of them in one tile.
MOST_OPEN = 4096
#: Most pairs of a tile and an edge compared for all lights together: some tens of seconds.
MAX_COMPARED = 1 << 28
#: Pairs compared at a time: some 20 arrays of doubles of this length are in memory.
COMPARED_AT_ONCE = 1 << 18


@dataclass(frozen=True, eq=False)
class TileTables:
    """The tables that `tile_light` reads.

    Attributes
    ----------
    tiles : for each pass, (rows, columns, 3): start of a tile's list, numbers of its unoccluded and its shaded lights
    layers : for each pass, the most lights with edges in front of them in one tile
    bounds : for each pass, upper bounds of any tile's unoccluded lights, shaded lights, edges in front of one
    table : (rows, 1024, 4), lights and edges
    """

    tiles: tuple[NDArray[np.float32], ...]
    layers: tuple[int, ...]
    bounds: tuple[tuple[int, int, int], ...]
    table: NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class _Pairs:
    """One row for each tile that a light reaches."""

    tile: NDArray[np.int64]
    light: NDArray[np.int64]
    count: NDArray[np.int64]  # edges that may be between
    edges: NDArray[np.int64]  # edges of all rows, one after another


def tile_tables(
    window: Window,
    lights: Sequence[Light2D],
    walls: Sequence[Wall],
    size: tuple[int, int],
    side: int,
    layers: tuple[int, ...] = LAYERS,
) -> TileTables:
    """Return lists for every tile of ``side`` × ``side`` pixels.

    An edge is in a tile's list if it meets the hull of the tile's circle and the lamp: only such an edge can be between
    a pixel of the tile and a point of the lamp.
    """
    outlines = outlines_of(walls)
    columns, rows = (size[0] + side - 1) // side, (size[1] + side - 1) // side
    found: list[_Pairs] = []
    compared, texels = 0, 0
    for which, light in enumerate(lights):
        reach = _reach(window, light, outlines, size, side)
        compared += int(reach.tile.size * reach.near.size)
        _check_work(compared, which + 1, len(outlines.edges))
        found.append(_reached(light, which, outlines, reach))
        # each light is checked before the next one costs anything
        _check_most(int(found[-1].count.max(initial=0)), most_edges(layers[-1]), side)
        texels += _texels(found[-1])
        _check_table(texels)
    pairs = _joined(found)
    kind = np.where(pairs.count <= most_edges(layers[0]), 0, len(layers) - 1)
    shaded = pairs.count > 0
    # the rank of a row among those of its kind in its tile decides the pass
    rank = _rank(pairs.tile * 4 + kind * 2 + shaded)
    layer = np.where(shaded, rank // np.array(layers)[kind], 0) * len(layers) + kind
    order = np.lexsort((shaded, pairs.tile, layer))
    starts = _table_starts(pairs, order)
    table = _table(pairs, starts, lights, outlines.edges)
    passes = np.unique(layer) if len(layer) else np.zeros(1, np.int64)
    tiles, bounds = [], []
    for number in passes:
        heads = np.zeros((rows * columns, 3), np.float32)
        mine = order[layer[order] == number]
        first, at = np.unique(pairs.tile[mine], return_index=True)
        heads[first, 0] = starts[mine][at]
        heads[:, 1] = np.bincount(pairs.tile[mine], ~shaded[mine], rows * columns)
        heads[:, 2] = np.bincount(pairs.tile[mine], shaded[mine], rows * columns)
        tiles.append(heads.reshape(rows, columns, 3))
        most = layers[int(number) % len(layers)]
        free, hidden, longest = (int(v) for v in (*heads[:, 1:].max(0), pairs.count[mine].max(initial=0)))
        bounds.append((_rounded(free), min(_rounded(hidden), most), min(_rounded(longest), most_edges(most))))
    layer_of_pass = tuple(layers[int(number) % len(layers)] for number in passes)
    return TileTables(tuple(tiles), layer_of_pass, tuple(bounds), table)


def _rounded(count: int) -> int:
    """Round up to a power of two, so that similar worlds share kernels."""
    return 1 << max(count - 1, 0).bit_length()


@dataclass(frozen=True, eq=False)
class _Reach:
    """The tiles that a light may reach, and the edges that may occlude it."""

    tile: NDArray[np.int64]
    middles: Float64  # (tiles, 2), world units
    around: float  # radius of a tile's circle
    near: NDArray[np.int64]


def _check_work(compared: int, lights: int, edges: int) -> None:
    if compared > MAX_COMPARED:
        raise pg.GraphError(
            f"light map: the first {lights} lights and {edges} edges make {compared} pairs of a tile and an edge in a "
            f"light's radius, and at most {MAX_COMPARED} are allowed; give lights shorter radii, take larger "
            "tiles, join walls, or choose penumbra='move'"
        )


def _check_most(edges: int, most: int, side: int) -> None:
    if edges > most:
        raise pg.GraphError(
            f"light map: {edges} edges are between one light and a tile of {side} pixels, and "
            f"at most {most} are allowed; join walls, take smaller tiles, or choose penumbra='move'"
        )


def _check_table(texels: int) -> None:
    if -(-texels // (1 << ROW_BITS)) > MAX_TABLE_ROWS:
        raise pg.GraphError(
            f"light map: the lists of its tiles take {texels} texels or more, and at most "
            f"{MAX_TABLE_ROWS << ROW_BITS} are allowed; take larger tiles"
        )


def _texels(pairs: _Pairs) -> int:
    """Return the texels of the table: two for a light, one for an edge."""
    return int((2 + pairs.count).sum())


def _reach(window: Window, light: Light2D, outlines: Outlines, size: tuple[int, int], side: int) -> _Reach:
    wide, high = (window.right - window.left) / size[0], (window.top - window.bottom) / size[1]
    columns, rows = (size[0] + side - 1) // side, (size[1] + side - 1) // side
    x = window.left + (np.arange(columns) + 0.5) * side * wide
    y = window.top - (np.arange(rows) + 0.5) * side * high
    around = 0.5 * side * float(np.hypot(wide, high))
    ways = np.hypot(x[None, :] - light.position[0], y[:, None] - light.position[1])
    tile = np.flatnonzero(ways.reshape(-1) < light.radius + around)
    middles = np.asarray(np.column_stack([x[tile % columns], y[tile // columns]]), np.float64)
    near = np.flatnonzero(distance_to_edges(light.position, outlines.edges) < light.radius)
    return _Reach(tile, middles, around, near)


def _reached(light: Light2D, number: int, outlines: Outlines, reach: _Reach) -> _Pairs:
    """Return the tiles that one light reaches, with the edges between; some tiles at a time."""
    edges, sides = outlines.edges[reach.near], _solid_sides(outlines, light.position)[reach.near]
    counts, found = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
    step = max(COMPARED_AT_ONCE // max(len(edges), 1), 1)
    for first in range(0, len(reach.tile), step):
        middles = reach.middles[first : first + step]
        between = _between(middles, reach.around, light, edges) & ~_before(middles, reach.around, edges, sides)
        counts.append(between.sum(1))
        found.append(reach.near[np.nonzero(between)[1]])
    return _Pairs(reach.tile, np.full(len(reach.tile), number), np.concatenate(counts), np.concatenate(found))


def _between(middles: Float64, around: float, light: Light2D, edges: Float64) -> NDArray[np.bool_]:
    """Return (tiles, edges): True if an edge meets the hull of a tile's circle and the lamp."""
    ax, ay, bx, by = edges.T[:, None, :]
    mx, my = middles[:, 0, None], middles[:, 1, None]
    lx, ly = light.position
    ex, ey, wx, wy = bx - ax, by - ay, lx - mx, ly - my
    # an edge that meets the hull crosses its axis, meets one of the two circles, or has an end inside
    one = (wx * (ay - my) - wy * (ax - mx)) * (wx * (by - my) - wy * (bx - mx)) <= 0.0
    two = (ex * (my - ay) - ey * (mx - ax)) * (ex * (ly - ay) - ey * (lx - ax)) <= 0.0
    found: NDArray[np.bool_] = one & two
    square = ex * ex + ey * ey
    for px, py, radius in ((mx, my, around), (lx, ly, light.size)):
        t = np.clip(((px - ax) * ex + (py - ay) * ey) / square, 0.0, 1.0)
        found |= (px - ax - t * ex) ** 2 + (py - ay - t * ey) ** 2 <= radius * radius
    square = np.maximum(wx * wx + wy * wy, 1e-300)
    # the hull's sides lean by the difference of the radii, and are farther off the axis by 1 / cos of the angle; with
    # nested circles it is inside the larger one's extent along the axis
    narrow = (light.size - around) ** 2
    apart = square > 2.0 * narrow
    wider = np.where(apart, square / np.maximum(square - narrow, 1e-300), 1.0)
    for px, py in ((ax, ay), (bx, by)):
        t = np.clip(((px - mx) * wx + (py - my) * wy) / square, 0.0, 1.0)
        limit = np.where(apart, around + (light.size - around) * t, max(around, light.size))
        found |= (px - mx - t * wx) ** 2 + (py - my - t * wy) ** 2 <= limit * limit * wider
    return found


def _solid_sides(outlines: Outlines, lamp: Point) -> NDArray[np.int64]:
    """Return `Outlines.sides`, with 0 for walls around the lamp."""
    ax, ay, bx, by = outlines.edges.T
    inside = outlines.sides * ((bx - ax) * (lamp[1] - ay) - (by - ay) * (lamp[0] - ax)) >= 0
    around = np.bincount(outlines.walls, ~inside) == 0
    return np.where(around[outlines.walls], 0, outlines.sides)


def _before(middles: Float64, around: float, edges: Float64, sides: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return (tiles, edges): True if a convex wall's edge faces all of a tile.

    The wall's other edges cover the same part of a lamp outside it, so this one can be skipped.
    """
    ax, ay, bx, by = edges.T[:, None, :]
    side = sides / np.maximum(np.hypot(bx - ax, by - ay), 1e-300)
    outside = -side * ((bx - ax) * (middles[:, 1, None] - ay) - (by - ay) * (middles[:, 0, None] - ax))
    return np.asarray((outside > around) & (sides != 0))


def _joined(parts: Sequence[_Pairs]) -> _Pairs:
    empty = np.zeros(0, np.int64)
    return _Pairs(
        *(
            np.concatenate([empty, *(getattr(part, name) for part in parts)])
            for name in ("tile", "light", "count", "edges")
        )
    )


def _rank(keys: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the rank of each key among equal ones."""
    order = np.argsort(keys, kind="stable")
    _, first, again = np.unique(keys[order], return_index=True, return_inverse=True)
    rank = np.empty(len(keys), np.int64)
    rank[order] = np.arange(len(keys)) - first[again]
    return rank


def _table_starts(pairs: _Pairs, order: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the start of each row's entry: two texels, then its edges."""
    starts = np.zeros(len(order), np.int64)
    long = 2 + pairs.count[order]
    starts[order] = np.cumsum(long) - long
    return starts


def _table(pairs: _Pairs, starts: NDArray[np.int64], lights: Sequence[Light2D], edges: Float64) -> NDArray[np.float32]:
    width = 1 << ROW_BITS
    rows = max(-(-_texels(pairs) // width), 1)
    table = np.zeros((rows * width, 4), np.float32)
    shapes = np.array([(*light.position, light.radius, light.size) for light in lights], np.float64).reshape(-1, 4)
    colors = np.array([light.color for light in lights], np.float64).reshape(-1, 3)
    table[starts] = shapes[pairs.light]
    table[starts + 1, :3] = colors[pairs.light]
    table[starts + 1, 3] = pairs.count
    before = np.cumsum(pairs.count) - pairs.count
    table[np.repeat(starts + 2 - before, pairs.count) + np.arange(len(pairs.edges))] = edges[pairs.edges]
    return table.reshape(rows, width, 4)


@pg.kernel
def flat(color: vec4) -> vec4:
    """Return one color."""
    return color


def tiled_light(
    window: Window,
    lights: Sequence[Light2D],
    walls: Sequence[Wall],
    size: tuple[int, int],
    ambient: tuple[float, float, float],
    format: str,
    side: int,
    name: str,
) -> pg.Target:
    """Compute the light of all lamps with exact soft shadows, in one pass wherever its lists allow; see `light_map`."""
    tables = tile_tables(window, lights, walls, size, side)
    table = _static(f"{name}_table", "rgba32f", tables.table)
    total = _ambient(ambient, size, name)
    for number, (tiles, bounds) in enumerate(zip(tables.tiles, tables.bounds, strict=True), 1):
        last = number == len(tables.tiles)
        label = name if last else f"{name}_layer{number}"
        total = tile_light(
            _static(f"{name}_tiles{number}", "rgb32f", tiles), table, total, _corner(window, size), side, *bounds,
            into=pg.target(label, format if last else "rgba32f", size),
        )  # fmt: skip
    return total


@dataclass(frozen=True, eq=False)
class LiveLight:
    """A light map whose lamps and walls may all move from run to run; see `live_light_map`.

    Attributes
    ----------
    target : the map
    """

    target: pg.Target
    window: Window
    size: tuple[int, int]
    tile_px: int
    shaded: int
    rows: int
    name: str

    def inputs(self, lights: Sequence[Light2D], walls: Sequence[Wall]) -> dict[str, NDArray[np.float32]]:
        """Return the inputs of a run: ``program.run(**live.inputs(lights, walls))``.

        Raises
        ------
        passgraph.GraphError
            If the tables are too small.
        """
        tables = tile_tables(self.window, lights, walls, self.size, self.tile_px, (self.shaded,))
        if len(tables.layers) > 1:
            raise pg.GraphError(
                f"{self.name}: a tile of {self.tile_px} pixels has more than {self.shaded} lights with edges in "
                "front of them; raise shaded, or take smaller tiles or shorter lights"
            )
        if len(tables.table) > self.rows:
            raise pg.GraphError(
                f"{self.name}: the lists take {tables.table.size // 4} texels, and the limit is "
                f"{self.rows << ROW_BITS}; raise room"
            )
        table = np.zeros((self.rows, 1 << ROW_BITS, 4), np.float32)
        table[: len(tables.table)] = tables.table
        return {f"{self.name}_tiles": tables.tiles[0], f"{self.name}_table": table}


@checked
def live_light_map(
    window: Window,
    size: tuple[int, int],
    room: Annotated[int, pg.Range(1 << ROW_BITS, MAX_TABLE_ROWS << ROW_BITS, "texels")] = 1 << 17,
    ambient: Color = (0.0, 0.0, 0.0),
    format: str = "rgba16f",
    tile_px: Annotated[int, pg.Range(1, 1024, "px")] = 32,
    shaded: Annotated[int, pg.Range(1, 1024)] = 31,
    name: str = "live_light",
) -> LiveLight:
    """Return an exact light map for moving lamps and walls: one pass per frame, lists computed on the host.

    Parameters
    ----------
    window, size, ambient, format, name : as in `light_map`
    room : texels for the lists: one edge, or half a light, of one tile each
    tile_px : side of a tile; smaller ones take more time on the host and less on the device
    shaded : most lights with edges in front of them in one tile; 31 may have 32 edges each, 64 have 22

    Examples
    --------
    >>> live = live_light_map(Window(0, 0, 4, 4), (8, 8), room=1024)
    >>> with pg.compile(live.target, backend="reference") as program:
    ...     red = program(**live.inputs([Light2D((2.0, 2.0), radius=4.0)], [Wall.box(3, 1, 3.5, 3)]))["live_light"]
    >>> bool(red[4, 3, 0] > 0.9), red[4, 7, 0].item()
    (True, 0.0)
    """
    rows = -(-room // (1 << ROW_BITS))
    tiles = pg.Input(f"{name}_tiles", "rgb32f", (-(-size[0] // tile_px), -(-size[1] // tile_px)))
    table = pg.Input(f"{name}_table", "rgba32f", (1 << ROW_BITS, rows))
    target = tile_light(
        tiles, table, _ambient(ambient, size, name), _corner(window, size), tile_px, MOST_OPEN, shaded,
        most_edges(shaded), into=pg.target(name, format, size),
    )  # fmt: skip
    return LiveLight(target, window, size, tile_px, shaded, rows, name)


def _corner(window: Window, size: tuple[int, int]) -> tuple[float, float, float, float]:
    """Return the upper left corner, and the step from pixel to pixel."""
    return window.left, window.top, (window.right - window.left) / size[0], (window.bottom - window.top) / size[1]


def _ambient(color: tuple[float, float, float], size: tuple[int, int], name: str) -> pg.Target:
    return flat((*color, 1.0), into=pg.target(f"{name}_ambient", "rgba32f", size))


def _static(name: str, format: str, texels: NDArray[np.float32]) -> pg.Target:
    return pg.Input(name, format, (texels.shape[1], texels.shape[0]), static=True, default=texels)
