"""Bounds for the search for casters: the least depth around each block of a shadow map.

A caster can occlude an area light only within the cone from the receiver to the light, which is wider the nearer the
caster is to the light.  So the necessary search width depends on the casters in front of that receiver.  The least
depth of all casters in a scene is a poor bound: one floor that extends to the plane of the lamp would make every search
as wide as the map.
"""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

import passgraph as pg
from passgraph.effects.shadows.shadow_filters import Receiver, reach_of
from passgraph.effects.shadows.shadow_map import NOTHING
from passgraph.effects.surfaces.views import LightFrame
from passgraph.language import Const, Image, clamp, floor, ivec2, length, pixel, vec2, vec3, vec4

#: Least texels along each side of a block with one nearest depth; larger blocks combine several.
LEAST_BLOCK = 8
#: Reach of the four depths around a receiver's block, in blocks.
AROUND = (1.0, 4.0, 16.0, 64.0)
#: Most blocks along each side of a map: the farthest depth then covers half the map at any size, which is the reach of
#: a filter (see `passgraph.effects.shadows.shadow_filters.FARTHEST`).
MOST_BLOCKS = 128


@pg.kernel
def nearest_of_blocks(map: Image, side: Const[int]) -> float:
    """Return the least depth of each block; beyond the map's border its last texels are repeated."""
    first = pixel() * side
    nearest = NOTHING
    for y in range(side):
        for x in range(side):
            nearest = min(nearest, map.texel(first + ivec2(x, y)).r)
    return nearest


@pg.kernel
def within_one(blocks: Image) -> float:
    """Return the least depth of 3 × 3 blocks."""
    nearest = NOTHING
    for y in range(-1, 2):
        for x in range(-1, 2):
            nearest = min(nearest, blocks[x, y].r)
    return nearest


@pg.kernel
def within_four(one: Image) -> vec2:
    """Add the least depth of 9 × 9 blocks, combined from 3 × 3 of the previous."""
    nearest = NOTHING
    for y in range(-1, 2):
        for x in range(-1, 2):
            nearest = min(nearest, one[3 * x, 3 * y].r)
    return vec2(one[0, 0].r, nearest)


@pg.kernel
def within_sixteen(two: Image) -> vec3:
    """Add the least depth of 33 × 33 blocks, combined from 4 × 4 of the previous."""
    nearest = NOTHING
    for y in range(4):
        for x in range(4):
            nearest = min(nearest, two[8 * x - 12, 8 * y - 12].g)
    return vec3(two[0, 0].rg, nearest)


@pg.kernel
def within_sixty_four(three: Image) -> vec4:
    """Add the least depth of 129 × 129 blocks, combined from 4 × 4 of the previous."""
    nearest = NOTHING
    for y in range(4):
        for x in range(4):
            nearest = min(nearest, three[32 * x - 48, 32 * y - 48].b)
    return vec4(three[0, 0].rgb, nearest)


def nearest_casters(map: pg.Target, map_size: int, name: str) -> pg.Target:
    """Compute the least depths around each block of a shadow map.

    Returns
    -------
    rgba32f, a texel for every block of the map: the least depth up to 1, 4, 16 and 64 blocks from it.  A block has 8 ×
    8 texels in maps of up to 1024, and an integer multiple in larger ones, so that there are at most MOST_BLOCKS.
    """
    said = f"nearest casters of {name}"
    side = -(-map_size // LEAST_BLOCK)
    nearest = nearest_of_blocks(map, LEAST_BLOCK, into=pg.target(f"{said}, 0", "r32f", (side, side)))
    wider = -(-side // MOST_BLOCKS)
    if wider > 1:
        side = -(-side // wider)
        nearest = nearest_of_blocks(nearest, wider, into=pg.target(f"{said}, wider", "r32f", (side, side)))
    steps = ((within_one, "r32f"), (within_four, "rg32f"), (within_sixteen, "rgb32f"), (within_sixty_four, "rgba32f"))
    for number, (kernel, format) in enumerate(steps, 1):
        named = f"{said}, {number}" if number < len(steps) else said
        nearest = kernel(nearest, into=pg.target(named, format, (side, side)))
    return nearest


@pg.function
def block_of(map: Image, nearest: Image) -> int:
    """Return the texels along each side of a block.

    The sizes of both pictures determine it if there are at least as many blocks per side as texels per block; with
    fewer blocks, the map is small and its blocks have the least size.
    """
    return max(LEAST_BLOCK, (map.size.x + nearest.size.x - 1) // nearest.size.x)


@pg.function
def search_reach(map: Image, nearest: Image, light: LightFrame, receiver: Receiver, kind: int) -> float:
    """Return the distance from the receiver, scene units, within which all its casters are.

    All casters up to some distance are no nearer to the light than the least depth there; a search as wide as that
    depth requires finds all that matter, if it ends before that distance.
    """
    inside = clamp(receiver.place, vec2(0.5), vec2(map.size) - 0.5)
    outside = length(receiver.place - inside)
    # a scene unit; a reach of half the map must not exceed it by rounding
    texels = 0.999 * max(length(receiver.right), abs(receiver.above.y))
    block = block_of(map, nearest)
    least = nearest.texel(ivec2(floor(inside)) // block)
    reach = reach_of(light, receiver, light.near, kind)
    for i in range(4):
        k = 3 - i
        if reach * texels <= AROUND[k] * float(block) - outside:
            reach = min(reach, reach_of(light, receiver, least[k], kind))
    return reach
