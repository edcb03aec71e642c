"""Shadow lookups in maps of moments: the stored moments, and bounds on a receiver's light.

A map of moments can be blurred before it is compared, unlike a depth map.  The moments of the depths around a receiver
bound its light from above.  The bound is exact if a caster and the surface behind it have one depth each.  Otherwise it
causes the artifacts of these maps: leaks where the bound is far from the truth, dark planes where the receiver's own
surface counts as a caster.

Depths are linear and run from -1 (the light's near plane) to 1 (nothing before the far plane).
"""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Any

import passgraph as pg
from passgraph.effects.shadows.shadow_filters import CONE_SLOPE, FilterFrame, limit_at, receiver_at
from passgraph.effects.surfaces.views import LightFrame
from passgraph.language import Image, clamp, dot, exp, floor, ivec2, log, saturate, sqrt, vec2, vec3, vec4

#: Variance that rounding alone may leave, relative to the mean square: 2 ** -24 for each of about a hundred sums, whose
#: errors add up as their root, and for the warp's own 3 ulp.
VARIANCE_ROUNDING = 2.0**-20
#: Largest exponent: exp(2 * 42) is 3e36, and float32 ends at 3.4e38.
LARGEST_EXPONENT = 42.0
#: Exponent of the warp that separates near casters. More leaks less between casters and needs more offset on slanted
#: planes: it grows with the exponent.
#: Source: A. Lauritzen, "Sum-Area Variance Shadow Maps", Intel, 2011, uses 40 and 5.
NEGATIVE_EXPONENT = 5.0
#: Least distance in front of a plane at which four moments allow darkness, in its standard deviations: 1 for a whole
#: plane, 1.31 (slope along an axis) to 1.49 (diagonal) where the far plane clips it at the receiver.
PLANE_DEVIATIONS = 1.5
#: Fraction of `LEAST_SURE` mixed into four moments so that they stay valid after rounding.
#: Source: C. Peters, R. Klein, "Moment Shadow Mapping", 2015: 3e-7 for float32, 6e-5 for 16 bits. After a wide
#: blur 3e-7 leaves 1 of 10000 texels invalid and 1e-6 none; three times that is used.
MOMENT_BIAS = 3e-6
MOMENT_BIAS_16 = 6e-5
#: Pivots of the moments' matrix are 0 or more up to rounding.
LEAST_PIVOT = 1e-10
#: Keeps the square of a root within float32.
FLATTEST = 1e-12
#: The mixed-in moments are far from invalid ones: those of -1, 0 and 1 with the weights 3/16, 5/8 and 3/16.
LEAST_SURE = (0.0, 0.375, 0.0, 0.375)
#: The variance of a box of half width r, sampled at texels and read bilinearly, is below (r² + BOX_ROUNDING) / 3 along
#: each side: 1/6 for the sampling and 1/4 for the reading.
BOX_ROUNDING = 1.25


@pg.function
def normalised(depth: float, by: FilterFrame) -> float:
    """Scale scene units to -1 … 1; depths outside, or NaN, are no caster and become 1."""
    z = 0.5 * (depth - by.near) * by.scale
    return 2.0 * z - 1.0 if z >= 0.0 and z <= 1.0 else 1.0


@pg.function
def two_moments(d: float) -> vec2:
    """Return the moments that "vsm" stores."""
    return vec2(d, d * d)


@pg.function
def warped_moments(d: float, exponent: float) -> vec4:
    """Return the moments that "evsm4" stores: a depth warped in two ways, and their squares."""
    up = exp(exponent * d)
    down = -exp(-min(exponent, NEGATIVE_EXPONENT) * d)
    return vec4(up, up * up, down, down * down)


@pg.function
def four_moments(d: float) -> vec4:
    """Return the moments that "msm" stores."""
    square = d * d
    return vec4(d, square, square * d, square * square)


@pg.function
def packed_moments(b: vec4) -> vec4:
    """Pack four moments into 0 … 1 with as little loss in 16 bits as a linear map allows.

    Source: C. Peters, R. Klein, "Moment Shadow Mapping", 2015, the optimized quantization.
    """
    return vec4(
        1.5 * b.x - 2.0 * b.z + 0.5,
        4.0 * (b.y - b.w),
        sqrt(0.75) * b.x - sqrt(12.0) / 9.0 * b.z + 0.5,
        0.5 * (b.y + b.w),
    )


@pg.function
def unpacked_moments(p: vec4) -> vec4:
    """Return the moments packed by `packed_moments`."""
    x, z = p.x - 0.5, p.z - 0.5
    return vec4(
        -x / 3.0 + sqrt(3.0) * z,
        0.125 * p.y + p.w,
        -0.75 * x + 0.75 * sqrt(3.0) * z,
        p.w - 0.125 * p.y,
    )


@pg.function
def chebyshev(mean: float, square: float, t: float) -> float:
    """Return the largest fraction of values at or above ``t`` that these two moments allow (Chebyshev, one-sided)."""
    if t <= mean:
        return 1.0
    variance = max(square - mean * mean, VARIANCE_ROUNDING * square)
    return variance / (variance + (t - mean) * (t - mean))


@pg.function
def warped_bound(b: vec4, above: float, below: float, exponent: float) -> float:
    """Return the lesser of the bounds by both warps, at possibly different depths."""
    up = exp(exponent * clamp(above, -1.0, 1.0))
    down = -exp(-min(exponent, NEGATIVE_EXPONENT) * clamp(below, -1.0, 1.0))
    return min(chebyshev(b.x, b.y, up), chebyshev(b.z, b.w, down))


@pg.function
def hamburger(moments: vec4, t: float, bias: float) -> float:
    """Return the largest fraction of values at or above ``t`` that these four moments allow.

    Of all distributions with these moments, one with three values, including ``t``, has the least weight before ``t``
    (Markov, Krein).  The other two values are the roots of a polynomial whose coefficients solve the Hankel matrix of
    the moments, here by its Cholesky factors.

    Source: C. Peters, R. Klein, "Moment Shadow Mapping", 2015.
    """
    b = moments + (vec4(LEAST_SURE[0], LEAST_SURE[1], LEAST_SURE[2], LEAST_SURE[3]) - moments) * bias
    variance = max(b.y - b.x * b.x, LEAST_PIVOT)
    skew = b.z - b.x * b.y
    ratio = skew / variance
    rest = max(b.w - b.y * b.y - skew * ratio, LEAST_PIVOT)
    # the inverse of the Hankel matrix takes (1, t, t²) to the coefficients of p + q x + r x²
    r = (t * t - b.y - ratio * (t - b.x)) / rest
    q = (t - b.x) / variance - ratio * r
    p = 1.0 - b.x * q - b.y * r
    # a nearly linear polynomial has one root far away, which has no weight
    least = FLATTEST * (abs(q) + 1.0)
    r = r if abs(r) > least else least
    half = -0.5 * q / r
    wide = sqrt(max(half * half - p / r, 0.0))
    far = half + (wide if half >= 0.0 else -wide)
    near = p / (r * far) if far != 0.0 else 0.0
    low, high = min(near, far), max(near, far)
    dark = 0.0
    if high < t:
        dark = 1.0 - (low * high - b.x * (low + high) + b.y) / ((t - low) * (t - high))
    elif low < t:
        dark = (t * high - b.x * (t + high) + b.y) / ((low - t) * (low - high))
    # the mixed-in part is no caster
    return saturate(1.0 - dark + bias)


@pg.function
def without_bleed(lit: float, bleed: float) -> float:
    """Map fractions up to ``bleed`` to 0, and stretch the rest."""
    return saturate((lit - bleed) / (1.0 - bleed)) if lit < 1.0 else 1.0


@pg.struct
class Probe:
    """A receiver's depth and the map's moments there."""

    moments: vec4
    depth: float  # -1 to 1, more behind all casters
    spread: float  # standard deviation of non-casters within the blur, in the same unit
    reach: float  # largest distance of these from the receiver's depth
    share: float  # as in `passgraph.effects.shadows.shadow_filters.Receiver`


@pg.function
def probe(
    map: Image, light: LightFrame, position: vec3, surface: vec3, lift: float, by: FilterFrame, kind: int
) -> Probe:
    """Read the inputs of every lookup.

    The blur covers the receiver's own plane, or the half of it that the far plane has not clipped, and in a concave
    edge the next wall, no steeper than the cone of CONE_SLOPE.  A lookup compares at a depth in front of the receiver
    such that neither counts as a caster.  A map that is not blurred is read at one texel, against the depth of "hard".
    """
    receiver = receiver_at(map, light, position, surface, lift, kind)
    if receiver.share >= 0.0:
        return Probe(vec4(0.0), 0.0, 0.0, 0.0, receiver.share)
    size, texel = vec2(map.size), floor(receiver.place)
    outside = texel.x < 0.0 or texel.y < 0.0 or texel.x >= size.x or texel.y >= size.y
    sharp = by.radius <= 0.0
    depth = limit_at(receiver, texel + 0.5 - receiver.place, kind) if sharp else receiver.depth - receiver.slack
    t = (depth - by.near) * by.scale - 1.0
    if outside or t <= -1.0:
        return Probe(vec4(0.0), 0.0, 0.0, 0.0, 1.0)
    found = map.sample(receiver.place / size)
    if sharp:
        found = map.texel(ivec2(texel))
    # slope of depth per texel: in perspective maps that of 1 / depth
    slope = receiver.slope * (1.0 if kind == 0 else receiver.depth * receiver.depth)
    wall = CONE_SLOPE * receiver.texel
    spread = sqrt((dot(slope, slope) + wall * wall) * (by.radius * by.radius + BOX_ROUNDING) / 3.0) * by.scale
    reach = (max(abs(slope.x), wall) + max(abs(slope.y), wall)) * (by.radius + 1.5) * by.scale
    if sharp:
        spread, reach = 0.0, 0.0
    return Probe(found, t, spread, reach, -1.0)


@pg.function
def before(at: Probe, offset: float) -> float:
    """Return the depth to compare at: in front of the receiver, less so if its own plane is clipped.

    If the receiver is behind the far plane by the whole reach, no part of its plane can count as a caster.
    """
    cut = clamp((at.depth - 1.0) / max(at.reach, 1e-20), 0.0, 1.0)
    return min(at.depth, 1.0) - offset * (1.0 - cut)


@pg.function
def variance_bound(at: Probe, by: FilterFrame) -> float:
    """Return the light bound from two moments.

    The mean of a plane is its own depth; that of a concave edge or of a clipped plane is at most 0.87 standard
    deviations of the steeper side in front of it.

    Source: W. Donnelly, A. Lauritzen, "Variance Shadow Maps", 2006. Deviation: no derivatives of the depth are stored;
    the blur's own spread replaces them.
    """
    return chebyshev(at.moments.x, at.moments.y, before(at, at.spread))


@pg.function
def exponential_bound(at: Probe, by: FilterFrame) -> float:
    """Return the lesser of the bounds by both warps.

    In addition to the offset of `variance_bound`: the positive warp's mean is behind the mean of the depths (Jensen),
    and at most log(1 + c r) / c in front of the receiver if they are uniform within r.  The negative one's is in front
    of it, by at most c σ² / 2 as for every sum of uniform distributions (Hoeffding's lemma with their own variance),
    and not farther than the nearest of them.

    Source: A. Lauritzen, M. McCool, "Layered Variance Shadow Maps", 2008; both warps after A. Lauritzen, 2011.
    """
    above = min(at.spread, log(1.0 + by.exponent * at.reach) / by.exponent)
    below = min(at.spread + 0.5 * min(by.exponent, NEGATIVE_EXPONENT) * at.spread * at.spread, at.reach)
    return warped_bound(at.moments, before(at, above), before(at, below), by.exponent)


@pg.function
def moment_bound(at: Probe, by: FilterFrame) -> float:
    """Return the light bound from four moments; 1 at PLANE_DEVIATIONS in front of a plane.

    Source: C. Peters, R. Klein, "Moment Shadow Mapping", 2015. Deviation: the offset of slanted planes.
    """
    return hamburger(at.moments, before(at, PLANE_DEVIATIONS * at.spread), MOMENT_BIAS)


@pg.function
def moment_bound_16(at: Probe, by: FilterFrame) -> float:
    """Return `moment_bound` for a 16-bit map."""
    return hamburger(unpacked_moments(at.moments), before(at, PLANE_DEVIATIONS * at.spread), MOMENT_BIAS_16)


def lookup_by(bound: Any) -> Any:
    """Return the lookup with the most light that a bound allows."""

    @pg.function
    def share_by_bound(
        map: Image,
        nearest: Image,
        light: LightFrame,
        position: vec3,
        surface: vec3,
        lift: float,
        by: FilterFrame,
        kind: int,
        face: int,
    ) -> float:
        at = probe(map, light, position, surface, lift, by, kind)
        return at.share if at.share >= 0.0 else without_bleed(bound(at, by), by.bleed)

    return share_by_bound
