"""Lens flare: ghosts and a halo of bright light, computed from the picture itself."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Annotated

import passgraph as pg
from passgraph.effects.checked import effect
from passgraph.effects.filters.blur import gaussian_blur
from passgraph.effects.lens.god_rays import lit_air, shining
from passgraph.effects.quantities import NotNegative, Share
from passgraph.language import Const, Image, length, normalize, output_size, smoothstep, uv, vec2, vec3, vec4

#: Distance from the center at which ghosts vanish, relative to the picture's size; half the width of the halo, in
#: heights.
GHOST_END, HALO_HALF = 0.75, 0.1
#: Standard deviation of the blur of the flare, in pixels of half the size.
SOFT_PX = 1.5


@pg.function
def dispersed(source: Image, at: vec2, apart: float) -> vec3:
    """Return red, green and blue from neighboring positions on the line to the center."""
    way = normalize(0.5 - at) * apart
    return vec3(source.sample(at + way).r, source.sample(at).g, source.sample(at - way).b)


@pg.kernel
def in_lens(source: Image, ghosts: Const[int], spacing: float, halo: float, radius: float, apart: float) -> vec4:
    """Return ghosts and the halo of the picture, upside down."""
    at, total = 1.0 - uv(), vec3(0.0)
    for i in range(ghosts):
        there = at + (0.5 - at) * (spacing * float(i))
        total += dispersed(source, there, apart) * (1.0 - smoothstep(0.0, GHOST_END, length(there - 0.5)))
    # in heights of the picture
    heights = vec2(float(output_size().x) / float(output_size().y), 1.0)
    away = (at - 0.5) * heights
    off = min(abs(length(away) - radius) / HALO_HALF, 1.0)
    ring = halo * (1.0 - smoothstep(0.0, 1.0, off))
    if ring > 0.0:
        total += dispersed(source, at - normalize(away) * radius / heights, apart) * ring
    return vec4(total, 1.0)


@effect("lens-flare", linear=True, alpha="premultiplied")
def lens_flare(
    color: pg.Target,
    threshold: NotNegative | pg.Value | pg.Derived = 0.8,
    intensity: NotNegative | pg.Value | pg.Derived = 0.1,
    ghosts: Annotated[int, pg.Range(0, 16)] = 5,
    spacing: Annotated[float, pg.Range(0, 2)] | pg.Value | pg.Derived = 0.35,
    halo: NotNegative | pg.Value | pg.Derived = 0.5,
    halo_radius: Annotated[float, pg.Range(0, 2)] | pg.Value | pg.Derived = 0.4,
    dispersion: Share | pg.Value | pg.Derived = 0.01,
    into: pg.TargetSpec | None = None,
    name: str = "lens_flare",
) -> pg.Target:
    """Add lens flare: ghosts on the line through the center, and a halo.

    Parameters
    ----------
    color : any picture, linear light
    threshold : least luminance of light that flares, scene-linear
    intensity : factor of the flare; 0 leaves the picture unchanged
    ghosts : number of ghosts
    spacing : spacing of ghosts. Light at a distance w from the center has its ghost number i at ``-w / (1 - i
        spacing)``
    halo : factor of the halo relative to the ghosts
    halo_radius : radius of the halo of a light in the center, as a fraction of the picture's height
    dispersion : distance of red from green, and of green from blue, as a fraction of the picture's size
    into : destination target; default: float32 named ``name``
    name : name of the passes and targets

    Ghosts fade as their source approaches the picture's border, the halo within a tenth of the height from its radius.
    Light outside of the picture does not flare, nor do NaN and infinity.  The flare is computed at half the size, and
    blurred.
    Source: J. Chapman, "Screen Space Lens Flare", 2017.
    Deviations: lights do not reappear at the opposite side; no starburst, and no dirt, for which there is
    ``dirty_lens_bright``.

    Examples
    --------
    A lamp at the left has its first ghost at the right, as far from the center:

    >>> import numpy as np
    >>> frame = np.zeros((32, 64, 4), np.float32)
    >>> frame[15:17, 15:17] = 100.0
    >>> with pg.compile(lens_flare(pg.Input("frame"), ghosts=1, halo=0.0), backend="reference") as program:
    ...     flare = program(frame=frame)["lens_flare"][16, 20:, 1]
    >>> 20 + int(flare.argmax()) in (47, 48)
    True
    """
    half = pg.target(f"{name}_source", "rgba32f", like=color, scale=0.5)
    source = shining(color, color, threshold, False, into=half, name=half.name).border("zero")
    sharp = pg.target(f"{name}_sharp", "rgba32f", like=source)
    flare = in_lens(source, ghosts, spacing, halo, halo_radius, dispersion, into=sharp, name=sharp.name)
    soft = gaussian_blur(flare, SOFT_PX, into=pg.target(f"{name}_soft", "rgba32f", like=source), name=f"{name}_soft")
    return lit_air(color, soft, intensity, into=into or pg.target(name, "rgba32f", like=color), name=name)
