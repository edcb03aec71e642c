"""Kuwahara filter: average the most uniform part of each pixel's surroundings, as if painted with a brush."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from math import cos, pi, sin
from typing import Annotated, Any

import passgraph as pg
from passgraph.effects.checked import effect
from passgraph.effects.filters.blur import gaussian_blur
from passgraph.effects.pictures.decoded import decoded
from passgraph.language import Const, Image, clamp, dot, isfinite, length, sqrt, vec2, vec4

#: Number of sectors, and the position on the unit circle, from a sector's center, where its weight becomes 0.
SECTORS: Any = tuple((cos(k * pi / 4.0), sin(k * pi / 4.0)) for k in range(8))
END = 3.0 * pi / 8.0
COS_END, SIN2_END = cos(END), sin(END) ** 2
#: Standard deviation of the blur of directions, px, and the offset of variances: a step of 8 bits, squared.
SMOOTHED_PX, STEP = 2.0, 1.0 / 255.0**2


@pg.kernel
def directions(color: Image) -> vec4:
    """Return the structure tensor, summed over channels: xx, yy, xy; 0 where that is not finite."""
    dx = (color[1, -1] + 2.0 * color[1, 0] + color[1, 1] - color[-1, -1] - 2.0 * color[-1, 0] - color[-1, 1]).rgb * 0.25
    dy = (color[-1, 1] + 2.0 * color[0, 1] + color[1, 1] - color[-1, -1] - 2.0 * color[0, -1] - color[1, -1]).rgb * 0.25
    xx, yy, xy = dot(dx, dx), dot(dy, dy), dot(dx, dy)
    return vec4(xx, yy, xy, 1.0) if isfinite(xx + yy) else vec4(0.0, 0.0, 0.0, 1.0)


@pg.kernel
def painted(color: Image, tensor: Image, radius: Const[int], sharpness: float) -> vec4:
    """Return the mean of eight sectors of an ellipse along the edge, weighted by their uniformity."""
    t = tensor[0, 0]
    sum, difference = t.r + t.g, sqrt((t.r - t.g) * (t.r - t.g) + 4.0 * t.b * t.b)
    share = difference / sum if sum > 0.0 else 0.0
    # Half of the double angle of the edge, which is perpendicular to the gradient
    c2 = (t.g - t.r) / difference if difference > 0.0 else 1.0
    edge = vec2(sqrt(max(0.5 + 0.5 * c2, 0.0)), sqrt(max(0.5 - 0.5 * c2, 0.0)) * (1.0 if t.b < 0.0 else -1.0))
    along, across = float(radius) * (1.0 + share), float(radius) / (1.0 + share)
    overlap = 2.0 / float(radius)
    narrow = (overlap + COS_END) / SIN2_END

    here = color[0, 0]
    base = here if isfinite(here.r + here.g + here.b + here.a) else vec4(0.0)
    sums, squares, weights = [vec4(0.0)] * 8, [0.0] * 8, [0.0] * 8
    # Reach of the ellipse along each axis
    most = 2 * radius
    far_x = clamp(int(length(vec2(along * edge.x, across * edge.y))), 0, most)
    far_y = clamp(int(length(vec2(along * edge.y, across * edge.x))), 0, most)
    for y in range(-far_y, far_y + 1):
        for x in range(-far_x, far_x + 1):
            at = vec2(float(x), float(y))
            v = vec2(dot(at, edge) / along, (at.y * edge.x - at.x * edge.y) / across)
            c = color[x, y]
            fall = max(1.0 - dot(v, v), 0.0)
            if fall > 0.0 and isfinite(c.r + c.g + c.b + c.a):
                c -= base
                for k in range(8):
                    out = v.x * SECTORS[k].x + v.y * SECTORS[k].y
                    aside = v.y * SECTORS[k].x - v.x * SECTORS[k].y
                    w = max(out + overlap - narrow * aside * aside, 0.0)
                    w *= w * fall * fall
                    sums[k] += c * w
                    squares[k] += dot(c.rgb, c.rgb) * w
                    weights[k] += w
    least = 1e30
    for k in range(8):
        mean = sums[k] / max(weights[k], 1e-20)
        sums[k] = mean
        squares[k] = max(squares[k] / max(weights[k], 1e-20) - dot(mean.rgb, mean.rgb), 0.0) + STEP
        if weights[k] > 0.0:
            least = min(least, squares[k])
    total, weight = vec4(0.0), 0.0
    for k in range(8):
        w = pow(min(least / squares[k], 1.0), 0.5 * sharpness) if weights[k] > 0.0 else 0.0
        total += sums[k] * w
        weight += w
    return base + total / weight if weight > 0.0 else here


@effect("kuwahara", alpha="premultiplied")
def kuwahara(
    color: pg.Target,
    radius_px: Annotated[int, pg.Range(1, 8, "px")] = 4,
    sharpness: Annotated[float, pg.Range(0, 16)] | pg.Value | pg.Derived = 8.0,
    into: pg.TargetSpec | None = None,
    name: str = "kuwahara",
) -> pg.Target:
    """Make a picture look painted: flat areas, sharp edges, strokes along them (anisotropic Kuwahara filter).

    Parameters
    ----------
    color : any picture, which should be encoded for display; outside of it, reads follow the rule of
        ``color.border(...)``
    radius_px : radius of the brush in areas without direction; along an edge it is up to twice as long and half as wide
    sharpness : exponent of the deviation in a sector: 0 is a blur, 8 uses the most uniform sector almost alone
    into : destination target; default: float32 named ``name``
    name : name of the passes and targets

    An ellipse along the edge, from the blurred structure tensor, is divided into eight overlapping sectors. A pixel is
    the mean of their means, weighted by their uniformity.  NaN and infinity are ignored.
    Source: J. E. Kyprianidis, A. Semmo, H. Kang, J. Döllner, "Anisotropic Kuwahara Filtering with Polynomial Weighting
    Functions", 2010.
    Deviations: weights fall to 0 at the ellipse's border, as ``(1 - r²)²``, so that no tap appears or vanishes by
    rounding; a sector has the weight ``(variance + 1 / 255²) ** (-sharpness / 2)``, which no variance overflows.

    Examples
    --------
    >>> import numpy as np
    >>> noise = np.random.default_rng(1).normal(0.0, 0.05, (24, 24, 1)).astype(np.float32)
    >>> step = np.where(np.arange(24) < 12, 0.2, 0.8).astype(np.float32)[None, :, None]
    >>> frame = step + noise * np.ones(4, np.float32)
    >>> with pg.compile(kuwahara(pg.Input("frame")), backend="reference") as program:
    ...     shown = program(frame=frame)["kuwahara"][..., 0]
    >>> bool(shown[:, :10].std() < 0.4 * frame[:, :10, 0].std())
    True
    >>> bool(shown[:, 11].max() < 0.35 < 0.65 < shown[:, 12].min())
    True
    """
    light = decoded(color, f"{name}_light")
    steep = directions(light, into=pg.target(f"{name}_tensor", "rgba32f", like=light), name=f"{name}_tensor")
    soft = pg.target(f"{name}_directions", "rgba32f", like=light)
    tensor = gaussian_blur(steep, SMOOTHED_PX, into=soft, name=f"{name}_directions")
    return painted(light, tensor, radius_px, sharpness, into=into or pg.target(name, "rgba32f"), name=name)
