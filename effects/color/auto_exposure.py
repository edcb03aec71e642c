"""Auto exposure: scale a picture so that its average becomes middle gray."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Annotated

import passgraph as pg
from passgraph.effects.checked import effect
from passgraph.effects.quantities import Exposure, Share
from passgraph.language import Image, clamp, dot, exp2, isnan, ivec2, log2, mix, vec2, vec3, vec4

#: Histogram: number of bins, and the stops from middle gray to its darkest end and from end to end.
BINS, DARKEST, STOPS = 256, -16.0, 32.0
#: Scene-linear luminance that stays unchanged.
GREY = 0.18
#: Limits of the ignored fractions of pixels: together they leave some.
Clipped = Annotated[float, pg.Range(0, 0.49)]


@pg.kernel
def stops_of(color: Image) -> float:
    """Return the position of the luminance in the histogram, 0 to 1, clamped to its ends; NaN is in no bin."""
    light = dot(color[0, 0].rgb, vec3(0.2126, 0.7152, 0.0722))
    place = clamp((log2(max(light, 1e-30) / GREY) - DARKEST) / STOPS, 0.0, 1.0)
    return -1.0 if isnan(light) else place


@pg.kernel
def metered(counts: Image, dark: float, bright: float, least: float, most: float) -> float:
    """Return the exposure, in stops, from the mean logarithm between two fractions of the pixels."""
    total = 0.0
    for i in range(BINS):
        total += counts.texel(ivec2(i, 0)).r
    first, last = total * dark, total * (1.0 - bright)
    below, weight, sum = 0.0, 0.0, 0.0
    for i in range(BINS):
        above = below + counts.texel(ivec2(i, 0)).r
        inside = max(min(above, last) - max(below, first), 0.0)
        weight += inside
        sum += inside * (float(i) + 0.5)
        below = above
    mean = sum / weight if weight > 0.0 else -DARKEST / STOPS * BINS
    return clamp(-DARKEST - mean * (STOPS / BINS), least, most)


@pg.kernel
def settled(wanted: Image, last: Image, share: float) -> vec2:
    """Move a fraction of the way from last run's exposure, and set the flag for one; the first run has none."""
    before = last[0, 0]
    return vec2(mix(before.r, wanted[0, 0].r, share) if before.g > 0.0 else wanted[0, 0].r, 1.0)


@pg.kernel
def exposed(color: Image, exposure: Image) -> vec4:
    c = color[0, 0]
    return vec4(c.rgb * exp2(exposure.texel(ivec2(0, 0)).r), c.a)


@effect("auto-exposure", linear=True)
def auto_exposure(
    color: pg.Target,
    dark_share: Clipped | pg.Value | pg.Derived = 0.1,
    bright_share: Clipped | pg.Value | pg.Derived = 0.1,
    least_stops: Exposure | pg.Value | pg.Derived = -8.0,
    most_stops: Exposure | pg.Value | pg.Derived = 8.0,
    settle_share: Share | pg.Value | pg.Derived = 1.0,
    into: pg.TargetSpec | None = None,
    name: str = "auto_exposure",
) -> pg.Target:
    """Adjust exposure: scale scene-linear light so that its logarithmic mean becomes middle gray, 0.18.

    Parameters
    ----------
    color : scene-linear, Rec. 709 primaries, any range
    dark_share : fraction of the pixels, the darkest ones, to ignore
    bright_share : fraction of the pixels, the brightest ones, to ignore
    least_stops : lower limit of the exposure
    most_stops : upper limit of the exposure
    settle_share : fraction of the way to the new exposure in each run; 1 goes there at once, and 1 - exp(-seconds /
        time) adapts like an eye. The first run goes there at once
    into : destination target; default: float32 named ``name``
    name : name of the pass

    The exposure comes from a histogram of logarithms, so small lamps and black corners matter little; its bins are an
    eighth of a stop.
    Source: the percentile-clipped histogram of common engines; K. Narkowicz, "Automatic Exposure", 2016.

    Examples
    --------
    >>> import numpy as np
    >>> dim = np.full((8, 8, 4), 0.18 / 4, np.float32)
    >>> with pg.compile(auto_exposure(pg.Input("frame")), backend="reference") as program:
    ...     shown = program(frame=dim)["auto_exposure"][0, 0, 0]
    >>> bool(abs(shown / 0.18 - 1.0) < 0.05)  # within half a bin
    True
    """
    light = stops_of(color, into=pg.target(f"{name}_stops", "r32f"), name=f"{name}_stops")
    counts = pg.histogram(light, BINS, channel=0, name=f"{name}_histogram")
    wanted = metered(
        counts, dark_share, bright_share, least_stops, most_stops,
        into=pg.target(f"{name}_metered", "r32f", (1, 1)), name=f"{name}_metered",
    )  # fmt: skip
    exposure = wanted
    if settle_share != 1.0:
        spec = pg.target(f"{name}_settled", "rg32f", (1, 1))
        exposure = settled(wanted, pg.previous(spec), settle_share, into=spec, name=spec.name)
    return exposed(color, exposure, into=into or pg.target(name, "rgba32f"), name=name)
