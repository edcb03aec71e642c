"""Fit shadow maps to the visible receivers, and to the casters in front of them.

Everything here happens on the host, in float64.  Receivers and casters are approximated by some hundred boxes.  Boxes
of receivers are clipped to the camera's frustum; boxes of casters count as far as the light's extent lets them shadow
the remaining receivers.  A map with parallel rays may be drawn in perspective across its own plane, with more texels
near the camera.  A fit is rounded outward to a grid, so that a map stays unchanged while the camera moves a little:
edges do not crawl, and the map of a static light is drawn again only when the grid is left.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import field
from math import atan2, ceil, cos, floor, hypot, log2, pi, sin, sqrt

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.records import dataclass

Float64 = NDArray[np.float64]
#: A piece is a triangle longer than this fraction of the whole; else the content of one of CELLS³ cells.
LARGE, MOST_LARGE, CELLS = 0.1, 128, 8
#: Directions of the normals of the polygon around receivers.
WAYS = np.array([(cos(i * pi / 8.0), sin(i * pi / 8.0)) for i in range(16)])
#: Steps of the grid that a fit is rounded to, along the longer side.
STEPS = 64
#: Distinct rotations of the camera about the light's axis.
TURNS = 32
#: Largest ratio of texel density between the nearest and the farthest texels.
DENSEST = 2.0
#: Margin in texels: reads of a comparison, and rounding.
MARGIN_TEXELS = 2.0
#: The corners of a box, whose bits 0, 1 and 2 are x, y and z, and its edges as pairs of them.
BITS = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)])
EDGES = np.array([(i, i | bit) for bit in (1, 2, 4) for i in range(8) if not i & bit])


def pieces_of(nodes: Sequence[pg.Node], origin: Float64) -> Float64:
    """Return world boxes relative to ``origin`` that contain all triangles with an area, (n, 2, 3), at most some
    hundred."""
    lows, highs = [], []
    for node in nodes:
        points = node.mesh.positions.astype(np.float64) @ node.transform[:3, :3].T + (node.transform[:3, 3] - origin)
        corners = points[node.mesh.triangles]
        areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        corners = corners[areas > 0.0]
        lows.append(corners.min(axis=1))
        highs.append(corners.max(axis=1))
    if not sum(map(len, lows)):
        return np.zeros((0, 2, 3))
    boxes = np.stack([np.concatenate(lows), np.concatenate(highs)], axis=1)
    long = np.linalg.norm(boxes[:, 1] - boxes[:, 0], axis=1)
    low, high = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    large = np.zeros(len(boxes), np.bool_)
    large[np.argsort(-long)[:MOST_LARGE]] = True
    large &= long > LARGE * float(np.linalg.norm(high - low))
    small = boxes[~large]
    cell = np.clip((small.mean(axis=1) - low) / np.maximum(high - low, 1e-300) * CELLS, 0, CELLS - 1).astype(np.int64)
    _, which = np.unique(cell @ (1, CELLS, CELLS * CELLS), return_inverse=True)
    count = int(which.max()) + 1 if len(small) else 0
    grouped = np.stack([np.full((count, 3), np.inf), np.full((count, 3), -np.inf)], axis=1)
    np.minimum.at(grouped[:, 0], which, small[:, 0])
    np.maximum.at(grouped[:, 1], which, small[:, 1])
    # With an index, np.unique does not import numpy.ma.
    return np.concatenate([np.unique(boxes[large], axis=0, return_index=True)[0], grouped])


def corners_of(boxes: Float64) -> Float64:
    """Return the corners (n, 8, 3) of boxes (n, 2, 3)."""
    return np.asarray(np.where(BITS[None], boxes[:, None, 1], boxes[:, None, 0]))


def seen_points(boxes: Float64, camera: pg.Camera, aspect: float, origin: Float64) -> Float64:
    """Return points whose hull contains the part of the boxes in the camera's frustum, (n, 3) relative to ``origin``.

    For a box that the frustum clips, these are the corners of the remaining part: each ends a part of one of the box's
    edges within the frustum, or a part of one of the frustum's edges within the box.
    """
    half, middle = camera.window(aspect)
    (left, bottom), (right, top) = np.subtract(middle, half), np.add(middle, half)
    # movement of the sides per unit of distance, and their position without it
    spread, fixed = (0.0, 1.0) if camera.orthographic else (1.0, 0.0)
    rotation, eye = camera.view_rotation()[:3, :3], np.subtract(camera.eye, origin)
    # an infinite far plane is behind everything
    behind = 2.0 * (float(np.abs(boxes - eye).max(initial=0.0)) + camera.near)
    near, far = camera.near, camera.far if np.isfinite(camera.far) else behind
    # inside: normal · point + offset ≥ 0 for each of six planes
    sides = np.array([-left, right, -bottom, top])
    local = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, -1], [0, 0, 1.0]])
    local[:4, 2] = -spread * sides
    normals = local @ rotation
    offsets = -normals @ eye + np.array([*(fixed * sides), -near, far])
    middles = 0.5 * (boxes[:, 0] + boxes[:, 1]) @ normals.T + offsets
    reaches = 0.5 * (boxes[:, 1] - boxes[:, 0]) @ np.abs(normals).T
    within = (middles >= reaches).all(axis=1)
    cut = boxes[(middles >= -reaches).all(axis=1) & ~within]
    corners = np.array([(x, y) for y in (bottom, top) for x in (left, right)])
    ends = [np.c_[corners * (spread * z + fixed), np.full(4, -z)] @ rotation for z in (near, far)]
    return np.concatenate(
        [
            corners_of(boxes[within]).reshape(-1, 3),
            _parts_before_planes(corners_of(cut)[:, EDGES], normals, offsets),
            _parts_in_boxes(np.concatenate(ends)[EDGES] + eye, cut),
        ]
    )


def _parts_before_planes(edges: Float64, normals: Float64, offsets: Float64) -> Float64:
    """Return the ends of the parts of edges, (n, 12, 2, 3), on the inner side of all planes, (m, 3)."""
    # planes come first: NumPy reduces a short last axis slowly
    heights = (normals @ edges.reshape(-1, 3).T + offsets[:, None]).reshape(len(normals), -1, 2)
    first, last = heights[..., 0], heights[..., 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        t = first / (first - last)
    enter = np.where(first < 0.0, np.where(last < 0.0, np.inf, t), 0.0).max(axis=0)
    leave = np.where((first >= 0.0) & (last < 0.0), t, 1.0).min(axis=0)
    return _ends(edges.reshape(-1, 2, 3), enter, leave)


def _parts_in_boxes(edges: Float64, boxes: Float64) -> Float64:
    """Return the ends of the parts of edges, (m, 2, 3), in one of the boxes, (n, 2, 3)."""
    first, way = edges[:, 0].T[:, None], (edges[:, 1] - edges[:, 0]).T[:, None]  # (3, 1, m)
    low, high = boxes.transpose(1, 2, 0)[..., None]  # (3, n, 1) each
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (low - first) / way, (high - first) / way
    # NaN if an edge runs within a side of a box: that side does not clip it
    enter = np.fmax(np.fmax.reduce(np.fmin(a, b), axis=0), 0.0)
    leave = np.fmin(np.fmin.reduce(np.fmax(a, b), axis=0), 1.0)
    return _ends(np.broadcast_to(edges, (len(boxes), *edges.shape)).reshape(-1, 2, 3), enter.ravel(), leave.ravel())


def _ends(edges: Float64, enter: Float64, leave: Float64) -> Float64:
    """Return the points at both fractions of edges, (n, 2, 3), if the first comes before the second."""
    some = enter <= leave
    first, way = edges[some, 0], edges[some, 1] - edges[some, 0]
    return np.concatenate([first + enter[some, None] * way, first + leave[some, None] * way])


def _cut(polygons: Float64, normal: Float64, offset: float) -> Float64:
    """Return the parts of convex polygons, (n, k, 3), on the inner side of a plane, (m, k + 1, 3); corners may
    repeat."""
    heights = polygons @ normal + offset
    some = (heights >= 0.0).any(axis=1)
    polygons, heights = polygons[some], heights[some]
    if not len(polygons) or (heights >= 0.0).all():
        return polygons
    after, height_after = np.roll(polygons, -1, axis=1), np.roll(heights, -1, axis=1)
    crosses = (heights >= 0.0) != (height_after >= 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.where(crosses, heights / (heights - height_after), 0.0)[..., None]
    middle = polygons + t * (after - polygons)
    kept = np.stack([polygons, middle], axis=2).reshape(len(polygons), -1, 3)
    inside = np.stack([heights >= 0.0, crosses], axis=2).reshape(len(polygons), -1)
    order = np.argsort(~inside, axis=1, kind="stable")[:, : polygons.shape[1] + 1]
    kept, inside = np.take_along_axis(kept, order[..., None], 1), np.take_along_axis(inside, order, 1)
    return np.asarray(np.where(inside[..., None], kept, kept[:, :1]))


@dataclass(frozen=True, eq=False)
class Fit:
    """The region to which the maps of one scene are fitted.

    Attributes
    ----------
    camera : the camera of each run
    origin : (3,) world point that boxes are relative to
    receivers : (n, 2, 3) boxes
    casters : (n, 2, 3) boxes of everything that can cast a shadow under a light
    square : True if texels must be squares of one size, for blurred maps
    map_size : texels along each side
    margin_texels : margin on each side
    """

    camera: pg.Value
    origin: Float64
    receivers: Float64
    casters: Callable[[pg.Light], Float64]
    map_size: int
    square: bool = False
    margin_texels: float = MARGIN_TEXELS
    kept: dict[str, tuple[object, Float64]] = field(default_factory=dict)

    def window(
        self, light: pg.Light, frustum: tuple[Float64, Float64], camera: pg.Camera, size: tuple[int, int]
    ) -> Float64:
        """Return the matrix in front of a light's projection, (4, 4); the identity if nothing narrower fits."""
        # the map and the kernels that read it call this with the same values in each run
        key = light, camera, size, frustum[0].tobytes(), frustum[1].tobytes()
        return self._once("window", key, lambda: self._window(light, frustum, camera, size))

    def _window(
        self, light: pg.Light, frustum: tuple[Float64, Float64], camera: pg.Camera, size: tuple[int, int]
    ) -> Float64:
        (view, projection), aspect = frustum, size[0] / size[1]
        points = self._once(
            "points", (camera, aspect), lambda: seen_points(self.receivers, camera, aspect, self.origin)
        )
        if not len(points):
            return np.eye(4)
        casters = self._once("casters", (light, view.tobytes()), lambda: self._before_light(light, view))
        needed = needed_places(light, view, projection, points + self.origin, casters)
        if needed is None or not len(needed):
            return np.eye(4)
        share = 1.0 + 2.0 * self.margin_texels / max(self.map_size - 2.0 * self.margin_texels, 1.0)
        if self.square:
            return _square(needed, share)
        turn, slope = 0.0, 0.0
        if light.kind == "directional":
            along = (view[:3, :3] @ camera.forward)[:2]
            turn = round(atan2(along[1], along[0]) / (2.0 * pi) * TURNS) * (2.0 * pi / TURNS)
            # parallel rays do not magnify near objects
            slope = 0.0 if camera.orthographic else hypot(*along)
        return _oblong(needed, turn, _nearest(points + self.origin, camera) * float(projection[0, 0]), slope, share)

    def _before_light(self, light: pg.Light, view: Float64) -> Float64:
        """Return corners of the casters' boxes in the map's view, (8, n, 3): NumPy reduces a short last axis slowly."""
        corners = corners_of(self.casters(light)).transpose(1, 0, 2).reshape(-1, 3) + self.origin
        return (corners @ view[:3, :3].T + view[:3, 3]).reshape(8, -1, 3)

    def _once(self, name: str, key: object, make: Callable[[], Float64]) -> Float64:
        """Return the last value of its name, if its key is unchanged."""
        found = self.kept.get(name)
        if found is None or found[0] != key:
            found = self.kept[name] = key, make()
        return found[1]


def _nearest(points: Float64, camera: pg.Camera) -> float:
    """Return the distance along the view axis to the nearest of the points."""
    return float(((points - camera.eye) @ camera.forward).min())


def needed_places(
    light: pg.Light, view: Float64, projection: Float64, points: Float64, casters: Float64
) -> Float64 | None:
    """Return the part of a map in which casters may shadow some points, in the map's clip space; None for the whole
    map.

    Parameters
    ----------
    view, projection : of the whole map
    points : (n, 3) world, whose hull contains the receivers
    casters : (8, m, 3) corners of boxes, in the map's view

    Returns
    -------
    (k, 2) corners of a polygon within the map: the hull of the receivers, extended as far as the light's extent can
    bring casters in, clipped to the box of those casters.
    """
    scale, parallel = float(projection[0, 0]), light.kind == "directional"
    place = points @ view[:3, :3].T + view[:3, 3]
    depth, depths = -place[:, 2], -casters[..., 2]
    far, nearest = float(depth.max()), depths.min(axis=0)
    counts = nearest < far
    if parallel:
        flat, flats = place[:, :2] * scale, casters[..., :2] * scale
        reach = light.radius * np.maximum(far - nearest, 0.0) * scale
    else:
        least = 1e-4 * max(far, 0.0)
        if float(depth.min()) <= least:
            return None
        x, y = casters[..., 0] * scale, casters[..., 1] * scale
        beyond = [(side > 0.0).all(axis=0) for side in (x - depths, -x - depths, y - depths, -y - depths)]
        counts &= ~((depths <= 0.0).all(axis=0) | np.any(beyond, axis=0))
        if (nearest[counts] <= least).any():
            return None  # next to the light a caster may occlude everything that it shines on
        flat, flats = (
            place[:, :2] * scale / depth[:, None],
            casters[..., :2] * scale / np.maximum(depths, least)[..., None],
        )
        reach = light.radius * np.maximum(1.0 / np.maximum(nearest, least) - 1.0 / far, 0.0) * scale
    lows, highs = flats.min(axis=0), flats.max(axis=0)
    wide = reach[:, None]
    counts &= ((lows <= flat.max(axis=0) + wide) & (highs >= flat.min(axis=0) - wide)).all(axis=1)
    if not counts.any():
        return np.zeros((0, 2))
    lows, highs = lows[counts], highs[counts]
    # distance of casters from the receivers' hull, as far as the light's extent brings them in
    heights = (flat @ WAYS.T).max(axis=0)
    stand_out = np.where(WAYS[:, 0] > 0.0, highs[:, :1], lows[:, :1]) * WAYS[:, 0]
    stand_out += np.where(WAYS[:, 1] > 0.0, highs[:, 1:], lows[:, 1:]) * WAYS[:, 1]
    grown = heights + np.clip(stand_out - heights, 0.0, wide[counts]).max(axis=0)
    hull = _polygon(grown)
    low, high = np.maximum(lows.min(axis=0), -1.0), np.minimum(highs.max(axis=0), 1.0)
    polygon = np.concatenate([hull, np.zeros((len(hull), 1))], axis=1)[None]
    for axis in (0, 1):
        normal = np.eye(3)[axis]
        polygon = _cut(_cut(polygon, normal, -float(low[axis])), -normal, float(high[axis]))
    return np.asarray(polygon.reshape(-1, 3)[:, :2])


def _polygon(heights: Float64) -> Float64:
    """Return the corners of the polygon with sides at these distances in each of WAYS, (k, 2) in order."""
    after, next_heights = np.roll(WAYS, -1, axis=0), np.roll(heights, -1)
    turned = WAYS[:, 0] * after[:, 1] - WAYS[:, 1] * after[:, 0]
    x = (heights * after[:, 1] - next_heights * WAYS[:, 1]) / turned
    y = (next_heights * WAYS[:, 0] - heights * after[:, 0]) / turned
    return np.stack([x, y], axis=1)


def _grid(extent: float) -> float:
    """Return a power of 2 that fits some forty to STEPS times into a length."""
    return float(2.0 ** ceil(log2(max(extent, 1e-9) / STEPS)))


def _rounded(low: float, high: float, grid: float) -> tuple[float, float]:
    """Round the interval outward to the grid."""
    return floor(low / grid) * grid, max(ceil(high / grid), floor(low / grid) + 1.0) * grid


def _square(needed: Float64, share: float) -> Float64:
    """Return a window with texels parallel to the map's own."""
    low, high = needed.min(axis=0), needed.max(axis=0)
    grid = _grid(float((high - low).max()))
    (x0, x1), (y0, y1) = (_rounded(float(low[i]), float(high[i]), grid) for i in (0, 1))
    half = 0.5 * max(x1 - x0, y1 - y0) * share
    window = np.diag([1.0 / half, 1.0 / half, 1.0, 1.0])
    window[:2, 3] = -0.5 * (x0 + x1) / half, -0.5 * (y0 + y1) / half
    return window if half < 1.0 else np.eye(4)


def _oblong(needed: Float64, turn: float, near: float, slope: float, share: float) -> Float64:
    """Return a window whose second axis points away from the camera, and whose texels grow along it.

    Source: M. Wimmer, D. Scherzer, W. Purgathofer, "Light Space Perspective Shadow Maps", 2004: the center of the
    perspective is in front of the nearest point by the geometric mean of the nearest and the farthest.
    """
    c, s = cos(turn), sin(turn)
    axes = np.array([[s, -c], [c, s]])  # across the camera's direction, and along it
    corners = needed @ axes.T
    grid = _grid(float(np.ptp(corners, axis=0).max()))
    t0, t1 = _rounded(float(corners[:, 1].min()), float(corners[:, 1].max()), grid)
    extent = t1 - t0
    # distance of the center in front of t0; halving steps, so that it changes rarely
    wanted = (near + sqrt(near * (near + extent))) / max(slope, 1e-3)
    centre = extent * 2.0 ** (round(2.0 * log2(max(wanted / extent, 1.0 / (DENSEST - 1.0)))) / 2.0)
    flat = slope == 0.0 or centre > 16.0 * extent
    w = np.ones(len(corners)) if flat else corners[:, 1] - t0 + centre
    across = corners[:, 0] / w
    fine = _grid(float(np.ptp(across)))
    a0, a1 = _rounded(float(across.min()), float(across.max()), fine)
    middle, half = 0.5 * (a0 + a1), 0.5 * (a1 - a0)
    window = np.eye(4)
    if flat:
        window[0, :2], window[0, 3] = axes[0] / half, -middle / half
        window[1, :2], window[1, 3] = axes[1] * (2.0 / extent), -(t0 + t1) / extent
        window[:2] /= share
        return window
    # along: -1 at t0 and 1 at t1, linear in t over w
    alpha = (2.0 * centre + extent) / extent
    beta = -centre - alpha * t0
    w_row = np.array([*axes[1], 0.0, centre - t0])
    window[0] = (np.array([*axes[0], 0.0, 0.0]) - middle * w_row) / half / share
    window[1] = np.array([*(alpha * axes[1]), 0.0, beta]) / share
    window[3] = w_row
    # 1 at the window's near edge, so that depths stay within the clip volume
    edge = (-share * (centre - t0) - beta) / (alpha + share) + centre - t0
    window[[0, 1, 3]] /= edge
    return window
