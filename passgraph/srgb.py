"""The sRGB curve on the host (IEC 61966-2-1:1999, section 5), in the dtype of the argument.

Kernels use ``encode_srgb`` and ``decode_srgb`` of
:mod:`passgraph.language.prelude`.
"""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Floats = TypeVar("Floats", bound=NDArray[Any])


def srgb_to_linear(encoded: Floats) -> Floats:
    """Decode sRGB-encoded values in [0, 1] to linear light.

    >>> srgb_to_linear(np.array([0.0, 0.5, 1.0])).round(4).tolist()
    [0.0, 0.214, 1.0]
    """
    curved = ((np.maximum(encoded, 0) + 0.055) / 1.055) ** 2.4
    return np.where(encoded <= 0.04045, encoded / 12.92, curved)  # type: ignore[return-value]


def linear_to_srgb(light: Floats) -> Floats:
    """Encode linear light in [0, 1] as sRGB.

    >>> linear_to_srgb(np.array([0.0, 0.214, 1.0])).round(2).tolist()
    [0.0, 0.5, 1.0]
    """
    curved = 1.055 * np.maximum(light, 0) ** (1 / 2.4) - 0.055
    return np.where(light <= 0.0031308, 12.92 * light, curved)  # type: ignore[return-value]
