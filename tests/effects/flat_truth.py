"""What a luminous disc sheds on each pixel of a flat world, by rays cast at evenly spaced angles."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from passgraph.effects.light2d import Light2D, Wall, Window
from passgraph.effects.light2d.world import all_edges, in_reach
from tests.effects.scenes import Float64

RAYS = 401


def places(size: tuple[int, int], window: Window) -> Float64:
    """World place of each pixel's centre, (height, width, 2)."""
    x, y = np.meshgrid(np.arange(size[0]) + 0.5, np.arange(size[1]) + 0.5)
    x, y = window.world((x, y), size)  # type: ignore[arg-type]
    return np.stack([x, y], axis=2)


def faded(light: Light2D, at: Float64) -> Float64:
    """The light's falloff alone."""
    t = np.minimum(np.hypot(*np.moveaxis(at - light.position, 2, 0)) / light.radius, 1.0)
    return np.asarray((1.0 - t * t) ** 2)


def share_in_sight(
    light: Light2D,
    walls: Sequence[Wall],
    size: tuple[int, int],
    window: Window,
    rays: int = RAYS,
    every_px: int = 1,
) -> Float64:
    """Share of the lamp's angle that each pixel sees, 1 inside the lamp; of every so many pixels each way."""
    start = every_px // 2
    chosen = places(size, window)[start::every_px, start::every_px]
    # all rays to a point are one; as many pixels at once as stay in a processor's cache
    some = chosen.reshape(-1, 2)
    parts = [_seen(light, walls, some[i : i + 128], rays if light.size else 1) for i in range(0, len(some), 128)]
    return np.concatenate(parts).reshape(chosen.shape[:2])


def _seen(light: Light2D, walls: Sequence[Wall], at: Float64, rays: int) -> Float64:
    """The share of some places (n, 2)."""
    toward = np.array(light.position) - at
    far = np.hypot(toward[:, 0], toward[:, 1])[:, None]
    half = np.arcsin(np.minimum(light.size / far, 1.0))
    off = half * ((2 * np.arange(rays) + 1) / rays - 1)
    angle = np.arctan2(toward[:, 1], toward[:, 0])[:, None] + off
    ray_x, ray_y = np.cos(angle), np.sin(angle)
    reach = far * np.cos(off) - np.sqrt(np.maximum(light.size**2 - (far * np.sin(off)) ** 2, 0))
    free = np.ones(angle.shape, bool)
    for ax, ay, bx, by in in_reach(all_edges(walls), light):
        a, d = np.array([ax, ay]) - at, np.array([bx - ax, by - ay])
        # on the ray at t / across, on the edge at s / across; of both the sign that makes across positive
        across = ray_x * d[1] - ray_y * d[0]
        sign = np.sign(across)
        across *= sign
        t = (a[:, 0] * d[1] - a[:, 1] * d[0])[:, None] * sign
        s = (a[:, :1] * ray_y - a[:, 1:] * ray_x) * sign
        free &= ~((t > 0) & (t < reach * across) & (s >= 0) & (s <= across))
    return np.where(far[:, 0] <= light.size, 1.0, free.mean(axis=1))
