"""The static light map: the sum of all lights with walls' shadows, computed once and multiplied onto the scene."""

from __future__ import annotations

from collections.abc import Sequence
from math import asin, cos, hypot, pi, sin
from typing import Annotated, Literal, get_args

import numpy as np

import passgraph as pg
from passgraph.effects.checked import checked
from passgraph.effects.light2d.light_tiles import tiled_light
from passgraph.effects.light2d.penumbra import gradient
from passgraph.effects.light2d.smoothing import mixed_light
from passgraph.effects.light2d.sprites import around, shadow_of
from passgraph.effects.light2d.world import Float64, Light2D, Point, Wall, Window, all_edges, in_reach
from passgraph.effects.pictures.stretched import WHOLE_CLIP, black, drawn, full_quad, in_window
from passgraph.effects.quantities import Color

Penumbra = Literal["exact", "none", "rotate", "move", "mixed"]
PENUMBRAS: tuple[Penumbra, ...] = get_args(Penumbra)
#: Number of times that shadows are drawn.
Draws = Annotated[int, pg.Range(2, 64)]
#: Side of a tile.
Tile = Annotated[int, pg.Range(4, 256, "px")]
#: The scene is destination, the light map source: scene × light, for color and alpha.
ONTO_SCENE = pg.Blend("zero", "source_color")


@checked
def light_map(
    window: Window,
    lights: Sequence[Light2D],
    walls: Sequence[Wall],
    size: tuple[int, int],
    penumbra: Penumbra = "exact",
    draws: Draws = 8,
    ambient: Color = (0.0, 0.0, 0.0),
    format: str = "rgba16f",
    tile_px: Tile = 16,
    name: str = "light_map",
) -> pg.Target:
    """Return the light of all lamps, shadows included; it reads no input, so a program computes it once.

    Parameters
    ----------
    window : the part of the world in the picture
    lights : any number; with "exact" one pass computes them all, otherwise each has a buffer of its own, cleared, lit,
        darkened by shadows, and added
    walls : obstacles; the inside of a closed one is dark
    size : (width, height) of the map, px
    penumbra : "exact" computes the visible fraction of each lamp's angle; walls must not reach into a lamp, and at most
        180 edges may be between it and one tile.  "none" treats lamps as points.  "rotate" draws the shadows several
        times, rotated about the lamp, "move" with the lamp's center moved across its disc.  "mixed" blurs a point's
        shadow by halved pictures, sharp at the wall and softer with the distance behind it
    draws : for "rotate" and "move"
    ambient : linear RGB everywhere
    format : format of the map and its buffers, four channels, blendable; alpha is 1
    tile_px : for "exact": side of the tiles for which lights and occluding edges are listed
    name : name of the map and, with the light's number, of its buffers

    Source: for "exact", the angle of a disc that segments leave uncovered, by a sweep over their intervals; light is
    proportional to that angle, which holds for a lamp that is equally bright from every side.  Lists of lights for
    tiles as in O. Olsson, U. Assarsson, "Tiled Shading", 2011.

    Examples
    --------
    >>> lamp = Light2D((2.0, 2.0), radius=4.0)
    >>> made = light_map(Window(0, 0, 4, 4), [lamp], [Wall.box(3, 1, 3.5, 3)], (8, 8), penumbra="none")
    >>> with pg.compile(made, backend="reference") as program:
    ...     red = program()["light_map"][:, :, 0]
    >>> bool(red[4, 3] > 0.9), red[4, 7].item()
    (True, 0.0)
    """
    if penumbra == "exact":
        return tiled_light(window, lights, walls, size, ambient, format, tile_px, name)
    total: pg.Target = pg.draw(
        full_quad(), vertex=in_window, fragment=black, into=pg.target(name, format, size, clear=(*ambient, 1.0)),
        blend="add", name=f"{name}_ambient", values={"clip": WHOLE_CLIP},
    )  # fmt: skip
    every = all_edges(walls)
    for number, light in enumerate(lights):
        edges = in_reach(every, light)
        label = f"{name}_{number}"
        if penumbra == "mixed" and light.size > 0.0 and len(edges):
            total = drawn(mixed_light(window, light, edges, size, name=label), total, f"{label}_add", blend="add")
            continue
        several = light.size > 0.0 and penumbra in ("rotate", "move")
        parts = _spread(light, edges, penumbra, draws) if several else [(light.position, edges)]
        for part, (place, turned) in enumerate(parts):
            at = f"{label}.{part}" if several else label
            buffer = _hard(window, light, place, turned, pg.target(at, format, size), at)
            total = drawn(buffer, total, f"{at}_add", 1.0 / len(parts), blend="add")
    return total


def _values(window: Window, light: Light2D) -> dict[str, object]:
    return {"clip": window.clip, "color": light.color, "light": (*light.position, light.radius, light.size)}


def _hard(window: Window, light: Light2D, source: Point, edges: Float64, into: pg.TargetSpec, name: str) -> pg.Target:
    """Draw a cleared buffer, the light's gradient, and over it shadows as from a point."""
    lit: pg.Target = pg.draw(
        around(light.position, light.radius), vertex=in_window, fragment=gradient, into=into, name=name,
        values=_values(window, light),
    )  # fmt: skip
    if len(edges):
        lit = pg.draw(
            shadow_of(edges, source), vertex=in_window, fragment=black, into=lit, name=f"{name}_shadow",
            values={"clip": window.clip},
        )  # fmt: skip
    return lit


def _spread(light: Light2D, edges: Float64, how: Penumbra, draws: int) -> list[tuple[Point, Float64]]:
    """Return the light's position in each draw, and the edges that cast its shadows."""
    x, y = light.position
    if how == "move":
        # equal parts of the disc's area on a spiral: uniform from every side
        golden = pi * (3.0 - 5.0**0.5)
        steps = [(light.size * ((i + 0.5) / draws) ** 0.5, i * golden) for i in range(draws)]
        return [((x + r * cos(t), y + r * sin(t)), edges) for r, t in steps]
    # the lamp's half angle as seen from the nearest wall
    near = (
        max(min(hypot(ex - x, ey - y) for e in edges for ex, ey in (e[:2], e[2:])), light.size) if len(edges) else 1.0
    )
    half = asin(min(light.size / near, 1.0))
    parts = []
    for i in range(draws):
        turn = half * ((2.0 * i + 1.0) / draws - 1.0)
        rotation = np.array([[cos(turn), sin(turn)], [-sin(turn), cos(turn)]])
        turned = (edges.reshape(-1, 2) - light.position) @ rotation + light.position
        parts.append((light.position, turned.reshape(-1, 4)))
    return parts


@checked
def lit(
    scene: pg.Target,
    light: pg.Target,
    into: pg.TargetSpec | None = None,
    name: str = "lit",
) -> pg.Target:
    """Light a scene by a light map: draw the scene, and the map over it with factors zero and source_color.

    Parameters
    ----------
    scene : the unlit picture, linear
    light : the map, any size; stretched bilinearly
    into : destination target; default: float16 of the scene's size named ``name``
    name : of the passes and target
    """
    copy = drawn(scene, into or pg.target(name, "rgba16f", like=scene), f"{name}_scene")
    return drawn(light, copy, name, blend=ONTO_SCENE)
