"""FSR 1: enlarge a picture with smooth edges, then sharpen it."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any

import passgraph as pg
from passgraph.effects.antialias.resize import sized
from passgraph.effects.checked import effect
from passgraph.effects.pictures.decoded import decoded
from passgraph.effects.quantities import Share
from passgraph.formats import FORMATS
from passgraph.language import Image, clamp, inversesqrt, ivec2, output_size, pixel, saturate, vec2, vec4

#: The twelve texels around a position, starting at the upper left one of the nearest four.
TAPS: Any = (
    (0, -1), (1, -1), (-1, 0), (0, 0), (1, 0), (2, 0), (-1, 1), (0, 1), (1, 1), (2, 1), (0, 2), (1, 2)
)  # fmt: skip
#: For each of the nearest four: the indices of itself and of the texels above, left, right and below it.
CROSSES: Any = ((3, 0, 2, 4, 7), (4, 1, 3, 5, 8), (7, 3, 6, 8, 10), (8, 4, 7, 9, 11))
#: Smaller squared gradients have no direction; smaller contrasts are divided by as much.
FLAT, LEAST_CONTRAST = 1.0 / 32768.0, 1.0 / 65536.0
#: The negative lobe of a kernel without an edge, and its reduction by an edge.
LOBE, LOBE_LESS = 0.5, 0.29
#: The largest weight of a neighbor in sharpening.
MOST = 0.1875


@pg.function
def edge_share(before: float, here: float, behind: float) -> float:
    """Return 1 where luma is monotonic, and 0 where both neighbors are equal."""
    contrast = max(abs(behind - here), abs(here - before), LEAST_CONTRAST)
    share = saturate(abs(behind - before) / contrast)
    return share * share


@pg.kernel
def enlarged(color: Image) -> vec4:
    """EASU: twelve texels with a Lanczos-like kernel rotated to the edge, clamped to the range of the nearest four."""
    # positions are integers in half pixels of the result: exact in ints
    made, size = output_size(), color.size
    across = (2 * pixel().x + 1) * size.x - made.x
    down = (2 * pixel().y + 1) * size.y - made.y
    base = ivec2(across // (2 * made.x), down // (2 * made.y))
    f = vec2(
        float(across - base.x * (2 * made.x)) / float(2 * made.x),
        float(down - base.y * (2 * made.y)) / float(2 * made.y),
    )  # fmt: skip

    colors, lumas = [vec4(0.0)] * 12, [0.0] * 12
    for i in range(12):
        colors[i] = color.texel(base + ivec2(TAPS[i][0], TAPS[i][1]))
        lumas[i] = 0.5 * colors[i].r + colors[i].g + 0.5 * colors[i].b

    # gradient and edge of the nearest four, weighted by distance
    shares = vec4((1.0 - f.x) * (1.0 - f.y), f.x * (1.0 - f.y), (1.0 - f.x) * f.y, f.x * f.y)
    way, edge = vec2(0.0), 0.0
    for i in range(4):
        here, above, left, right, below = (
            lumas[CROSSES[i][0]], lumas[CROSSES[i][1]], lumas[CROSSES[i][2]], lumas[CROSSES[i][3]], lumas[CROSSES[i][4]]
        )  # fmt: skip
        way += vec2(right - left, below - above) * shares[i]
        edge += (edge_share(left, here, right) + edge_share(above, here, below)) * shares[i]
    steep = way.x * way.x + way.y * way.y
    way = way * inversesqrt(steep) if steep >= FLAT else vec2(1.0, 0.0)
    edge = 0.25 * edge * edge

    # longer along diagonals, shorter across edges
    stretch = 1.0 / max(abs(way.x), abs(way.y))
    lengths = vec2(1.0 + (stretch - 1.0) * edge, 1.0 - 0.5 * edge)
    lobe = LOBE - LOBE_LESS * edge
    total, weight = vec4(0.0), 0.0
    for i in range(12):
        out = vec2(TAPS[i][0], TAPS[i][1]) - f
        turned = vec2(out.x * way.x + out.y * way.y, out.y * way.x - out.x * way.y) * lengths
        square = min(turned.x * turned.x + turned.y * turned.y, 1.0 / lobe)
        window, core = lobe * square - 1.0, 0.4 * square - 1.0
        w = (1.5625 * core * core - 0.5625) * window * window
        total += colors[i] * w
        weight += w
    lowest = min(colors[3], colors[4], colors[7], colors[8])
    highest = max(colors[3], colors[4], colors[7], colors[8])
    return clamp(total / weight, lowest, highest)


@pg.kernel
def sharpened(color: Image, sharpness: float) -> vec4:
    """RCAS: subtract the four neighbors, as much as keeps every channel in the range from 0 to 1."""
    c, n, w, e, s = color[0, 0], color[0, -1], color[-1, 0], color[1, 0], color[0, 1]
    lowest, highest = min(n, w, e, s).rgb, max(n, w, e, s).rgb
    share = -MOST
    for i in range(3):
        least, most = min(lowest[i], c[i]), max(highest[i], c[i])
        room = max(-least / (4.0 * highest[i]), (1.0 - most) / (4.0 * lowest[i] - 4.0))
        share = max(share, room if least > 0.0 and most < 1.0 else 0.0)
    share = min(share, 0.0) * sharpness
    return vec4(((n + w + e + s).rgb * share + c.rgb) / (1.0 + 4.0 * share), c.a)


@effect("fsr1", alpha="premultiplied")
def fsr1(
    color: pg.Target,
    scale: Annotated[float, pg.Range(1, 4)] = 2.0,
    sharpness: Share | pg.Value | pg.Derived = 0.87,
    into: pg.TargetSpec | None = None,
    name: str = "fsr1",
) -> pg.Target:
    """Enlarge a picture along its edges, and sharpen it (FSR 1: EASU and RCAS).

    Parameters
    ----------
    color : a picture for display, encoded, 0 to 1, with smooth edges: after tone mapping and antialiasing. Alpha, which
        should be premultiplied, is enlarged with the color. Outside of the picture, reads follow the rule of
        ``color.border(...)``
    scale : the new width and height relative to the old ones; each is rounded up
    sharpness : 1 sharpens most, 0 not at all: 2 to the power of minus AMD's stops
    into : destination target, whose size replaces ``scale`` if it has one; default: float32 named ``name``
    name : name of the passes and targets

    Source: AMD, "FidelityFX Super Resolution 1.0", 2021 (EASU: twelve texels with a Lanczos-like kernel that is rotated
    to the edge; RCAS: five texels, limited by the range of each channel). Deviations: divisions, roots and positions
    are exact; where a channel leaves 0 to 1 nothing is sharpened.

    Examples
    --------
    >>> import numpy as np
    >>> edge = np.where(np.arange(6) < 3, 0.25, 0.75).astype(np.float32)[None, :, None] * np.ones((4, 6, 4))
    >>> with pg.compile(fsr1(pg.Input("frame"), sharpness=0.0), backend="reference") as program:
    ...     [round(float(y), 2) for y in program(frame=edge)["fsr1"][3, 2:10, 0]]
    [0.25, 0.25, 0.25, 0.32, 0.68, 0.75, 0.75, 0.75]
    """
    color = decoded(color, f"{name}_light", "rgba32f")
    spec = sized(into or pg.target(name, "rgba32f"), color, scale)
    between = replace(spec, name=f"{name}_enlarged", format=FORMATS["rgba32f"])
    larger = enlarged(color, into=between, name=between.name)
    picture: pg.Target = sharpened(larger, sharpness, into=spec, name=name)
    return picture
