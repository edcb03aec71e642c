"""A flat world as a picture: floor, light map, rims along walls, shadows of moving things, and dirt on the lens."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Literal

import passgraph as pg
from passgraph.effects.checked import effect
from passgraph.effects.color.tone_map import tone_map
from passgraph.effects.lens.lens import dirt_texture, dirty_lens_bright
from passgraph.effects.light2d.distance_grid import distance_grid, occlusion, reach
from passgraph.effects.light2d.lens_spots import dirty_lens_map, dirty_lens_spots, light_spots
from passgraph.effects.light2d.light_map import Draws, Penumbra, light_map, lit
from passgraph.effects.light2d.sprites import Near, moving_shadows
from passgraph.effects.light2d.world import Window
from passgraph.effects.light2d.world_file import World2D
from passgraph.effects.pictures.stretched import Spot, in_window, quads
from passgraph.effects.quantities import Exposure, NotNegative, Share
from passgraph.language import Image, exp2, floor, ivec2, pixel, uv, vec2, vec3, vec4

Lens = Literal["none", "bright", "spots", "map"]
#: Linear color of moving things.
BODY = (0.35, 0.12, 0.08)


@pg.kernel
def tiled_floor(corner: vec4, color: vec3) -> vec4:
    """Draw square tiles of one world unit in two shades; ``corner`` is the upper left position, then a pixel's size."""
    place = corner.xy + (vec2(pixel()) + 0.5) * corner.zw
    tile = ivec2(floor(place))
    shade = 1.0 - 0.12 * float((tile.x + tile.y) % 2)
    return vec4(color * shade, 1.0)


@pg.fragment
def body(spot: Spot, light: Image, color: vec3) -> vec4:
    """Draw the top of a moving thing in the light at its position."""
    return vec4(color * light.sample(uv()).rgb, 1.0)


@pg.kernel
def exposed(color: Image, stops: float) -> vec4:
    """Apply the exposure."""
    c = color[0, 0]
    return vec4(c.rgb * exp2(stops), c.a)


@effect("light2d", "world2d")
def light2d(
    world: World2D,
    size: tuple[int, int] = (1280, 720),
    penumbra: Penumbra = "exact",
    draws: Draws = 8,
    rims: Share = 0.5,
    near: Near = "fade",
    lens: Lens = "none",
    lens_strength: NotNegative = 1.0,
    exposure_stops: Exposure = 0.0,
    display: bool = True,
    name: str = "light2d",
) -> pg.Target:
    """Render a flat world from above, with lights, walls and soft shadows.

    Parameters
    ----------
    world : see `World2D.load`
    size : (width, height) of the picture, px
    penumbra : of lamps: the exact visible angle, none, or shadows drawn several times or blurred. See `light_map`
    draws : for penumbrae "rotate" and "move"
    rims : darkness of the rims along walls
    near : shadows of moving things near a lamp: fade, or more sprites. See `moving_shadows`
    lens : dirt on the lens. "none"; "bright" where the picture is bright; "spots" by spots of light drawn for this
        view; "map" by a map of spots of the world
    lens_strength : factor of the dirt
    exposure_stops : brightness: factor 2 per stop
    display : sRGB; off: the linear HDR result
    name : name of the result

    Examples
    --------
    >>> with pg.compile(light2d(World2D.shipped(), (64, 36)), backend="reference", size=(64, 36)) as program:
    ...     program()["light2d"].shape
    (36, 64, 4)
    """
    window = world.fitted(size)
    unit = (window.right - window.left) / size[0]
    ground = tiled_floor(
        (window.left, window.top, unit, -unit),
        world.floor,
        into=pg.target(f"{name}_floor", "rgba16f", size),
    )
    light = light_map(window, world.lights, world.walls, size, penumbra, draws, world.ambient, name=f"{name}_light_map")
    shown = lit(ground, light, name=f"{name}_lit")
    cell = unit * max(size) / 64.0
    grid = distance_grid(window, world.walls, cell)
    if rims > 0.0 and world.walls:
        shown = occlusion(shown, grid, 0.6 * cell, rims, name=f"{name}_rims", over=(window, cell))
    if world.movers:
        shown = moving_shadows(
            shown, window, world.lights, pg.Value(f"{name}_movers", tuple, default=world.movers), len(world.movers),
            lambda place: reach(grid, window, place, cell, 0.5 * cell), near=near, name=f"{name}_shadows",
        )  # fmt: skip
        shown = pg.draw(
            quads([mover.corners for mover in world.movers]), vertex=in_window, fragment=body, into=shown,
            name=f"{name}_bodies", values={"clip": window.clip, "light": light, "color": BODY},
        )  # fmt: skip
    if lens != "none":
        shown = _behind_lens(shown, window, world, size, lens, lens_strength, name)
    if not display:
        return exposed(shown, exposure_stops, into=pg.target(name, "rgba32f"))
    return tone_map(shown, exposure_stops, "linear", into=pg.target(name, "rgba8"), name=name)


def _behind_lens(
    shown: pg.Target, window: Window, world: World2D, size: tuple[int, int], lens: Lens, strength: float, name: str
) -> pg.Target:
    texels = strength * dirt_texture((size[0] // 2 or 1, size[1] // 2 or 1))
    dirt = pg.Input(f"{name}_dirt", "rgba16f", (texels.shape[1], texels.shape[0]), static=True, default=texels)
    if lens == "bright":
        return dirty_lens_bright(shown, dirt, name=f"{name}_lens")
    spots = light_spots(window, world.lights, size, name=f"{name}_spots")
    if lens == "spots":
        return dirty_lens_spots(shown, dirt, spots, name=f"{name}_lens")
    return dirty_lens_map(shown, dirt, spots, window, window, name=f"{name}_lens")
