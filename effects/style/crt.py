"""CRT: show a picture as a tube does, with scan lines, a phosphor mask and curved glass."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Annotated, Literal

import passgraph as pg
from passgraph.effects.checked import effect
from passgraph.effects.pictures.decoded import decoded
from passgraph.effects.quantities import NotNegative
from passgraph.effects.style.pixelate import mean_of_block
from passgraph.language import Const, Image, exp2, floor, ivec2, pixel, uv, vec2, vec3, vec4

#: Magnification of the glass toward the sides; and falloff of the glow, along lines and across them.
WARP_X, WARP_Y = 0.031, 0.041
GLOW_PIXEL, GLOW_SCAN = 1.5, 2.0
Mask = Literal["stretched-vga", "vga", "grille", "tv", "none"]
MASKS: tuple[Mask, ...] = ("stretched-vga", "vga", "grille", "tv", "none")


@pg.function
def phosphors(kind: int, dark: float, light: float) -> vec3:
    """Return the factor of each color of this pixel: the mask lets one of three through."""
    at, third, line = pixel(), 0, 1.0
    if kind == 0:
        third = (at.x + 3 * at.y + 2) % 6 // 2
    if kind == 1:
        third = (at.x + 3 * (at.y // 2)) % 6 // 2
    if kind >= 2:
        third = at.x % 3
    if kind == 3:
        line = dark if (at.y + (1 if at.x % 6 < 3 else 0)) % 2 == 0 else light
    return vec3(light if third == 0 else dark, light if third == 1 else dark, light if third == 2 else dark) * line


@pg.kernel
def shown_by_tube(
    lines: Image, scan: float, sharpness: float, glow: float, curve: float, mask: Const[int], dark: float, light: float
) -> vec4:
    """Apply Gaussians along each line and across lines, over seven by five pixels of the beam."""
    place = 2.0 * uv() - 1.0
    place *= 1.0 + curve * vec2(WARP_X, WARP_Y) * (place * place).yx
    at = (0.5 + 0.5 * place) * vec2(lines.size)
    nearest = floor(at)
    away = nearest + 0.5 - at
    beam, around = vec3(0.0), vec3(0.0)
    for j in range(-2, 3):
        near, near_weight, wide, wide_weight = vec3(0.0), 0.0, vec3(0.0), 0.0
        for i in range(-3, 4):
            c = lines.texel(ivec2(nearest) + ivec2(i, j)).rgb
            d = away.x + float(i)
            if abs(i) <= (1 if abs(j) == 1 else 2):
                w = exp2(-sharpness * d * d)
                near += c * w
                near_weight += w
            if abs(j) < 2:
                w = exp2(-GLOW_PIXEL * d * d)
                wide += c * w
                wide_weight += w
        d = away.y + float(j)
        line = near / near_weight
        if abs(j) < 2:
            beam += line * exp2(-scan * d * d)
            line = wide / wide_weight
        around += line * exp2(-GLOW_SCAN * d * d)
    light_ = beam + around * glow
    return vec4(light_ if mask == 4 else light_ * phosphors(mask, dark, light), 1.0)


@effect("crt", linear=True, alpha="ignored")
def crt(
    color: pg.Target,
    pixel_px: Annotated[int, pg.Range(1, 64, "px")] = 4,
    scan: Annotated[float, pg.Range(0, 64)] | pg.Value | pg.Derived = 8.0,
    sharpness: Annotated[float, pg.Range(0, 16)] | pg.Value | pg.Derived = 3.0,
    glow: NotNegative | pg.Value | pg.Derived = 0.0625,
    curve: Annotated[float, pg.Range(0, 8)] | pg.Value | pg.Derived = 1.0,
    mask: Mask = "stretched-vga",
    mask_dark: NotNegative | pg.Value | pg.Derived = 0.5,
    mask_light: NotNegative | pg.Value | pg.Derived = 1.5,
    into: pg.TargetSpec | None = None,
    name: str = "crt",
) -> pg.Target:
    """Show a picture on a cathode ray tube: scan lines, a shadow mask, some glow and curved glass.

    Parameters
    ----------
    color : linear light, any range
    pixel_px : side of the squares whose means the beam shows. 1 keeps pixels, for small pictures that ``into`` enlarges
    scan : thinness of lines: the beam falls by 2 to this power a line away. 8 is soft, 16 medium
    sharpness : sharpness of pixels along a line; 2 is soft, 4 hard
    glow : factor of the light that spreads over 5 lines
    curve : curvature of the glass; 0 is flat. Outside of its edge the result is black
    mask : the arrangement of red, green and blue phosphors, in pixels of the result
    mask_dark : factor of the two colors that the mask hides
    mask_light : factor of the one that it shows
    into : where it goes, of any size; default: float32 with the name ``name``
    name : name of the passes and targets

    Source: T. Lottes, "CRT", Shadertoy XsjSzR, 2014, public domain.
    Deviations: rows of the mask are counted from the top; squares of pixels are averaged, where the original reads one
    of each.

    Examples
    --------
    >>> import numpy as np
    >>> white = np.ones((16, 16, 4), np.float32)
    >>> with pg.compile(crt(pg.Input("frame"), 4, mask="none", curve=0.0), backend="reference") as program:
    ...     [round(float(y), 2) for y in program(frame=white)["crt"][8:12, 8, 0]]
    [0.67, 1.03, 1.03, 0.67]
    """
    spec = pg.target(f"{name}_lines", "rgba32f", like=color, scale=1.0 / pixel_px)
    light = decoded(color, f"{name}_light", "rgba32f")
    lines = mean_of_block(light, pixel_px, into=spec, name=spec.name).border("zero")
    return shown_by_tube(
        lines, scan, sharpness, glow, curve, MASKS.index(mask), mask_dark, mask_light,
        into=into or pg.target(name, "rgba32f", like=color), name=name,
    )  # fmt: skip
