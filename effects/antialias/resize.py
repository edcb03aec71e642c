"""Resize: change the size of a picture, with filtering as wide as shrinking needs."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Literal

import passgraph as pg
from passgraph.effects.channels import between, result_like
from passgraph.effects.checked import effect
from passgraph.effects.pictures.decoded import decoded
from passgraph.graph.targets import Like
from passgraph.language import Const, Image, ivec2, output_size, pixel, vec4

Filter = Literal["box", "bilinear", "catmull-rom", "mitchell", "lanczos3"]
#: Filter → its reach to each side, in pixels of the smaller picture, and B and C of cubic ones.
FILTERS: dict[Filter, tuple[float, float, float]] = {
    "box": (0.5, 0.0, 0.0), "bilinear": (1.0, 0.0, 0.0), "catmull-rom": (2.0, 0.0, 0.5),
    "mitchell": (2.0, 1.0 / 3.0, 1.0 / 3.0), "lanczos3": (3.0, 0.0, 0.0),
}  # fmt: skip
#: Coefficients of Lanczos' filter divided by its zeros, the highest power first.
REST = (
    -1.46531733e-8, 8.12191572e-7, -2.29608206e-5, 4.39815066e-4, -6.09092317e-3, 5.89287611e-2, -0.355480235, 1.0
)  # fmt: skip


@pg.function
def lanczos3(u: float) -> float:
    """Return sinc(x) sinc(x / 3) for u = x², up to 9: its zeros times a polynomial, with an error of 2e-7."""
    rest = REST[0]
    for i in range(1, len(REST)):
        rest = rest * u + REST[i]
    zeros = (1.0 - u) * (1.0 - u / 4.0) * (1.0 - u / 9.0)
    return zeros * (1.0 - u / 9.0) * rest


@pg.function
def cubic(x: float, b: float, c: float) -> float:
    """Cubic filter of D. Mitchell's and A. Netravali's family."""
    if x < 1.0:
        return (((12.0 - 9.0 * b - 6.0 * c) * x + (-18.0 + 12.0 * b + 6.0 * c)) * x * x + 6.0 - 2.0 * b) / 6.0
    return (((-b - 6.0 * c) * x + 6.0 * b + 30.0 * c) * x - 12.0 * b - 48.0 * c) * x / 6.0 + (8.0 * b + 24.0 * c) / 6.0


@pg.function
def weight(texel: int, pixel_: int, length: int, output_length: int, reach: Const[float], b: float, c: float) -> float:
    """Return the weight of a texel of a row for a pixel of the resized row; ints hold their distance exactly."""
    distance = (2 * texel + 1) * output_length - (2 * pixel_ + 1) * length
    if reach == 0.5:
        return 1.0 if distance > -max(length, output_length) and distance <= max(length, output_length) else 0.0
    x = abs(float(distance)) / float(2 * max(length, output_length))
    if texel < 0 or texel >= length or x >= reach:
        return 0.0
    if reach == 1.0:
        return 1.0 - x
    return lanczos3(x * x) if reach == 3.0 else cubic(x, b, c)


@pg.kernel(alike=True)
def resized(
    color: Image, across: Const[bool], down: Const[bool], reach: Const[float], b: Const[float], c: Const[float]
) -> vec4:
    """Return the filtered mean of the texels that a pixel covers, across, down or both."""
    at, size, made = pixel(), color.size, output_size()
    # integers in half texels over the result, as in weight()
    reach_x, reach_y = int(2.0 * reach) * max(size.x, made.x), int(2.0 * reach) * max(size.y, made.y)
    left = ((2 * at.x + 1) * size.x - reach_x - made.x) // (2 * made.x) + 1 if across else at.x
    top = ((2 * at.y + 1) * size.y - reach_y - made.y) // (2 * made.y) + 1 if down else at.y
    taps_x = (reach_x + made.x - 1) // made.x if across else 1
    taps_y = (reach_y + made.y - 1) // made.y if down else 1
    total, total_weight = vec4(0.0), 0.0
    for y in range(taps_y):
        weight_y = weight(top + y, at.y, size.y, made.y, reach, b, c) if down else 1.0
        if weight_y != 0.0:
            for x in range(taps_x):
                both = weight_y
                if across:
                    both = weight_y * weight(left + x, at.x, size.x, made.x, reach, b, c)
                if both != 0.0:
                    total += color.texel(ivec2(left + x, top + y)) * both
                    total_weight += both
    return total / total_weight


def sized(spec: pg.TargetSpec, color: pg.Target, scale: float) -> pg.TargetSpec:
    """Return a target with a size: its own, or a multiple of a picture's.

    >>> sized(pg.target("a"), pg.Input("frame"), 0.5).size.scale, sized(pg.target("a", size=(9, 5)), 1, 1).size.width
    ((0.5, 0.5), 9)
    """
    return spec if spec.size is not None else replace(spec, size=Like(color, (scale, scale)))


@effect("resize", alpha="premultiplied", alike=True)
def resize(
    color: pg.Target,
    scale: Annotated[float, pg.Range(0.001, 16)] = 0.5,
    filter: Filter = "lanczos3",
    into: pg.TargetSpec | None = None,
    name: str = "resize",
) -> pg.Target:
    """Enlarge or shrink a picture, with a filter as wide as shrinking needs.

    Parameters
    ----------
    color : any picture; means of linear light keep the brightness. Alpha should be premultiplied
    scale : the new width and height relative to the old ones; each is rounded up
    filter : "box" is the mean of the area that a pixel covers, or the nearest texel when enlarging; "bilinear" a tent;
        "catmull-rom" and "lanczos3" are sharp, and overshoot at edges; "mitchell" is between these
    into : destination target, whose size replaces ``scale`` if it has one; default: float32 named ``name``
    name : name of the pass

    When shrinking, the filter is widened by the ratio, so that nothing aliases. Both sides are scaled by the ratio of
    whole pixels. Texels outside of the picture do not count.

    Source: K. Turkowski, "Filters for Common Resampling Tasks", 1990 (Lanczos); D. Mitchell, A. Netravali,
    "Reconstruction Filters in Computer Graphics", SIGGRAPH 1988 (cubic filters: Catmull-Rom B = 0, C = 1/2; Mitchell
    B = C = 1/3). Filters and their supports are those of Pillow.

    Examples
    --------
    >>> import numpy as np
    >>> ramp = np.arange(8, dtype=np.float32)[None, :, None] * np.ones(4, np.float32)
    >>> made = resize(pg.Input("frame"), 0.25, "box")
    >>> with pg.compile(made, backend="reference") as program:
    ...     program(frame=ramp)["resize"][0, :, 0].tolist()
    [1.5, 5.5]
    """
    color = decoded(color, f"{name}_light", "rgba32f")
    spec = sized(result_like(color, into, name), color, scale)
    picture: pg.Target
    if isinstance(spec.size, Like) and spec.size.other is color:
        # across first, which leaves a few taps a pixel where both sides at once have as many squared
        narrow = pg.target(f"{name}_across", between(color, spec), like=color, scale=(spec.size.scale[0], 1.0))
        narrow_picture = resized(color, True, False, *FILTERS[filter], into=narrow, name=narrow.name)
        picture = resized(narrow_picture, False, True, *FILTERS[filter], into=spec, name=name)
    else:
        picture = resized(color, True, True, *FILTERS[filter], into=spec, name=name)
    return picture
