"""SMAA: smooth jagged edges in a finished picture by the shapes that they form."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Annotated

import passgraph as pg
from passgraph.effects.antialias.fxaa import perceived
from passgraph.effects.antialias.smaa_areas import DIAGONAL, STRAIGHT, areas
from passgraph.effects.checked import effect
from passgraph.effects.color.black_and_white import REC709
from passgraph.effects.quantities import Share
from passgraph.language import Const, Image, clamp, ivec2, ivec3, mix, pixel, sqrt, vec2, vec4

#: An edge next to one that is stronger by this factor does not count.
ADAPTATION = 2.0
#: Rows and columns of the table of areas, each half of it.
TABLE = 80


@pg.kernel
def edges(luma: Image, threshold: float) -> vec2:
    """Return 1 where luma changes to the left of the pixel (red) and above it (green), unless a neighbor changes far
    more."""
    here, left, above = luma[0, 0].r, luma[-1, 0].r, luma[0, -1].r
    change = vec2(abs(here - left), abs(here - above))
    if max(change.x, change.y) < threshold:
        return vec2(0.0)
    most = max(
        change.x, change.y, abs(here - luma[1, 0].r), abs(here - luma[0, 1].r), abs(left - luma[-2, 0].r),
        abs(above - luma[0, -2].r),
    )  # fmt: skip
    return vec2(
        1.0 if change.x >= threshold and ADAPTATION * change.x >= most else 0.0,
        1.0 if change.y >= threshold and ADAPTATION * change.y >= most else 0.0,
    )


@pg.function
def is_edge(edges: Image, at: ivec2, down: Const[bool]) -> bool:
    """Return True if there is an edge above a pixel, or to its left if ``down`` edges are followed."""
    return edges.texel(at).r > 0.5 if down else edges.texel(at).g > 0.5


@pg.function
def crossings(edges: Image, at: ivec2, across: ivec2, down: Const[bool]) -> int:
    """Return the edges across the followed one at the near side of a pixel: 1 beyond it, 3 on the pixel's own side."""
    beyond = is_edge(edges, at - across, not down)
    return (3 if is_edge(edges, at, not down) else 0) + (1 if beyond else 0)


@pg.function
def straight_weights(
    edges: Image, table: Image, at: ivec2, steps: Const[int], corner: float, down: Const[bool]
) -> vec2:
    """Return the fractions of the color across the edge, in this pixel and in that one, from the ends of the edge."""
    along, across = (ivec2(0, 1) if down else ivec2(1, 0)), (ivec2(1, 0) if down else ivec2(0, 1))
    left, right = 0, 0
    for i in range(2 * steps - 1):
        there = at - along * i
        if crossings(edges, there, across, down) != 0 or not is_edge(edges, there - along, down):
            break
        left = i + 1
    for i in range(2 * steps):
        there = at + along * (i + 1)
        if crossings(edges, there, across, down) != 0 or not is_edge(edges, there, down):
            break
        right = i + 1
    begin, end = at - along * left, at + along * (right + 1)
    first, last = crossings(edges, begin, across, down), crossings(edges, end, across, down)
    place = vec2(STRAIGHT * first, STRAIGHT * last) + sqrt(vec2(left, right)) + 0.5
    weights = table.sample(place / vec2(2 * TABLE, TABLE)).rg

    # a corner of the shape stays one: the edge across continues beyond the nearer end
    rounding = (1.0 - corner) * (0.5 if left == right else 1.0)
    kept = vec2(1.0)
    if left <= right:
        kept.x -= rounding if is_edge(edges, begin + across, not down) else 0.0
        kept.y -= rounding if is_edge(edges, begin - across * 2, not down) else 0.0
    if right <= left:
        kept.x -= rounding if is_edge(edges, end + across, not down) else 0.0
        kept.y -= rounding if is_edge(edges, end - across * 2, not down) else 0.0
    return weights * clamp(kept, 0.0, 1.0)


@pg.function
def followed(edges: Image, at: ivec2, way: ivec2, rising: Const[bool], steps: Const[int]) -> ivec3:
    """Return the length of a diagonal in pixels; 1 if it continues after all steps; 1 if the last has an edge above."""
    distance, goes_on, above = 0, 0, 0
    for i in range(1, steps + 1):
        there = at + way * i
        neighbor = is_edge(edges, there if rising else there + ivec2(1, 0), True)
        above = 1 if is_edge(edges, there, False) else 0
        distance, goes_on = i - 1, above if neighbor else 0
        if goes_on == 0:
            break
    return ivec3(distance, goes_on, above)


@pg.function
def one_of(edges: Image, above: ivec2, left: ivec2) -> int:
    """Return crossings at an end of a diagonal: 2 for the edge above one pixel, 1 for the edge left of the other."""
    return (2 if is_edge(edges, above, False) else 0) + (1 if is_edge(edges, left, True) else 0)


@pg.function
def diagonal_area(table: Image, before: ivec3, behind: ivec3, first: int, last: int) -> vec2:
    """Return the areas of a diagonal; an end that the search did not reach counts as unknown."""
    column = TABLE + before.x + (DIAGONAL * first if before.y == 0 else 0)
    return table.texel(ivec2(column, behind.x + (DIAGONAL * last if behind.y == 0 else 0))).rg


@pg.function
def diagonal_weights(edges: Image, table: Image, at: ivec2, steps: Const[int]) -> vec2:
    """Return the same for edges that step up by one pixel, and down by one pixel."""
    weights = vec2(0.0)
    before = ivec3(0)
    if is_edge(edges, at, True):
        before = followed(edges, at, ivec2(-1, 1), True, steps)
        before.x += before.z
    behind = followed(edges, at, ivec2(1, -1), True, steps)
    if before.x + behind.x > 2:
        p, q = at + ivec2(-before.x, before.x), at + ivec2(behind.x + 1, -behind.x)
        first, last = one_of(edges, p - ivec2(1, 0), p), one_of(edges, q, q - ivec2(0, 1))
        weights += diagonal_area(table, before, behind, first, last)

    before = followed(edges, at, ivec2(-1, -1), False, steps)
    behind = ivec3(0)
    if is_edge(edges, at + ivec2(1, 0), True):
        behind = followed(edges, at, ivec2(1, 1), False, steps)
        behind.x += behind.z
    if before.x + behind.x > 2:
        p, q = at - ivec2(before.x), at + ivec2(behind.x + 1, behind.x)
        first, last = one_of(edges, p - ivec2(1, 0), p - ivec2(0, 1)), one_of(edges, q, q)
        weights += diagonal_area(table, before, behind, first, last).gr
    return weights


@pg.kernel
def shares(edges: Image, table: Image, corner: float, steps: Const[int], diagonal_steps: Const[int]) -> vec4:
    """Return the color taken across the edge above, from above and from here, and the same for the edge to the left."""
    at, e = pixel(), edges[0, 0].rg
    above, left = vec2(0.0), vec2(0.0)
    is_diagonal = False
    if e.y > 0.5:
        if diagonal_steps > 0:
            above = diagonal_weights(edges, table, at, diagonal_steps)
            is_diagonal = above.x + above.y > 0.0
        if not is_diagonal:
            above = straight_weights(edges, table, at, steps, corner, False)
    if e.x > 0.5 and not is_diagonal:
        left = straight_weights(edges, table, at, steps, corner, True)
    return vec4(above, left)


@pg.kernel
def blended(color: Image, shares: Image) -> vec4:
    """Blend with the neighbors to both sides, or above and below, at the stronger edge."""
    c, own = color[0, 0], shares[0, 0]
    right, below, above, left = shares[1, 0].a, shares[0, 1].g, own.r, own.b
    across = max(right, left) > max(below, above)
    first, second = (right if across else below), (left if across else above)
    total = first + second
    if total < 1e-5:
        return c
    # skip fractions of 0: infinity times 0 is NaN
    smooth = vec4(0.0)
    if first > 0.0:
        smooth += mix(c, color[1, 0] if across else color[0, 1], first) * (first / total)
    if second > 0.0:
        smooth += mix(c, color[-1, 0] if across else color[0, -1], second) * (second / total)
    return smooth


@effect("smaa", alpha="premultiplied")
def smaa(
    color: pg.Target,
    threshold: Annotated[float, pg.Range(0, 0.5, above=True)] | pg.Value | pg.Derived = 0.1,
    steps: Annotated[int, pg.Range(1, 100)] = 16,
    diagonal_steps: Annotated[int, pg.Range(0, 18)] = 8,
    corner: Share | pg.Value | pg.Derived = 0.25,
    linear: bool = False,
    into: pg.TargetSpec | None = None,
    name: str = "smaa",
) -> pg.Target:
    """Smooth jagged edges of a finished picture by their shapes (SMAA 1x).

    Parameters
    ----------
    color : a picture for display, encoded, 0 to 1: after tone mapping. Alpha, which should be premultiplied, is
        smoothed with the color
    threshold : least difference of luma at an edge
    steps : length of the search along edges, two pixels per step, to either side
    diagonal_steps : length of the search along diagonals, one pixel per step; 0 treats them as rows and columns
    corner : rounding of corners; 0 leaves them sharp, 1 treats them as any other shape
    linear : colors are linear light, as read from sRGB formats. Luma is then encoded before edges are searched; values
        brighter than 1 count as 1
    into : destination target; default: 8 bits per channel, half floats with ``linear``, named ``name``
    name : name of the passes and targets

    The published presets are, as threshold, steps, diagonal steps and corner: low 0.15, 4, 0, 1; medium 0.1, 8, 0, 1;
    high 0.1, 16, 8, 0.25, which is the default; ultra 0.05, 32, 16, 0.25.

    Source: J. Jimenez, J. I. Echevarria, T. Sousa, D. Gutierrez, "SMAA: Enhanced Subpixel Morphological Antialiasing",
    Eurographics 2012, version 2.8. Deviation: edges are read one by one, without a search table.

    Examples
    --------
    >>> import numpy as np
    >>> steps = (np.arange(16) > 2 * np.arange(8)[:, None]).astype(np.float32)
    >>> into = pg.target("smooth", "rgba32f")
    >>> with pg.compile(smaa(pg.Input("frame"), into=into), backend="reference") as program:
    ...     smooth = program(frame=np.repeat(steps[:, :, None], 4, axis=2))["smooth"]
    >>> [round(float(y), 2) for y in smooth[4, 5:12, 0]]
    [0.0, 0.0, 0.0, 0.25, 0.75, 1.0, 1.0]
    """
    luma = perceived(color, REC709, linear, into=pg.target(f"{name}_luma", "r32f", like=color), name=f"{name}_luma")
    found = edges(luma, threshold, into=pg.target(f"{name}_edges", "rg8", like=color), name=f"{name}_edges")
    table = pg.Input(f"{name}_areas", "rg8", (2 * TABLE, TABLE), static=True, default=areas())
    by = pg.target(f"{name}_shares", "rgba8", like=color)
    weights = shares(found, table, corner, steps, diagonal_steps, into=by, name=by.name)
    into = into or pg.target(name, "rgba16f" if linear else "rgba8")
    smooth: pg.Target = blended(color, weights, into=into, name=name)
    return smooth
