"""Radial blur: the motion blur of a camera that zooms or rolls."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from math import cos, sin
from typing import Annotated, Literal

import passgraph as pg
from passgraph.effects.channels import between, result_like
from passgraph.effects.checked import effect
from passgraph.effects.pictures.decoded import decoded
from passgraph.effects.quantities import Place, Share, combined
from passgraph.language import Array, Image, output_size, pixel, vec2, vec4

#: Reads in each of two passes; the second reads means of the first.
READS = 8


def steps_of(zoom: float, spin_rad: float, times: float) -> list[tuple[float, float]]:
    """Return complex factors from the center at even times around that of the picture.

    >>> [round(x, 3) for x, y in steps_of(0.5, 0.0, 1 / 8)]
    [0.837, 0.881, 0.927, 0.975, 1.026, 1.079, 1.135, 1.194]
    """
    at = [(number - 0.5 * (READS - 1)) * times for number in range(READS)]
    return [((1.0 + zoom) ** t * cos(spin_rad * t), (1.0 + zoom) ** t * sin(spin_rad * t)) for t in at]


@pg.kernel(alike=True)
def along_way(color: Image, middle: vec2, steps: Array[vec2, Literal[8]]) -> vec4:
    """Return the mean of positions that the same zoom and rotation move here at different times."""
    size, total = vec2(output_size()), vec4(0.0)
    away = vec2(pixel()) + 0.5 - middle * size
    for i in range(READS):
        turned = vec2(away.x * steps[i].x - away.y * steps[i].y, away.x * steps[i].y + away.y * steps[i].x)
        total += color.sample(middle + turned / size)
    return total / float(READS)


@effect("radial-blur", linear=True, alpha="premultiplied", alike=True)
def radial_blur(
    color: pg.Target,
    zoom: Share | pg.Value | pg.Derived = 0.1,
    spin_rad: Annotated[float, pg.Range(-3.2, 3.2, "radians")] | pg.Value | pg.Derived = 0.0,
    x: Place | pg.Value | pg.Derived = 0.5,
    y: Place | pg.Value | pg.Derived = 0.5,
    into: pg.TargetSpec | None = None,
    name: str = "radial_blur",
) -> pg.Target:
    """Blur away from a center, or around it, like a camera that zooms or rolls.

    Parameters
    ----------
    color : any picture, linear light; outside of it, reads follow the rule of ``color.border(...)``
    zoom : growth of the picture during the exposure, as a fraction of its size
    spin_rad : rotation during the exposure
    x : the fixed point, as a fraction of the width from the left edge; below 0 and above 1 it is outside
    y : the fixed point, as a fraction of the height from the upper edge
    into : destination target; default: float32 named ``name``
    name : name of the passes and targets

    The result is the mean of 64 times around that of the picture, at even ratios of size and angles. Two passes read 8
    positions each; the second reads the means of the first.
    Source: M. Potmesil, I. Chakravarty, "Modeling Motion Blur in Computer-Generated Images", SIGGRAPH 1983, for a
    motion of all pixels by one zoom and rotation.

    Examples
    --------
    Rings around the middle stay when they are turned:

    >>> import numpy as np
    >>> y, x = np.mgrid[:33, :33] - 16
    >>> rings = np.float32(np.sin(0.3 * np.hypot(x, y)))[..., None] * np.ones(4, np.float32)
    >>> with pg.compile(radial_blur(pg.Input("frame"), 0.0, 1.0), backend="reference") as program:
    ...     shown = program(frame=rings)["radial_blur"]
    >>> bool(abs(shown - rings)[5:-5, 5:-5].max() < 0.03)
    True
    """
    light = decoded(color, f"{name}_light", "rgba32f")
    middle = combined(lambda *place: place, x, y)
    into = result_like(light, into, name)
    count, spec = READS * READS, pg.target(f"{name}_near", between(light, into), like=light)
    near = combined(lambda growth, turn: steps_of(growth, turn, 1.0 / count), zoom, spin_rad)
    far = combined(lambda growth, turn: steps_of(growth, turn, 1.0 / READS), zoom, spin_rad)
    means = along_way(light, middle, near, into=spec, name=spec.name).border(color.border_rule)
    return along_way(means, middle, far, into=into, name=name)
