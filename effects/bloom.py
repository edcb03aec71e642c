"""Bloom: what is brighter than a threshold glows around itself."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

import passgraph as pg
from passgraph import Image, ivec2, uv, vec2, vec4
from passgraph.effects.checked import checked

#: Brightest value that glows, scene-linear: the largest float16.
BRIGHTEST = 65504.0


@pg.kernel
def bright(color: Image, threshold: float) -> vec4:
    """What is above the threshold, hue kept: the colour scaled by how far its largest channel is above."""
    c = color[0, 0]
    top = min(max(c.r, c.g, c.b), BRIGHTEST)
    share = max(top - threshold, 0.0) / max(top, 1e-6)
    # NaN as the second argument of min and max is ignored
    glow = min(BRIGHTEST, max(0.0, c.rgb))
    return vec4(glow * (share if share > 0.0 else 0.0), 0.0)


@pg.function
def step_of(size: ivec2) -> vec2:
    return 1.0 / vec2(size)


@pg.kernel
def down(color: Image) -> vec4:
    """Half the size: the centre four times and the four diagonal neighbours once, each a bilinear read."""
    at = uv()
    d = step_of(color.size)
    total = color.sample(at) * 4.0
    total += color.sample(at + vec2(d.x, d.y)) + color.sample(at + vec2(-d.x, d.y))
    total += color.sample(at + vec2(d.x, -d.y)) + color.sample(at - d)
    return total / 8.0


@pg.function
def tent(color: Image, at: vec2) -> vec4:
    """Eight bilinear reads on a diamond, the diagonal ones twice."""
    d = 0.5 * step_of(color.size)
    total = color.sample(at + vec2(-2.0 * d.x, 0.0)) + color.sample(at + vec2(2.0 * d.x, 0.0))
    total += color.sample(at + vec2(0.0, -2.0 * d.y)) + color.sample(at + vec2(0.0, 2.0 * d.y))
    total += (color.sample(at + vec2(d.x, d.y)) + color.sample(at + vec2(-d.x, d.y))) * 2.0
    total += (color.sample(at + vec2(d.x, -d.y)) + color.sample(at - d)) * 2.0
    return total / 12.0


@pg.kernel
def up(color: Image) -> vec4:
    """Twice the size."""
    return tent(color, uv())


@pg.kernel
def add_glow(color: Image, glow: Image, intensity: float) -> vec4:
    """The picture and the glow, scaled up the last time, bilinearly; alpha is the picture's."""
    c = color[0, 0]
    return vec4(c.rgb + glow.sample(uv()).rgb * intensity, c.a)


@checked
def bloom(
    color: pg.Target,
    threshold: float | pg.Value | pg.Derived = 1.0,
    intensity: float | pg.Value | pg.Derived = 0.5,
    levels: int = 4,
    into: pg.TargetSpec | None = None,
    name: str = "bloom",
) -> pg.Target:
    """Add a glow around what is bright, by dual filtering: smaller and smaller pictures, and back.

    Parameters
    ----------
    color : any picture, linear light
    threshold : what is above it glows, scene-linear, 0 or more; may be a ``pg.Value``
    intensity : factor on the glow, 0 or more; 0 leaves the picture as it is; may be a ``pg.Value``
    levels : halvings, 1 to 8; each doubles the glow's width
    into : where it goes; left out, float32 with the name ``name``
    name : of the passes and targets

    The weights of every filter add up to 1: away from the borders the glow of a spot holds as much light as
    the spot has above the threshold.  NaN does not glow, and infinity as the largest float16.

    Source: M. Bjørge, "Bandwidth-Efficient Rendering", SIGGRAPH 2015 (dual filtering).
    Deviation: from two levels on the last doubling, to full size, is bilinear: the glow is smooth by then, and eight
    reads of every pixel cost more than all other passes together.

    Examples
    --------
    >>> import numpy as np
    >>> made = bloom(pg.Input("frame"), threshold=1.0, intensity=0.5, levels=2)
    >>> with pg.compile(made, backend="reference") as program:
    ...     program(frame=np.full((8, 8, 4), 3.0, np.float32))["bloom"][4, 4].tolist()
    [4.0, 4.0, 4.0, 3.0]
    """
    if not 1 <= levels <= 8:
        raise pg.GraphError(f"{name}: levels must be 1 to 8, got {levels!r}")
    for what, value in (("threshold", threshold), ("intensity", intensity)):
        if isinstance(value, (int, float)) and not 0.0 <= value < float("inf"):
            raise pg.GraphError(f"{name}: {what} must be 0 or more, got {value!r}")
    full: pg.Target = bright(color, threshold, into=pg.target(f"{name}_bright", "rgba32f"), name=f"{name}_bright")
    chain = [full]
    for level in range(1, levels + 1):
        label = f"{name}_down{level}"
        chain.append(down(chain[-1], into=pg.target(label, "rgba32f", like=full, scale=0.5**level), name=label))
    glow = chain.pop()
    # one halving alone is too narrow to be doubled bilinearly
    for level in range(levels - 1, 0 if levels > 1 else -1, -1):
        label = f"{name}_up{level}"
        glow = up(glow, into=pg.target(label, "rgba32f", like=full, scale=0.5**level), name=label)
    made: pg.Target = add_glow(color, glow, intensity, into=into or pg.target(name, "rgba32f"), name=name)
    return made
