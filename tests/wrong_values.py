"""Values of every kind that does not fit somewhere, and small things that fit, to make one argument of a call wrong."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import passgraph as pg
from passgraph.scene import Camera, Light, Mesh, Node, Scene

KERNELS = """
class Corner:
    position: vec4
    color: vec4

class Lamp:
    place: vec3
    power: float

def place(vertex: Vertex, shift: vec3 = (0, 0, 0)) -> Corner:
    return Corner(vec4(vertex.position + shift, 1.0), vertex.color)

def paint(corner: Corner) -> vec4:
    return corner.color

def mixed(color: Image, gain: float, count: int, on: bool, tint: vec3, m: mat3, a: Array[float, 3],
          cells: Array[ivec2, 2], reach: Const[int] = 2, base: Const[vec2] = (0, 0)) -> vec4:
    total = color[0, 0] * gain + vec4(m * tint, a[0] + float(count + cells[0].x) + base.x)
    for i in range(reach):
        total += color[i, 0]
    return total if on else color[0, 0]

def copy(color: Image) -> vec4:
    return color[0, 0]

def lamplit(color: Image, lamp: Lamp) -> vec4:
    return color[0, 0] * lamp.power
"""
FRAME = np.full((4, 8, 4), 0.5, np.float32)


@cache
def kernel(name: str) -> Any:
    return pg.kernel(source=KERNELS, name=name)


@cache
def stage(name: str) -> Any:
    return (pg.vertex if name == "place" else pg.fragment)(source=KERNELS, name=name)


def frame(name: str = "frame") -> pg.Target:
    return pg.Input(name, "rgba32f", (8, 4))


@cache
def triangle() -> Mesh:
    return Mesh.make([[-1, -1, 0], [3, -1, 0], [-1, 3, 0]], [[0, 1, 2]])


@cache
def small_scene() -> Scene:
    return Scene((Node(triangle()),), Camera((0, 0, 5), (0, 0, 0)), (Light.directional((0, -1, -1)),))


class Hostile:
    """Looks like an array, and is none."""

    def __array__(self, *_: Any, **__: Any) -> Any:
        raise TypeError("no array")

    def __bool__(self) -> bool:
        raise RuntimeError("neither")

    def __repr__(self) -> str:
        return "<hostile>"


@cache
def values() -> dict[str, Any]:
    masked = np.ma.masked_array(np.ones((4, 8, 4), np.float32), mask=True)
    return {
        "None": None, "True": True, "0": 0, "3": 3, "-1": -1, "0.5": 0.5, "2**31": 2**31, "2**70": 2**70,
        "10**400": 10**400, "1e300": 1e300, "nan": float("nan"), "inf": float("inf"), "1j": 1j,
        "''": "", "'x'": "x", "'1'": "1", "'self'": "self", "'numpy:²'": "numpy:²", "a nul": "a\0b",
        "a lone surrogate": "\udcff", "bytes": b"x",
        "[]": [], "[1]": [1], "(1, 2)": (1, 2), "ragged": [[1], [1, 2]], "nested": [[[[1]]]], "(None,)": (None,),
        "('a', 'b')": ("a", "b"), "{}": {}, "{'x': 1}": {"x": 1}, "set": {1, 2}, "object": object(), "a class": int,
        "a function": len, "a generator": (i for i in ()), "hostile": Hostile(),
        "float32(1)": np.float32(1), "int64(3)": np.int64(3), "float32(nan)": np.float32("nan"),
        "an empty array": np.zeros(0), "a 0-d array": np.array(1.0), "an array of 3": np.zeros(3),
        "2x3": np.zeros((2, 3)),
        "4x8x4": FRAME, "4x8x5": np.zeros((4, 8, 5), np.float32), "of text": np.array(["a"]),
        "of objects": np.array([object(), None]), "complex": np.zeros((4, 8, 4), np.complex64),
        "of dates": np.zeros((4, 8), "datetime64[s]"), "structured": np.zeros((4, 8), [("r", "f4"), ("g", "f4")]),
        "masked": masked, "a target spec": pg.target("spec", "rgba32f"), "a depth spec": pg.target("deep", "depth32f"),
        "an input": pg.Input("other", "rgba32f", (8, 4)), "history": pg.previous(pg.target("old", "rgba32f")),
        "a target": kernel("copy")(frame("source")), "a value": pg.Value("given", float),
        "a derived value": pg.Value("given2", float).map(abs), "a kernel": kernel("copy"), "a mesh": triangle(),
        "a scene": small_scene(), "a camera": small_scene().camera, "a light": small_scene().lights[0],
        "a path": Path("/nowhere/at/all.png"), "a blend": pg.Blend(), "a stencil": pg.Stencil(),
        "a folder": Path("/"),
    }  # fmt: skip
