"""FXAA: smooth jagged edges in a finished picture."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from functools import lru_cache
from itertools import accumulate
from typing import Annotated, Any, Literal

import passgraph as pg
from passgraph.effects.checked import effect
from passgraph.effects.color.black_and_white import REC601
from passgraph.effects.color.srgb_encoding import encode_srgb
from passgraph.effects.quantities import Share
from passgraph.language import Const, Image, clamp, dot, fract, ivec2, mix, pixel, vec3, vec4

Quality = Literal["12", "39"]
#: Preset → steps of the search along an edge to either side, texels. Luma is read after each but the last, which is the
#: assumed end of the edge if no read found it.
STEPS: dict[Quality, tuple[float, ...]] = {
    "12": (1.0, 1.5, 2.0, 4.0, 12.0),
    "39": (1.0, 1.0, 1.0, 1.0, 1.0, 1.5, 2.0, 2.0, 2.0, 2.0, 4.0, 8.0),
}
#: Rows and columns, and ends of edges and their threshold, are often equal up to rounding: this factor decides, not a
#: device's last digit.
NEARLY = 0.9999


@pg.kernel
def perceived(color: Image, weights: vec3, linear: Const[bool]) -> float:
    """Return luma as displays encode it, 0 to 1; NaN is black."""
    c = color[0, 0].rgb
    y = min(1.0, max(0.0, dot(c, weights)))
    return encode_srgb(y) if linear else y


@lru_cache(maxsize=len(STEPS))
def _smoothing(quality: Quality) -> Any:
    """Return the kernel of a preset."""
    *read, last = accumulate(STEPS[quality])
    places = tuple(read)
    farthest = last

    @pg.function
    def luma_at(luma: Image, at: ivec2, along: ivec2, across: ivec2, away: float) -> float:
        """Return luma on the border of two rows at an offset along it, like a bilinear read there."""
        base = at + along * int(away)
        mean = luma.texel(base).r + luma.texel(base + across).r
        if fract(away) != 0.0:
            mean = 0.5 * (mean + luma.texel(base + along).r + luma.texel(base + along + across).r)
        return 0.5 * mean

    @pg.kernel
    def smooth(color: Image, luma: Image, subpixel: float, contrast: float, least: float) -> vec4:
        m = luma[0, 0].r
        n, s, w, e = luma[0, -1].r, luma[0, 1].r, luma[-1, 0].r, luma[1, 0].r
        highest, lowest = max(m, n, s, w, e), min(m, n, s, w, e)
        spread = highest - lowest
        if spread < max(least, highest * contrast) or spread == 0.0:
            return color[0, 0]
        nw, ne, sw, se = luma[-1, -1].r, luma[1, -1].r, luma[-1, 1].r, luma[1, 1].r

        # How far this pixel differs from its neighbors
        mean = (2.0 * (n + s + w + e) + nw + ne + sw + se) / 12.0
        out = clamp(abs(mean - m) / spread, 0.0, 1.0)
        smoothed = (3.0 - 2.0 * out) * out * out
        shift = smoothed * smoothed * subpixel

        # Second differences across rows and across columns; the edge runs along the axis with the lesser
        rows = abs(nw + sw - 2.0 * w) + 2.0 * abs(n + s - 2.0 * m) + abs(ne + se - 2.0 * e)
        columns = abs(nw + ne - 2.0 * n) + 2.0 * abs(w + e - 2.0 * m) + abs(sw + se - 2.0 * s)
        level = rows >= NEARLY * columns
        before, behind = n if level else w, s if level else e
        first = abs(before - m) >= abs(behind - m)
        steep = max(abs(before - m), abs(behind - m))
        border = 0.5 * (m + (before if first else behind))
        side = -1 if first else 1
        across = ivec2(0, side) if level else ivec2(side, 0)
        along = ivec2(1, 0) if level else ivec2(0, 1)

        # Along the border of the two rows to where luma leaves the mean of both
        at = pixel()
        back, ahead = farthest, farthest
        end_back, end_ahead = 0.0, 0.0
        found_back, found_ahead = False, False
        for i in range(len(places)):
            if not found_back:
                end_back = luma_at(luma, at, -along, across, places[i]) - border
                found_back = abs(end_back) >= NEARLY * 0.25 * steep
                back = places[i] if found_back else farthest
            if not found_ahead:
                end_ahead = luma_at(luma, at, along, across, places[i]) - border
                found_ahead = abs(end_ahead) >= NEARLY * 0.25 * steep
                ahead = places[i] if found_ahead else farthest
            if found_back and found_ahead:
                break
        end = end_back if back < ahead else end_ahead
        # Past the middle of the step, the other row's pixels move
        if (end < 0.0) != (m - border < 0.0):
            shift = max(shift, 0.5 - min(back, ahead) / (back + ahead))
        # Skip pixels that do not move: infinity times 0 is NaN
        return mix(color[0, 0], color.texel(at + across), shift) if shift > 0.0 else color[0, 0]

    return smooth


@effect("fxaa", alpha="premultiplied")
def fxaa(
    color: pg.Target,
    quality: Quality = "12",
    subpixel: Share | pg.Value | pg.Derived = 0.75,
    contrast: Annotated[float, pg.Range(0, 1)] | pg.Value | pg.Derived = 0.166,
    least_contrast: Annotated[float, pg.Range(0, 1)] | pg.Value | pg.Derived = 0.0833,
    linear: bool = False,
    into: pg.TargetSpec | None = None,
    name: str = "fxaa",
) -> pg.Target:
    """Smooth jagged edges of a finished picture (FXAA 3.11).

    Parameters
    ----------
    color : a picture for display, encoded, 0 to 1: after tone mapping. Alpha, which should be premultiplied, is
        smoothed with the color
    quality : length and precision of the search along edges. "12" reads 8 texels to each side, "39" finds ends of edges
        to the texel
    subpixel : strength of smoothing for single pixels that differ from their neighbors; 0 leaves them
    contrast : least contrast of an edge, as a fraction of the brightest neighbor's luma
    least_contrast : least contrast of an edge, as luma
    linear : colors are linear light, as read from sRGB formats. Luma is then encoded before edges are searched; values
        brighter than 1 count as 1
    into : destination target; default: 8 bits per channel, half floats with ``linear``, named ``name``
    name : name of the passes and targets

    Source: T. Lottes, "FXAA", NVIDIA white paper, 2009 and 2011, version 3.11, quality presets 12 and 39.
    Deviations: luma is stored in a picture of its own, in float32, in place of alpha; values that are equal up to
    rounding count as equal (edges along rows win over edges along columns).

    Examples
    --------
    >>> import numpy as np
    >>> steps = (np.arange(16) > 2 * np.arange(8)[:, None]).astype(np.float32)
    >>> into = pg.target("smooth", "rgba32f")
    >>> with pg.compile(fxaa(pg.Input("frame"), into=into), backend="reference") as program:
    ...     smooth = program(frame=np.repeat(steps[:, :, None], 4, axis=2))["smooth"]
    >>> [round(float(y), 2) for y in smooth[4, 5:12, 0]]
    [0.0, 0.0, 0.02, 0.21, 0.79, 0.98, 1.0]
    """
    luma = perceived(color, REC601, linear, into=pg.target(f"{name}_luma", "r32f", like=color), name=f"{name}_luma")
    into = into or pg.target(name, "rgba16f" if linear else "rgba8")
    smooth: pg.Target = _smoothing(quality)(color, luma, subpixel, contrast, least_contrast, into=into, name=name)
    return smooth
