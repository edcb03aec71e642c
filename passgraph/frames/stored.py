"""Between a file's own types and a program's: the one place where results become what is stored."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.frames.frame import Stored
from passgraph.quantise import quantised
from passgraph.srgb import srgb_to_linear


def given(picture: Stored, linear: bool) -> Stored:
    """What a program is given: integers as they are, or with ``linear`` their colours decoded from sRGB."""
    if not linear or picture.dtype.kind != "u":
        return picture
    colours = picture.shape[2] - (picture.shape[2] in (2, 4))
    light = np.empty(picture.shape, np.float32)
    light[..., :colours] = _curve(picture.dtype.str)[picture[..., :colours]]
    light[..., colours:] = picture[..., colours:] / np.float32(np.iinfo(picture.dtype).max)
    return light


@cache
def _curve(dtype: str) -> NDArray[np.float32]:
    most = np.iinfo(dtype).max
    return srgb_to_linear(np.arange(most + 1, dtype=np.float32) / np.float32(most))


def stored(result: NDArray[np.float32], dtype: np.dtype[Any], name: str) -> Stored:
    """A program's result in the type that a sink stores; ``name`` is the frame's, for the error of NaN."""
    return result if dtype.kind == "f" else quantised(result, dtype, name)
