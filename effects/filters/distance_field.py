"""Distance field: the distance of each pixel to a shape, found by jump flooding."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Annotated, Literal

import passgraph as pg
from passgraph.effects.checked import effect
from passgraph.effects.color.black_and_white import REC709
from passgraph.language import Const, Image, dot, pixel, sqrt, vec2, vec3, vec4

#: A position for "no shape": farther away than any picture is wide.
NOWHERE = -1.0e6


@pg.kernel
def places(color: Image, threshold: float, by_alpha: Const[bool]) -> vec4:
    """Return this pixel's position, as inside of the shape (red, green) or outside of it (blue, alpha)."""
    c = color[0, 0]
    value = c.a if by_alpha else dot(c.rgb, vec3(REC709[0], REC709[1], REC709[2]))
    here, nowhere = vec2(pixel()), vec2(NOWHERE)
    return vec4(here, nowhere) if value > threshold else vec4(nowhere, here)


@pg.kernel
def flooded(found: Image, step: Const[int], signed: Const[bool]) -> vec4:
    """Return the nearest of the positions that this pixel and its eight neighbors at a step's distance have found."""
    here, best = vec2(pixel()), found[0, 0]
    inside, outside = best.xy - here, best.zw - here
    nearest, other = dot(inside, inside), dot(outside, outside)
    for y in range(-1, 2):
        for x in range(-1, 2):
            if x != 0 or y != 0:
                there = found[x * step, y * step]
                way = there.xy - here
                if dot(way, way) < nearest:
                    best.xy = there.xy
                    nearest = dot(way, way)
                if signed:
                    way = there.zw - here
                    if dot(way, way) < other:
                        best.zw = there.zw
                        other = dot(way, way)
    return best


@pg.kernel
def measured(found: Image, reach: float, unit: float, signed: Const[bool]) -> vec4:
    """Return the distance to the shape, minus the distance from inside it."""
    inside, outside = found[0, 0].xy - vec2(pixel()), found[0, 0].zw - vec2(pixel())
    distance = min(sqrt(dot(inside, inside)), reach)
    if signed:
        distance -= min(sqrt(dot(outside, outside)), reach)
    return vec4(vec3(distance / unit), 1.0)


@effect("distance-field")
def distance_field(
    color: pg.Target,
    channel: Literal["luminance", "alpha"] = "luminance",
    threshold: Annotated[float, pg.Range()] | pg.Value | pg.Derived = 0.5,
    signed: bool = False,
    reach_px: Annotated[int, pg.Range(1, 8191, "px")] = 255,
    unit_px: Annotated[float, pg.Range(0, None, "px", above=True)] | pg.Value | pg.Derived = 1.0,
    into: pg.TargetSpec | None = None,
    name: str = "distance_field",
) -> pg.Target:
    """Compute the distance of each pixel to a shape: the nearest pixel above a threshold.

    Parameters
    ----------
    color : any picture; the shape is its bright, or opaque, part
    channel : luminance, with the weights of Rec. 709, or alpha
    threshold : threshold of the channel; pixels above it are the shape. NaN is outside
    signed : inside the shape, distances to the nearest pixel outside are negative; off, they are 0
    reach_px : largest distance; costs a pass for each doubling, and two more
    unit_px : the distance that is shown as 1; for a display about ``reach_px``
    into : destination target; default: float32 named ``name``
    name : name of the passes and targets

    Distances are between pixel centers, the same in red, green and blue; ``reach_px`` if there is no shape.
    Source: G. Rong, T.-S. Tan, "Jump Flooding in GPU with Applications to Voronoi Diagram and Distance Transform",
    2006, its variant JFA+2. It finds the nearest pixel of the shape, or, for a few pixels in ten thousand, one that is
    farther by less than 1.

    Examples
    --------
    >>> import numpy as np
    >>> frame = np.zeros((4, 6, 4), np.float32)
    >>> frame[0, :2] = 1.0
    >>> with pg.compile(distance_field(pg.Input("frame"), signed=True), backend="reference") as program:
    ...     program(frame=frame)["distance_field"][0, :, 0].tolist()
    [-1.0, -1.0, 1.0, 2.0, 3.0, 4.0]
    """
    spec = pg.target(f"{name}_places", "rgba32f", like=color)
    found = places(color, threshold, channel == "alpha", into=spec, name=spec.name)
    steps = [2**exponent for exponent in reversed(range(reach_px.bit_length()))]
    for number, step in enumerate((*steps, 2, 1)):
        spec = pg.target(f"{name}_{number}", "rgba32f", like=color)
        found = flooded(found, step, signed, into=spec, name=spec.name)
    into = into or pg.target(name, "rgba32f")
    return measured(found, float(reach_px), unit_px, signed, into=into, name=name)
