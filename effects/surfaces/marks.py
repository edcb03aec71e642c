"""Points, lines and copies of a mesh as triangles, so that every backend draws them alike, and scattering is a draw.

`points`, `lines` and `instances` return geometry for `passgraph.draw`; `spread_point` and `spread_line` give a vertex
kernel the corners of each mark, with a size in pixels.
"""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

import passgraph as pg
from passgraph import arguments
from passgraph.graph.draw_state import FrozenGeometry, Geometry, frozen
from passgraph.language import mix, normalize, output_size, vec2, vec4

#: Corners of a mark, each once, and its two triangles.
_CORNERS = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
_TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
#: Most marks of a draw: float32 represents integers up to here.
MOST_MARKS = 1 << 22


def points(positions: ArrayLike | int, colors: ArrayLike | None = None) -> FrozenGeometry:
    """Return a square for each point, for vertex kernels that call `spread_point`.

    Parameters
    ----------
    positions
        (n, 3) numbers, or only their count: a kernel then finds them by ``vertex.instance``, in a picture for example.
    colors
        (n, 4) numbers, linear; default: white.

    Returns
    -------
    FrozenGeometry
        Four vertices per point: ``position`` and ``color`` are the point's, ``uv`` is the corner (0 or 1 in each
        direction), ``instance`` the point's index as a float.

    Raises
    ------
    passgraph.InputError
        For arrays of other shapes, and more than 4,194,304 points.

    Examples
    --------
    >>> dots = points([[0, 0, 0], [1, 0, 0]])
    >>> dots.positions.shape, dots.triangles.tolist()[-1], dots.instances[:, 0].tolist()
    ((8, 3), [4, 6, 7], [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0])
    """
    if isinstance(positions, int):
        count = arguments.whole_number(positions, "points: their number", 1, MOST_MARKS, pg.InputError)
        places = np.zeros((count, 3), np.float32)
    else:
        places = _rows(positions, 3, "points: positions")
    tints = None if colors is None else _rows(colors, 4, "points: colors", len(places))
    return _marks(len(places), positions=places, colors=tints)


def lines(starts: ArrayLike, ends: ArrayLike, colors: ArrayLike | None = None) -> FrozenGeometry:
    """Return a strip for each segment, for vertex kernels that call `spread_line`.

    Parameters
    ----------
    starts, ends
        (n, 3) numbers.
    colors
        (n, 4) numbers, linear; default: white.

    Returns
    -------
    FrozenGeometry
        Four vertices per segment: ``position`` is its start and ``normal`` its end, at all four; ``uv`` is (along,
        across), 0 or 1 each; ``instance`` the segment's index as a float.

    Raises
    ------
    passgraph.InputError
        As for `points`.

    Examples
    --------
    >>> strips = lines([[0, 0, 0]], [[1, 2, 3]])
    >>> strips.normals.tolist()[0], strips.uvs.tolist()
    ([1.0, 2.0, 3.0], [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    """
    places = _rows(starts, 3, "lines: starts")
    other_ends = _rows(ends, 3, "lines: ends", len(places))
    tints = None if colors is None else _rows(colors, 4, "lines: colors", len(places))
    return _marks(len(places), positions=places, normals=other_ends, colors=tints)


def instances(mesh: Geometry, count: int) -> FrozenGeometry:
    """Return copies of a mesh for one draw, distinguished by ``vertex.instance``, an integer from 0 as a float.

    The copies take memory; the vertex kernel looks up their differences (matrices, colors) by index, in an array
    parameter or in a picture.

    >>> from passgraph.scene import Mesh
    >>> flock = instances(Mesh.make([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]), 3)
    >>> flock.triangles.tolist(), flock.instances[:, 0].tolist()
    ([[0, 1, 2], [3, 4, 5], [6, 7, 8]], [0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0])
    """
    arguments.whole_number(count, "instances: their number", 1, MOST_MARKS, pg.InputError)
    kept = frozen(mesh)
    vertices = len(kept.positions)
    if vertices * count > 4 * MOST_MARKS:
        raise pg.InputError(f"instances: {count} copies of {vertices} vertices; at most {4 * MOST_MARKS} in a draw")
    arrays = {name: getattr(kept, name, None) for name in ("positions", "normals", "uvs", "colors", "tangents")}
    copies = {name: np.tile(array, (count, 1)) for name, array in arrays.items() if array is not None}
    numbers = np.repeat(np.arange(count, dtype=np.float32), vertices)[:, None]
    return FrozenGeometry(triangles=_shifted(kept.triangles, vertices, count), instances=numbers, **copies)


@pg.function
def spread_point(place: vec4, corner: vec2, diameter_px: float) -> vec4:
    """Return a corner of a point's square: its clip-space position, moved by half a diameter in pixels of the
    target."""
    return vec4(place.xy + (corner * 2.0 - 1.0) * diameter_px / vec2(output_size()) * place.w, place.zw)


@pg.function
def before_near(end: vec4, other: vec4) -> vec4:
    """Return an end of a segment, or its intersection with the near plane if the end is behind that."""
    inside, outside = other.z + other.w, -(end.z + end.w)
    return mix(other, end, inside / (inside + outside)) if outside > 0.0 and inside > 0.0 else end


@pg.function
def spread_line(start: vec4, end: vec4, corner: vec2, width_px: float) -> vec4:
    """Return a corner of a segment's strip, from both of its ends in clip space; ``corner`` is (along, across).

    The segment is clipped at the near plane first: a strip whose width follows w of either sign would cross itself.
    """
    first, last = before_near(start, end), before_near(end, start)
    size = vec2(output_size())
    direction = normalize((last.xy * first.w - first.xy * last.w) * size)
    across = vec2(-direction.y, direction.x)
    here = first if corner.x < 0.5 else last
    return vec4(here.xy + across * (corner.y * 2.0 - 1.0) * width_px / size * here.w, here.zw)


def _marks(count: int, **by_mark: NDArray[np.float32] | None) -> FrozenGeometry:
    """Return four vertices and two triangles per mark."""
    arrays = {name: np.repeat(rows, 4, axis=0) for name, rows in by_mark.items() if rows is not None}
    numbers = np.repeat(np.arange(count, dtype=np.float32), 4)[:, None]
    corners = np.tile(_CORNERS, (count, 1))
    return FrozenGeometry(triangles=_shifted(_TRIANGLES, 4, count), uvs=corners, instances=numbers, **arrays)


def _shifted(triangles: NDArray[np.int32], vertices: int, count: int) -> NDArray[np.int32]:
    """Return the triangles of ``count`` copies of a mesh with ``vertices`` vertices."""
    firsts = (np.arange(count, dtype=np.int64) * vertices)[:, None, None]
    return (np.asarray(triangles, np.int64)[None] + firsts).reshape(-1, 3).astype(np.int32)


def _rows(given: ArrayLike, columns: int, what: str, count: int | None = None) -> NDArray[np.float32]:
    rows = arguments.numbers(given, what)
    expected = f"({'n' if count is None else count}, {columns})"
    if rows.ndim != 2 or rows.shape[1] != columns or not len(rows) or count not in (None, len(rows)):
        raise pg.InputError(f"{what} must be {expected}, got {rows.shape}")
    if len(rows) > MOST_MARKS:
        raise pg.InputError(f"{what}: {len(rows)} rows; a draw has at most {MOST_MARKS}")
    return rows.astype(np.float32)
