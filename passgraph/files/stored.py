"""Between a file's own types and a program's: the one place where results become what is stored."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.files.frame import Stored
from passgraph.graph.targets import InputSpec
from passgraph.pictures import scaled
from passgraph.quantise import quantised
from passgraph.run.caller_arrays import GREY_CHANNELS, format_of
from passgraph.srgb import srgb_to_linear


def as_program_input(picture: Stored, spec: InputSpec, linear: bool) -> Stored:
    """What a program is given: integers as they are, or with ``linear`` their colours decoded from sRGB.

    What its input decodes itself (``"srgb"``, in 8 bits) stays as it is.
    Where its input is declared with four channels, gray and RGB pictures get them.
    """
    if picture.ndim == 3 and spec.format is not None and spec.format.channels == 4:
        picture = with_channels(picture, 4)
    if not linear or picture.dtype.kind != "u":
        return picture
    if spec.srgb and picture.ndim == 3 and format_of(picture.dtype, picture.shape[2], spec.srgb).srgb:
        return picture
    if picture.ndim == 2:
        one = picture[:, :, None]
        picture = with_channels(one, GREY_CHANNELS) if spec.format is None else one
    colours = picture.shape[2] - (picture.shape[2] in (2, 4))
    light = np.empty(picture.shape, np.float32)
    light[..., :colours] = _curve(picture.dtype.str)[picture[..., :colours]]
    light[..., colours:] = picture[..., colours:] / np.float32(np.iinfo(picture.dtype).max)
    return light


@cache
def _curve(dtype: str) -> NDArray[np.float32]:
    most = np.iinfo(dtype).max
    return srgb_to_linear(np.arange(most + 1, dtype=np.float32) / np.float32(most))


def stored(result: Stored, dtype: np.dtype[Any], name: str) -> Stored:
    """A program's result, in float32 or in integers, in the type that a sink stores.

    ``name`` is the frame's, for the error of NaN.
    """
    if result.dtype == dtype:
        return result
    values = scaled(result)
    return values if dtype.kind == "f" else quantised(values, dtype, name)


def with_channels(picture: Stored, count: int) -> Stored:
    """A picture with 1, 3 or 4 channels: gray is repeated, colours become gray by their luma, alpha is 1 if missing."""
    have = picture.shape[2]
    if have == count:
        return picture
    colours = picture[..., : 3 if have > 2 else 1]
    if count == 1:
        if colours.shape[2] == 1:
            return colours
        weights = np.array([0.2126, 0.7152, 0.0722], np.float32)  # Rec. 709
        luma: Stored = np.rint(colours.astype(np.float32) @ weights)[..., None].astype(picture.dtype)
        return luma
    made = np.empty((*picture.shape[:2], count), picture.dtype)
    made[..., :3] = colours
    if count == 4:
        opaque = np.iinfo(picture.dtype).max if picture.dtype.kind == "u" else 1
        made[..., 3] = picture[..., -1] if have in (2, 4) else opaque
    return made
