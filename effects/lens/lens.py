"""Dirt on the lens over bright areas; `passgraph.effects.light2d.lens_spots` shows it at lamps."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.effects.checked import checked, effect
from passgraph.effects.pictures.stretched import drawn
from passgraph.effects.quantities import NotNegative

#: The dirt is source, the lit picture destination: dirt × destination + destination.
OVER_BRIGHT = pg.Blend("destination_color", "one", source_alpha="zero", destination_alpha="one")

Float64 = NDArray[np.float64]
#: Size of the built-in dirt texture, px.
DIRT_SIZE = (960, 540)


def dirt_texture(size: tuple[int, int], seed: int = 1) -> NDArray[np.float32]:
    """Return a texture of dust, smears and rings: the light that dirt scatters, (height, width, 4), 0 to 1, linear.

    Parameters
    ----------
    size : (width, height), px
    seed : another seed gives other dirt

    >>> dirt_texture((32, 18)).shape
    (18, 32, 4)
    """
    width, height = size
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid((np.arange(width) + 0.5) / height, (np.arange(height) + 0.5) / height)
    wide = width / height
    dirt = np.zeros((height, width), np.float64)

    def seen_from(radius: float) -> tuple[tuple[slice, slice], Float64, Float64]:
        """Return the pixels around a random position, and their offset from it."""
        cx, cy = rng.uniform((0, 0), (wide, 1))
        left, right = (int(np.clip((cx + side * radius) * height, 0, width)) for side in (-1, 1))
        top, bottom = (int(np.clip((cy + side * radius) * height, 0, height)) for side in (-1, 1))
        part = slice(top, bottom + 1), slice(left, right + 1)
        return part, x[part] - cx, y[part] - cy

    for _ in range(260):  # dust
        radius, dark = rng.uniform(0.002, 0.009), rng.uniform(0.15, 0.6)
        part, u, v = seen_from(radius)
        dirt[part] += dark * np.clip(2.0 - 2.0 * np.hypot(u, v) / radius, 0, 1)
    for _ in range(40):  # dried drops: a disc with a brighter rim
        radius, dark = rng.uniform(0.015, 0.06), rng.uniform(0.03, 0.14)
        part, u, v = seen_from(radius)
        dirt[part] += dark * _dried(np.hypot(u, v) / radius)
    for _ in range(14):  # smears: long and soft
        long, thin, turn = rng.uniform(0.1, 0.35), rng.uniform(0.01, 0.04), rng.uniform(0, np.pi)
        dark = rng.uniform(0.04, 0.12)
        part, u, v = seen_from(long)
        along, across = u * np.cos(turn) + v * np.sin(turn), v * np.cos(turn) - u * np.sin(turn)
        dirt[part] += dark * np.clip(1.0 - (along / long) ** 2 - (across / thin) ** 2, 0, 1)
    texels = np.ones((height, width, 4), np.float32)
    texels[:, :, :3] = np.clip(dirt, 0.0, 1.0)[:, :, None]
    return texels


def _dried(t: Float64) -> Float64:
    """Return a drop's profile over the distance from its center, 1 at its rim."""
    return np.asarray(np.clip(8.0 - 8.0 * t, 0, 1) * (0.35 + 0.65 * np.clip(t, 0, 1) ** 6))


@effect("dirty-lens")
def dirty_lens(
    color: pg.Target,
    dirt: pg.Target | None = None,
    strength: NotNegative = 1.0,
    into: pg.TargetSpec | None = None,
    name: str = "dirty_lens",
) -> pg.Target:
    """Show dirt on the lens where the picture is bright.

    Parameters
    ----------
    color : any picture, linear light
    dirt : the light that the dirt scatters, as stored, any size; default: `dirt_texture`
    strength : factor of the dirt
    into : destination target; default: float16 of the picture's size named ``name``
    name : name of the passes and targets

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


@checked
def dirty_lens_bright(
    scene: pg.Target,
    dirt: pg.Target,
    strength: NotNegative = 1.0,
    into: pg.TargetSpec | None = None,
    name: str = "lens",
) -> pg.Target:
    """Show dirt where the picture is bright, lamp or not: cheap, and wrong in scenes that are bright everywhere.

    Parameters
    ----------
    scene, dirt : linear pictures; the dirt is stretched over the scene
    strength : factor of the dirt
    into : destination target; default: float16 of the scene's size named ``name``
    name : name of the passes and targets
    """
    copy = drawn(scene, into or pg.target(name, "rgba16f", like=scene), f"{name}_scene")
    return drawn(dirt, copy, name, strength, blend=OVER_BRIGHT)
