"""God rays: beams of light from the sky between occluders."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Annotated

import passgraph as pg
from passgraph.effects.checked import effect
from passgraph.effects.color.black_and_white import REC709
from passgraph.effects.quantities import NotNegative, Place, Share, combined, mapped
from passgraph.language import Const, Image, dot, ivec2, pixel, uv, vec2, vec3, vec4

#: Passes over half the picture, each over the sums of the one before, and reads in each.
PASSES, READS = 3, 6
#: Largest half float, the limit of light. The largest distance stands for infinity.
BRIGHTEST, FARTHEST = 65504.0, 3.4028234e38


@pg.kernel
def shining(color: Image, occluders: Image, threshold: float, has_occluders: Const[bool]) -> vec4:
    """Halve the size: return bright light and, where distances are known, only that of the sky."""
    total = vec3(0.0)
    for y in range(2):
        for x in range(2):
            at = 2 * pixel() + ivec2(x, y)
            c = min(vec3(BRIGHTEST), max(vec3(0.0), color.texel(at).rgb))
            light = dot(c, vec3(REC709[0], REC709[1], REC709[2]))
            z = occluders.texel(at).r if has_occluders else 0.0
            if not (z > 0.0 and z < FARTHEST) and light > threshold:
                total += c * ((light - threshold) / light)
    return vec4(0.25 * total, 1.0)


@pg.kernel
def gathered(source: Image, light: vec2, nearer: float, kept: float, strides: Const[int]) -> vec4:
    """Average positions on the way to the light, each nearer by a fraction and of less weight than the one before."""
    step, fall = pow(nearer, float(strides)), pow(kept, float(strides))
    away, weight = uv() - light, 1.0
    total, weights = vec3(0.0), 0.0
    for _ in range(READS):
        total += source.sample(light + away).rgb * weight
        weights += weight
        away, weight = away * step, weight * fall
    return vec4(total / weights, 1.0)


@pg.kernel
def lit_air(color: Image, rays: Image, intensity: float) -> vec4:
    c = color[0, 0]
    # for an odd side, half of it ends beyond the picture
    return vec4(c.rgb + rays.sample(0.5 * (vec2(pixel()) + 0.5) / vec2(rays.size)).rgb * intensity, c.a)


@effect("god-rays", linear=True, alpha="premultiplied")
def god_rays(
    color: pg.Target,
    x: Place | pg.Value | pg.Derived = 0.5,
    y: Place | pg.Value | pg.Derived = 0.25,
    intensity: NotNegative | pg.Value | pg.Derived = 0.5,
    threshold: NotNegative | pg.Value | pg.Derived = 0.8,
    density: Annotated[float, pg.Range(0, 0.99)] | pg.Value | pg.Derived = 0.9,
    decay: Share | pg.Value | pg.Derived = 0.1,
    occluders: pg.Target | None = None,
    into: pg.TargetSpec | None = None,
    name: str = "god_rays",
) -> pg.Target:
    """Add beams of light from a bright place, such as the sun, that objects in front of it interrupt.

    Parameters
    ----------
    color : any picture, linear light
    x : position of the light, as a fraction of the width from the left edge; may be outside of 0 to 1
    y : position of the light, as a fraction of the height from the upper edge
    intensity : factor of the beams; 0 leaves the picture unchanged
    threshold : least luminance of a light source, scene-linear. With ``occluders`` it may be 0
    density : fraction of the way to the light along which light is gathered
    decay : weight of the last position on that way, relative to the pixel's own; less makes shorter beams
    occluders : depth picture of the size of ``color``. Red is the distance, and 0, infinity or NaN for the sky, which
        is then the only light source; default: brightness alone decides
    into : destination target; default: float32 named ``name``
    name : name of the passes and targets

    The beams are the weighted mean of 216 positions between a pixel and the light, at half the size: a uniform sky adds
    ``intensity`` times its own light.  The outside of the picture is dark.  NaN and infinity are ignored.
    Source: K. Mitchell, "Volumetric Light Scattering as a Post-Process", GPU Gems 3, chapter 13, 2007.
    Deviations: weights add up to 1. Steps shrink toward the light by a constant factor, so that three passes, each over
    the sums of the one before, need 18 reads for 216 positions (T. Sousa, "Crysis Next Gen Effects", GDC 2008).

    Examples
    --------
    A lamp at the left, and a constant fraction of its light at the right, on the way from there:

    >>> import numpy as np
    >>> lamp = np.where(np.arange(64) < 8, 4.0, 0.0).astype(np.float32)[None, :, None] * np.ones((8, 64, 4))
    >>> with pg.compile(god_rays(pg.Input("frame"), 0.0, 0.5), backend="reference") as program:
    ...     beams = program(frame=lamp)["god_rays"][4, :, 0]
    >>> bool(beams[0] > 4.5), bool(beams[12] > beams[40] > 0.0)
    (True, True)
    """
    half = pg.target(f"{name}_source", "rgba32f", like=color, scale=0.5)
    rays = shining(color, occluders or color, threshold, occluders is not None, into=half, name=half.name)
    steps = READS**PASSES - 1
    nearer = mapped(density, lambda share: (1.0 - share) ** (1.0 / steps))
    kept = mapped(decay, lambda share: share ** (1.0 / steps))
    place = combined(lambda *at: at, x, y)
    for number in range(PASSES):
        spec = pg.target(f"{name}_{number}", "rgba32f", like=rays)
        rays = gathered(rays.border("zero"), place, nearer, kept, READS**number, into=spec, name=spec.name)
    return lit_air(color, rays, intensity, into=into or pg.target(name, "rgba32f"), name=name)
