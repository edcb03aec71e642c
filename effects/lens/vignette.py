"""Vignette: darkening toward the corners."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Annotated

import passgraph as pg
from passgraph.effects.channels import result_like
from passgraph.effects.checked import effect
from passgraph.effects.quantities import NotNegative, mapped, tan_half
from passgraph.language import Image, dot, exp2, log2, output_size, pixel, vec2, vec4


@pg.kernel(alike=True)
def darkened(color: Image, tan_half: float, strength: float) -> vec4:
    """Multiply the color by the fourth power of the cosine between this pixel's ray and the axis."""
    size = vec2(output_size())
    ray = (2.0 * vec2(pixel()) + 1.0 - size) * (tan_half / size.y)
    share = exp2(-2.0 * strength * log2(1.0 + dot(ray, ray)))
    c = color[0, 0]
    return vec4(c.rgb * share, c.a)


@effect("vignette", alike=True)
def vignette(
    color: pg.Target,
    vertical_fov_rad: Annotated[float, pg.Range(0.001, 3.1, "radians")] | pg.Value | pg.Derived = 0.8,
    strength: NotNegative | pg.Value | pg.Derived = 1.0,
    into: pg.TargetSpec | None = None,
    name: str = "vignette",
) -> pg.Target:
    """Darken the corners, by the fourth power of the cosine of the angle to the axis.

    Parameters
    ----------
    color : linear light, any range
    vertical_fov_rad : vertical angle of view
    strength : exponent of the law; 1 is an ideal thin lens, 0 leaves the picture unchanged, lenses with hoods and many
        elements reach 2 and more
    into : destination target; default: float32 named ``name``
    name : name of the pass

    Source: R. Kingslake, "Optics in Photography", SPIE, 1992, "the cos⁴ law" of natural vignetting.

    Examples
    --------
    >>> import numpy as np
    >>> with pg.compile(vignette(pg.Input("frame"), 1.5707963), backend="reference") as program:
    ...     shown = program(frame=np.ones((101, 1, 4), np.float32))["vignette"]
    >>> [round(float(shown[row, 0, 0]), 3) for row in (0, 25, 50)]  # cos 45° ** 4 is 0.25, at the very border
    [0.255, 0.645, 1.0]
    """
    half = mapped(vertical_fov_rad, tan_half)
    return darkened(color, half, strength, into=result_like(color, into, name), name=name)
