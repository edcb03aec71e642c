"""Bloom: a glow around bright areas."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Annotated

import passgraph as pg
from passgraph.effects.checked import effect
from passgraph.effects.quantities import NotNegative, Share
from passgraph.language import Image, clamp, ivec2, output_size, pixel, uv, vec2, vec3, vec4

#: Brightest value that glows, scene-linear: the largest float16.
BRIGHTEST = 65504.0


@pg.kernel
def bright(color: Image, threshold: float, softness: float) -> vec4:
    """Return the light above the threshold with its hue: scaled by the excess of its largest channel.

    Around the threshold the excess rises along a parabola, which meets both lines without a kink.
    """
    c = color[0, 0]
    top = min(max(c.r, c.g, c.b), BRIGHTEST)
    knee = threshold * softness
    risen = clamp(top - threshold + knee, 0.0, 2.0 * knee)
    share = max(top - threshold, risen * risen / max(4.0 * knee, 1e-6)) / max(top, 1e-6)
    # NaN as the second argument of min and max is ignored
    glow = min(vec3(BRIGHTEST), max(vec3(0.0), c.rgb))
    return vec4(glow * (share if share > 0.0 else 0.0), 0.0)


@pg.function
def overlap(texel: float, begin: float, length: float) -> float:
    """Return the part of a texel that lies in an interval."""
    return max(min(texel + 1.0, begin + length) - max(texel, begin), 0.0)


@pg.function
def tent_below(x: float) -> float:
    """Return the fraction of a tent (1 at 0, 0 from -1 and 1 on) below x."""
    t = clamp(x, -1.0, 1.0)
    return 0.5 + t - 0.5 * t * abs(t)


@pg.function
def tent_share(low: float, high: float, centre: float) -> float:
    """Return the weight of a bilinearly read texel in the mean from low to high."""
    return (tent_below(high - centre) - tent_below(low - centre)) / (high - low)


@pg.function
def wide_share(low: float, high: float, centre: float) -> float:
    """Return the same for three reads, a texel apart, the middle one four times."""
    sides = tent_share(low, high, centre - 1.0) + tent_share(low, high, centre + 1.0)
    return (4.0 * tent_share(low, high, centre) + sides) / 6.0


@pg.struct
class Covered:
    """The texels of another picture under a pixel: from ``first + low`` to ``first + high``."""

    first: ivec2
    low: vec2
    high: vec2


@pg.function
def covered(size: ivec2, target_size: ivec2) -> Covered:
    """Return the texels of a picture under this pixel of a target; the integer part is exact."""
    begin = pixel() * size
    first = begin // target_size
    low = vec2(begin - first * target_size) / vec2(target_size)
    return Covered(first, low, low + vec2(size) / vec2(target_size))


@pg.kernel(known_sizes=True)
def down(color: Image) -> vec4:
    """Halve the size: average the mean of the area that a pixel covers with that of twice the width.

    Where the size halves exactly, these are bilinear reads: four times the center and once the diagonal neighbors.
    """
    size, target_size = color.size, output_size()
    if size.x == 2 * target_size.x and size.y == 2 * target_size.y:
        at, d = uv(), 1.0 / vec2(size)
        total = color.sample(at) * 4.0
        total += color.sample(at + vec2(d.x, d.y)) + color.sample(at + vec2(-d.x, d.y))
        total += color.sample(at + vec2(d.x, -d.y)) + color.sample(at - d)
        return total / 8.0
    # In texels: the start of twice the width, as integer and fraction, and the texels that a pixel covers.
    begin = (2 * pixel() - 1) * size
    first = begin // (2 * target_size)
    rest = vec2(begin - first * (2 * target_size)) / vec2(2 * target_size)
    one = vec2(size) / vec2(target_size)
    total = vec4(0.0)
    for y in range(5):
        near_y = overlap(float(y), rest.y + 0.5 * one.y, one.y)
        wide_y = overlap(float(y), rest.y, 2.0 * one.y)
        for x in range(5):
            near = near_y * overlap(float(x), rest.x + 0.5 * one.x, one.x)
            wide = wide_y * overlap(float(x), rest.x, 2.0 * one.x)
            total += color.texel(first + ivec2(x, y)) * (0.5 * near + 0.125 * wide)
    return total / (one.x * one.y)


@pg.kernel(known_sizes=True)
def up(color: Image) -> vec4:
    """Double the size: eight bilinear reads on a diamond, the diagonal ones twice.

    Where the size is not doubled exactly, it is the mean over a pixel of three bilinear reads each way, as wide.
    """
    size, target_size = color.size, output_size()
    if 2 * size.x == target_size.x and 2 * size.y == target_size.y:
        at, d = uv(), 0.5 / vec2(size)
        total = color.sample(at + vec2(-2.0 * d.x, 0.0)) + color.sample(at + vec2(2.0 * d.x, 0.0))
        total += color.sample(at + vec2(0.0, -2.0 * d.y)) + color.sample(at + vec2(0.0, 2.0 * d.y))
        total += (color.sample(at + vec2(d.x, d.y)) + color.sample(at + vec2(-d.x, d.y))) * 2.0
        total += (color.sample(at + vec2(d.x, -d.y)) + color.sample(at - d)) * 2.0
        return total / 12.0
    over = covered(size, target_size)
    total = vec4(0.0)
    for y in range(-2, 4):
        share_y = wide_share(over.low.y, over.high.y, float(y) + 0.5)
        for x in range(-2, 4):
            share = share_y * wide_share(over.low.x, over.high.x, float(x) + 0.5)
            total += color.texel(over.first + ivec2(x, y)) * share
    return total


@pg.kernel(known_sizes=True)
def add_glow(color: Image, glow: Image, intensity: float) -> vec4:
    """Add the glow, upsampled bilinearly, to the picture; alpha is the picture's.

    A glow of half the size, rounded up, is stretched over the whole picture.
    """
    c = color[0, 0]
    size, target_size = glow.size, output_size()
    if (size.x == target_size.x or 2 * size.x == target_size.x) and (
        size.y == target_size.y or 2 * size.y == target_size.y
    ):
        return vec4(c.rgb + glow.sample(uv()).rgb * intensity, c.a)
    over = covered(size, target_size)
    light = vec3(0.0)
    for y in range(-1, 3):
        share_y = tent_share(over.low.y, over.high.y, float(y) + 0.5)
        for x in range(-1, 3):
            share = share_y * tent_share(over.low.x, over.high.x, float(x) + 0.5)
            light += glow.texel(over.first + ivec2(x, y)).rgb * share
    return vec4(c.rgb + light * intensity, c.a)


@effect("bloom", alpha="premultiplied")
def bloom(
    color: pg.Target,
    threshold: NotNegative | pg.Value | pg.Derived = 0.8,
    intensity: NotNegative | pg.Value | pg.Derived = 0.5,
    levels: Annotated[int, pg.Range(1, 8)] = 4,
    softness: Share | pg.Value | pg.Derived = 0.5,
    into: pg.TargetSpec | None = None,
    name: str = "bloom",
) -> pg.Target:
    """Add a glow around bright areas, by dual filtering (repeated downsampling and upsampling).

    Parameters
    ----------
    color : any picture, linear light
    threshold : only light above it glows, scene-linear. The default suits photographs (white is 1) and HDR
    intensity : factor of the glow; 0 leaves the picture unchanged
    levels : number of halvings; each doubles the glow's width
    softness : how gradually glow begins: from ``(1 - softness) * threshold`` on, and in full from
        ``(1 + softness) * threshold`` on; at 0 the glow begins at the threshold, with a kink
    into : destination target; default: float32 named ``name``
    name : name of the passes and targets

    The glow of a bright spot has as much light as the spot has above the threshold, at every size and position, even in
    corners, so a moving spot does not flicker.  Sizes that halve exactly cost least: where one is odd, filters average
    the areas that pixels cover.  NaN does not glow, and infinity glows as the largest float16.

    Sources: M. Bjørge, "Bandwidth-Efficient Rendering", SIGGRAPH 2015 (dual filtering); the soft threshold is that of
    Blender's and Unity's bloom.
    Deviation: from two levels on, the last doubling, to full size, is bilinear: the glow is smooth by then, and eight
    reads of every pixel would cost more than all other passes together.

    Examples
    --------
    >>> import numpy as np
    >>> made = bloom(pg.Input("frame"), threshold=1.0, intensity=0.5, levels=2)
    >>> with pg.compile(made, backend="reference") as program:
    ...     program(frame=np.full((8, 8, 4), 3.0, np.float32))["bloom"][4, 4].tolist()
    [4.0, 4.0, 4.0, 3.0]
    """
    full = bright(color, threshold, softness, into=pg.target(f"{name}_bright", "rgba32f"))
    chain = [full]
    for level in range(1, levels + 1):
        label = f"{name}_down{level}"
        chain.append(down(chain[-1], into=pg.target(label, "rgba32f", like=full, scale=0.5**level)))
    glow = chain.pop()
    # one halving alone is too narrow to be doubled bilinearly
    for level in range(levels - 1, 0 if levels > 1 else -1, -1):
        label = f"{name}_up{level}"
        glow = up(glow.border("mirror"), into=pg.target(label, "rgba32f", like=full, scale=0.5**level))
    return add_glow(color, glow, intensity, into=into or pg.target(name, "rgba32f"), name=name)
