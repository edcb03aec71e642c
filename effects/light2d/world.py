"""Lights and walls of a flat world, and their position in a picture."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import isfinite, pi

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph import arguments
from passgraph.effects.annotations import check_fields

Point = tuple[float, float]
Float64 = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Window:
    """The rectangle of the world that fills a picture; y points up, row 0 of the picture is its top.

    Attributes
    ----------
    left, bottom, right, top : world units; right above left, top above bottom

    >>> Window(0, 0, 8, 4).pixels((2.0, 3.0), (80, 40))
    (20.0, 10.0)
    """

    left: float
    bottom: float
    right: float
    top: float

    def __post_init__(self) -> None:
        check_fields(self)
        if not (self.left < self.right and self.bottom < self.top):
            raise pg.GraphError(f"window {self} needs left < right and bottom < top")

    def pixels(self, place: Point, size: tuple[int, int]) -> Point:
        """Return a world position in pixels of a (width, height) picture; the first pixel's center is (0.5, 0.5)."""
        x = (place[0] - self.left) / (self.right - self.left) * size[0]
        return x, (self.top - place[1]) / (self.top - self.bottom) * size[1]

    def world(self, pixel: Point, size: tuple[int, int]) -> Point:
        """The inverse of `pixels`."""
        x = self.left + pixel[0] / size[0] * (self.right - self.left)
        return x, self.top - pixel[1] / size[1] * (self.top - self.bottom)

    @property
    def clip(self) -> tuple[float, float, float, float]:
        """Return (scale x, scale y, offset x, offset y) from the world to clip space."""
        sx, sy = 2.0 / (self.right - self.left), 2.0 / (self.top - self.bottom)
        return sx, sy, -1.0 - sx * self.left, -1.0 - sy * self.bottom

    @property
    def corners(self) -> tuple[Point, Point, Point, Point]:
        return (self.left, self.bottom), (self.right, self.bottom), (self.right, self.top), (self.left, self.top)


@dataclass(frozen=True, slots=True)
class Light2D:
    """A round lamp in the plane.

    Attributes
    ----------
    position : its center, world units
    color : linear RGB at the middle, each 0 or more
    radius : radius of its light, world units, above 0; it falls as (1 - (distance / radius)²)²
    size : radius of the luminous disc, world units, 0 or more and below ``radius``; 0 casts hard shadows
    """

    position: Point
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    radius: float = 10.0
    size: float = 0.0

    def __post_init__(self) -> None:
        try:
            wrong = (len(self.position), len(self.color)) != (2, 3)
            finite = all(isfinite(v) for v in (*self.position, *self.color, self.radius, self.size))
        except (TypeError, ValueError, OverflowError):
            wrong = finite = True
        if wrong:  # the slow check, which names the field
            check_fields(self)
        if not finite:
            raise pg.GraphError(f"{self}: every number must be finite")
        if not (self.radius > 0.0 and 0.0 <= self.size < self.radius):
            raise pg.GraphError(f"{self}: radius must be above 0, and size from 0 to below radius")
        if min(self.color) < 0.0:
            raise pg.GraphError(f"{self}: color must be 0 or more")

    def moved(self, by: Point) -> Light2D:
        return Light2D((self.position[0] + by[0], self.position[1] + by[1]), self.color, self.radius, self.size)


@dataclass(frozen=True, slots=True)
class Wall:
    """An opaque obstacle: an outline of straight edges.

    Attributes
    ----------
    points : two or more corners, world units, in order
    closed : whether the last corner joins the first; the inside of a closed wall is dark
    """

    points: tuple[Point, ...]
    closed: bool = True

    def __post_init__(self) -> None:
        try:
            good = len(self.points) >= 2 and all(isfinite(x) and isfinite(y) for x, y in self.points)
        except (TypeError, ValueError, OverflowError):
            check_fields(self)
            raise
        arguments.flag(self.closed, "Wall: closed")
        if not good:
            raise pg.GraphError(f"a wall needs two or more finite corners, got {self.points}")

    @classmethod
    def box(cls, left: float, bottom: float, right: float, top: float) -> Wall:
        """Return an upright rectangle."""
        return cls(((left, bottom), (right, bottom), (right, top), (left, top)))

    @property
    def edges(self) -> tuple[tuple[Point, Point], ...]:
        ends = self.points[1:] + (self.points[:1] if self.closed and len(self.points) > 2 else ())
        return tuple(zip(self.points, ends, strict=False))


def all_edges(walls: Iterable[Wall]) -> Float64:
    """Return the edges (n, 4) as x, y, x, y, without those of zero length."""
    edges = [(*a, *b) for wall in walls for a, b in wall.edges if a != b]
    return np.array(edges, np.float64).reshape(-1, 4)


@dataclass(frozen=True, eq=False)
class Outlines:
    """All edges of some walls.

    Attributes
    ----------
    edges : (n, 4) as x, y, x, y
    walls : (n,) index of each edge's wall
    sides : (n,) 1 where a convex wall is to the left of the edge, -1 to the right; 0 for all other walls
    """

    edges: Float64
    walls: NDArray[np.int64]
    sides: NDArray[np.int64]


def outlines_of(walls: Iterable[Wall]) -> Outlines:
    """Return the edges of walls, and the side of each on which its wall is.

    >>> outlines_of([Wall.box(0, 0, 1, 1), Wall(((0, 0), (1, 0)))]).sides.tolist()
    [1, 1, 1, 1, 0]
    """
    edges, numbers, sides = [np.zeros((0, 4))], [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
    for number, wall in enumerate(walls):
        own = all_edges([wall])
        x, y = own[:, 2] - own[:, 0], own[:, 3] - own[:, 1]
        next_x, next_y = np.roll(x, -1), np.roll(y, -1)
        turns = np.arctan2(x * next_y - y * next_x, x * next_x + y * next_y)
        # exactly one turn in one direction: convex
        convex = (
            wall.closed and abs(abs(turns.sum()) - 2 * pi) < 1e-6 and bool((turns >= 0).all() or (turns <= 0).all())
        )
        edges.append(own)
        numbers.append(np.full(len(own), number))
        sides.append(np.full(len(own), int(np.sign(turns.sum())) if convex and len(own) > 2 else 0))
    return Outlines(np.concatenate(edges), np.concatenate(numbers), np.concatenate(sides))


def in_reach(edges: Float64, light: Light2D) -> Float64:
    """Return the edges (n, 4) that are near enough to occlude a light."""
    return edges[distance_to_edges(light.position, edges) < light.radius]


def distance_to_edges(place: Point, edges: Float64) -> Float64:
    """Return the distance of a place to each of the edges (n, 4), world units.

    >>> distance_to_edges((0.0, 2.0), np.array([[-1.0, 0.0, 1.0, 0.0], [3.0, 2.0, 3.0, 2.0]]))
    array([2., 3.])
    """
    start, along = edges[:, :2], edges[:, 2:] - edges[:, :2]
    away = np.array(place) - start
    t = np.clip((away * along).sum(1) / np.maximum((along * along).sum(1), 1e-300), 0.0, 1.0)
    return np.asarray(np.hypot(*(away - t[:, None] * along).T))
