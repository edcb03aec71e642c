"""Glitch: displaced bands, misplaced blocks, and separated colors."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Annotated

import passgraph as pg
from passgraph.effects.checked import effect
from passgraph.effects.lens.film_grain import Index, hashed
from passgraph.effects.pictures.decoded import decoded
from passgraph.effects.quantities import Share
from passgraph.language import Image, ivec2, pixel, vec4

Distance = Annotated[int, pg.Range(0, 4096, "px")]


@pg.function
def by_chance(bits: int, most: int) -> int:
    """Return a random integer from ``-most`` to ``most``, uniformly distributed."""
    return (((bits & 0xFFFF) * (2 * most + 1)) >> 16) - most


@pg.kernel
def displaced(
    color: Image, amount: float, shift: int, split: int, band: int, block: int, index: int, seed: int
) -> vec4:
    """Return displaced texels; red and blue with a further offset in displaced bands."""
    at, key, most = pixel(), index ^ (seed * 0x9E3779B9), int(amount * 65536.0)
    row = hashed(at.y // band, -1, key)
    square = hashed(at.x // block, at.y // block, key)
    there, apart = at, 0
    if row.x & 0xFFFF < most:
        there += ivec2(by_chance(row.y, shift), 0)
        apart = by_chance(row.z, split)
    if square.x & 0x3FFFF < most:
        there += ivec2(by_chance(square.y, shift), by_chance(square.z, shift))
    c = color.texel(there)
    return vec4(color.texel(there + ivec2(apart, 0)).r, c.g, color.texel(there - ivec2(apart, 0)).b, c.a)


@effect("glitch", alpha="premultiplied")
def glitch(
    color: pg.Target,
    amount: Share | pg.Value | pg.Derived = 0.3,
    shift_px: Distance | pg.Value | pg.Derived = 24,
    split_px: Distance | pg.Value | pg.Derived = 8,
    band_px: Annotated[int, pg.Range(1, 4096, "px")] | pg.Value | pg.Derived = 8,
    block_px: Annotated[int, pg.Range(1, 4096, "px")] | pg.Value | pg.Derived = 32,
    index: Index | pg.Value | pg.Derived = 0,
    seed: Index = 0,
    into: pg.TargetSpec | None = None,
    name: str = "glitch",
) -> pg.Target:
    """Damage a picture as a bad signal does: displaced bands and blocks, separated colors.

    Parameters
    ----------
    color : any picture, any range; outside of it, reads follow the rule of ``color.border(...)``
    amount : fraction of displaced bands, and four times the fraction of displaced blocks
    shift_px : largest displacement, of bands along rows, of blocks along columns too
    split_px : largest distance of red and blue from green in a displaced band
    band_px : height of a band
    block_px : side of a block
    index : the picture's number in its sequence, for new damage in each. `passgraph.frames` gives it as
        ``values=lambda number: {"index": number}``
    seed : another seed gives other damage
    into : destination target; default: float32 named ``name``
    name : name of the pass

    Distances are uniformly distributed whole pixels, so that every number of the result is one of the picture, and the
    same on every backend.
    Source: M. Jarzynski, M. Olano, "Hash Functions for GPU Rendering", 2020 (pcg3d, hashed from band or block, index
    and seed). The looks are those of lines without sync and of misplaced blocks, as in analog and compressed video.

    Examples
    --------
    >>> import numpy as np
    >>> ramp = np.arange(64, dtype=np.float32)[None, :, None] * np.ones((64, 1, 4), np.float32)
    >>> with pg.compile(glitch(pg.Input("frame"), 0.5), backend="reference") as program:
    ...     green = program(frame=ramp)["glitch"][..., 1]
    >>> bool(0.3 < (green != ramp[..., 1]).mean() < 0.8), bool((green == green.round()).all())
    (True, True)
    """
    light = decoded(color, f"{name}_light")
    return displaced(
        light, amount, shift_px, split_px, band_px, block_px, index, seed, into=into or pg.target(name, "rgba32f"),
        name=name,
    )  # fmt: skip
