"""Sobel filter: the gradient of luminance, which is large at edges."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Literal

import passgraph as pg
from passgraph.effects.checked import effect
from passgraph.effects.color.black_and_white import REC709
from passgraph.effects.quantities import NotNegative
from passgraph.language import Image, dot, sqrt, vec3, vec4

Weights = Literal["sobel", "scharr", "prewitt"]
#: Weights of the middle row and of each row next to it in the mean of three differences.
MIDDLE: dict[Weights, float] = {"sobel": 0.5, "scharr": 0.625, "prewitt": 1.0 / 3.0}


@pg.kernel
def luminances(color: Image) -> float:
    """Return the relative luminance of each pixel."""
    return dot(color[0, 0].rgb, vec3(REC709[0], REC709[1], REC709[2]))


@pg.kernel
def steepness(light: Image, middle: float, strength: float) -> vec4:
    """Return the root mean square of both slopes, in luminance per two pixels."""
    side_weight = 0.5 - 0.5 * middle
    dx = middle * (light[1, 0].r - light[-1, 0].r)
    dx += side_weight * (light[1, -1].r - light[-1, -1].r + light[1, 1].r - light[-1, 1].r)
    dy = middle * (light[0, 1].r - light[0, -1].r)
    dy += side_weight * (light[-1, 1].r - light[-1, -1].r + light[1, 1].r - light[1, -1].r)
    return vec4(vec3(strength * sqrt(0.5 * (dx * dx + dy * dy))), 1.0)


@effect("sobel", alpha="premultiplied")
def sobel(
    color: pg.Target,
    weights: Weights = "sobel",
    strength: NotNegative | pg.Value | pg.Derived = 1.0,
    into: pg.TargetSpec | None = None,
    name: str = "sobel",
) -> pg.Target:
    """Show edges: the magnitude of the gradient of luminance, as gray.

    Parameters
    ----------
    color : any picture, Rec. 709 primaries, any range; premultiplied, edges are those over black. Outside of it, reads
        follow the rule of ``color.border(...)``
    weights : weights of the three averaged rows: 1, 2, 1 for "sobel", 3, 10, 3 for "scharr", which is more accurate in
        direction, 1, 1, 1 for "prewitt"
    strength : factor of the result; 1 shows a vertical step from 0 to 1 as 0.71
    into : destination target; default: float32 named ``name``. The result is opaque
    name : name of the passes and targets

    Source: I. Sobel, G. Feldman, "A 3x3 Isotropic Gradient Operator for Image Processing", 1968; H. Scharr, "Optimal
    Operators in Digital Image Processing", 2000. Scaled as in scikit-image.

    Examples
    --------
    >>> import numpy as np
    >>> edge = (np.arange(6) < 3).astype(np.float32)[None, :, None] * np.ones(4, np.float32)
    >>> with pg.compile(sobel(pg.Input("frame")), backend="reference") as program:
    ...     [round(float(y), 2) for y in program(frame=edge)["sobel"][0, :, 0]]
    [0.0, 0.0, 0.71, 0.71, 0.0, 0.0]
    """
    light = luminances(color, into=pg.target(f"{name}_luminance", "r32f", like=color), name=f"{name}_luminance")
    light = light.border(color.border_rule)
    return steepness(light, MIDDLE[weights], strength, into=into or pg.target(name, "rgba32f"), name=name)
