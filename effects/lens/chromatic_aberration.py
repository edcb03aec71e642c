"""Chromatic aberration: color fringes from different magnifications of red and blue."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Annotated

import passgraph as pg
from passgraph.effects.checked import effect
from passgraph.effects.pictures.decoded import decoded
from passgraph.language import Const, Image, uv, vec4


@pg.kernel
def dispersed(color: Image, spread: float, samples: Const[int]) -> vec4:
    """Average the picture at one size per wavelength, blue to red, none smaller than the original."""
    away = uv() - 0.5
    total, weights = vec4(0.0), vec4(0.0)
    for i in range(samples):
        place = 2.0 * float(i) / float(samples - 1) - 1.0
        weight = vec4(max(place, 0.0), 1.0 - abs(place), max(-place, 0.0), 1.0 - abs(place))
        c = color.sample(0.5 + away * (1.0 - 0.5 * (abs(spread) - spread * place)))
        # only channels that count, so that the others are not filtered
        for k in range(4):
            if weight[k] > 0.0:
                total[k] += c[k] * weight[k]
                weights[k] += weight[k]
    return total / weights


@effect("chromatic-aberration", alpha="premultiplied")
def chromatic_aberration(
    color: pg.Target,
    spread: Annotated[float, pg.Range(-0.2, 0.2)] | pg.Value | pg.Derived = 0.005,
    samples: Annotated[int, pg.Range(3, 33)] = 9,
    into: pg.TargetSpec | None = None,
    name: str = "chromatic_aberration",
) -> pg.Target:
    """Add color fringes that grow toward the corners: each wavelength has its own magnification.

    Parameters
    ----------
    color : linear light, any range; alpha, which should be premultiplied, moves with green
    spread : how much larger blue is than red, as a fraction of the size; 0.002 is a good lens, 0.01 a bad one
    samples : number of wavelengths. 3 show three separate pictures, 9 a spectrum for edges up to some 10 pixels wide
    into : destination target; default: float32 named ``name``
    name : name of the pass

    The aberration is lateral: the center stays sharp.  The weights of the wavelengths add up to 1 in each channel, so
    uniform areas stay unchanged.  The least magnified color fills the picture and the others extend beyond it, so
    nothing outside is read and borders have no fringe.

    Deviation from eyes: the sensitivities of red, green and blue are tents over the spectrum, so no channel is
    negative.

    Examples
    --------
    >>> import numpy as np
    >>> edge = (np.arange(32) < 28).astype(np.float32)[None, :, None] * np.ones(4, np.float32)
    >>> with pg.compile(chromatic_aberration(pg.Input("frame"), 0.1, 3), backend="reference") as program:
    ...     shown = program(frame=edge)["chromatic_aberration"]
    >>> [round(float(share), 2) for share in shown[0, 28]]
    [0.0, 0.62, 1.0, 0.62]
    """
    light = decoded(color, f"{name}_light")
    return dispersed(light, spread, samples, into=into or pg.target(name, "rgba32f"), name=name)
