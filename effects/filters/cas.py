"""CAS: sharpen most where neighbors differ little, so that edges do not ring."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

import passgraph as pg
from passgraph.effects.checked import effect
from passgraph.effects.pictures.decoded import decoded
from passgraph.effects.quantities import Share
from passgraph.language import Image, clamp, sqrt, vec4

#: Largest weight of each of the four neighbors, as a reciprocal: for the least and the most sharpness.
LEAST, MOST = 8.0, 5.0


@pg.kernel
def adapted(color: Image, sharpness: float) -> vec4:
    """Subtract the four neighbors, with a weight from the green channel."""
    c, n, w, e, s = color[0, 0], color[0, -1], color[-1, 0], color[1, 0], color[0, 1]
    lowest, highest = min(n.g, w.g, c.g, e.g, s.g), max(n.g, w.g, c.g, e.g, s.g)
    room = min(lowest, 1.0 - highest)
    if not room > 0.0:
        return c
    share = -sqrt(min(room / highest, 1.0)) / (LEAST + (MOST - LEAST) * sharpness)
    sharp = (n * share + w * share + e * share + s * share + c) / (1.0 + 4.0 * share)
    return clamp(sharp, min(c, vec4(0.0)), max(c, vec4(1.0)))


@effect("cas", linear=True, alpha="premultiplied")
def cas(
    color: pg.Target,
    sharpness: Share | pg.Value | pg.Derived = 0.5,
    into: pg.TargetSpec | None = None,
    name: str = "cas",
) -> pg.Target:
    """Sharpen by local contrast (AMD's contrast adaptive sharpening, without its scaling).

    Parameters
    ----------
    color : linear light, 0 to 1, Rec. 709 primaries; pixels with green outside of that range around them stay. Outside
        of the picture, reads follow the rule of ``color.border(...)``
    sharpness : 0 sharpens least, 1 most
    into : destination target; default: float32 named ``name``
    name : name of the pass

    Subtracts the four neighbors, with the weight -sqrt(min(least, 1 - most) / most) / (8 to 5) of the least and the
    most green among the five.
    Source: T. Lottes, "FidelityFX CAS", AMD, 2019: its faster variant with five reads and one weight for all channels.
    Deviations: divisions and roots are exact; values outside of 0 to 1 are kept; alpha, which should be premultiplied,
    is filtered with the color.

    Examples
    --------
    >>> import numpy as np
    >>> edge = np.where(np.arange(6) < 3, 0.4, 0.6).astype(np.float32)[None, :, None] * np.ones(4, np.float32)
    >>> with pg.compile(cas(pg.Input("frame"), 1.0), backend="reference") as program:
    ...     [round(float(y), 2) for y in program(frame=edge)["cas"][0, :, 0]]
    [0.4, 0.4, 0.31, 0.69, 0.6, 0.6]
    """
    light = decoded(color, f"{name}_light", "rgba32f")
    return adapted(light, sharpness, into=into or pg.target(name, "rgba32f"), name=name)
