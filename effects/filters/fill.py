"""Fill holes of a picture from their surroundings by a pyramid: pull means up, and push them down into holes."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Annotated

import passgraph as pg
from passgraph.effects.checked import effect
from passgraph.language import Const, Image, clamp, isfinite, ivec2, pixel, vec2, vec4


@pg.kernel
def known(color: Image, mask: Image, has_mask: Const[bool]) -> vec4:
    """Return the color times the known fraction of this pixel, and that fraction."""
    c = color[0, 0]
    share = 1.0 - (clamp(mask[0, 0].r, 0.0, 1.0) if has_mask else 0.0)
    return c * share if isfinite(c.r + c.g + c.b + c.a) and share > 0.0 else vec4(0.0)


@pg.kernel
def pulled(fine: Image) -> vec4:
    """Halve the size: return the mean of the known pixels, and its weight; one pixel of four is enough."""
    first, total = 2 * pixel(), vec4(0.0)
    for y in range(2):
        for x in range(2):
            total += fine.texel(first + ivec2(x, y))
    return total / max(total.a, 1.0)


@pg.kernel
def pushed(fine: Image, coarse: Image) -> vec4:
    """Return the known part, and for the rest the value at half the size."""
    c, around = fine[0, 0], coarse.sample(0.5 * (vec2(pixel()) + 0.5) / vec2(coarse.size))
    return c + around * ((1.0 - c.a) / around.a) if c.a < 1.0 and around.a > 0.0 else c


@effect("fill", alpha="premultiplied")
def fill(
    color: pg.Target,
    mask: pg.Target | None = None,
    levels: Annotated[int, pg.Range(1, 14)] = 10,
    into: pg.TargetSpec | None = None,
    name: str = "fill",
) -> pg.Target:
    """Fill transparent, masked, NaN or infinite pixels smoothly from their surroundings.

    Parameters
    ----------
    color : any picture, any range, multiplied by alpha, which is the known fraction of a pixel
    mask : picture of the size of ``color``; red is the fraction of a pixel to fill, 0 to 1
    levels : number of halvings; a hole is filled if something is known within ``2 ** levels`` pixels, else it is
        transparent black
    into : destination target; default: float32 named ``name``
    name : name of the passes and targets

    Opaque pixels outside of the mask stay bit-identical; the result is opaque.  Each level is the mean of the known
    parts of four pixels, with the sum of their weights, at most 1; holes are filled from coarse to fine, bilinearly.
    Source: S. J. Gortler, R. Grzeszczuk, R. Szeliski, M. F. Cohen, "The Lumigraph", SIGGRAPH 1996, 3.4: push and pull.
    Deviation: half the size is the mean of 2 by 2 pixels, without the margin of the paper's B-spline.

    Examples
    --------
    >>> import numpy as np
    >>> frame = np.zeros((1, 4, 4), np.float32)
    >>> frame[0, 0], frame[0, 3] = (0.2, 0.4, 0.6, 1.0), (0.6, 0.4, 0.2, 1.0)
    >>> with pg.compile(fill(pg.Input("frame")), backend="reference") as program:
    ...     program(frame=frame)["fill"].round(2)[0, :, 0].tolist() == np.float32([0.2, 0.3, 0.5, 0.6]).tolist()
    True
    """
    first = pg.target(f"{name}_known", "rgba32f", like=color)
    fine = [known(color, mask or color, mask is not None, into=first, name=first.name).border("zero")]
    for level in range(1, levels + 1):
        spec = pg.target(f"{name}_pulled{level}", "rgba32f", like=fine[0], scale=0.5**level)
        fine.append(pulled(fine[-1], into=spec, name=spec.name).border("zero"))
    filled = fine.pop()
    for level in range(levels - 1, -1, -1):
        spec = pg.target(f"{name}_pushed{level}", "rgba32f", like=fine[0], scale=0.5**level)
        last = (into or pg.target(name, "rgba32f")) if level == 0 else spec
        filled = pushed(fine[level], filled.border("clamp"), into=last, name=name if level == 0 else spec.name)
    return filled
