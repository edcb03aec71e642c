"""A floor from straight above: its heights, and how near to it something stands or hangs."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph import Const, Image, clamp, discard, front_facing, mat4, pixel, vec4
from passgraph.effects.quantities import Share
from passgraph.effects.surfaces.batches import merged
from passgraph.scene.matrices import transform_points

Float64 = NDArray[np.float64]
Darkness = Share | Mapping[str, Share]
#: Of a node that a mapping of darkness leaves out.
DARKNESS = 0.7
#: What lies less than this share of the threshold under the floor counts as lying on it.
SLACK = 1e-3
#: Height of the floor where there is none.
NO_FLOOR = -1e30


@pg.struct
class Layer:
    """A vertex seen from straight above."""

    position: vec4
    y: float  # scene units over the map's origin
    color: vec4


@pg.vertex
def from_above(vertex: pg.Vertex, clip_from_local: mat4) -> Layer:
    """The near plane lies at the threshold over the floor's highest place: what is higher is clipped."""
    return Layer(clip_from_local * vec4(vertex.position, 1.0), vertex.position.y, vertex.color)


@pg.fragment
def height_of(layer: Layer) -> float:
    """The floor as a height map."""
    return layer.y


@pg.function
def over_floor(heights: Image, y: float, threshold: float, has_heights: bool) -> float:
    """0 on the floor, 1 at the threshold over it."""
    if has_heights:
        return (y - heights.texel(pixel()).r) / threshold
    return y / threshold


@pg.fragment
def buried(layer: Layer, heights: Image, threshold: float, has_heights: Const[bool]) -> float:
    """Faces under the floor, counted: more that look down than up where the floor lies inside a body."""
    if over_floor(heights, layer.y, threshold, has_heights) >= -SLACK:
        discard()
    return -1.0 if front_facing() else 1.0


@pg.fragment
def gradient(
    layer: Layer, heights: Image, inside: Image, threshold: float, darkness: float, solid: float,
    has_heights: Const[bool], has_inside: Const[bool],
) -> vec4:  # fmt: skip
    """The share of the light that is left: all at the threshold, the least on the floor."""
    h = over_floor(heights, layer.y, threshold, has_heights)
    if h > 1.0 or (front_facing() and abs(h) <= SLACK):
        discard()  # the second is the floor itself, where one mesh holds floor and bodies
    if has_inside and h < -SLACK and inside.texel(pixel()).r < 0.5:
        discard()  # under the floor, and the floor here is outside of the body
    through = layer.color.rgb * (1.0 - clamp(max(layer.color.a, solid), 0.0, 1.0))
    return vec4(1.0 - darkness * (1.0 - clamp(h, 0.0, 1.0)) * (1.0 - through), 1.0)


@dataclass(frozen=True, eq=False)
class Window:
    """The square of the world that the map shows; right is +x, down is +z.

    Attributes
    ----------
    origin : world position of its middle
    half : half of its side, scene units
    """

    origin: Float64
    half: float

    @property
    def flat(self) -> Float64:
        """Places relative to the origin to (x, y) in -1 to 1 and z in scene units over the origin."""
        k = 1.0 / self.half
        return np.array([[k, 0, 0, 0], [0, 0, -k, 0], [0, 1, 0, 0], [0, 0, 0, 1.0]])

    def clip(self, low: float, high: float) -> Float64:
        """To a clip space whose near plane lies at world y ``high`` and its far plane at ``low``."""
        made, depth = self.flat, high - low
        made[2] = 0.0, -2.0 / depth, 0.0, (high + low - 2.0 * float(self.origin[1])) / depth
        return made


@dataclass(frozen=True, eq=False)
class ContactMap:
    """Targets that `contact_map` draws, and where they lie.

    Attributes
    ----------
    map : rgba16f, share of the light that is left
    heights : r32f, of the floor over the window's origin; None on a plane
    window : the square that both show
    """

    map: pg.Target
    heights: pg.Target | None
    window: Window


def contact_map(
    scene: pg.Scene, floor: Sequence[pg.Node], height: float, threshold: float, darkness: Darkness, map_size: int
) -> ContactMap:
    """Draw what is within ``threshold`` of a floor: a height field, or the plane at ``height`` without one."""
    bodies = [node for node in scene.nodes if node.casts and node not in floor]
    near = near_to_field(bodies, floor, threshold) if floor else near_to_plane(bodies, height, threshold)
    if not near:
        raise pg.GraphError(f"contact: nothing in scene {scene.name!r} is within {threshold:g} of its floor")
    low = np.min([node.bounds[0] for node in near], axis=0)
    high = np.max([node.bounds[1] for node in near], axis=0)
    origin = 0.5 * (low + high)
    top, bottom = height, height
    if floor:
        top = max(float(node.bounds[1, 1]) for node in floor)
        bottom = min(float(node.bounds[0, 1]) for node in floor)
    origin[1] = 0.5 * (top + bottom)
    # the map is square, with a margin of a few texels
    half = 0.5 * float(max(high[0] - low[0], high[2] - low[2], 1e-6)) * (1.0 + 8.0 / map_size)
    window, size = Window(origin, half), (map_size, map_size)
    blank = pg.Input("contact blank", "r32f", (1, 1), static=True, default=np.zeros((1, 1, 1), np.float32))
    heights = None
    if floor:
        slack = 1e-3 * max(top - bottom, threshold)
        heights = pg.draw(
            merged(floor, origin), vertex=from_above, fragment=height_of,
            into=pg.target("contact heights", "r32f", size, clear=NO_FLOOR),
            depth=pg.target("contact heights test", "depth32f", size),
            clip_from_local=window.clip(bottom - slack, top + slack),
        )  # fmt: skip
    values: dict[str, object] = {
        "heights": heights or blank, "has_heights": heights is not None, "threshold": threshold,
        "clip_from_local": window.clip(min(float(low[1]), bottom) - threshold, top + threshold),
    }  # fmt: skip
    inside = None
    if floor or low[1] < height - SLACK * threshold:
        inside = pg.draw(
            merged(near, origin), vertex=from_above, fragment=buried, blend="add",
            into=pg.target("contact inside", "r16f", size), values=values,
        )  # fmt: skip
    values |= {"inside": inside or blank, "has_inside": inside is not None}
    into: pg.Target | pg.TargetSpec = pg.target("contact map", "rgba16f", size, clear=1.0)
    for (dark, solid), nodes in alike(near, darkness).items():
        into = pg.draw(
            merged(nodes, origin), vertex=from_above, fragment=gradient, into=into, blend="min", name="contact map",
            values={**values, "darkness": dark, "solid": float(solid)},
        )  # fmt: skip
    assert isinstance(into, pg.Target)
    return ContactMap(into, heights, window)


def alike(nodes: Iterable[pg.Node], darkness: Darkness) -> dict[tuple[float, bool], list[pg.Node]]:
    """Nodes by darkness, and by whether their colours' opacity means nothing."""
    groups: dict[tuple[float, bool], list[pg.Node]] = {}
    for node in nodes:
        dark = darkness.get(node.name, DARKNESS) if isinstance(darkness, Mapping) else darkness
        groups.setdefault((dark, node.material.alpha_mode != "blend"), []).append(node)
    return groups


def near_to_plane(nodes: Iterable[pg.Node], height: float, threshold: float) -> list[pg.Node]:
    """Nodes of which something is over the plane, and something less than the threshold over it."""
    return [
        node
        for node in nodes
        if node.bounds[1, 1] > height + SLACK * threshold and node.bounds[0, 1] < height + threshold
    ]


def near_to_field(nodes: Iterable[pg.Node], floor: Iterable[pg.Node], threshold: float) -> list[pg.Node]:
    """The same over a height field, by the floor's triangles that may lie under a node's box."""
    corners = np.concatenate([transform_points(f.transform, f.mesh.positions)[f.mesh.triangles] for f in floor])
    low, high = corners.min(axis=1), corners.max(axis=1)
    found = []
    for node in nodes:
        box = node.bounds
        under = ((high >= box[0]) & (low <= box[1]))[:, [0, 2]].all(axis=1)
        if under.any() and box[0, 1] < high[under, 1].max() + threshold and box[1, 1] > low[under, 1].min():
            found.append(node)
    return found


def floor_nodes(scene: pg.Scene, name: str | None) -> list[pg.Node]:
    """The nodes of this name; none where there is no name."""
    found = [node for node in scene.nodes if node.name == name]
    if name is not None and not found:
        raise pg.GraphError(f"contact: floor: {_unknown(scene, name)}")
    return found


def check_names(scene: pg.Scene, darkness: Darkness) -> None:
    """Every name that of a node."""
    for name in darkness if isinstance(darkness, Mapping) else ():
        if all(node.name != name for node in scene.nodes):
            raise pg.GraphError(f"contact: darkness: {_unknown(scene, name)}")


def _unknown(scene: pg.Scene, name: str) -> str:
    names = sorted({node.name for node in scene.nodes})
    near = get_close_matches(name, names, n=1)
    hint = f"; did you mean {near[0]!r}?" if near else f"; it has {', '.join(names[:8])}"
    return f"scene {scene.name!r} has no node {name!r}{hint}"
