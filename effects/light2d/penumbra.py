"""The exact shadow of a luminous disc in the plane: which share of its angle is in sight."""

# mypy: disable-error-code="no-any-return,type-arg,valid-type,index"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from functools import lru_cache
from math import pi
from typing import Any

import numpy as np

import passgraph as pg
from passgraph import Array, asin, atan, cos, dot, length, sin, sqrt, vec2, vec3, vec4
from passgraph.effects.light2d.shapes import Spot
from passgraph.effects.light2d.world import Float64

#: Most edges within one light's reach: its kernel compares each with each.
MAX_EDGES = 128


@pg.function
def falloff(distance: float, radius: float) -> float:
    """(1 - (distance / radius)²)², 0 from the radius on."""
    t = min(distance / radius, 1.0)
    return (1.0 - t * t) * (1.0 - t * t)


@pg.function
def cross2(a: vec2, b: vec2) -> float:
    return a.x * b.y - a.y * b.x


@pg.fragment
def gradient(spot: Spot, color: vec3, light: vec4) -> vec4:
    """The light without shadows; ``light`` is (x, y, radius, size)."""
    return vec4(color * falloff(length(spot.place - light.xy), light.z), 0.0)


@lru_cache(maxsize=16)
def penumbra_kernel(count: int) -> Any:
    """The light with exact soft shadows of ``count`` edges, each (ax, ay, bx, by) in world units."""

    @pg.fragment
    def soft_light(spot: Spot, color: vec3, light: vec4, edges: Array[vec4, count]) -> vec4:
        toward = light.xy - spot.place
        far = length(toward)
        if far <= light.w:  # inside the lamp
            return vec4(color * falloff(far, light.z), 0.0)
        axis = toward / far
        side = vec2(-axis.y, axis.x)
        half = asin(light.w / far)
        low = [0.0] * count
        high = [0.0] * count
        for i in range(count):
            a = edges[i].xy - spot.place
            b = edges[i].zw - spot.place
            angle_a = atan(dot(side, a), dot(axis, a))
            angle_b = atan(dot(side, b), dot(axis, b))
            start = min(angle_a, angle_b)
            end = max(angle_a, angle_b)
            if end - start > pi:  # the edge passes behind this place
                first = start
                start = end if end < half else end - 2.0 * pi
                end = first + 2.0 * pi if end < half else first
            start = max(start, -half)
            end = min(end, half)
            low[i] = 4.0
            high[i] = 4.0
            if start < end:
                # an edge that does not touch the lamp is either before or behind it in all of the overlap
                middle = 0.5 * (start + end)
                ray = axis * cos(middle) + side * sin(middle)
                off = far * sin(middle)
                lamp = far * cos(middle) - sqrt(max(light.w * light.w - off * off, 0.0))
                if cross2(a, b - a) / cross2(ray, b - a) < lamp:
                    low[i] = start
                    high[i] = end
        # walk from one end of the lamp to the other, through covered stretches and gaps in turn
        at = -half
        visible = 0.0
        for _step in range(2 * count + 1):
            end = at
            gap = half
            for i in range(count):
                if low[i] <= at:
                    end = max(end, high[i])
                else:
                    gap = min(gap, low[i])
            if end <= at:
                visible += gap - at
                end = gap
            at = end
            if at >= half:
                break
        return vec4(color * (falloff(far, light.z) * visible / (2.0 * half)), 0.0)

    return soft_light


def padded(edges: Float64) -> Float64:
    """Edges up to the next power of two, at least 4, so that scenes share kernels; those added have no length."""
    count = max(len(edges), 1)
    if count > MAX_EDGES:
        raise pg.GraphError(
            f"light map: {count} edges lie within one light's reach, and {MAX_EDGES} may; join walls, or choose "
            "penumbra='rotate' or 'move'"
        )
    size = max(4, 1 << (count - 1).bit_length())
    filled = np.zeros((size, 4))
    filled[: len(edges)] = edges
    if len(edges):
        filled[len(edges) :] = np.tile(edges[0, :2], 2)
    return filled
