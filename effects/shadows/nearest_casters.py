"""How near to the light casters come about each place of a shadow map: what bounds the search for them.

A caster can be in the way of a light with an extent only within the cone from the receiver to the light, which is the
wider the nearer the caster is to the light.  How wide a search has to be is a fact of the casters before that
receiver; the depth where all casters of a scene begin says little about it: one floor whose border reaches the plane
of the lamp would make every search as wide as the map.
"""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

import passgraph as pg
from passgraph import Image, clamp, floor, ivec2, length, pixel, vec2, vec3, vec4
from passgraph.effects.shadows.shadow_filters import Receiver, reach_of
from passgraph.effects.shadows.shadow_map import NOTHING
from passgraph.effects.surfaces.views import LightFrame

#: Texels along each side of a block that has one nearest depth.
BLOCK = 8
#: How far about a receiver's block the four depths look, in texels of the map: 1, 4, 16 and 64 blocks.
AROUND = (8.0, 32.0, 128.0, 512.0)


@pg.kernel
def nearest_of_blocks(map: Image) -> float:
    """The least depth of each block; beyond the map's border its last texels count again."""
    first = pixel() * BLOCK
    nearest = NOTHING
    for y in range(BLOCK):
        for x in range(BLOCK):
            nearest = min(nearest, map.texel(first + ivec2(x, y)).r)
    return nearest


@pg.kernel
def within_one(blocks: Image) -> float:
    """The least of 3 × 3 blocks."""
    nearest = NOTHING
    for y in range(-1, 2):
        for x in range(-1, 2):
            nearest = min(nearest, blocks[x, y].r)
    return nearest


@pg.kernel
def within_four(one: Image) -> vec2:
    """And that of 9 × 9, put together from 3 × 3 of the above."""
    nearest = NOTHING
    for y in range(-1, 2):
        for x in range(-1, 2):
            nearest = min(nearest, one[3 * x, 3 * y].r)
    return vec2(one[0, 0].r, nearest)


@pg.kernel
def within_sixteen(two: Image) -> vec3:
    """And that of 33 × 33, put together from 4 × 4 of the above."""
    nearest = NOTHING
    for y in range(4):
        for x in range(4):
            nearest = min(nearest, two[8 * x - 12, 8 * y - 12].g)
    return vec3(two[0, 0].rg, nearest)


@pg.kernel
def within_sixty_four(three: Image) -> vec4:
    """And that of 129 × 129, put together from 4 × 4 of the above."""
    nearest = NOTHING
    for y in range(4):
        for x in range(4):
            nearest = min(nearest, three[32 * x - 48, 32 * y - 48].b)
    return vec4(three[0, 0].rgb, nearest)


def nearest_casters(map: pg.Target, map_size: int, name: str) -> pg.Target:
    """The least depths about each block of a shadow map.

    Returns
    -------
    rgba32f, a texel for every 8 × 8 of the map: the least depth up to 8, 32, 128 and 512 texels from the block.
    """
    side = -(-map_size // BLOCK)
    steps = (
        (nearest_of_blocks, "r32f"), (within_one, "r32f"), (within_four, "rg32f"), (within_sixteen, "rgb32f"),
        (within_sixty_four, "rgba32f"),
    )  # fmt: skip
    made = map
    for number, (kernel, format) in enumerate(steps):
        said = f"nearest casters of {name}, {number}" if number + 1 < len(steps) else f"nearest casters of {name}"
        made = kernel(made, into=pg.target(said, format, (side, side)))
    return made


@pg.function
def search_reach(map: Image, nearest: Image, light: LightFrame, receiver: Receiver, kind: int) -> float:
    """Scene units about the receiver within which every caster lies that can be in its light's way.

    All casters up to some distance are no nearer to the light than the least depth there; a search as wide as that
    depth asks finds all that matter, wherever it ends before that distance.
    """
    inside = clamp(receiver.place, vec2(0.5), vec2(map.size) - 0.5)
    outside = length(receiver.place - inside)
    # a scene unit; a reach that is half the map must not be more by rounding
    texels = 0.999 * max(length(receiver.right), abs(receiver.above.y))
    least = nearest.texel(ivec2(floor(inside)) // BLOCK)
    reach = reach_of(light, receiver, light.near, kind)
    for i in range(4):
        k = 3 - i
        if reach * texels <= AROUND[k] - outside:
            reach = min(reach, reach_of(light, receiver, least[k], kind))
    return reach
