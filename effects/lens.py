"""Dirt on the lens, three ways: over what is bright, over spots of light drawn anew, over a map of spots."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph import Image, uv, vec2, vec4
from passgraph.effects.checked import checked
from passgraph.effects.light2d.buffers import drawn
from passgraph.effects.light2d.light_map import light_map
from passgraph.effects.light2d.world import Float64, Light2D, Window

#: The dirt is source, what is lit the destination: dirt × destination + destination.
OVER_BRIGHT = pg.Blend("destination_color", "one", source_alpha="zero", destination_alpha="one")

#: Of the dirt that comes with the effect, px.
DIRT_SIZE = (960, 540)


@pg.kernel
def added(scene: Image, glow: Image) -> vec4:
    """The scene and the glow on the dirt; alpha is the scene's."""
    c = scene[0, 0]
    return vec4(c.rgb + glow.sample(uv()).rgb, c.a)


@pg.kernel
def dirt_times(spots: Image, dirt: Image) -> vec4:
    """The light that the dirt scatters, doubled as in `modulate2x`."""
    return spots[0, 0] * dirt.sample(uv()) * 2.0


@pg.kernel
def modulate2x(scene: Image, dirt: Image, spots: Image, corner: vec2, across: vec2) -> vec4:
    """Two textures multiplied and doubled, the second at the view's own coordinates."""
    c = scene[0, 0]
    glow = dirt.sample(uv()).rgb * spots.sample(corner + uv() * across).rgb * 2.0
    return vec4(c.rgb + glow, c.a)


def dirt_texture(size: tuple[int, int], seed: int = 1) -> NDArray[np.float32]:
    """Dust, smears and rings as a picture: how much light the dirt scatters, (height, width, 4), 0 to 1, linear.

    Parameters
    ----------
    size : (width, height), px
    seed : another number, other dirt

    >>> dirt_texture((32, 18)).shape
    (18, 32, 4)
    """
    width, height = size
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid((np.arange(width) + 0.5) / height, (np.arange(height) + 0.5) / height)
    wide = width / height
    made = np.zeros((height, width), np.float64)

    def seen_from(radius: float) -> tuple[tuple[slice, slice], Float64, Float64]:
        """The pixels around a place by chance, and their way from it."""
        cx, cy = rng.uniform((0, 0), (wide, 1))
        left, right = (int(np.clip((cx + side * radius) * height, 0, width)) for side in (-1, 1))
        top, bottom = (int(np.clip((cy + side * radius) * height, 0, height)) for side in (-1, 1))
        part = slice(top, bottom + 1), slice(left, right + 1)
        return part, x[part] - cx, y[part] - cy

    for _ in range(260):  # dust
        radius, dark = rng.uniform(0.002, 0.009), rng.uniform(0.15, 0.6)
        part, u, v = seen_from(radius)
        made[part] += dark * np.clip(2.0 - 2.0 * np.hypot(u, v) / radius, 0, 1)
    for _ in range(40):  # drops that have dried: a disc with a brighter rim
        radius, dark = rng.uniform(0.015, 0.06), rng.uniform(0.03, 0.14)
        part, u, v = seen_from(radius)
        made[part] += dark * _dried(np.hypot(u, v) / radius)
    for _ in range(14):  # smears: long and soft
        long, thin, turn = rng.uniform(0.1, 0.35), rng.uniform(0.01, 0.04), rng.uniform(0, np.pi)
        dark = rng.uniform(0.04, 0.12)
        part, u, v = seen_from(long)
        along, across = u * np.cos(turn) + v * np.sin(turn), v * np.cos(turn) - u * np.sin(turn)
        made[part] += dark * np.clip(1.0 - (along / long) ** 2 - (across / thin) ** 2, 0, 1)
    texels = np.ones((height, width, 4), np.float32)
    texels[:, :, :3] = np.clip(made, 0.0, 1.0)[:, :, None]
    return texels


def _dried(t: Float64) -> Float64:
    """A drop's profile over the way from its middle, 1 at its rim."""
    return np.asarray(np.clip(8.0 - 8.0 * t, 0, 1) * (0.35 + 0.65 * np.clip(t, 0, 1) ** 6))


@checked
def dirty_lens(
    color: pg.Target,
    dirt: pg.Target | None = None,
    strength: float = 1.0,
    into: pg.TargetSpec | None = None,
    name: str = "dirty_lens",
) -> pg.Target:
    """`dirty_lens_bright` of a picture, with dirt of its own where none is given.

    Parameters
    ----------
    color : any picture, linear light
    dirt : how much light the dirt scatters, linear, any size; left out, `dirt_texture`
    strength : factor on the dirt, 0 or more
    into : where it goes; left out, float16 of the picture's size with the name ``name``
    name : of the passes and targets

    Examples
    --------
    >>> with pg.compile(dirty_lens(pg.Input("frame")), backend="reference") as program:
    ...     shown = program(frame=np.ones((18, 32, 4), np.float32))["dirty_lens"]
    >>> bool(shown.min() >= 1.0), bool(shown.max() > 1.0)
    (True, True)
    """
    if dirt is None:
        texels = dirt_texture(DIRT_SIZE)
        dirt = pg.Input(f"{name}_dirt", "rgba16f", DIRT_SIZE, static=True, default=texels)
    return dirty_lens_bright(color, dirt, strength, into, name)


def dirty_lens_bright(
    scene: pg.Target, dirt: pg.Target, strength: float = 1.0, into: pg.TargetSpec | None = None, name: str = "lens"
) -> pg.Target:
    """Dirt shows where the picture is bright, lamp or not: cheap, and wrong in scenes that are bright all over.

    Parameters
    ----------
    scene, dirt : linear pictures; the dirt is stretched over the scene
    strength : factor on the dirt, 0 or more
    into : where it goes; left out, float16 of the scene's size with the name ``name``
    name : of the passes and targets
    """
    if not 0.0 <= strength < float("inf"):
        raise pg.GraphError(f"{name}: strength must be 0 or more, got {strength!r}")
    copy = drawn(scene, into or pg.target(name, "rgba16f", like=scene), f"{name}_scene")
    return drawn(dirt, copy, name, strength, blend=OVER_BRIGHT)


def light_spots(
    window: Window, lights: Sequence[Light2D], size: tuple[int, int], share: float = 0.4, name: str = "spots"
) -> pg.Target:
    """All lamps as spots without shadows, ``share`` of their radius wide; it reads no input, so it is drawn once.

    Parameters
    ----------
    window, lights, size, name : as in `light_map`
    share : of each light's radius, above 0, 1 or less
    """
    if not 0.0 < share <= 1.0:
        raise pg.GraphError(f"{name}: share must be above 0 and at most 1, got {share!r}")
    smaller = [Light2D(light.position, light.color, light.radius * share) for light in lights]
    return light_map(window, smaller, (), size, name=name)


def dirty_lens_spots(
    scene: pg.Target, dirt: pg.Target, spots: pg.Target, into: pg.TargetSpec | None = None, name: str = "lens"
) -> pg.Target:
    """Dirt shows where lamps are: a buffer of spots as this view sees them, times the dirt, doubled, is added.

    Parameters
    ----------
    scene, dirt : linear pictures; the dirt is stretched over the scene
    spots : `light_spots` of the view's own window, to be made anew when the view moves
    into : where it goes; left out, float32 with the name ``name``
    name : of the passes and targets
    """
    glow = dirt_times(spots, dirt, into=pg.target(f"{name}_glow", "rgba16f", like=spots))
    return added(scene, glow, into=into or pg.target(name, "rgba32f"), name=name)


def dirty_lens_map(
    scene: pg.Target,
    dirt: pg.Target,
    spots: pg.Target,
    level: Window,
    view: pg.Value | Window,
    into: pg.TargetSpec | None = None,
    name: str = "lens",
) -> pg.Target:
    """The same by one map of the whole level: in each frame only the view's corners change.

    Parameters
    ----------
    scene, dirt : linear pictures; the dirt is stretched over the scene
    spots : `light_spots` of the window ``level``, made once
    level : the window of the map
    view : the window of the scene; may be a ``pg.Value`` that runs bring
    into : where it goes; left out, float32 with the name ``name``
    name : of the pass

    Source: S. Hargreaves, "DualTextureEffect", 2010 (two textures multiplied and doubled).
    """

    def corner(seen: Window) -> tuple[float, float]:
        return level.pixels((seen.left, seen.top), (1, 1))

    def across(seen: Window) -> tuple[float, float]:
        (x, y), (right, bottom) = corner(seen), level.pixels((seen.right, seen.bottom), (1, 1))
        return right - x, bottom - y

    places = (corner(view), across(view)) if isinstance(view, Window) else (view.map(corner), view.map(across))
    return modulate2x(scene, dirt, spots, *places, into=into or pg.target(name, "rgba32f"), name=name)
