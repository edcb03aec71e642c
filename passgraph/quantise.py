"""Convert host pictures to and from the numbers of formats: the only place where the host rounds."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import InputError
from passgraph.formats import Format, colour_format, float_format

FloatBlock = NDArray[np.float32]
#: Values converted at a time, so that temporaries stay in the processor's cache.
CHUNK = 1 << 16


def numbers_of(values: NDArray[Any], format_: Format, whose: str = "") -> NDArray[Any]:
    """Convert values to the numbers that a format stores: the nearest, halves to even.

    Scaling is computed in float32, as in kernels: 254.5 / 255 is a half then, although it is not exact in float32.
    NaN becomes 0 in integers; if ``whose`` names the values, it is an InputError.

    >>> numbers_of(np.array([0.0, 0.5 / 255, 1.5 / 255, 7.0, np.nan, -np.inf]), Format("r8", 1, 8, 255))
    array([  0,   0,   2, 255,   0,   0], dtype=uint8)
    """
    with np.errstate(all="ignore"):  # values above 65504 overflow in half precision
        if format_.steps:
            return _steps(np.asarray(values), format_, whose)
        return np.ascontiguousarray(np.asarray(values).astype(np.float32, copy=False), format_.number)


def _steps(picture: NDArray[Any], format_: Format, whose: str) -> NDArray[Any]:
    counted = np.empty(picture.shape, format_.number)
    values, steps = picture.reshape(-1), counted.reshape(-1)
    buffer = np.empty(min(CHUNK, values.size), np.float32)
    for start in range(0, values.size, CHUNK):
        chunk = values[start : start + CHUNK]
        part = buffer[: chunk.size]
        np.clip(chunk.astype(np.float32, copy=False), 0, 1, out=part)
        if np.isnan(part.min()):
            if whose:
                check_no_nan(picture, whose)
            np.copyto(part, 0, where=np.isnan(part))
        np.multiply(part, np.float32(format_.steps), out=part)
        np.rint(part, out=part)
        np.copyto(steps[start : start + CHUNK], part, casting="unsafe")
    return counted


def integers_of(values: NDArray[Any], dtype: np.dtype[Any], whose: str) -> NDArray[Any]:
    """Convert floats of any shape to uint8 or uint16: clip to [0, 1], round half to even.

    Raises
    ------
    InputError : for NaN, which has no integer value; ``whose`` begins its message.

    >>> integers_of(np.array([-1.0, 0.5, 2.0]), np.dtype(np.uint8), "three").tolist()
    [0, 128, 255]
    """
    format_ = colour_format(dtype.str[1:], 1)
    assert format_ is not None and format_.steps
    return numbers_of(values, format_, whose)


def opaque(dtype: np.dtype[Any]) -> int:
    """Return the number that stands for alpha 1 in arrays of a dtype.

    >>> opaque(np.dtype(np.uint8)), opaque(np.dtype(np.float16))
    (255, 1)
    """
    return int(np.iinfo(dtype).max) if dtype.kind == "u" else 1


def check_no_nan(pixels: NDArray[Any], whose: str) -> None:
    """Raise InputError with the position of the first NaN in a picture (h, w, channels)."""
    missing = np.isnan(pixels)
    if missing.any():
        row, column, channel = (int(i) for i in np.argwhere(np.atleast_3d(missing))[0])
        raise InputError(
            f"{whose}: {int(missing.sum())} of {pixels.size} values are NaN, the first in row {row},"
            f" column {column}, channel {channel}; save as .exr or .npy to look at them"
        )


def values_of(numbers: NDArray[Any], format_: Format) -> FloatBlock:
    """Convert stored numbers to float32; fractions are rounded once."""
    if numbers.dtype == np.float32 and not format_.steps:
        return numbers
    values = np.empty(numbers.shape, np.float32)
    _values_into(values, numbers, format_)
    return values


def _values_into(values: NDArray[np.float32], numbers: NDArray[Any], format_: Format) -> None:
    """Convert stored numbers into a float32 array of the same shape, with any strides."""
    if not format_.steps or numbers.size <= CHUNK:
        np.copyto(values, numbers)
        if format_.steps:
            np.divide(values, np.float32(format_.steps), out=values)
        return
    if len(numbers) == 1:
        _values_into(values[0], numbers[0], format_)
        return
    rows = max(1, CHUNK * len(numbers) // numbers.size)
    for start in range(0, len(numbers), rows):
        _values_into(values[start : start + rows], numbers[start : start + rows], format_)


def convert(source: NDArray[Any], held: Format, into: NDArray[Any], wanted: Format) -> None:
    """Copy a picture (height, width, channels) into one of another format. Strides and byte order may be any.

    Alpha that the source lacks is 1; channels that the destination lacks are left out.

    >>> made = np.empty((1, 1, 4), np.float32)
    >>> convert(np.array([[[0, 51, 255]]], np.uint8), Format("rgb8", 3, 8, 255), made, float_format(4))
    >>> made
    array([[[0. , 0.2, 1. , 1. ]]], dtype=float32)
    """
    channels = min(held.channels, wanted.channels)
    source, common = source[..., :channels], into[..., :channels]
    into[..., channels:] = wanted.steps or 1
    if held.number == wanted.number:
        np.copyto(common, source)
    elif wanted.number == "f4":
        _values_into(common, source, held)
    else:
        np.copyto(common, numbers_of(values_of(source, held), wanted))


def converted(source: NDArray[Any], held: Format, wanted: Format) -> NDArray[Any]:
    """Return a picture in another format; the array itself if its numbers and channels are the same."""
    if source.dtype == np.dtype(wanted.number) and held.channels == wanted.channels:
        return source
    into = np.empty((*source.shape[:2], wanted.channels), wanted.number)
    convert(source, held, into, wanted)
    return into


def transfer_format(array: NDArray[Any], format_: Format) -> Format:
    """Return the format of a caller's array for a picture: values as float32, else the picture's own numbers."""
    return float_format(format_.channels) if array.dtype == np.float32 else format_


def quantised(values: NDArray[Any], format_: Format) -> FloatBlock:
    """Round values to the nearest that a format stores, as :func:`numbers_of` does.

    Used for uploads, clears and the reference's blending; kernels write values that are already rounded.

    >>> quantised(np.array([0.4 / 255, 1.6 / 255, 7.0]), Format("r8", 1, 8, 255)) * 255
    array([  0.,   2., 255.], dtype=float32)
    """
    return values_of(numbers_of(values, format_), format_)
