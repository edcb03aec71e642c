"""A shader read here beside the same text on OpenGL."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from original import HEAD, Original

import passgraph as pg
from passgraph.glsl import Shader, parse
from passgraph.graph.calls import PixelKernel

Picture = NDArray[np.float32]


def picture(width: int, height: int, seed: int = 0) -> Picture:
    """Gradients with noise over them, of values that float32 and float16 hold alike."""
    y, x = np.mgrid[0:height, 0:width]
    smooth = np.stack([x / width, y / height, (np.sin(x * 0.3) + 1) / 2, np.ones_like(x)], -1)
    noise = np.random.default_rng(seed).random((height, width, 4)) * [1, 1, 1, 0]
    return np.round((0.7 * smooth + 0.3 * noise) * 256).astype(np.float32) / 256


def run(
    shader: Shader, size: tuple[int, int], pictures: dict[str, Picture], values: dict[str, Any] | None = None,
    backend: str = "reference",
) -> Picture:  # fmt: skip
    """What a shader draws here, always of four channels."""
    kernel: PixelKernel[Any] = PixelKernel.of_program(shader.program)
    needed = {p.name: pg.Input(p.name) for p in kernel.parameters if p.name in pictures}
    given = {p.name: (values or {})[p.name] for p in kernel.parameters if p.name in (values or {})}
    target = kernel(into=pg.target("shown", format="rgba32f", scale=1.0), **needed, **given)
    with pg.compile(target, backend=backend, size=size) as program:
        return np.asarray(program(**{name: pictures[name] for name in needed})["shown"])


def both(
    gl: Original, text: str, size: tuple[int, int] = (5, 4), pictures: dict[str, Picture] | None = None,
    values: dict[str, Any] | None = None, *, newer: bool = False,
) -> tuple[Picture, Picture]:  # fmt: skip
    """The picture made here and the one that OpenGL makes, which reads the text as GLSL 3.30 or 4.30."""
    pictures = pictures or {}
    head = HEAD.replace("330", "430") if newer else HEAD
    return run(parse(text), size, pictures, values), gl.run(text, size, pictures, values or {}, head)
