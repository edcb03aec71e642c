"""How like two pictures look, pixel by pixel."""

from __future__ import annotations

from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import InputError

Picture = NDArray[Any]

#: Pictures smaller than this have no SSIM: width of its window, 11 texels.
SMALLEST_SIDE = 11


def ssim_map(made: Picture, true: Picture, span: float = 1.0) -> Picture | None:
    """Structural similarity of each pixel, 1 is equal; None where a picture is too small for its window.

    Source: Z. Wang et al., "Image Quality Assessment: From Error Visibility to Structural Similarity", 2004.

    Parameters
    ----------
    made, true : (h, w) or (h, w, channels); channels are averaged
    span : the difference of the highest and lowest value that the pictures can have
    """
    if min(made.shape[:2]) < SMALLEST_SIDE:
        return None
    from skimage.metrics import structural_similarity

    measured: Any = structural_similarity
    axis = None if made.ndim == 2 else 2
    _, each = measured(
        made, true, data_range=span, gaussian_weights=True, sigma=1.5, use_sample_covariance=False, full=True,
        channel_axis=axis,
    )  # fmt: skip
    return np.asarray(each if axis is None else each.mean(axis=2))


def flip_map(made: Picture, true: Picture) -> Picture:
    """Perceived difference of each pixel on a display, 0 is equal; pictures are (h, w, 3), sRGB, 0 to 1.

    Source: P. Andersson et al., "FLIP: A Difference Evaluator for Alternating Images", 2020.
    """
    import flip_evaluator

    each, _, _ = flip_evaluator.evaluate(true, made, "LDR", applyMagma=False, computeMeanError=False)
    return np.asarray(each)[:, :, 0]


def check_installed() -> None:
    """Raise InputError where what the measures need is not here."""
    needed = ("skimage", "flip_evaluator", "matplotlib")
    missing = [name for name in needed if find_spec(name) is None]
    if missing:
        raise InputError(f"bench needs {', '.join(missing)}; run: pip install 'passgraph[bench]'")
