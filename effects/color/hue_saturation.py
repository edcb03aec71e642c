"""Hue and saturation: rotate colors around gray, and scale their distance from it."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Annotated, Any

import passgraph as pg
from passgraph.effects.checked import effect
from passgraph.effects.quantities import NotNegative, axis_of, mapped
from passgraph.language import Image, dot, mix, vec2, vec3, vec4

#: Luma, and the matrix of a quarter turn, as in SVG.
LUMA = (0.213, 0.715, 0.072)
QUARTER_TURN: Any = ((-0.213, -0.715, 0.928), (0.143, 0.140, -0.283), (-0.787, 0.715, 0.072))


@pg.kernel
def turned(color: Image, axis: vec2, saturation: float) -> vec4:
    """Rotate by the angle of ``axis``, then scale the distance from luma."""
    c, weights = color[0, 0].rgb, vec3(LUMA[0], LUMA[1], LUMA[2])
    gray = vec3(dot(c, weights))
    quarter = vec3(dot(QUARTER_TURN[0], c), dot(QUARTER_TURN[1], c), dot(QUARTER_TURN[2], c))
    c = gray + axis.x * (c - gray) + axis.y * quarter
    return vec4(mix(vec3(dot(c, weights)), c, saturation), color[0, 0].a)


@effect("hue-saturation")
def hue_saturation(
    color: pg.Target,
    hue_rad: Annotated[float, pg.Range(-7, 7, "radians")] | pg.Value | pg.Derived = 0.0,
    saturation: NotNegative | pg.Value | pg.Derived = 1.0,
    into: pg.TargetSpec | None = None,
    name: str = "hue_saturation",
) -> pg.Target:
    """Rotate the hue of colors and change their saturation; luma stays.

    Parameters
    ----------
    color : encoded for display, any range; results are not clamped, and alpha stays
    hue_rad : angle around gray; 2.09, a third of a turn, turns red into green and green into blue
    saturation : factor of the distance from luma; 0 is gray
    into : destination target; default: float32 named ``name``
    name : name of the pass

    Source: W3C, "Filter Effects Module Level 1", 2018: ``hueRotate``, then ``saturate`` of ``feColorMatrix``, which are
    ``hue-rotate()`` and ``saturate()`` in CSS.

    Examples
    --------
    >>> import numpy as np
    >>> red = np.array([[[1, 0, 0, 1]]], np.float32)
    >>> with pg.compile(hue_saturation(pg.Input("frame"), 2.0943951), backend="reference") as program:
    ...     program(frame=red)["hue_saturation"][0, 0].round(2).tolist() == np.float32([-0.36, 0.44, -0.36, 1]).tolist()
    True
    """
    axis = mapped(hue_rad, axis_of)
    return turned(color, axis, saturation, into=into or pg.target(name, "rgba32f"), name=name)
