"""Bilateral filter: average nearby pixels of similar color, which smooths areas and keeps edges."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Annotated

import passgraph as pg
from passgraph.effects.checked import effect
from passgraph.effects.pictures.decoded import decoded
from passgraph.language import Const, Image, dot, exp, vec4


@pg.kernel
def mean_of_like(color: Image, radius: Const[int], sigma_px: float, sigma_color: float) -> vec4:
    """Weights fall with distance and with the difference in color; pixels with NaN or infinity get none."""
    center = color[0, 0]
    total, weight = center, 1.0
    far, unlike = -0.5 / (sigma_px * sigma_px), -0.5 / (sigma_color * sigma_color)
    for y in range(-radius, radius + 1):
        for x in range(-radius, radius + 1):
            if x * x + y * y <= radius * radius and (x != 0 or y != 0):
                c = color[x, y]
                away = c.rgb - center.rgb
                w = exp(float(x * x + y * y) * far + dot(away, away) * unlike)
                if w > 0.0:
                    total += c * w
                    weight += w
    return total / weight


@effect("bilateral", alpha="premultiplied")
def bilateral(
    color: pg.Target,
    radius_px: Annotated[int, pg.Range(1, 16, "px")] = 4,
    sigma_px: Annotated[float, pg.Range(0.1, 100, "px")] | pg.Value | pg.Derived = 3.0,
    sigma_color: Annotated[float, pg.Range(0.001, 100)] | pg.Value | pg.Derived = 0.1,
    into: pg.TargetSpec | None = None,
    name: str = "bilateral",
) -> pg.Target:
    """Smooth areas and keep edges: a Gaussian blur over pixels of similar color.

    Parameters
    ----------
    color : any picture; with encoded values one ``sigma_color`` suits dark and bright areas. Outside of it, reads
        follow the rule of ``color.border(...)``
    radius_px : radius of the disc of pixels that are read, 49 pixels for 4
    sigma_px : standard deviation of the weight by distance
    sigma_color : standard deviation of the weight by the distance in red, green and blue, in the picture's values
    into : destination target; default: float32 named ``name``
    name : name of the pass

    Pixels that are NaN or infinite stay, and do not affect others.
    Source: C. Tomasi, R. Manduchi, "Bilateral Filtering for Gray and Color Images", 1998, equation 5.

    Examples
    --------
    >>> import numpy as np
    >>> noise = np.random.default_rng(1).normal(0.0, 0.02, (16, 16, 1)).astype(np.float32)
    >>> frame = np.where(np.arange(16) < 8, 0.2, 0.8).astype(np.float32)[None, :, None] + noise * np.ones(4, np.float32)
    >>> with pg.compile(bilateral(pg.Input("frame"), sigma_color=0.1), backend="reference") as program:
    ...     shown = program(frame=frame)["bilateral"]
    >>> bool(shown[:, :8, 0].std() < 0.4 * frame[:, :8, 0].std()), bool(shown[:, 8, 0].min() > 0.75)
    (True, True)
    """
    light = decoded(color, f"{name}_light")
    into = into or pg.target(name, "rgba32f")
    return mean_of_like(light, radius_px, sigma_px, sigma_color, into=into, name=name)
