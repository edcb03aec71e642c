"""What a thin lens sees of flat layers: rays from all over the lens, in NumPy."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import pi, sqrt

import numpy as np

from tests.effects.scenes import Float64, Picture


@dataclass(frozen=True)
class Layer:
    """A plane across the view axis, seen through a pinhole.

    Attributes
    ----------
    distance : along the view axis, m
    color : of places in the picture, px from its middle: x and y to (..., 3), linear light
    covers : whether the layer is there
    """

    distance: float
    color: Callable[[Float64, Float64], Float64]
    covers: Callable[[Float64, Float64], Float64]


@dataclass(frozen=True)
class Camera:
    """A thin lens before a sensor that shows a picture of this size; lengths in m."""

    size: tuple[int, int]
    focus: float
    focal_length: float = 0.05
    f_number: float = 2.0
    sensor_height: float = 0.024

    def shift_px(self, distance: float) -> float:
        """How far, in the picture, rays from the lens's rim meet a plane away from where the ray of its middle does.

        The sensor lies at v = F s / (s - F); a ray through a point (x, y) of the lens goes through the place in focus,
        s times its direction, and is at x · (1 - z / s) from the middle's ray at distance z.
        """
        image = self.focal_length * self.focus / (self.focus - self.focal_length)
        aperture = 0.5 * self.focal_length / self.f_number
        pixels = self.size[1] / self.sensor_height
        return aperture * (1.0 - distance / self.focus) / distance * image * pixels


def _lens(rays: int) -> Float64:
    """Places of equal area on the lens, (n, 2), within 1."""
    number = np.arange(rays) + 0.5
    out, angle = np.sqrt(number / rays), number * pi * (3.0 - sqrt(5.0))
    return np.stack([out * np.cos(angle), out * np.sin(angle)], axis=1)


def _places(size: tuple[int, int], parts: int) -> tuple[Float64, Float64]:
    width, height = size
    y, x = (np.mgrid[0 : height * parts, 0 : width * parts] + 0.5) / parts
    return x - width / 2, y - height / 2


def seen(camera: Camera, layers: Sequence[Layer], rays: int = 512, parts: int = 2) -> Float64:
    """The picture, (height, width, 3); layers are given from near to far, and the last is everywhere."""
    x, y = _places(camera.size, parts)
    total = np.zeros((*x.shape, 3))
    for u, v in _lens(rays):
        left = np.ones(x.shape, bool)
        for layer in layers:
            shift = camera.shift_px(layer.distance)
            at = x + u * shift, y + v * shift
            hit = left & (layer.covers(*at) > 0.5)
            total[hit] += layer.color(*at)[hit]
            left &= ~hit
    return _pixels(total / rays, camera.size, parts)


def pinhole(camera: Camera, layers: Sequence[Layer], parts: int = 2) -> tuple[Picture, Picture]:
    """What a renderer gives: colours, (height, width, 4), and distances, (height, width, 1), of pixels' middles."""
    x, y = _places(camera.size, parts)
    made = np.zeros((*x.shape, 3))
    left = np.ones(x.shape, bool)
    mx, my = _places(camera.size, 1)
    depth, free = np.zeros(mx.shape), np.ones(mx.shape, bool)
    for layer in layers:
        hit = left & (layer.covers(x, y) > 0.5)
        made[hit] = layer.color(x, y)[hit]
        left &= ~hit
        here = free & (layer.covers(mx, my) > 0.5)
        depth[here] = layer.distance
        free &= ~here
    smooth = _pixels(made, camera.size, parts)
    picture = np.ones((*smooth.shape[:2], 4), np.float32)
    picture[:, :, :3] = smooth
    return picture, depth[:, :, None].astype(np.float32)


def _pixels(samples: Float64, size: tuple[int, int], parts: int) -> Float64:
    width, height = size
    return np.asarray(samples.reshape(height, parts, width, parts, 3).mean(axis=(1, 3)))
