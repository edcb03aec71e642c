"""Halftone: dots of ink whose size follows the darkness of the picture."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from math import cos, pi, sin
from typing import Annotated, Any

import passgraph as pg
from passgraph.effects.checked import effect
from passgraph.effects.color.black_and_white import REC709
from passgraph.effects.quantities import axis_of, mapped
from passgraph.language import Const, Image, clamp, fract, pixel, vec2, vec3, vec4

#: Samples of a pixel in each direction.
SAMPLES = 4
#: Rotations of the screens of cyan, magenta and yellow relative to black, as cosine and sine: the usual printing
#: angles.
SCREENS: Any = tuple((cos(angle * pi / 180.0), sin(angle * pi / 180.0)) for angle in (-30.0, 30.0, -45.0, 0.0))


@pg.function
def inked(ink: float, axis: vec2, cell: float) -> float:
    """Return the fraction of this pixel under diamonds that cover the fraction ``ink`` of each cell."""
    # At least one of four inks is absent
    if not ink > 0.0:
        return 0.0
    covered = 0.0
    for j in range(SAMPLES):
        for i in range(SAMPLES):
            p = vec2(pixel()) + (vec2(float(i), float(j)) + 0.5) / float(SAMPLES)
            q = fract(vec2(p.x * axis.x + p.y * axis.y, p.y * axis.x - p.x * axis.y) / cell) - 0.5
            d = abs(q.x) + abs(q.y)
            # The fraction of a cell that is nearer to its center
            nearer = 2.0 * d * d if d < 0.5 else 1.0 - 2.0 * (1.0 - d) * (1.0 - d)
            covered += 1.0 if nearer < ink else 0.0
    return covered / float(SAMPLES * SAMPLES)


@pg.kernel
def printed(color: Image, axis: vec2, cell: float, colored: Const[bool]) -> vec4:
    """Return white paper times the transmission of each ink."""
    c = color[0, 0]
    light = clamp(c.rgb, 0.0, 1.0)
    if not colored:
        gray = REC709[0] * light.r + REC709[1] * light.g + REC709[2] * light.b
        return vec4(vec3(1.0 - inked(1.0 - gray, axis, cell)), c.a)
    most = max(light.r, light.g, light.b)
    inks = vec4(1.0 - light / most if most > 0.0 else vec3(0.0), 1.0 - most)
    through = vec4(1.0)
    for k in range(4):
        turned = vec2(axis.x * SCREENS[k].x - axis.y * SCREENS[k].y, axis.x * SCREENS[k].y + axis.y * SCREENS[k].x)
        through[k] = 1.0 - inked(inks[k], turned, cell)
    return vec4(through.rgb * through.a, c.a)


@effect("halftone", linear=True)
def halftone(
    color: pg.Target,
    cell_px: Annotated[float, pg.Range(2, 256, "px")] | pg.Value | pg.Derived = 8.0,
    angle_rad: Annotated[float, pg.Range(-7, 7, "radians")] | pg.Value | pg.Derived = pi / 4.0,
    colored: bool = True,
    into: pg.TargetSpec | None = None,
    name: str = "halftone",
) -> pg.Target:
    """Print a picture as dots of cyan, magenta, yellow and black ink, or of black alone.

    Parameters
    ----------
    color : linear light, 0 to 1, Rec. 709 primaries, and clamped to that; alpha stays
    cell_px : distance between dots
    angle_rad : angle of the rows of black dots; cyan, magenta and yellow are at -30, 30 and -45 degrees from it
    colored : four inks; off, black of the picture's luminance
    into : destination target; default: float32 named ``name``
    name : name of the pass

    The mean over a uniform area is its color: a diamond covers exactly the ink's fraction of its cell, and screens at
    different angles overlap like independent ones.  Edges of dots are smoothed by 16 samples per pixel.
    Source: D. Lau, G. Arce, "Modern Digital Halftoning", 2001, clustered dots; M. E. Demichel, 1924, overlapping inks.

    Examples
    --------
    >>> import numpy as np
    >>> with pg.compile(halftone(pg.Input("frame"), 6.0, colored=False), backend="reference") as program:
    ...     shown = program(frame=np.full((48, 48, 4), 0.3, np.float32))["halftone"][..., 0]
    >>> float(shown.min()), float(shown.max()), bool(abs(shown.mean() - 0.3) < 0.02)
    (0.0, 1.0, True)
    """
    axis = mapped(angle_rad, axis_of)
    return printed(color, axis, cell_px, colored, into=into or pg.target(name, "rgba32f"), name=name)
