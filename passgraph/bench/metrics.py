"""Metrics: similarity of two pictures, error of a shadow, and the Pareto front of methods."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from math import nan, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.bench.truth import Float32, Mask, Truth
from passgraph.errors import InputError
from passgraph.srgb import linear_to_srgb

Picture = NDArray[Any]

#: Width of SSIM's window in texels; smaller pictures have no SSIM.
SMALLEST_SIDE = 11


def ssim_map(got: Picture, true: Picture, span: float = 1.0) -> Picture | None:
    """Return the structural similarity of each pixel, 1 is equal; None if a picture is smaller than the window.

    Source: Z. Wang et al., "Image Quality Assessment: From Error Visibility to Structural Similarity", 2004.

    Parameters
    ----------
    made, true : (h, w) or (h, w, channels); channels are averaged
    span : difference of the highest and lowest value that the pictures can have
    """
    if min(got.shape[:2]) < SMALLEST_SIDE:
        return None
    from skimage.metrics import structural_similarity

    measured: Any = structural_similarity
    axis = None if got.ndim == 2 else 2
    _, each = measured(
        got, true, data_range=span, gaussian_weights=True, sigma=1.5, use_sample_covariance=False, full=True,
        channel_axis=axis,
    )  # fmt: skip
    return np.asarray(each if axis is None else each.mean(axis=2))


def flip_map(got: Picture, true: Picture) -> Picture | None:
    """Return the perceived difference of each pixel on a display, 0 is equal; pictures are (h, w, 3), sRGB, 0 to 1.

    None if flip-evaluator is not installed (the ``flip`` extra).

    Source: P. Andersson et al., "FLIP: A Difference Evaluator for Alternating Images", 2020.
    """
    try:
        import flip_evaluator
    except ImportError:
        return None

    each, _, _ = flip_evaluator.evaluate(true, got, "LDR", applyMagma=False, computeMeanError=False)
    return np.asarray(each)[:, :, 0]


def check_installed(say: Callable[[str], None]) -> None:
    """Raise InputError if a package for the metrics is missing; ``say`` gets a line about an optional one."""
    needed = ("skimage", "matplotlib")
    missing = [name for name in needed if find_spec(name) is None]
    if missing:
        raise InputError(f"bench needs {', '.join(missing)}; run: pip install 'passgraph[bench]'")
    if find_spec("flip_evaluator") is None:
        say("FLIP is not measured (nan); flip-evaluator is not installed; run: pip install 'passgraph[flip]'")


#: Share of the light beyond which a hidden pixel is falsely lit, or one in full view falsely dark.
FALSE_SHARE = 0.1


@dataclass(frozen=True)
class Errors:
    """Errors over the compared pixels.

    Attributes
    ----------
    rmse : over all of them
    penumbra_rmse : over those with a true share of 0.01 to 0.99; NaN if there are none
    ssim : structural similarity, 1 is equal: Z. Wang et al., "Image Quality Assessment", 2004
    flip : mean of FLIP, 0 is equal: P. Andersson et al., "FLIP: A Difference Evaluator for Alternating Images", 2020.
        NaN without the ``flip`` extra
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
    """Measure the errors of a shadow factor.

    Parameters
    ----------
    share : (h, w) visible share of the light, 0 to 1
    truth : the ground truth
    counts : (h, w) compared pixels; elsewhere both count as lit
    """
    if not counts.any():
        raise InputError("bench: no pixel can be compared; is the light behind every surface that the camera sees?")
    computed, true = np.where(counts, share, 1.0).astype(np.float32), np.where(counts, truth.share, 1.0)
    true = true.astype(np.float32)
    off = computed.astype(np.float64) - true
    penumbra = counts & truth.penumbra
    return Errors(
        _root_mean_square(off[counts]),
        _root_mean_square(off[penumbra]) if penumbra.any() else nan,
        _mean(ssim_map(computed, true), counts),
        _mean(flip_map(_shown(computed), _shown(true)), counts),
        float(np.mean((true[counts] <= 0.01) & (computed[counts] > FALSE_SHARE))),
        float(np.mean((true[counts] >= 0.99) & (computed[counts] < 1.0 - FALSE_SHARE))),
    )


def _root_mean_square(values: NDArray[np.float64]) -> float:
    return sqrt(float(np.mean(values**2)))


def _mean(each: Picture | None, counts: Mask) -> float:
    return nan if each is None else float(np.mean(each[counts]))


def _shown(share: Float32) -> Float32:
    """Return a white surface as displayed: sRGB in three equal channels."""
    x = np.clip(share, 0.0, 1.0)
    return np.ascontiguousarray(np.repeat(linear_to_srgb(x)[:, :, None], 3, axis=2), np.float32)


def front(points: Sequence[tuple[float, float]]) -> list[int]:
    """Return the indices of the Pareto front: points that no other beats in one coordinate without losing in the other.

    >>> front([(1.0, 9.0), (2.0, 9.0), (3.0, 4.0), (4.0, 5.0), (9.0, 1.0)])
    [0, 2, 4]
    """
    order = sorted(range(len(points)), key=lambda i: points[i])
    on_front: list[int] = []
    for i in order:
        if not on_front or points[i][1] < points[on_front[-1]][1]:
            on_front.append(i)
    return on_front
