"""Normalize: stretch a picture from two of its percentiles to 0 and 1."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Annotated

import passgraph as pg
from passgraph.effects.channels import result_like
from passgraph.effects.checked import effect
from passgraph.language import Image, ivec2, vec4

Percent = Annotated[float, pg.Range(0, 100, "%")]


@pg.kernel(alike=True)
def stretched(color: Image, low: Image, high: Image) -> vec4:
    """Map two numbers to 0 and 1."""
    c, dark, bright = color[0, 0], low.texel(ivec2(0, 0)).r, high.texel(ivec2(0, 0)).r
    return vec4((c.rgb - dark) / (bright - dark) if bright > dark else c.rgb - dark, c.a)


@effect("normalize", alike=True)
def normalize(
    color: pg.Target,
    low: Percent | pg.Value | pg.Derived = 1.0,
    high: Percent | pg.Value | pg.Derived = 99.0,
    into: pg.TargetSpec | None = None,
    name: str = "normalize",
) -> pg.Target:
    """Stretch the contrast: map two percentiles of luminance to 0 and 1.

    Parameters
    ----------
    color : any picture, any range; of one or two channels, the first one counts
    low : this share of the pixels becomes 0 or less
    high : this share of the pixels becomes 1 or less, and the others more
    into : destination target; default: float32 named ``name``
    name : name of the passes and targets

    Results are not clamped; alpha stays. NaN does not count. Tiles do not change the result (`passgraph.tiled`).
    Source: R. Gonzalez, R. Woods, "Digital Image Processing", 4th ed., 2018, 3.2, "Contrast stretching"; percentiles
    as ``numpy.percentile`` computes them with ``method="inverted_cdf"``.

    Examples
    --------
    >>> import numpy as np
    >>> ramp = np.linspace(0.2, 0.4, 101, dtype=np.float32)[None]
    >>> with pg.compile(normalize(pg.Input("frame", "r32f"), 0.0, 100.0), backend="reference") as program:
    ...     [round(float(y), 3) for y in program(frame=ramp)["normalize"][0, ::50, 0]]
    [0.0, 0.5, 1.0]
    """
    dark, bright = (pg.percentile(color, share, name=f"{name}_{end}") for share, end in ((low, "low"), (high, "high")))
    return stretched(color, dark, bright, into=result_like(color, into, name), name=name)
