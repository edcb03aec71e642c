"""How far a shadow is from the truth."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan, sqrt

import numpy as np
from numpy.typing import NDArray

from passgraph.bench.likeness import Picture, flip_map, ssim_map
from passgraph.bench.truth import Float32, Mask, Truth
from passgraph.errors import InputError
from passgraph.srgb import linear_to_srgb

#: A hidden pixel counts as falsely lit, and one in full view as falsely dark, beyond this share of the light.
FALSE_SHARE = 0.1


@dataclass(frozen=True)
class Errors:
    """Over the pixels that count.

    Attributes
    ----------
    rmse : over all of them
    penumbra_rmse : over those whose true share is 0.01 to 0.99; NaN where there is none
    ssim : structural similarity, 1 is equal: Z. Wang et al., "Image Quality Assessment", 2004
    flip : mean of FLIP, 0 is equal: P. Andersson et al., "FLIP: A Difference Evaluator for Alternating Images", 2020
    false_lit : share of pixels without light (at most 0.01 of it) that show more than 0.1
    false_dark : share of pixels in full light (at least 0.99) that show less than 0.9
    """

    rmse: float
    penumbra_rmse: float
    ssim: float
    flip: float
    false_lit: float
    false_dark: float


def compared(share: Float32, truth: Truth, counts: Mask) -> Errors:
    """Errors of a shadow factor.

    Parameters
    ----------
    share : (h, w) share of the light that arrives, 0 to 1
    truth : what it is compared with
    counts : (h, w) where; elsewhere both count as lit
    """
    if not counts.any():
        raise InputError("bench: no pixel can be compared; is the light behind every surface that the camera sees?")
    made, true = np.where(counts, share, 1.0).astype(np.float32), np.where(counts, truth.share, 1.0)
    true = true.astype(np.float32)
    off = made.astype(np.float64) - true
    penumbra = counts & truth.penumbra
    return Errors(
        _root_mean_square(off[counts]),
        _root_mean_square(off[penumbra]) if penumbra.any() else nan,
        _mean(ssim_map(made, true), counts),
        _mean(flip_map(_shown(made), _shown(true)), counts),
        float(np.mean((true[counts] <= 0.01) & (made[counts] > FALSE_SHARE))),
        float(np.mean((true[counts] >= 0.99) & (made[counts] < 1.0 - FALSE_SHARE))),
    )


def _root_mean_square(values: NDArray[np.float64]) -> float:
    return sqrt(float(np.mean(values**2)))


def _mean(each: Picture | None, counts: Mask) -> float:
    return nan if each is None else float(np.mean(each[counts]))


def _shown(share: Float32) -> Float32:
    """A white surface on a display: sRGB in three equal channels."""
    x = np.clip(share, 0.0, 1.0)
    return np.ascontiguousarray(np.repeat(linear_to_srgb(x)[:, :, None], 3, axis=2), np.float32)
