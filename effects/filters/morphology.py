"""Morphology: the least or largest number around each pixel, which shrinks or grows bright shapes."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Annotated, Literal

import passgraph as pg
from passgraph.effects.channels import between, result_like
from passgraph.effects.checked import effect
from passgraph.language import Const, Image, vec4

Operation = Literal["erode", "dilate", "open", "close"]
#: For each step, True if it takes the largest numbers.
STEPS: dict[Operation, tuple[bool, ...]] = {
    "erode": (False,),
    "dilate": (True,),
    "open": (False, True),
    "close": (True, False),
}


@pg.kernel(alike=True)
def extreme(color: Image, radius: Const[int], across: Const[bool], largest: Const[bool]) -> vec4:
    """Return the extreme of each channel along a line."""
    found = color[0, 0]
    for i in range(1, radius + 1):
        before, behind = color[-i, 0] if across else color[0, -i], color[i, 0] if across else color[0, i]
        found = max(found, before, behind) if largest else min(found, before, behind)
    return found


@effect("morphology", alpha="premultiplied", alike=True)
def morphology(
    color: pg.Target,
    operation: Operation = "dilate",
    radius_px: Annotated[int, pg.Range(0, 64, "px")] = 1,
    into: pg.TargetSpec | None = None,
    name: str = "morphology",
) -> pg.Target:
    """Erode, dilate, open or close: shrink or grow bright shapes, or remove small ones.

    Parameters
    ----------
    color : any picture, any range; outside of it, reads follow the rule of ``color.border(...)``
    operation : "erode" takes the least number of each channel in a square around the pixel, "dilate" the largest;
        "open" erodes, then dilates, which removes small bright shapes; "close" removes small dark ones
    radius_px : the square is 2 * radius_px + 1 wide; 0 returns ``color`` itself
    into : destination target; default: float32 named ``name``
    name : name of the passes and targets

    Results are exact. NaN does not affect other pixels.
    Source: J. Serra, "Image Analysis and Mathematical Morphology", 1982; a square is separated into rows and columns.

    Examples
    --------
    >>> import numpy as np
    >>> speck = np.zeros((5, 5, 4), np.float32)
    >>> speck[2, 2] = 1.0
    >>> with pg.compile(morphology(pg.Input("frame"), "dilate"), backend="reference") as program:
    ...     int(program(frame=speck)["morphology"][..., 0].sum())
    9
    """
    if radius_px == 0:
        return color
    shape, steps, result = color, STEPS[operation], result_like(color, into, name)
    stored = between(color, result)
    for number, largest in enumerate(steps, 1):
        label = f"{name}_{number}"
        shape = extreme(shape, radius_px, True, largest, into=pg.target(f"{label}_x", stored, like=color))
        last = result if number == len(steps) else pg.target(label, stored, like=color)
        shape = extreme(shape.border(color.border_rule), radius_px, False, largest, into=last, name=f"{label}_y")
        shape = shape if number == len(steps) else shape.border(color.border_rule)
    return shape
