"""Graphs and pictures that the tests of tiles share, and the untiled truth."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.effects.color.black_and_white import black_and_white
from passgraph.effects.color.tone_map import tone_map
from passgraph.effects.filters.blur import depth_aware_blur, gaussian_blur

Picture = NDArray[np.float32]

KERNELS = """
def sobel(color: Image) -> vec4:
    dx = color[1, -1] + color[1, 0] * 2.0 + color[1, 1] - color[-1, -1] - color[-1, 0] * 2.0 - color[-1, 1]
    dy = color[-1, 1] + color[0, 1] * 2.0 + color[1, 1] - color[-1, -1] - color[0, -1] * 2.0 - color[1, -1]
    return sqrt(dx * dx + dy * dy)

def unsharp(color: Image, soft: Image, amount: float) -> vec4:
    return color[0, 0] + (color[0, 0] - soft[0, 0]) * amount

def vignette(color: Image, amount: float) -> vec4:
    d = uv() - 0.5
    return vec4(color[0, 0].rgb * (1.0 - amount * dot(d, d)), 1.0)

def placed(color: Image) -> vec4:
    size, here = vec2(color.size), vec2(pixel())
    share = 0.0
    for i in range(4):
        if i > 1:
            share += float(pixel().x % (i + 2)) / float(output_size().y)
    return color[-3, 2] * 0.5 + vec4(here / size, fract(here.x * 0.37 + here.y * 0.11), share)

def far(color: Image) -> vec4:
    return color[-9, 0] * 0.25 + color[5, 0] * 0.25 + color[0, -6] * 0.25 + color[0, 2] * 0.25

def grown(color: Image) -> vec4:
    c = color[0, 0]
    if c.r > 0.5:
        c = color[-2, 1] * 2.0 + dfdy(uv().y)
    return fwidth(c) + dfdy(dfdx(c * uv().x)) * float(pixel().y)

def one(color: Image) -> float:
    return color[-2, 1].r * 0.5 + color[1, -3].r * 0.25

def gradient() -> vec4:
    return vec4(uv(), fract(float(pixel().x) * 0.3), 1.0)

def looked_up(color: Image, table: Image) -> vec4:
    last = table.size.x - 1
    return table.texel(ivec2(int(color[1, 0].r * float(last)), 0)) + vec4(uv() * 0.1, 0.0, 0.0)

def soft3(color: Image) -> vec3:
    total = vec3(0.0)
    for i in range(-2, 3):
        total += color[i, 0].rgb * 0.2
    return total
"""


def kernel(name: str) -> Any:
    return pg.kernel(source=KERNELS, name=name)


def frame(border: str = "clamp") -> pg.Target:
    return pg.Input("frame").border(border)


def _unsharp(border: str) -> pg.Target:
    color = frame(border)
    made: pg.Target = kernel("unsharp")(color, gaussian_blur(color, 1.5), 0.75)
    return made


def _deep(border: str) -> pg.Target:
    """A chain whose passes read around themselves, at places of their own, through formats of all kinds."""
    first = kernel("placed")(frame(border), into=pg.target("first", "rgba16f"), name="first")
    soft = gaussian_blur(first.border(border), 2.0, name="soft")
    edges = kernel("far")(soft.border(border), into=pg.target("edges", "rgba8"), name="edges")
    second = kernel("placed")(edges.border(border), into=pg.target("second", "rgba32f"), name="second")
    made: pg.Target = kernel("unsharp")(second, first, 0.5, into=pg.target("deep", "rgba16"))
    return made


#: Name → graph of the input ``frame`` (and ``depth``) by a border rule.
GRAPHS: dict[str, Callable[[str], pg.Target]] = {
    "blur": lambda border: gaussian_blur(frame(border), 2.0, radius_px=7),
    "unsharp": _unsharp,
    "black and white": lambda border: black_and_white(frame(border)),
    "tone map": lambda border: tone_map(frame(border)),
    "sobel": lambda border: kernel("sobel")(frame(border)),
    "grown": lambda border: kernel("grown")(frame(border)),
    "vignette": lambda border: kernel("vignette")(gaussian_blur(frame(border), 1.0), 0.8),
    "depth-aware blur": lambda border: depth_aware_blur(frame(border), pg.Input("depth").border(border), 3),
    "deep": _deep,
}


def picture(width: int, height: int, channels: int = 4, seed: int = 0) -> Picture:
    return np.random.default_rng(seed).random((height, width, channels), np.float32)


def inputs(width: int, height: int) -> dict[str, Picture]:
    return {"frame": picture(width, height), "depth": 1.0 + 9.0 * picture(width, height, 1, seed=1)}


def untiled(outputs: Any, **given: Any) -> Picture:
    """The first result, computed whole."""
    with pg.compile(outputs) as program:
        result = program(**{name: value for name, value in given.items() if name in program.inputs})
        return next(iter(result.values()))


def same(one: Any, other: Any) -> bool:
    return bool(np.asarray(one).shape == np.asarray(other).shape and np.array_equal(one, other, equal_nan=True))
