"""Volumes: slices stored one below another in a picture, as `Target.slices` reads them."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from passgraph import arguments
from passgraph.errors import InputError


def stacked(volume: object) -> NDArray[Any]:
    """Return a volume (depth, height, width[, channels]) as one picture with its slices one below another.

    The picture is (depth · height, width[, channels]) in the same dtype; it is a view of the volume where possible.

    Raises
    ------
    InputError
        Unless it is a non-empty array of numbers with three or four dimensions.

    Examples
    --------
    >>> import numpy as np
    >>> stacked(np.zeros((33, 33, 33, 3), np.float32)).shape
    (1089, 33, 3)
    """
    expected = "be an array (depth, height, width) or (depth, height, width, channels)"
    array = arguments.numbers(volume, "a volume", expected)
    if array.ndim not in (3, 4) or 0 in array.shape:
        raise InputError(f"a volume must {expected}, got one of shape {array.shape}")
    depth, height = array.shape[:2]
    return array.reshape(depth * height, *array.shape[2:])
