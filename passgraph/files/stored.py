"""Convert pictures between the dtypes of files and those of programs."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.files.frame import Stored
from passgraph.graph.targets import InputSpec
from passgraph.pictures import scaled
from passgraph.quantise import integers_of, opaque
from passgraph.run.caller_arrays import GREY_CHANNELS, format_of
from passgraph.srgb import srgb_to_linear


def as_program_input(picture: Stored, spec: InputSpec, linear: bool) -> Stored:
    """Convert a picture to a program's input: integers are passed as they are, or decoded from sRGB if ``linear``.

    8-bit pictures of an ``"srgb"`` input are passed as they are, since the program decodes them. Gray and RGB pictures
    get four channels if the input is declared with four.
    """
    if picture.ndim == 3 and spec.format is not None and spec.format.channels == 4:
        picture = with_channels(picture, 4)
    if not linear or picture.dtype.kind != "u":
        return picture
    if spec.srgb and picture.ndim == 3 and format_of(picture.dtype, picture.shape[2], spec.srgb).srgb:
        return picture
    if picture.ndim == 2:
        gray = picture[:, :, None]
        picture = with_channels(gray, GREY_CHANNELS) if spec.format is None else gray
    colours = picture.shape[2] - (picture.shape[2] in (2, 4))
    decoded = np.empty(picture.shape, np.float32)
    decoded[..., :colours] = _curve(picture.dtype.str)[picture[..., :colours]]
    decoded[..., colours:] = picture[..., colours:] / np.float32(np.iinfo(picture.dtype).max)
    return decoded


@cache
def _curve(dtype: str) -> NDArray[np.float32]:
    """Return the lookup table of the sRGB decoding of an integer dtype."""
    most = np.iinfo(dtype).max
    return srgb_to_linear(np.arange(most + 1, dtype=np.float32) / np.float32(most))


def stored(result: Stored, dtype: np.dtype[Any], name: str) -> Stored:
    """Convert a program's result, float32 or integers, to the dtype that a sink stores.

    ``name`` is the frame's name for the error about NaN.
    """
    if result.dtype == dtype:
        return result
    values = scaled(result)
    return values if dtype.kind == "f" else integers_of(values, dtype, name)


def with_channels(picture: Stored, count: int) -> Stored:
    """Convert a picture to 1, 3 or 4 channels: gray is repeated, colors become luma, missing alpha is 1."""
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
    converted = np.empty((*picture.shape[:2], count), picture.dtype)
    converted[..., :3] = colours
    if count == 4:
        converted[..., 3] = picture[..., -1] if have in (2, 4) else opaque(picture.dtype)
    return converted
