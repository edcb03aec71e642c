"""Sepia: tone a picture brown like an old photograph."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Any

import passgraph as pg
from passgraph.effects.checked import effect
from passgraph.effects.quantities import Share
from passgraph.language import Image, dot, mix, vec3, vec4

#: Weights of red, green and blue in each channel.
BROWN: Any = ((0.393, 0.769, 0.189), (0.349, 0.686, 0.168), (0.272, 0.534, 0.131))


@pg.kernel
def toned(color: Image, amount: float) -> vec4:
    """Interpolate between the color and its brown."""
    c = color[0, 0].rgb
    brown = vec3(dot(BROWN[0], c), dot(BROWN[1], c), dot(BROWN[2], c))
    return vec4(mix(c, brown, amount), color[0, 0].a)


@effect("sepia")
def sepia(
    color: pg.Target,
    amount: Share | pg.Value | pg.Derived = 1.0,
    into: pg.TargetSpec | None = None,
    name: str = "sepia",
) -> pg.Target:
    """Tone a picture brown, like an old photograph.

    Parameters
    ----------
    color : encoded for display, any range; results are not clamped, and alpha stays
    amount : fraction of the toned color; 0 leaves the picture unchanged
    into : destination target; default: float32 named ``name``
    name : name of the pass

    Source: W3C, "Filter Effects Module Level 1", 2018: ``sepia()``.

    Examples
    --------
    >>> import numpy as np
    >>> with pg.compile(sepia(pg.Input("frame")), backend="reference") as program:
    ...     shown = program(frame=np.full((1, 1, 4), 0.5, np.float32))["sepia"]
    >>> shown[0, 0].round(2).tolist() == np.float32([0.68, 0.6, 0.47, 0.5]).tolist()
    True
    """
    return toned(color, amount, into=into or pg.target(name, "rgba32f"), name=name)
