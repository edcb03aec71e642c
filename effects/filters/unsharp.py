"""Unsharp mask: add the detail that a blur removes."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Annotated

import passgraph as pg
from passgraph.effects.channels import between, result_like
from passgraph.effects.checked import effect
from passgraph.effects.filters.blur import gaussian_blur
from passgraph.effects.pictures.decoded import decoded
from passgraph.effects.quantities import NotNegative
from passgraph.language import Image, clamp, vec4


@pg.kernel(alike=True)
def sharpened(color: Image, soft: Image, amount: float, threshold: float) -> vec4:
    """Add the difference from the mean of visible pixels around; alpha stays."""
    c, mean = color[0, 0], soft[0, 0]
    detail = c.rgb - mean.rgb * (c.a / mean.a if mean.a > 0.0 else 1.0)
    return vec4(c.rgb + amount * (detail - clamp(detail, -threshold, threshold)), c.a)


@effect("unsharp", alpha="premultiplied", alike=True)
def unsharp(
    color: pg.Target,
    amount: NotNegative | pg.Value | pg.Derived = 0.8,
    sigma_px: Annotated[float, pg.Range(0, 100, "px", above=True)] = 1.5,
    threshold: NotNegative | pg.Value | pg.Derived = 0.0,
    into: pg.TargetSpec | None = None,
    name: str = "unsharp",
) -> pg.Target:
    """Sharpen a picture by an unsharp mask.

    Parameters
    ----------
    color : any picture, any range; encoded values give light and dark halos of the same strength. Alpha, which should
        be premultiplied, stays: color is compared with the mean of the visible color around it, so that outlines of
        cut-out pictures get no halo
    amount : factor of the added detail; 0 leaves the picture unchanged
    sigma_px : standard deviation of the Gaussian; detail is finer than this
    threshold : differences in a channel up to this count as noise; it is subtracted from larger ones
    into : destination target; default: float32 named ``name``
    name : name of the passes and targets

    Source: R. Gonzalez, R. Woods, "Digital Image Processing", 4th ed., 2018, 3.6, "Unsharp masking and highboost
    filtering". Results are not clamped.

    Examples
    --------
    >>> import numpy as np
    >>> edge = (np.arange(16) < 8).astype(np.float32)[None, :, None] * np.ones(4, np.float32)
    >>> edge[..., 3] = 1.0
    >>> with pg.compile(unsharp(pg.Input("frame"), 1.0), backend="reference") as program:
    ...     [round(float(y), 2) for y in program(frame=edge)["unsharp"][0, 6:10, 0]]
    [1.15, 1.37, -0.37, -0.15]
    """
    light = decoded(color, f"{name}_light")
    result = result_like(light, into, name)
    soft = gaussian_blur(light, sigma_px, into=pg.target(f"{name}_soft", between(light, result)), name=f"{name}_soft")
    return sharpened(light, soft, amount, threshold, into=result, name=name)
