"""Black and white: the smallest effect."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Annotated

import passgraph as pg
from passgraph.effects.checked import effect
from passgraph.language import Image, dot, vec3, vec4

#: Luma weights of Rec. ITU-R BT.709-6, item 3.2, and of BT.601-7 for older material.
REC709 = (0.2126, 0.7152, 0.0722)
REC601 = (0.299, 0.587, 0.114)


@pg.kernel
def luma(color: Image, weights: vec3) -> vec4:
    """Return the weighted sum of red, green and blue."""
    here = color[0, 0]
    y = dot(here.rgb, weights)
    return vec4(y, y, y, here.a)


@effect("black-and-white")
def black_and_white(
    frame: pg.Target,
    weights: Annotated[tuple[float, float, float], pg.Range(0, 1)] = REC709,
    into: pg.TargetSpec | None = None,
) -> pg.Target:
    """Convert color to gray: each pixel's luma in all three channels; alpha stays.

    Parameters
    ----------
    frame : a picture in any color space; linear light gives luminance, encoded values give luma
    weights : weights of red, green and blue, which should add up to 1
    into : destination target; default: a float32 target "black_and_white"

    Source: Rec. ITU-R BT.709-6 (2015), item 3.2.

    Examples
    --------
    >>> import numpy as np
    >>> gray = black_and_white(pg.Input("frame"))
    >>> with pg.compile(gray, backend="reference") as program:
    ...     picture = program(frame=np.array([[[0, 1, 0, 1]]], np.float32))["black_and_white"]
    >>> picture[0, 0].round(4).tolist() == [np.float32(0.7152)] * 3 + [1.0]
    True
    """
    return luma(frame, weights, into=into or pg.target("black_and_white", "rgba32f"), name="black_and_white")
