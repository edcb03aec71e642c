"""Tone mapping: scene-linear HDR to what a display shows."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Literal

import passgraph as pg
from passgraph import Const, Image, exp2, vec3, vec4

Curve = Literal["linear", "reinhard", "hable", "aces"]
CURVES: tuple[Curve, ...] = ("linear", "reinhard", "hable", "aces")
#: Brightest input in scene-linear units: the largest float16. Infinity becomes this.
BRIGHTEST = 65504.0
#: Hable's white point: the input that becomes 1.
HABLE_WHITE = 11.2


@pg.function
def finite(x: float) -> float:
    """0 for NaN and below 0, BRIGHTEST at most."""
    return min(x if x > 0.0 else 0.0, BRIGHTEST)


@pg.function
def hable(x: float) -> float:
    """Hable's filmic polynomial before it is scaled by the white point."""
    return (x * (0.15 * x + 0.05) + 0.004) / (x * (0.15 * x + 0.5) + 0.06) - 0.02 / 0.3


@pg.function
def compress(x: float, curve: int) -> float:
    """One channel through the curve, to [0, 1]."""
    y = x
    if curve == 1:
        y = x / (1.0 + x)
    if curve == 2:
        y = hable(x) / hable(HABLE_WHITE)
    if curve == 3:
        # divided through by x, so that large x stays finite
        y = x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)
    return min(max(y, 0.0), 1.0)


@pg.function
def encode_srgb(x: float) -> float:
    """IEC 61966-2-1, x in [0, 1]."""
    return 12.92 * x if x <= 0.0031308 else 1.055 * pow(x, 1.0 / 2.4) - 0.055


@pg.kernel
def tone(color: Image, exposure_stops: float, curve: Const[int], encode: Const[bool]) -> vec4:
    """Exposure, curve, encoding."""
    here = color[0, 0]
    lit = here.rgb * exp2(exposure_stops)
    shown = vec3(compress(finite(lit.r), curve), compress(finite(lit.g), curve), compress(finite(lit.b), curve))
    if encode:
        shown = vec3(encode_srgb(shown.r), encode_srgb(shown.g), encode_srgb(shown.b))
    return vec4(shown, min(finite(here.a), 1.0))


def tone_map(
    frame: pg.Target,
    exposure_stops: float | pg.Value | pg.Derived = 0.0,
    curve: Curve = "aces",
    encode: bool = True,
    into: pg.TargetSpec | None = None,
    name: str = "tone_map",
) -> pg.Target:
    """A scene-linear picture as a display shows it. NaN and negative values become black, infinity white.

    Parameters
    ----------
    frame : scene-linear, Rec. 709 primaries, any range
    exposure_stops : factor 2 a stop, -16 to 16; may be a ``pg.Value``
    curve : "linear" clips at 1; "reinhard" x / (1 + x); "hable" filmic, white at 11.2; "aces" Narkowicz's fit
    encode : sRGB-encode the result; off leaves it linear in [0, 1]
    into : where it goes; left out, 8 bits a channel where encoded, else float16, with the name ``name``
    name : of the pass

    Source: E. Reinhard et al., "Photographic Tone Reproduction for Digital Images", 2002, eq. 3; J. Hable,
    "Uncharted 2: HDR Lighting", GDC 2010; K. Narkowicz, "ACES Filmic Tone Mapping Curve", 2015.

    Examples
    --------
    >>> import numpy as np
    >>> shown = tone_map(pg.Input("frame"), curve="reinhard", encode=False)
    >>> with pg.compile(shown, backend="reference") as program:
    ...     program(frame=np.full((1, 1, 4), 1.0, np.float32))["tone_map"][0, 0, 0].item()
    0.5
    """
    if curve not in CURVES:
        raise pg.GraphError(f"tone_map: curve cannot be {curve!r}; it is one of {', '.join(CURVES)}")
    target = into or pg.target(name, "rgba8" if encode else "rgba16f")
    made: pg.Target = tone(frame, exposure_stops, CURVES.index(curve), encode, into=target, name=name)
    return made
