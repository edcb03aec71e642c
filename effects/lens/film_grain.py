"""Film grain: noise that is strongest in mid-tones."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from math import ceil
from typing import Annotated, Any

import passgraph as pg
from passgraph.effects.checked import effect
from passgraph.effects.filters.blur import SIGMAS, gaussian_blur, gaussian_weights
from passgraph.effects.quantities import Share, mapped
from passgraph.language import Const, Image, clamp, pixel, vec4

#: Mean and deviation of the sum of four random bytes (variance of n equal steps: (n² - 1) / 12).
BYTES_MEAN, BYTES_DEVIATION = 510, (4.0 * (256.0**2 - 1.0) / 12.0) ** 0.5
#: Pictures of a run are counted from 0.
Index = Annotated[int, pg.Range(0)]


@pg.struct
class Hashed:
    """Three pseudo-random ints."""

    x: int
    y: int
    z: int


@pg.function
def folded(bits: int) -> int:
    """Fold the upper half onto the lower."""
    return bits ^ ((bits >> 16) & 0xFFFF)


@pg.function
def hashed(x0: int, y0: int, z0: int) -> Hashed:
    """Hash by pcg3d of M. Jarzynski and M. Olano, "Hash Functions for GPU Rendering", 2020, section 3."""
    x, y, z = x0 * 1664525 + 1013904223, y0 * 1664525 + 1013904223, z0 * 1664525 + 1013904223
    x += y * z
    y += z * x
    z += x * y
    x, y, z = folded(x), folded(y), folded(z)
    x += y * z
    y += z * x
    z += x * y
    return Hashed(x, y, z)


@pg.function
def bell(bits: int) -> float:
    """Return the sum of four bytes: integers from -510 to 510, nearly normally distributed."""
    total = (bits & 255) + ((bits >> 8) & 255) + ((bits >> 16) & 255) + ((bits >> 24) & 255)
    return float(total - BYTES_MEAN)


@pg.kernel
def noise(index: int, seed: int, colored: Const[bool]) -> vec4:
    """Return pseudo-random integers, new ones for each pixel and index."""
    at = pixel()
    hashes = hashed(at.x, at.y, index ^ (seed * 0x9E3779B9))
    first = bell(hashes.x)
    return vec4(first, bell(hashes.y), bell(hashes.z), 0.0) if colored else vec4(first, first, first, 0.0)


@pg.kernel
def grained(color: Image, grain: Image, amplitude: float) -> vec4:
    """Add the grain, weighted by the parabola over the light that is 1 in the middle and 0 at both ends."""
    c = color[0, 0]
    y = clamp(c.rgb, 0.0, 1.0)
    return vec4(c.rgb + grain[0, 0].rgb * (y * (1.0 - y)) * (4.0 * amplitude), c.a)


@effect("film-grain")
def film_grain(
    color: pg.Target,
    strength: Share | pg.Value | pg.Derived = 0.04,
    size_px: Annotated[float, pg.Range(0, 16, "px")] = 0.0,
    colored: bool = False,
    index: Index | pg.Value | pg.Derived = 0,
    seed: Index = 0,
    into: pg.TargetSpec | None = None,
    name: str = "film_grain",
) -> pg.Target:
    """Add film grain to a finished picture: none in black and white, most in between.

    Parameters
    ----------
    color : encoded for display, 0 to 1
    strength : standard deviation where a channel is 0.5; up to 0.07 nothing leaves 0 to 1, so the average stays
    size_px : width of a grain; 0 makes each pixel a grain of its own, the same bits on every backend
    colored : red, green and blue have separate grains; off, they share one
    index : the picture's number in its sequence, for new grain in each. `passgraph.frames` gives it as
        ``values=lambda number: {"index": number}``
    seed : another seed gives other grain
    into : destination target; default: 8 bits a channel, named ``name``
    name : name of the passes and targets

    Source: the noise of areas that are covered with probability p has the variance p (1 - p) (E. W. H. Selwyn, 1935);
    the parabola is that, over encoded values. Noise is hashed from the pixel, the index and the seed: nothing repeats.

    Examples
    --------
    >>> import numpy as np
    >>> made = film_grain(pg.Input("frame"), 0.05, index=pg.Value("index", int), into=pg.target("shown", "rgba32f"))
    >>> grey = np.full((64, 64, 4), 0.5, np.float32)
    >>> with pg.compile(made, backend="reference") as program:
    ...     first, second = (program(frame=grey, index=number)["shown"][..., 0] for number in (1, 2))
    >>> round(float(first.std()), 2), round(float(first.mean()), 2), bool((first == second).mean() < 0.01)
    (0.05, 0.5, True)
    """
    grain: Any = noise(index, seed, colored, into=pg.target(f"{name}_noise", "rgba16f", like=color))
    deviation = BYTES_DEVIATION
    if size_px > 0.0:
        sigma, radius = 0.5 * size_px, ceil(0.5 * SIGMAS * size_px)
        first, *rest = gaussian_weights(sigma, radius)
        # standard deviation of the mean of independent numbers; repeated, so that the border averages as many as the
        # middle
        deviation *= first**2 + 2.0 * sum(weight**2 for weight in rest)
        wide = pg.target(f"{name}_grain", "rgba32f", like=color)
        grain = gaussian_blur(grain.border("repeat"), sigma, radius, into=wide, name=f"{name}_grain")
    amplitude = mapped(strength, lambda given: given / deviation)
    return grained(color, grain, amplitude, into=into or pg.target(name, "rgba8"), name=name)
