# mypy: disable-error-code="no-any-return"
"""Textures of materials as inputs with a default picture, and with mipmaps so that far ones do not alias."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal, get_args
from weakref import WeakKeyDictionary, WeakValueDictionary

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.graph.targets import InputSpec
from passgraph.language import Image, clamp, dfdx, dfdy, floor, fract, length, log2, mix, vec2, vec4
from passgraph.records import dataclass
from passgraph.scene import Texture
from passgraph.scene.materials import Minify, Wrap

Use = Literal["base color", "normals", "height"]
#: Wrap modes by the kernel's number, and numpy's names for such borders.
WRAPS: tuple[Wrap, ...] = ("repeat", "clamp", "mirror")
MINIFY: tuple[Minify, ...] = get_args(Minify)
NEAREST_LEVEL = MINIFY.index("nearest mipmap nearest")
_PADS: dict[Wrap, Any] = {"repeat": "wrap", "clamp": "edge", "mirror": "symmetric"}


@dataclass(frozen=True, eq=False)
class Mips:
    """The mipmap levels of one texture.

    Attributes
    ----------
    picture : (h, w, 4) float32, all levels
    size : (width, height) of level 0: the texture's own, up to the next power of two
    count : number of levels, 0 for a texture too small for any
    """

    picture: NDArray[np.float32]
    size: tuple[int, int]
    count: int


def mips_of(pixels: NDArray[np.float32], use: Use, wraps: tuple[Wrap, Wrap]) -> Mips:
    """Return the levels of a texture (h, w, 4) of linear values, each a mean over the areas of its texels.

    Colors are weighted by their alpha; normals (xyz in 0..1) are normalized again.

    The picture of a texture too small for any level is empty.

    >>> mips_of(np.ones((4, 8, 4), np.float32), "base color", ("repeat", "clamp")).picture.shape
    (7, 6, 4)
    """
    height, width = pixels.shape[:2]
    size = full_size((width, height))
    count = min(size).bit_length() - 1
    level = _gathered(pixels, use)
    picture = np.zeros((_top(size[1], count + 1), size[0] // 2 + 2, 4), np.float32)
    for number in range(1, count + 1):
        level = _resized(_resized(level, size[1] >> number, 0), size[0] >> number, 1)
        top = _top(size[1], number)
        shown = np.pad(_spread(level, use), ((0, 0), (1, 1), (0, 0)), _PADS[wraps[0]])
        shown = np.pad(shown, ((1, 1), (0, 0), (0, 0)), _PADS[wraps[1]])
        picture[top : top + shown.shape[0], : shown.shape[1]] = shown
        level = _gathered(_spread(level, use), use) if use == "normals" else level
    return Mips(picture, size, count)


def full_size(size: tuple[int, int]) -> tuple[int, int]:
    """Return the next powers of two."""
    return 1 << (size[0] - 1).bit_length(), 1 << (size[1] - 1).bit_length()


def _top(height: int, number: int) -> int:
    """Return the first row of a level with its border: earlier levels have half, a quarter, … of the rows, plus two."""
    return height - (height >> (number - 1)) + 2 * (number - 1)


def _gathered(values: NDArray[np.float32], use: Use) -> NDArray[np.float32]:
    """Return values that may be averaged: colors times alpha, normals in -1..1."""
    if use == "normals":
        return values * np.float32(2.0) - np.float32(1.0)
    return np.concatenate([values[:, :, :3] * values[:, :, 3:], values[:, :, 3:]], axis=2)


def _spread(values: NDArray[np.float32], use: Use) -> NDArray[np.float32]:
    """Invert `_gathered`."""
    if use == "normals":
        long = np.linalg.norm(values[:, :, :3], axis=2, keepdims=True)
        unit = values[:, :, :3] / np.maximum(long, np.float32(1e-6))
        return np.concatenate([unit * np.float32(0.5) + np.float32(0.5), np.ones_like(long)], axis=2)
    alpha = values[:, :, 3:]
    color = np.asarray(values[:, :, :3] / np.maximum(alpha, np.float32(1e-6)), np.float32)
    return np.concatenate([color, alpha], axis=2)


def _resized(values: NDArray[np.float32], count: int, axis: int) -> NDArray[np.float32]:
    """Return means over ``count`` equal parts of an axis; a part, one to two texels long, covers at most three."""
    side = values.shape[axis]
    starts = np.arange(count) * (side / count)
    ends = starts + side / count
    first = np.floor(starts).astype(np.int64)
    total: NDArray[np.float32] | None = None
    for step in range(3):
        texel = first + step
        share = np.clip(np.minimum(ends, texel + 1) - np.maximum(starts, texel), 0.0, None) * (count / side)
        shape = [1, 1, 1]
        shape[axis] = count
        part = values.take(np.minimum(texel, side - 1), axis) * share.astype(np.float32).reshape(shape)
        total = part if total is None else total + part
    assert total is not None
    return total


@pg.function
def level_at(uv: vec2, size: vec2) -> float:
    """Return the level on which a pixel's longer step is one texel of a texture of that size; below 0 if magnified, and
    where the next pixel's ray misses the surface's plane."""
    texels = uv * size
    return log2(max(1e-6, max(length(dfdx(texels)), length(dfdy(texels)))))


@pg.function
def wrapped_axis(at: float, wrap: int) -> float:
    """Map a coordinate into 0..1 by the number of a wrap mode."""
    if wrap == 0:
        return fract(at)
    if wrap == 1:
        return clamp(at, 0.0, 1.0)
    return 1.0 - abs(fract(at * 0.5) * 2.0 - 1.0)


@pg.function
def wrapped(at: vec2, wrap: int) -> vec2:
    """Map coordinates into 0..1 by the number of `wrap_number`."""
    return vec2(wrapped_axis(at.x, wrap % 3), wrapped_axis(at.y, wrap // 3))


@pg.function
def edge_wrapped(at: float, wrap: int, size: int) -> float:
    """Map a coordinate onto the texels of a picture that repeats, for modes in which the outermost texels go on."""
    half = 0.5 / float(size)
    return at if wrap == 0 else clamp(wrapped_axis(at, wrap), half, 1.0 - half)


@pg.function
def addressed(map: Image, at: vec2, wrap: int) -> vec2:
    """Return where to sample the picture of a texture: its border rule does one wrap mode, but not two of them."""
    if wrap % 3 == wrap // 3:
        return at
    return vec2(edge_wrapped(at.x, wrap % 3, map.size.x), edge_wrapped(at.y, wrap // 3, map.size.y))


@pg.function
def on_level(levels: Image, at: vec2, size: vec2, number: int) -> vec4:
    """Sample one level bilinearly, ``at`` in 0..1."""
    scale = 1.0 / float(1 << number)
    top = size.y * (1.0 - 2.0 * scale) + 2.0 * float(number) - 1.0
    return levels.sample((at * size * scale + vec2(1.0, top)) / vec2(levels.size))


@pg.function
def mipped(
    base: Image, levels: Image, size: vec2, count: int, wrap: int, minify: int, at: vec2, level_by_size: float
) -> vec4:
    """Sample a texture at a fractional level: a mix of the two nearest levels, or the nearer one."""
    color = vec4(0.0)
    level = level_by_size
    if minify == NEAREST_LEVEL:
        level = floor(level + 0.5)
    if count == 0 or level < 1.0:
        place = addressed(base, at, wrap)
        color = base.sample(place)
        if minify > 0 and level_by_size > 0.0:
            color = base.nearest(place)
    if count > 0 and level > 0.0:
        inside = wrapped(at, wrap)
        lower = min(int(floor(level)), count - 1)
        upper = on_level(levels, inside, size, lower + 1)
        if lower > 0:
            color = on_level(levels, inside, size, lower)
        color = mix(color, upper, min(level - float(lower), 1.0))
    return color


def wrap_number(texture: Texture | None) -> int:
    """Return the number of a texture's wrap modes for `wrapped` and `addressed`."""
    across, down = ("repeat", "repeat") if texture is None else texture.wraps
    return WRAPS.index(across) + 3 * WRAPS.index(down)


#: The inputs of each texture by use. All effects on a scene share them, so that one graph may hold several effects.
_inputs: WeakKeyDictionary[Texture, WeakValueDictionary[str, InputSpec]] = WeakKeyDictionary()
#: Distinguishes textures with the same name.
_numbers: WeakKeyDictionary[Texture, int] = WeakKeyDictionary()


def _shared_input(texture: Texture, use: str, make: Callable[[str], pg.Target]) -> pg.Target:
    """Return the input of a texture for a use; ``make`` makes it from its name."""
    if texture not in _numbers:
        others = [other for one in _numbers.keyrefs() if (other := one()) is not None and other.name == texture.name]
        used = {_numbers.get(other) for other in others}
        _numbers[texture] = next(number for number in range(len(used) + 1) if number not in used)
    by_use = _inputs.setdefault(texture, WeakValueDictionary())
    spec = by_use.get(use)
    if spec is not None:
        return pg.Target(spec)
    made = make(f"{texture.name} ({use} {_numbers[texture]})")
    assert isinstance(made.spec, InputSpec)
    by_use[use] = made.spec
    return made


def texture_input(texture: Texture, use: Use) -> pg.Target:
    """Return the input of a texture: ``use`` is "base color" (linear RGBA), "normals" or "height" (one)."""

    def make(name: str) -> pg.Target:
        pixels = texture.decode()
        if use == "height":
            pixels, kind = pixels[:, :, :1], "r8"
        else:
            # decoded here, once, so that a lookup costs four fetches and no transfer function
            kind = "rgba16f" if use == "base color" else "rgba8"
        return pg.Input(name, kind, texture.size, static=True, default=np.ascontiguousarray(pixels))

    # for two modes see `addressed`
    border = texture.wrap if isinstance(texture.wrap, str) else "repeat"
    return _shared_input(texture, use, make).border(border).filter(texture.magnify)


def texture_levels(texture: Texture, use: Use) -> dict[str, object]:
    """Return the arguments of `mipped` for a texture: its levels, their size and count, its wrap and filter."""
    size = full_size(texture.size)
    count = min(size).bit_length() - 1

    def make(name: str) -> pg.Target:
        mips = mips_of(texture.decode(), use, texture.wraps)
        kind = "rgba16f" if use == "base color" else "rgba8"
        return pg.Input(name, kind, mips.picture.shape[1::-1], static=True, default=mips.picture)

    if count:
        levels = _shared_input(texture, f"{use} levels", make)
        levels = levels.filter("linear" if texture.minify == MINIFY[0] else "nearest")
    else:
        levels = texture_input(texture, use)
    return {
        "levels": levels,
        "size": tuple(map(float, size)),
        "count": 0 if texture.minify == "nearest" else count,
        "wrap": wrap_number(texture),
        "minify": MINIFY.index(texture.minify),
    }
