"""Y'CbCr of 8 to 16 bits in planes to R'G'B'A' and back: a kernel each way, in float32, rounded once.

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

#: (height, width) uint8, or uint16 of more than 8 bits, with any stride between rows.
Plane: TypeAlias = NDArray[Any]
#: (height, width, 4) uint8 or uint16.
Pixels: TypeAlias = NDArray[Any]


@dataclass(frozen=True)
class Code:
    """How whole numbers stand for colors.

    Attributes
    ----------
    red, blue : what luma weighs them; green has the rest
    full : luma from 0 to the largest number, and not from 16 to 235 (of 8 bits)
    bits : of a number, 8 to 16
    """

    red: float
    blue: float
    full: bool
    bits: int = 8

    @property
    def most(self) -> int:
        """The largest number."""
        return (1 << self.bits) - 1

    def values(self) -> dict[str, Any]:
        """What both programs are given: zero and scale of luma and of chroma, where the type's largest number is 1."""
        step = 1 << (self.bits - 8)
        zero, luma, chroma = (0, self.most, self.most) if self.full else (16 * step, 219 * step, 224 * step)
        one = 255 if self.bits == 8 else 65535
        of_red, of_blue = 2 - 2 * self.red, 2 - 2 * self.blue
        green = 1 - self.red - self.blue
        return {
            "zero": (zero / one, 128 * step / one),
            "scale": (luma / one, chroma / one),
            "most": self.most / one,
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
    pixels: Image, weights: vec3, zero: vec2, scale: vec2, by_blue: vec2, by_red: vec2, most: float
) -> tuple[float, float, float]:
    c = pixels[0, 0].rgb
    y = dot(c, weights)
    cb = (c.b - y) / by_blue.x
    cr = (c.r - y) / by_red.x
    return min(y * scale.x + zero.x, most), min(cb * scale.y + zero.y, most), min(cr * scale.y + zero.y, most)


def pixels_of(planes: Sequence[Plane], code: Code, dtype: type[np.uint8 | np.uint16] = np.uint8) -> Pixels:
    """Y', Cb, Cr and perhaps alpha, all of one size, as pixels: each number the nearest to its color."""
    values = code.values()
    del values["weights"], values["most"]
    pixels: Any = _reader(planes[0].itemsize, np.dtype(dtype).itemsize)(
        luma=planes[0], blue=planes[1], red=planes[2], **values
    )["pixels"]
    if len(planes) == 4:
        pixels[..., 3] = _rescaled(planes[3], code.most, np.iinfo(dtype).max)
    made: Pixels = pixels
    return made


def to_planes(pixels: Pixels, planes: Sequence[Plane], code: Code) -> None:
    """Pixels into Y', Cb, Cr and perhaps alpha, of their size."""
    _writer(pixels.itemsize, planes[0].itemsize)(
        pixels=pixels, into=dict(zip(_NAMES, planes, strict=False)), **code.values()
    )
    if len(planes) == 4:
        planes[3][...] = _rescaled(pixels[..., 3], np.iinfo(pixels.dtype).max, code.most)


def _rescaled(numbers: NDArray[Any], most: int, wanted: int) -> NDArray[Any]:
    """Alpha from 0 to ``most`` as the nearest from 0 to ``wanted``."""
    return numbers if most == wanted else (numbers.astype(np.uint32) * wanted + most // 2) // most


_NAMES = ("luma", "blue", "red")
_VALUES: Any = {name: Value(name) for name in ("zero", "scale", "by_blue", "by_red")}


@cache
def _reader(from_bytes: int, to_bytes: int) -> Program:
    """Compiled once a process, for all threads."""
    luma, blue, red = (Input(name, f"r{8 * from_bytes}") for name in _NAMES)
    made = _colours(luma, blue, red, **_VALUES, into=target("pixels", f"rgba{8 * to_bytes}", like=luma))
    return compile(made, "numpy", results="stored")


@cache
def _writer(from_bytes: int, to_bytes: int) -> Program:
    pixels = Input("pixels", f"rgba{8 * from_bytes}")
    into = [target(name, f"r{8 * to_bytes}", like=pixels) for name in _NAMES]
    more: Any = {name: Value(name) for name in ("weights", "most")}
    return compile(_planes(pixels, **more, **_VALUES, into=into), "numpy", results="stored")
