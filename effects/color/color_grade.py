"""Color grading: white balance, contrast, split toning, lift, gamma, gain, saturation."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from math import hypot
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.effects.checked import effect
from passgraph.effects.color.black_and_white import REC709
from passgraph.effects.quantities import NotNegative, combined
from passgraph.language import Image, dot, mat3, mix, vec3, vec4

#: D65, the white of Rec. 709: color temperature, and distance from the Planckian locus in CIE 1960 (u, v).
D65_K, D65_DUV = 6504.0, 0.0032
#: Linear Rec. 709 to CIE XYZ (IEC 61966-2-1), and XYZ to the cone responses of Bradford.
XYZ_FROM_RGB = ((0.4124, 0.3576, 0.1805), (0.2126, 0.7152, 0.0722), (0.0193, 0.1192, 0.9505))
BRADFORD = ((0.8951, 0.2664, -0.1614), (-0.7502, 1.7135, 0.0367), (0.0389, -0.0685, 1.0296))
#: Planckian locus: u and v as quotients of polynomials in the temperature: numerators, then denominators.
KRYSTEK = (
    ((0.860117757, 1.54118254e-4, 1.28641212e-7), (0.317398726, 4.22806245e-5, 4.20481691e-8)),
    ((1.0, 8.42420235e-4, 7.08145163e-7), (1.0, -2.89741816e-5, 1.61456053e-7)),
)
Kelvin = Annotated[float, pg.Range(1000, 15000, "K")]
Duv = Annotated[float, pg.Range(-0.05, 0.05, "CIE 1960 uv")]
Tint = Annotated[tuple[float, float, float], pg.Range(0, None, above=True)]
Gamma = Annotated[tuple[float, float, float], pg.Range(0.1, 10)]
Gain = Annotated[tuple[float, float, float], pg.Range(0)]
Lift = Annotated[tuple[float, float, float], pg.Range(-1, 1)]
Float64 = NDArray[np.float64]


def planckian(kelvin: float) -> tuple[float, float]:
    """Return CIE 1960 (u, v) of a black body."""
    terms = (1.0, kelvin, kelvin * kelvin)
    over, under = ([sum(a * t for a, t in zip(row, terms, strict=True)) for row in part] for part in KRYSTEK)
    return over[0] / under[0], over[1] / under[1]


def white_of(kelvin: float, duv: float) -> Float64:
    """Return CIE XYZ, with Y = 1, of a light by its color temperature and its distance from the Planckian locus."""
    (u, v), (u1, v1) = planckian(kelvin), planckian(kelvin + 0.5)
    # across the locus; v is larger on the green side
    across = duv / hypot(u1 - u, v1 - v)
    u, v = u + across * (v1 - v), v + across * (u - u1)
    return np.array([1.5 * u / v, 1.0, (2.0 - 0.5 * u) / v - 5.0])


def balance(kelvin: float, duv: float) -> Float64:
    """Return the matrix from linear Rec. 709 to itself that turns this light's white into white."""
    cones = np.array(BRADFORD) @ np.array(XYZ_FROM_RGB)
    gains = (np.array(BRADFORD) @ white_of(D65_K, D65_DUV)) / (np.array(BRADFORD) @ white_of(kelvin, duv))
    return np.asarray(np.linalg.solve(cones, gains[:, None] * cones))


@pg.function
def signed_power(x: vec3, exponent: float) -> vec3:
    """Raise the magnitude to a power and keep the sign of ``x``."""
    power = pow(abs(x), vec3(exponent))
    return vec3(
        power.r if x.r > 0.0 else -power.r, power.g if x.g > 0.0 else -power.g, power.b if x.b > 0.0 else -power.b
    )


@pg.function
def power_above_0(x: float, exponent: float) -> float:
    """Raise numbers above 0 to a power; others stay."""
    return pow(x, exponent) if x > 0.0 else x


@pg.kernel
def graded(
    color: Image,
    balance: mat3,
    contrast: float,
    pivot: float,
    shadows: vec3,
    highlights: vec3,
    lift: vec3,
    gamma: vec3,
    gain: vec3,
    saturation: float,
) -> vec4:
    """Apply all steps in the order of the parameters."""
    weights = vec3(REC709[0], REC709[1], REC709[2])
    c = balance * color[0, 0].rgb
    if contrast != 1.0:
        c = signed_power(c / pivot, contrast) * pivot
    light = max(dot(c, weights), 0.0)
    tint = mix(shadows / dot(shadows, weights), highlights / dot(highlights, weights), light / (light + pivot))
    c = c * tint * (gain - lift) + lift
    if gamma.r != 1.0 or gamma.g != 1.0 or gamma.b != 1.0:
        c = vec3(
            power_above_0(c.r, 1.0 / gamma.r), power_above_0(c.g, 1.0 / gamma.g), power_above_0(c.b, 1.0 / gamma.b)
        )
    return vec4(mix(vec3(dot(c, weights)), c, saturation), color[0, 0].a)


@effect("color-grade", linear=True)
def color_grade(
    color: pg.Target,
    temperature_k: Kelvin | pg.Value | pg.Derived = D65_K,
    duv: Duv | pg.Value | pg.Derived = D65_DUV,
    contrast: NotNegative | pg.Value | pg.Derived = 1.0,
    pivot: Annotated[float, pg.Range(0, None, above=True)] | pg.Value | pg.Derived = 0.18,
    shadows: Tint | pg.Value | pg.Derived = (1.0, 1.0, 1.0),
    highlights: Tint | pg.Value | pg.Derived = (1.0, 1.0, 1.0),
    lift: Lift | pg.Value | pg.Derived = (0.0, 0.0, 0.0),
    gamma: Gamma | pg.Value | pg.Derived = (1.0, 1.0, 1.0),
    gain: Gain | pg.Value | pg.Derived = (1.0, 1.0, 1.0),
    saturation: NotNegative | pg.Value | pg.Derived = 1.0,
    into: pg.TargetSpec | None = None,
    name: str = "color_grade",
) -> pg.Target:
    """Grade scene-linear color: white balance, contrast, split toning, lift, gamma, gain and saturation, in this order.

    Parameters
    ----------
    color : scene-linear light, Rec. 709 primaries, any range; alpha stays
    temperature_k : color temperature of the scene's light, which becomes white. Below 6504 the picture turns bluer, as
        the light was warmer than daylight
    duv : distance of that light from the Planckian locus: 0 for incandescent lamps, 0.0032 for daylight; more for
        greener light, which makes the picture more magenta
    contrast : exponent of color divided by the pivot
    pivot : scene-linear value that contrast leaves unchanged, and where split toning is half of each tint
    shadows : color that multiplies dark pixels; only its hue and saturation count
    highlights : color that multiplies bright pixels; only its hue and saturation count
    lift : result for black
    gamma : exponent 1 / gamma for values above 0
    gain : result for 1, before gamma
    saturation : factor of each channel's distance from luminance; 0 is gray
    into : destination target; default: float32 named ``name``
    name : name of the pass

    Steps, with the luminance Y of Rec. 709: Bradford's matrix from the scene's white to D65; ``pivot * (c / pivot) **
    contrast`` with the sign of ``c``; a tint from ``shadows`` to ``highlights``, each with the luminance 1, by ``Y / (Y
    + pivot)``; ``(c * (gain - lift) + lift) ** (1 / gamma)``; ``Y + saturation * (c - Y)``.

    Source: K. M. Lam, "Metamerism and Colour Constancy", 1985 (Bradford); M. Krystek, "An Algorithm to Calculate
    Correlated Color Temperature", 1985 (Planckian locus, below 15,000 K within 1e-4); ASC CDL 1.2 with the slope
    ``gain - lift``, the offset ``lift`` and the power ``1 / gamma``, without its clamps.

    Examples
    --------
    >>> frame = np.full((1, 1, 4), (0.72, 0.18, 0.09, 1.0), np.float32)
    >>> with pg.compile(color_grade(pg.Input("frame"), contrast=2.0), backend="reference") as program:
    ...     program(frame=frame)["color_grade"].round(3)[0, 0].tolist() == np.float32([2.88, 0.18, 0.045, 1]).tolist()
    True
    """
    given = combined(balance, temperature_k, duv)
    return graded(
        color, given, contrast, pivot, shadows, highlights, lift, gamma, gain, saturation,
        into=into or pg.target(name, "rgba32f"), name=name,
    )  # fmt: skip
