"""Pixelate: show a picture as uniform squares."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import passgraph as pg
from passgraph.effects.channels import between, result_like
from passgraph.effects.checked import effect
from passgraph.graph.targets import Like
from passgraph.language import Const, Image, ivec2, pixel, vec4


@pg.kernel(alike=True)
def mean_of_block(color: Image, side: Const[int]) -> vec4:
    """Return the mean of a square's texels, without those beyond the picture's edge."""
    first = pixel() * side
    total, count = vec4(0.0), 0.0
    for y in range(side):
        for x in range(side):
            at = first + ivec2(x, y)
            if at.x < color.size.x and at.y < color.size.y:
                total += color.texel(at)
                count += 1.0
    return total / max(count, 1.0)


@pg.kernel(alike=True)
def block_of(blocks: Image, side: Const[int]) -> vec4:
    """Return the color of the square that contains this pixel."""
    return blocks.texel(pixel() // side)


@effect("pixelate", alpha="premultiplied", alike=True)
def pixelate(
    color: pg.Target,
    size_px: Annotated[int, pg.Range(1, 64, "px")] = 8,
    into: pg.TargetSpec | None = None,
    name: str = "pixelate",
) -> pg.Target:
    """Show a picture as squares, each the mean of its pixels.

    Parameters
    ----------
    color : any picture; means of linear light keep the brightness. Alpha should be premultiplied
    size_px : side of a square; 1 returns ``color`` itself
    into : destination target; default: float32 named ``name``
    name : name of the passes and targets

    Squares begin at the top left; those at the right and the bottom edge may be cut off, and average their remaining
    pixels.

    Examples
    --------
    >>> import numpy as np
    >>> ramp = np.arange(5, dtype=np.float32)[None, :, None] * np.ones(4, np.float32)
    >>> with pg.compile(pixelate(pg.Input("frame"), 2), backend="reference") as program:
    ...     program(frame=ramp)["pixelate"][0, :, 0].tolist()
    [0.5, 0.5, 2.5, 2.5, 4.0]
    """
    if size_px == 1:
        return color
    label, result = f"{name}_blocks", result_like(color, into, name)
    result = replace(result, size=result.size or Like(color))
    # a rounded-up size may have an extra square, which is never read
    blocks = mean_of_block(
        color, size_px, into=pg.target(label, between(color, result), like=color, scale=1.0 / size_px), name=label
    )
    return block_of(blocks, size_px, into=result, name=name)
