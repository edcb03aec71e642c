"""Proxies: pictures that are reduced by a whole number before anything is computed with them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Rows of a result that are computed at a time, so that temporaries stay small.
_ROWS = 64


def reduced(picture: NDArray[Any], factor: int) -> NDArray[Any]:
    """Return the mean of each square of ``factor`` × ``factor`` pixels, in the same dtype; edge pixels are repeated.

    Colors with alpha, the last of two or four channels, count by their alpha.

    >>> reduced(np.uint8([[[0], [4], [8]]]), 2)[..., 0].tolist()
    [[2, 8]]
    """
    if factor == 1:
        return picture
    height, width, channels = picture.shape
    rows, columns = -(-height // factor), -(-width // factor)
    result = np.empty((rows, columns, channels), picture.dtype)
    for top in range(0, rows, _ROWS):
        part = picture[top * factor : (top + _ROWS) * factor]
        padding = (-part.shape[0] % factor, -width % factor)
        padded = np.pad(part, ((0, padding[0]), (0, padding[1]), (0, 0)), mode="edge").astype(np.float32)
        squares = padded.reshape(-1, factor, columns, factor, channels)
        if channels in (2, 4) and not (squares[..., -1:] == squares[0, 0, 0, 0, -1]).all():
            alpha = squares[..., -1:]
            total = alpha.sum(axis=(1, 3))
            with np.errstate(all="ignore"):
                colors = (squares[..., :-1] * alpha).sum(axis=(1, 3)) / total
            plain = squares[..., :-1].mean(axis=(1, 3))
            mean = np.concatenate([np.where(total > 0, colors, plain), total / factor**2], axis=-1)
        else:
            mean = squares.mean(axis=(1, 3))
        result[top : top + _ROWS] = np.rint(mean) if picture.dtype.kind == "u" else mean
    return result


def sampled(picture: NDArray[Any], factor: int) -> NDArray[Any]:
    """Return the pixel at the center of each square of ``factor`` × ``factor`` pixels: for depth and other data.

    >>> sampled(np.arange(5.0).reshape(1, 5, 1), 2)[..., 0].tolist()
    [[1.0, 3.0, 4.0]]
    """
    if factor == 1:
        return picture
    rows, columns = (
        np.minimum(np.arange(-(-size // factor)) * factor + factor // 2, size - 1) for size in picture.shape[:2]
    )
    return np.ascontiguousarray(picture[rows][:, columns])
