"""Soft shadows from hard ones by smaller pictures: a uniform mix, and one that depends on the softness at each
place."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Annotated

import passgraph as pg
from passgraph.effects.checked import checked
from passgraph.effects.light2d.penumbra import cross2, falloff
from passgraph.effects.light2d.sprites import shadow_of
from passgraph.effects.light2d.world import Float64, Light2D, Window
from passgraph.effects.pictures.stretched import Spot, drawn, in_window
from passgraph.language import Image, floor, length, log2, saturate, uv, vec2, vec3, vec4

#: A halving upsampled by splines turns a hard edge into one about this many of its texels wide: of 2, 2.25, 2.5 and 3
#: the one nearest to the exact penumbra.
TEXELS_PER_EDGE = 2.25


@pg.kernel
def stretched(picture: Image) -> vec4:
    """Resample to another size, bilinearly."""
    return picture.sample(uv())


def _halves(picture: pg.Target, levels: int, name: str) -> list[pg.Target]:
    """Return the picture and its halvings, ``levels`` in all."""
    chain = [picture]
    for level in range(1, levels):
        label = f"{name}_half{level}"
        into = pg.target(label, "rgba32f", like=picture, scale=0.5**level)
        chain.append(stretched(chain[-1], into=into, name=label))
    return chain


@checked
def smoothed(
    light: pg.Target, levels: Annotated[int, pg.Range(1, 6)] = 3, format: str = "rgba16f", name: str = "smoothed"
) -> pg.Target:
    """Mix a light map in equal parts with its halvings, each upsampled bilinearly and added.

    Parameters
    ----------
    light : the map, any size
    levels : the map itself and its halvings
    format : of the result, four channels, blendable
    name : of the result and, with a number, of the halvings
    """
    total: pg.Target | pg.TargetSpec = pg.target(name, format, like=light)
    for number, part in enumerate(_halves(light, levels, name)):
        total = drawn(part, total, f"{name}_add{number}", 1.0 / levels, blend="add")
    assert isinstance(total, pg.Target)
    return total


@pg.function
def place_in(at: vec2, clip: vec4) -> vec2:
    """Return the world position of a point of the picture, ``at`` from 0 to 1; ``clip`` is `Window.clip`."""
    return vec2((2.0 * at.x - 1.0 - clip.z) / clip.x, (1.0 - 2.0 * at.y - clip.w) / clip.y)


@pg.fragment
def shadow_width(spot: Spot, clip: vec4, light: vec4, pixels_per_unit: float) -> vec4:
    """Return shadow in red; in green the width of the soft edge here, px: the lamp's width seen through the wall's
    edge."""
    ray = place_in(uv(), clip) - light.xy
    along = spot.edge.zw - spot.edge.xy
    # how many times farther from the lamp than the wall this place is
    times = cross2(ray, along) / cross2(spot.edge.xy - light.xy, along)
    return vec4(1.0, 2.0 * light.w * max(times - 1.0, 0.0) * pixels_per_unit, 0.0, 0.0)


@pg.function
def spline(picture: Image, at: vec2) -> vec4:
    """Sample a picture by cubic B-splines, as four bilinear reads: plain bilinear ones show the texels as facets.

    Source: C. Sigg, M. Hadwiger, "Fast Third-Order Texture Filtering", GPU Gems 2, 2005, chapter 20.
    """
    size = vec2(picture.size)
    place = at * size - 0.5
    texel = floor(place)
    t = place - texel
    u = 1.0 - t
    first = u * u * u / 6.0
    last = t * t * t / 6.0
    second = 2.0 / 3.0 - 0.5 * t * t * (2.0 - t)
    third = 1.0 - first - second - last
    low = texel - 0.5 + second / (first + second)
    high = texel + 1.5 + last / (third + last)
    near = low / size
    far = high / size
    left = first.x + second.x
    upper = first.y + second.y
    top = picture.sample(near) * left + picture.sample(vec2(far.x, near.y)) * (1.0 - left)
    bottom = picture.sample(vec2(near.x, far.y)) * left + picture.sample(far) * (1.0 - left)
    return top * upper + bottom * (1.0 - upper)


@pg.kernel
def gathered(sofar: Image, half: Image) -> vec4:
    """Sum shadow and width over the halvings: their ratio is a width even outside of the shadow."""
    return sofar[0, 0] + spline(half, uv())


@pg.kernel
def blended(sofar: Image, half: Image, width: Image, level: float) -> vec4:
    """Move toward a smaller picture where the edge is as wide as its texels."""
    w = width[0, 0]
    wanted = log2(max(w.g / max(w.r, 1e-6), 1e-6) / TEXELS_PER_EDGE)
    return sofar[0, 0] + (spline(half, uv()) - sofar[0, 0]) * saturate(wanted - level + 1.0)


@pg.kernel
def shaded(shadow: Image, clip: vec4, light: vec4, color: vec3) -> vec4:
    """Return the light's gradient, minus the shadow."""
    far = length(place_in(uv(), clip) - light.xy)
    return vec4(color * (falloff(far, light.z) * (1.0 - saturate(shadow[0, 0].r))), 0.0)


@checked
def mixed_light(
    window: Window,
    light: Light2D,
    edges: Float64,
    size: tuple[int, int],
    levels: Annotated[int, pg.Range(2, 8)] = 6,
    name: str = "mixed",
) -> pg.Target:
    """Compute one light whose shadows are sharp at the wall and soft far behind it, by selecting among halvings.

    A point's shadow is drawn with the width of its soft edge; halvings spread that width past the edge, and each place
    uses the halving whose texels are as wide.

    Parameters
    ----------
    window : the part of the world in the picture, pixels as wide as high
    light : with ``size`` above 0
    edges : (n, 4) as x, y, x, y, n above 0
    size : (width, height) of the picture, px
    levels : the shadow itself and its halvings
    name : name of the passes and targets
    """
    where = {"clip": window.clip, "light": (*light.position, light.radius, light.size)}
    mask: pg.Target = pg.draw(
        shadow_of(edges, light.position),
        vertex=in_window,
        fragment=shadow_width,
        into=pg.target(f"{name}_mask", "rgba32f", size),
        blend="max",
        values={**where, "pixels_per_unit": size[0] / (window.right - window.left)},
    )
    halves = _halves(mask, levels, name)
    width = mask
    for level, half in enumerate(halves[1:], 1):
        label = f"{name}_width{level}"
        width = gathered(width, half, into=pg.target(label, "rgba32f"))
    shadow = mask
    for level, half in enumerate(halves[1:], 1):
        label = f"{name}_mix{level}"
        shadow = blended(shadow, half, width, float(level), into=pg.target(label, "rgba32f"))
    return shaded(shadow, color=light.color, into=pg.target(name, "rgba32f"), name=name, **where)
