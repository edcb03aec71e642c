"""What a luminous disc sheds on each pixel of a flat world, by rays cast at evenly spaced angles."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from passgraph.effects.light2d import Light2D, Wall, Window
from passgraph.effects.light2d.world import edges_near
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
    light: Light2D, walls: Sequence[Wall], size: tuple[int, int], window: Window, rays: int = RAYS
) -> Float64:
    """Share of the lamp's angle that each pixel sees, (height, width); 1 inside the lamp."""
    at = places(size, window).reshape(-1, 2)
    toward = np.array(light.position) - at
    far = np.hypot(toward[:, 0], toward[:, 1])
    half = np.arcsin(np.minimum(light.size / far, 1.0))
    middle = np.arctan2(toward[:, 1], toward[:, 0])
    seen = np.zeros(len(at))
    for k in range(rays):
        off = half * ((2 * k + 1) / rays - 1)
        ray = np.stack([np.cos(middle + off), np.sin(middle + off)], axis=1)
        reach = far * np.cos(off) - np.sqrt(np.maximum(light.size**2 - (far * np.sin(off)) ** 2, 0))
        free = np.ones(len(at), bool)
        for ax, ay, bx, by in edges_near(walls, light):
            a, d = np.array([ax, ay]) - at, np.array([bx - ax, by - ay])
            across = ray[:, 0] * d[1] - ray[:, 1] * d[0]
            with np.errstate(divide="ignore", invalid="ignore"):
                t = (a[:, 0] * d[1] - a[:, 1] * d[0]) / across
                s = (a[:, 0] * ray[:, 1] - a[:, 1] * ray[:, 0]) / across
            free &= ~((t > 0) & (t < reach) & (s >= 0) & (s <= 1))
        seen += free
    return np.where(far <= light.size, 1.0, seen / rays).reshape(size[1], size[0])
