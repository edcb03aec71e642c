"""Dirt on the lens at lamps: over spots of light drawn for the view, or over a map of spots."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import passgraph as pg
from passgraph.effects.checked import checked
from passgraph.effects.light2d.light_map import light_map
from passgraph.effects.light2d.world import Light2D, Window
from passgraph.language import Image, uv, vec2, vec4


@pg.kernel
def added(scene: Image, glow: Image) -> vec4:
    """Add the glow on the dirt to the scene; alpha is the scene's."""
    c = scene[0, 0]
    return vec4(c.rgb + glow.sample(uv()).rgb, c.a)


@pg.kernel
def dirt_times(spots: Image, dirt: Image) -> vec4:
    """Return the light that the dirt scatters, doubled as in `modulate2x`."""
    return spots[0, 0] * dirt.sample(uv()) * 2.0


@pg.kernel
def modulate2x(scene: Image, dirt: Image, spots: Image, corner: vec2, across: vec2) -> vec4:
    """Multiply and double two textures, the second at the view's own coordinates."""
    c = scene[0, 0]
    glow = dirt.sample(uv()).rgb * spots.sample(corner + uv() * across).rgb * 2.0
    return vec4(c.rgb + glow, c.a)


@checked
def light_spots(
    window: Window,
    lights: Sequence[Light2D],
    size: tuple[int, int],
    share: Annotated[float, pg.Range(0, 1, above=True)] = 0.4,
    name: str = "spots",
) -> pg.Target:
    """Draw all lamps as spots without shadows, ``share`` of their radius wide; it reads no input, so it runs once.

    Parameters
    ----------
    window, lights, size, name : as in `light_map`
    share : fraction of each light's radius
    """
    smaller = [Light2D(light.position, light.color, light.radius * share) for light in lights]
    return light_map(window, smaller, (), size, name=name)


@checked
def dirty_lens_spots(
    scene: pg.Target, dirt: pg.Target, spots: pg.Target, into: pg.TargetSpec | None = None, name: str = "lens"
) -> pg.Target:
    """Show dirt where lamps are: add a buffer of spots in this view times the dirt, doubled.

    Parameters
    ----------
    scene, dirt : linear pictures; the dirt is stretched over the scene
    spots : `light_spots` of the view's own window, drawn again when the view moves
    into : destination target; default: float32 named ``name``
    name : name of the passes and targets
    """
    glow = dirt_times(spots, dirt, into=pg.target(f"{name}_glow", "rgba16f", like=spots), name=f"{name}_glow")
    return added(scene, glow, into=into or pg.target(name, "rgba32f"), name=name)


@checked
def dirty_lens_map(
    scene: pg.Target,
    dirt: pg.Target,
    spots: pg.Target,
    level: Window,
    view: pg.Value | Window,
    into: pg.TargetSpec | None = None,
    name: str = "lens",
) -> pg.Target:
    """Show dirt where lamps are, by one map of the whole level: only the view's corners change per frame.

    Parameters
    ----------
    scene, dirt : linear pictures; the dirt is stretched over the scene
    spots : `light_spots` of the window ``level``, drawn once
    level : the window of the map
    view : the window of the scene; may be a ``pg.Value`` set by runs
    into : destination target; default: float32 named ``name``
    name : name of the pass

    Source: S. Hargreaves, "DualTextureEffect", 2010 (two textures multiplied and doubled).
    """

    def corner(seen: Window) -> tuple[float, float]:
        return level.pixels((seen.left, seen.top), (1, 1))

    def across(seen: Window) -> tuple[float, float]:
        (x, y), (right, bottom) = corner(seen), level.pixels((seen.right, seen.bottom), (1, 1))
        return right - x, bottom - y

    places = (corner(view), across(view)) if isinstance(view, Window) else (view.map(corner), view.map(across))
    return modulate2x(scene, dirt, spots, *places, into=into or pg.target(name, "rgba32f"), name=name)
