# mypy: disable-error-code="no-any-return,valid-type"
"""Shadows of moving things: one or two sprites each, of which only position, angle and scale change."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from math import atan, cos, floor, hypot, inf, isfinite, sin
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.effects.annotations import check_fields
from passgraph.effects.checked import checked
from passgraph.effects.light2d.world import Float64, Light2D, Point, Window
from passgraph.effects.pictures.stretched import Shape, Spot, quads, shape_of
from passgraph.language import Array, Image, Vertex, uv, vec4

#: The far ends of shadows are this many times farther from the light than the edge.
FAR = 2.0**20


def shadow_of(edges: Float64, light: Point) -> Shape:
    """Return the shadow volume of edges (n, 4) seen from a light: one unbounded quad an edge.

    Neighboring edges share their corners to the last bit, so no light passes between their quads.  Every vertex stores
    its edge (ax, ay, bx, by) as its color.
    """
    ends = edges.reshape(-1, 2, 2)
    away = ends - np.array(light)
    near = np.concatenate([ends, np.ones((len(ends), 2, 1))], axis=2)
    # light + FAR · (corner - light), divided through by FAR
    far = np.concatenate([away + np.array(light) / FAR, np.full((len(ends), 2, 1), 1.0 / FAR)], axis=2)
    positions = np.stack([near[:, 0], near[:, 1], far[:, 1], far[:, 0]], axis=1).reshape(-1, 3)
    return shape_of(positions, np.zeros((len(positions), 2)), np.repeat(edges, 4, axis=0))


def around(center: Point, half: float) -> Shape:
    """Return an upright square."""
    x, y = center
    return quads([[(x - half, y - half), (x + half, y - half), (x + half, y + half), (x - half, y + half)]])


#: Angle in radians of a thing seen from a lamp, below which the two sprites are one.
ONE_SPRITE = 0.12
#: From the first angle on the shadow fades; at the second it is gone.
FADE = (1.0, 1.6)
#: Sprites of a thing nearer than that with "fan", and the most per thing.
FAN = 5
Near = Literal["fade", "fan"]
SPRITES: dict[Near, int] = {"fade": 2, "fan": FAN}
#: Opacity of one sprite's core.
CORE = 0.65
#: The sprite: opaque along the center of its width, fading along its length; its pivot is the middle of the left side.
SPRITE = CORE * np.outer([0.3, 1.0, 1.0, 0.3], [1.0, 0.85, 0.5, 0.0])


@dataclass(frozen=True, slots=True)
class Mover:
    """A rectangle that moves.

    Attributes
    ----------
    position : its center, world units
    half : half its width and half its height, world units, above 0
    angle_rad : rotation, counterclockwise
    """

    position: Point
    half: Point = (0.5, 0.5)
    angle_rad: float = 0.0

    def __post_init__(self) -> None:
        try:
            numbers = (*self.position, *self.half, self.angle_rad)
            good = (len(self.position), len(self.half)) == (2, 2) and all(isfinite(v) for v in numbers)
        except (TypeError, ValueError, OverflowError):
            good = False
        if not good:
            check_fields(self)

    def across(self, x: float, y: float) -> float:
        """Return the length of its projection on the axis perpendicular to the unit direction (x, y)."""
        c, s = cos(self.angle_rad), sin(self.angle_rad)
        return 2.0 * (self.half[0] * abs(c * y - s * x) + self.half[1] * abs(s * y + c * x))

    @property
    def corners(self) -> tuple[Point, Point, Point, Point]:
        """Return the corners, counterclockwise, world units."""
        c, s = cos(self.angle_rad), sin(self.angle_rad)
        (x, y), (w, h) = self.position, self.half
        ways = ((-w, -h), (w, -h), (w, h), (-w, h))
        first, second, third, fourth = ((x + c * dx - s * dy, y + s * dx + c * dy) for dx, dy in ways)
        return first, second, third, fourth


def nearest(lights: Sequence[Light2D], place: Point) -> Light2D | None:
    """Return the nearest lamp that reaches a place; None if there is none."""
    near, best = None, inf
    for light in lights:
        way = hypot(place[0] - light.position[0], place[1] - light.position[1])
        if way < min(best, light.radius):
            near, best = light, way
    return near


class LampCache:
    """A cache of the nearest lamp of each cell of a grid, computed at first use.

    Attributes
    ----------
    computed : number of nearest lamps computed

    >>> cache = LampCache([Light2D((0, 0)), Light2D((8, 0))], cell=1.0)
    >>> [cache((x, 0.2)).position for x in (1.2, 1.7, 6.5)], cache.computed
    ([(0, 0), (0, 0), (8, 0)], 2)
    """

    def __init__(self, lights: Sequence[Light2D], cell: float = 1.5) -> None:
        if not cell > 0.0:
            raise pg.GraphError(f"lamp cache: cell must be above 0, got {cell!r}")
        self.cell, self.computed = cell, 0
        self.lights: tuple[Light2D, ...] = tuple(lights)
        self._near: dict[tuple[int, int], Light2D | None] = {}

    def change(self, lights: Sequence[Light2D]) -> None:
        """Set other lamps; the cache is kept if they are equal."""
        if tuple(lights) != self.lights:
            self.lights = tuple(lights)
            self._near.clear()

    def __call__(self, place: Point) -> Light2D | None:
        """Return the nearest lamp that reaches the center of the place's cell."""
        key = floor(place[0] / self.cell), floor(place[1] / self.cell)
        if key not in self._near:
            self.computed += 1
            self._near[key] = nearest(self.lights, ((key[0] + 0.5) * self.cell, (key[1] + 0.5) * self.cell))
        return self._near[key]


def _turns(angle: float, near: Near) -> list[tuple[float, float]]:
    """Return the rotation and opacity of each sprite of a thing seen from the lamp under an angle."""
    if angle < ONE_SPRITE:
        return [(0.0, 2.0)]
    if near == "fade" or angle <= FADE[0]:
        fade = min(max((FADE[1] - angle) / (FADE[1] - FADE[0]), 0.0), 1.0)
        return [(-0.5 * angle, fade), (0.5 * angle, fade)]
    return [(angle * (i / (FAN - 1) - 0.5), 1.0) for i in range(FAN)]


def sprite_table(
    movers: Sequence[Mover],
    lights: Sequence[Light2D] | LampCache,
    reach: Callable[[Point], float],
    count: int,
    near: Near = "fade",
) -> NDArray[np.float32]:
    """Return sprites for each of ``count`` things, two rows each: pivot and opacity, then both axes; absent ones are 0.

    Parameters
    ----------
    movers : ``count`` or fewer
    lights : lamps (only the nearest one shades a thing), or a cache of the nearest
    reach : longest shadow from a place, world units: the distance grid's value plus the thinnest wall
    count : capacity of the table
    near : behavior near a lamp, see `moving_shadows`

    The table is (2 · sprites · count, 4), with 2 sprites per thing for "fade" and `FAN` for "fan".
    """
    if len(movers) > count:
        raise pg.GraphError(f"moving shadows: {len(movers)} things exceed count={count}")
    sprites = SPRITES[near]
    lamp_of = lights if isinstance(lights, LampCache) else partial(nearest, lights)
    table = np.zeros((2 * sprites * count, 4), np.float32)
    for number, mover in enumerate(movers):
        light = lamp_of(mover.position)
        if light is None:
            continue
        x, y = mover.position[0] - light.position[0], mover.position[1] - light.position[1]
        way = hypot(x, y)
        if way == 0.0:
            continue
        width = mover.across(x / way, y / way)
        angle = 2.0 * atan(0.5 * width / way)
        turns = _turns(angle, near)
        length = min(reach(mover.position), light.radius - way)
        if len(turns) > 1:
            # beyond this the inner sides of neighboring sprites separate, and light would show between them
            length = min(length, way * (len(turns) - 1))
        for side, (turn, opacity) in enumerate(turns):
            c, s = cos(turn) / way, sin(turn) / way
            along = x * c - y * s, x * s + y * c
            row = 2 * (sprites * number + side)
            table[row] = (*mover.position, opacity, 0.0)
            table[row + 1] = (along[0] * length, along[1] * length, -along[1] * 0.5 * width, along[0] * 0.5 * width)
    return table


@lru_cache(maxsize=16)
def _placed(rows: int) -> Any:
    @pg.vertex
    def placed(vertex: Vertex, clip: vec4, table: Array[vec4, rows]) -> Spot:  # pyright: ignore[reportInvalidTypeForm]
        first = min(2 * int(vertex.position.z + 0.5), rows - 2)
        axes = table[first + 1]
        pivot = table[first]
        at = pivot.xy + axes.xy * vertex.position.x + axes.zw * vertex.position.y
        corner = vec4(at.x * clip.x + clip.z, at.y * clip.y + clip.w, 0.0, 1.0)
        return Spot(corner, at, vertex.uv, vec4(0.0, 0.0, 0.0, pivot.z))

    return placed


@pg.fragment
def shadow_sprite(spot: Spot, sprite: Image) -> vec4:
    """Return black, as opaque as the sprite."""
    return vec4(0.0, 0.0, 0.0, min(sprite.sample(spot.uv).r * spot.edge.a, 1.0))


@pg.kernel
def faded(before: Image, now: Image, share: float) -> vec4:
    """Move from the last frame's shadow toward this one's."""
    return before[0, 0] + (now[0, 0] - before[0, 0]) * share


@pg.kernel
def darkened(scene: Image, shadow: Image) -> vec4:
    """Darken the scene by the shadow; alpha is the scene's."""
    c = scene[0, 0]
    return vec4(c.rgb * (1.0 - shadow.sample(uv()).a), c.a)


@checked
def moving_shadows(
    scene: pg.Target,
    window: Window,
    lights: Sequence[Light2D] | LampCache,
    movers: pg.Value,
    count: Annotated[int, pg.Range(1, 32)],
    reach: Callable[[Point], float] = lambda place: inf,
    share: Annotated[float, pg.Range(0, 1, above=True)] | pg.Value = 1.0,
    near: Near = "fade",
    into: pg.TargetSpec | None = None,
    name: str = "moving_shadows",
) -> pg.Target:
    """Draw a scene with shadows of moving things, two sprites each.

    Parameters
    ----------
    scene : any picture of the window
    window : as in `light_map`
    lights : the lamps, or a `LampCache` of them
    movers : a value set by runs: a sequence of `Mover`
    count : most things at once
    reach : longest shadow from a place, world units, such as `passgraph.effects.light2d.distance_grid.reach`
    share : fraction of the way from the last frame's shadows to the new ones; below 1 a shadow that jumps to another
        lamp cross-fades, and one that moves leaves a trail
    near : if a thing seen from its lamp spans more than 1 radian, two sprites separate: "fade" lets the shadow fade, to
        nothing at 1.6; "fan" uses five sprites
    into : destination target; default: float32 named ``name``
    name : name of the passes and targets

    A pair's shadow is at most as long as the distance from the lamp, where the sprites' inner sides meet.
    """
    sprite = pg.Input(f"{name}_sprite", "r32f", (4, 4), static=True, default=SPRITE.astype(np.float32))
    layer: pg.Target = pg.draw(
        _unit_quads(SPRITES[near] * count), vertex=_placed(2 * SPRITES[near] * count), fragment=shadow_sprite,
        into=pg.target(f"{name}_sprites", "rgba16f", like=scene), blend="alpha",
        values={
            "clip": window.clip, "sprite": sprite,
            "table": movers.map(lambda given: sprite_table(given, lights, reach, count, near)),
        },
    )  # fmt: skip
    if isinstance(share, pg.Value) or share != 1.0:
        kept = pg.target(f"{name}_faded", "rgba16f", like=scene)
        layer = faded(pg.previous(kept), layer, share, into=kept, name=f"{name}_faded")
    return darkened(scene, layer, into=into or pg.target(name, "rgba32f"), name=name)


def _unit_quads(count: int) -> Shape:
    """Return quads from (0, -1) to (1, 1), numbered in z."""
    corners = np.tile([[0.0, -1.0], [1.0, -1.0], [1.0, 1.0], [0.0, 1.0]], (count, 1))
    positions = np.column_stack([corners, np.repeat(np.arange(count), 4)]).astype(np.float32)
    triangles = (4 * np.arange(count)[:, None] + [0, 1, 2, 0, 2, 3]).reshape(-1, 3).astype(np.int32)
    uvs = np.column_stack([corners[:, 0], 0.5 - 0.5 * corners[:, 1]]).astype(np.float32)
    return Shape(positions, triangles, uvs, np.zeros((4 * count, 4), np.float32))
