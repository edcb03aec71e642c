"""Y'CbCr of 8 bits in planes to R'G'B'A' and back: a kernel each way, in float32, rounded once.

Source: ITU-T H.273 (2023), section 8.3, equations for MatrixCoefficients and VideoFullRangeFlag.
"""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from passgraph.graph.calls import kernel
from passgraph.graph.targets import Input, target
from passgraph.graph.values import Value
from passgraph.language.symbols import Image, vec2, vec3, vec4
from passgraph.language.vectors import dot
from passgraph.run.compile import compile
from passgraph.run.program import Program

#: (height, width) uint8, with any stride between rows.
Plane: TypeAlias = NDArray[np.uint8]
#: (height, width, 4) uint8.
Pixels: TypeAlias = NDArray[np.uint8]


@dataclass(frozen=True)
class Code:
    """How bytes stand for colours.

    Attributes
    ----------
    red, blue : what luma weighs them; green has the rest
    full : luma from 0 to 255 and not from 16 to 235
    """

    red: float
    blue: float
    full: bool

    def values(self) -> dict[str, Any]:
        """What both programs are given: of 1 for a byte of 255, zero and scale of luma and of chroma."""
        zero, luma, chroma = (0, 255, 255) if self.full else (16, 219, 224)
        of_red, of_blue = 2 - 2 * self.red, 2 - 2 * self.blue
        green = 1 - self.red - self.blue
        return {
            "zero": (zero / 255, 128 / 255),
            "scale": (luma / 255, chroma / 255),
            "weights": (self.red, green, self.blue),
            "by_red": (of_red, of_red * self.red / green),
            "by_blue": (of_blue, of_blue * self.blue / green),
        }


@kernel
def _colours(luma: Image, blue: Image, red: Image, zero: vec2, scale: vec2, by_blue: vec2, by_red: vec2) -> vec4:
    y = (luma[0, 0].r - zero.x) / scale.x
    cb = (blue[0, 0].r - zero.y) / scale.y
    cr = (red[0, 0].r - zero.y) / scale.y
    return vec4(y + by_red.x * cr, y - by_red.y * cr - by_blue.y * cb, y + by_blue.x * cb, 1.0)


@kernel
def _planes(
    pixels: Image, weights: vec3, zero: vec2, scale: vec2, by_blue: vec2, by_red: vec2
) -> tuple[float, float, float]:
    c = pixels[0, 0].rgb
    y = dot(c, weights)
    cb = (c.b - y) / by_blue.x
    cr = (c.r - y) / by_red.x
    return y * scale.x + zero.x, cb * scale.y + zero.y, cr * scale.y + zero.y


def pixels_of(planes: Sequence[Plane], code: Code) -> Pixels:
    """Y', Cb, Cr and perhaps alpha, all of one size, as pixels: each byte the nearest to its colour."""
    values = code.values()
    del values["weights"]
    pixels: Any = _reader()(luma=planes[0], blue=planes[1], red=planes[2], **values)["pixels"]
    if len(planes) == 4:
        pixels[..., 3] = planes[3]
    made: Pixels = pixels
    return made


def to_planes(pixels: Pixels, planes: Sequence[Plane], code: Code) -> None:
    """Pixels into Y', Cb, Cr and perhaps alpha, of their size."""
    _writer()(pixels=pixels, into=dict(zip(_NAMES, planes, strict=False)), **code.values())
    if len(planes) == 4:
        planes[3][...] = pixels[..., 3]


_NAMES = ("luma", "blue", "red")
_VALUES: Any = {name: Value(name) for name in ("zero", "scale", "by_blue", "by_red")}


@cache
def _reader() -> Program:
    """Compiled once a process, for all threads."""
    luma, blue, red = (Input(name, "r8") for name in _NAMES)
    made = _colours(luma, blue, red, **_VALUES, into=target("pixels", "rgba8", like=luma))
    return compile(made, "numpy", results="stored")


@cache
def _writer() -> Program:
    pixels = Input("pixels", "rgba8")
    into = [target(name, "r8", like=pixels) for name in _NAMES]
    return compile(_planes(pixels, weights=Value("weights"), **_VALUES, into=into), "numpy", results="stored")
