"""Three-dimensional pictures: slices below one another in one picture, as `Target.slices` reads them."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from passgraph import arguments
from passgraph.errors import InputError


def stacked(volume: object) -> NDArray[Any]:
    """A volume (depth, height, width) or (depth, height, width, channels) as the picture of its slices.

    The picture is (depth · height, width[, channels]), of the same dtype, without a copy where the memory allows it.

    Raises
    ------
    InputError
        For what is no array of numbers of three or four dimensions, none of them empty.

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
