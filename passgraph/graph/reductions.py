# mypy: disable-error-code="no-any-return"
"""``pg.reduce`` and ``pg.histogram``: reductions as trees of pixel passes, which every backend runs."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any, Literal, TypeAlias, cast

import numpy as np

from passgraph import arguments
from passgraph.errors import GraphError
from passgraph.formats import format_named
from passgraph.graph.calls import kernel
from passgraph.graph.run_values import Derived, Value
from passgraph.graph.targets import MAX_SIDE, MOST_BINS, Blocks, CountPass, PixelPass, Target, TargetSpec, target
from passgraph.language.kernel import function
from passgraph.language.primitives import floor, isnan
from passgraph.language.symbols import Const, Image, ivec2, output_size, pixel, vec2, vec3, vec4
from passgraph.language.vectors import dot

#: Reduction operators.
SUM, MIN, MAX, ARG_MIN, ARG_MAX = range(5)
#: Axes to reduce: everything, each row, each column.
BOTH, ROWS, COLUMNS = range(3)
#: Texels reduced pairwise as a unit, and units per block.
SIDE = 8
#: Numbers counted per loop iteration.
TOGETHER = 8
#: Channel number for the luminance of red, green and blue (Rec. 709).
LUMA = 4
INFINITY = float("inf")


@function
def of_channel(color: vec4, channel: int) -> float:
    """Return one channel, or the luminance, of a texel."""
    if channel == LUMA:
        return dot(color.rgb, vec3(0.2126, 0.7152, 0.0722))
    return color[channel]


@function
def neutral(how: int) -> vec4:
    """Return the neutral element of a reduction, used for texels beyond the picture."""
    if how == MIN:
        return vec4(INFINITY)
    if how == MAX:
        return vec4(-INFINITY)
    return vec4(0.0)


@function
def leaf(color: vec4, at: ivec2, how: int, channel: int) -> vec4:
    """Return a texel's value for the reduction; NaN is never the least nor the largest.

    A candidate for arg_min and arg_max is (value, x, y, 1); 0 in the last component means that there is none.
    """
    if how == MIN:
        return min(neutral(how), color)
    if how == MAX:
        return max(neutral(how), color)
    if how == SUM:
        return color
    number = of_channel(color, channel)
    return vec4(-number if how == ARG_MIN else number, at.x, at.y, 0.0 if isnan(number) else 1.0)


@function
def joined(a: vec4, b: vec4, how: int, first: bool) -> vec4:
    """Reduce two elements; ``a`` comes before ``b`` in the picture: left of it, or above."""
    if how == SUM:
        return a + b
    if how == MIN:
        return min(a, b)
    if how == MAX:
        return max(a, b)
    # In one row, ``a`` is left of ``b``; blocks have several rows.
    larger = b.x > a.x or (not first and b.x == a.x and b.z < a.z)
    return b if b.w > a.w or (b.w == a.w and larger) else a


@function
def at_place(image: Image, at: ivec2, how: int, channel: int, first: bool) -> vec4:
    """Return the value of a texel, or of a texel of the level before."""
    color = image.texel(at)
    if first:
        color = leaf(color, at, how, channel)
    inside = at.x < image.size.x and at.y < image.size.y
    if how >= ARG_MIN:
        return vec4(color.rgb, color.a if inside else 0.0)
    return color if inside else neutral(how)


@function
def eight(image: Image, at: ivec2, step: ivec2, how: int, channel: int, first: bool) -> vec4:
    """Reduce eight texels in a row, pairwise."""
    line = [vec4(0.0)] * SIDE
    for i in range(SIDE):
        line[i] = at_place(image, at + i * step, how, channel, first)
    for i in range(0, SIDE, 2):
        line[i] = joined(line[i], line[i + 1], how, first)
    left, right = joined(line[0], line[2], how, first), joined(line[4], line[6], how, first)
    return joined(left, right, how, first)


@function
def level(image: Image, how: int, over: int, channel: int, first: bool) -> vec4:
    """Reduce each block of 64 texels (8x8, or 64 in a row or column): eights pairwise, then in sequence."""
    step, next_line, block = ivec2(1, 0), ivec2(0, 1), ivec2(SIDE, SIDE)
    if over == ROWS:
        next_line, block = ivec2(SIDE, 0), ivec2(SIDE * SIDE, 1)
    if over == COLUMNS:
        step, next_line, block = ivec2(0, 1), ivec2(0, SIDE), ivec2(1, SIDE * SIDE)
    total = neutral(how)
    for i in range(SIDE):
        at = pixel() * block + i * next_line
        # All further texels are outside; a loop with a break is not unrolled, which compiles in a third of the time.
        if at.x >= image.size.x or at.y >= image.size.y:
            break
        total = joined(total, eight(image, at, step, how, channel, first), how, first)
    return neutral(how) if how >= ARG_MIN and total.w == 0.0 else total


@kernel
def reduce_level(
    image: Image, how: Const[int], over: Const[int], channel: Const[int] = 0, first: Const[bool] = False
) -> vec4:
    return level(image, how, over, channel, first)


@kernel
def reduced_one(top: Image) -> float:
    return top[0, 0].r


@kernel
def reduced_two(top: Image) -> vec2:
    return top[0, 0].rg


@kernel
def reduced(top: Image) -> vec4:
    return top[0, 0]


@function
def per_texel(total: vec4, size: ivec2, result_size: ivec2) -> vec4:
    """Divide a sum by its number of texels."""
    return total / (float(size.x // result_size.x) * float(size.y // result_size.y))


@kernel
def mean_one(top: Image, image: Image) -> float:
    return per_texel(top[0, 0], image.size, output_size()).r


@kernel
def mean_two(top: Image, image: Image) -> vec2:
    return per_texel(top[0, 0], image.size, output_size()).rg


@kernel
def mean(top: Image, image: Image) -> vec4:
    return per_texel(top[0, 0], image.size, output_size())


@kernel
def reduced_place(top: Image) -> vec2:
    """Return the place of the best candidate; (-1, -1) if there is none."""
    best = top[0, 0]
    return best.gb if best.a > 0.0 else vec2(-1.0)


@kernel
def bin_of(image: Image, low: float, high: float, bins: Const[int], channel: Const[int]) -> float:
    """Return the number of a texel's bin, from 1; 0 if it is in none."""
    number = of_channel(image[0, 0], channel)
    place = floor((number - low) * (float(bins) / (high - low)))
    return min(place, float(bins - 1)) + 1.0 if number >= low and number <= high else 0.0


@function
def counted(number: float, bins: vec4) -> vec4:
    """Return 1 for the number's own bin, 0 for others."""
    return vec4(
        1.0 if number == bins.x else 0.0,
        1.0 if number == bins.y else 0.0,
        1.0 if number == bins.z else 0.0,
        1.0 if number == bins.w else 0.0,
    )


@kernel
def count_bins(numbers: Image) -> vec4:
    """Count the numbers of each row per bin: four bins per pixel from left to right, rows from top to bottom.

    Each iteration reads several numbers; those beyond the picture are 0.
    """
    bins, counts = vec4(4 * pixel().x) + vec4(1.0, 2.0, 3.0, 4.0), vec4(0.0)
    for x in range(0, MAX_SIDE, TOGETHER):
        if x >= numbers.size.x:
            break
        for i in range(TOGETHER):
            counts += counted(numbers.texel(ivec2(x + i, pixel().y)).r, bins)
    return counts


@kernel
def count_of_bin(counts: Image) -> float:
    """Return one bin of a row of pixels that store four bins each."""
    return counts.texel(ivec2(pixel().x // 4, 0))[pixel().x % 4]


Reduction: TypeAlias = Literal["sum", "mean", "min", "max", "arg_min", "arg_max"]
Channel: TypeAlias = Literal["luma", 0, 1, 2, 3]
#: Operators by name, as the kernels number them; a mean is a sum and a division.
_HOW = {"sum": 0, "mean": 0, "min": 1, "max": 2, "arg_min": 3, "arg_max": 4}
#: For each axis, as the kernels number it: texels of a block across and down, and the levels to reach one block.
_BLOCKS: dict[str | None, tuple[int, tuple[int, int], int]] = {
    None: (0, (8, 8), 5),
    "x": (1, (64, 1), 3),
    "y": (2, (1, 64), 3),
}
#: Range of a histogram's width: float32 can store the width, and the factor from a number to its bin, for up to the
#: largest number of bins.
_WIDTHS = (1e-34, 3.4e38)


def reduce(
    image: Target,
    how: Reduction,
    *,
    axis: Literal["x", "y"] | None = None,
    channel: Channel | None = None,
    into: TargetSpec | None = None,
    name: str | None = None,
) -> Target:
    """Reduce a picture to one texel, or to one per row or column; each channel separately.

    Texels are read as in kernels: sRGB is decoded, and missing channels are 0, 0, 1.  They are reduced in one order on
    every backend (eight pairwise, then eight such eights), so sums of the same numbers are bit-identical unless a
    device flushes numbers below 2^-126 to zero.

    Parameters
    ----------
    image
        Any handle: an input, a target, or last run's content.
    how
        ``"sum"``, ``"mean"``, ``"min"``, ``"max"``, or ``"arg_min"``, ``"arg_max"``: the position of the least or
        largest number of a channel in ``image``, (x, y) in texels from the top left; among equal ones the first, row by
        row.
    axis
        ``"x"`` along each row, which gives 1 x height pixels; ``"y"`` along each column, width x 1; default: both, 1 x
        1.
    channel
        For ``"arg_min"`` and ``"arg_max"``: 0 to 3 (default 0) or ``"luma"`` (Rec. 709 weights; the first channel for
        formats with one or two).
    into
        Destination without a size; default: a float32 target.  With fewer than four channels, it gets the first ones.
    name
        Name of the pass, and of the default target; default: that of ``into``, or e.g. ``frame.sum``.

    Returns
    -------
    The reduced picture.  The error of a sum is at most 50 · 2^-24 of the sum of magnitudes; a mean adds at most 6 ·
    2^-24 of itself.  Least, largest and positions are exact.  A sum with NaN is NaN; the least and the largest ignore
    NaN: if there is nothing else the least is infinity, the largest minus infinity, and the position (-1, -1).

    Raises
    ------
    GraphError
        For an unknown operator, axis or channel, and for an ``into`` with a size.

    Examples
    --------
    >>> import numpy as np
    >>> import passgraph as pg
    >>> picture = np.arange(6, dtype=np.float32).reshape(2, 3, 1)
    >>> frame = pg.Input("frame", "r32f")
    >>> outputs = [reduce(frame, "sum"), reduce(frame, "max", axis="x"), reduce(frame, "arg_max")]
    >>> with pg.compile(outputs, backend="reference") as program:
    ...     result = program(frame=picture)
    >>> result["frame.sum"][0, 0].tolist(), result["frame.max"][:, 0, 0].tolist()
    ([15.0, 0.0, 0.0, 6.0], [2.0, 5.0])
    >>> result["frame.arg_max"][0, 0].tolist()
    [2.0, 1.0]
    """

    check_picture(image, "pg.reduce")
    arguments.one_of(how, "pg.reduce: how", _HOW)
    if axis is not None:
        arguments.one_of(axis, "pg.reduce: axis", ("x", "y"))
    place = how.startswith("arg")
    if channel is not None and not place:
        raise GraphError(
            f"pg.reduce: channel is for 'arg_min' and 'arg_max', and {how!r} gives every channel; leave it out, and "
            "read the one that you need"
        )
    number = channel_number(0 if channel is None else channel, image, "pg.reduce: channel")
    spec = _declared(into, name, f"{image.name}.{how}", "rg32f" if place else "rgba32f", f"pg.reduce {how!r}")
    name = _named(name, spec)
    top = _tree(image, _HOW[how], axis, number, spec.name)
    if place:
        return reduced_place(top, into=spec, name=name)
    by_channels: dict[int, Any]
    if how == "mean":
        by_channels = {1: mean_one, 2: mean_two}
        return cast("Target", by_channels.get(spec.format.channels, mean)(top, image, into=spec, name=name))
    by_channels = {1: reduced_one, 2: reduced_two}
    return cast("Target", by_channels.get(spec.format.channels, reduced)(top, into=spec, name=name))


def histogram(
    image: Target,
    bins: int = 256,
    *,
    channel: Channel = "luma",
    low: float | Value | Derived = 0.0,
    high: float | Value | Derived = 1.0,
    into: TargetSpec | None = None,
    name: str | None = None,
) -> Target:
    """Count the texels of a channel in bins of equal width from ``low`` to ``high``.

    As in ``numpy.histogram``: a bin includes its lower edge, the last one both edges; numbers below ``low``, above
    ``high`` and NaN are not counted.  A number within rounding of an edge may be counted on its other side.

    Parameters
    ----------
    image
        Any handle: an input, a target, or last run's content.
    bins
        1 to 2048.
    channel
        0 to 3, or ``"luma"``: Rec. 709 weights on red, green and blue; the first of formats with one or two.
    low, high
        The ends, ``low`` below ``high`` by at least 1e-34; numbers or run values.  256 bins from 0 to 1 give an 8-bit
        channel one bin per value.
    into
        Destination with one channel and without a size; default: an r32f target.
    name
        Name of the pass, and of the default target; default: that of ``into``, or e.g. ``frame.histogram``.

    Returns
    -------
    A picture of ``bins`` x 1 pixels, the bin at ``low`` on the left.  Counts are exact up to 2^24; beyond, the error is
    at most 2^-20 of the count.

    Raises
    ------
    GraphError
        For arguments out of range, and for an ``into`` with a size.

    Examples
    --------
    >>> import numpy as np
    >>> import passgraph as pg
    >>> counts = histogram(pg.Input("frame", "r8"), 4, channel=0)
    >>> with pg.compile(counts, backend="reference") as program:
    ...     program(frame=np.array([[0, 10, 70], [255, 254, 192]], np.uint8))["frame.histogram"][0, :, 0].tolist()
    [2.0, 1.0, 0.0, 3.0]
    """

    check_picture(image, "pg.histogram")
    arguments.whole_number(bins, "pg.histogram: bins", 1, MOST_BINS)
    number = channel_number(channel, image, "pg.histogram: channel")
    ends = _end(low, "low"), _end(high, "high")
    if not isinstance(low, (Value, Derived)) and not isinstance(high, (Value, Derived)):
        _check_width(low, high)
    result_spec = _declared(into, name, f"{image.name}.histogram", "r32f", "pg.histogram")
    name = _named(name, result_spec)
    # last run's content has no size of its own to take
    spec = target(f"{result_spec.name} bins", "r32f", like=image)
    numbered: Target = bin_of(image, *ends, bins, number, into=spec, name=spec.name)
    rows = TargetSpec(f"{result_spec.name} rows", format_named("rgba32f"), Blocks(image, MAX_SIDE, 1, -(-bins // 4)))
    top = _tree(count_rows(numbered, rows, rows.name), _HOW["sum"], "y", 0, rows.name)
    line = TargetSpec(f"{result_spec.name} in line", format_named("r32f"), Blocks(image, MAX_SIDE, MAX_SIDE, bins))
    return reduced_one(count_of_bin(top, into=line, name=line.name), into=result_spec, name=name)


def count_rows(numbers: Target, into: TargetSpec | tuple[TargetSpec, ...], name: str) -> Target:
    """Add a pass that counts the whole numbers of each row of a single-channel picture.

    Channel c of the pixel in column x of row y counts the texels of row y that equal ``4 * x + c + 1``; other numbers
    and NaN are not counted.  Rows below the picture count nothing.  The picture may hold any values.
    """
    counted_target: Target = count_bins(numbers.content.border("zero"), into=into, name=name)
    node = counted_target.made_by
    assert isinstance(node, PixelPass)
    return replace(
        counted_target, made_by=CountPass(**{field.name: getattr(node, field.name) for field in fields(node)})
    )


def _tree(image: Target, how: int, axis: str | None, channel: int, name: str) -> Target:
    """Add reduction levels down to one block, for the largest possible picture."""

    over, (width, height), levels = _BLOCKS[axis]
    level_target = image
    for level in range(1, levels + 1):
        spec = TargetSpec(
            f"{name} {level}", format_named("rgba32f"), Blocks(level_target.border("clamp"), width, height)
        )
        level_target = reduce_level(
            level_target.border("clamp"), how, over, channel, level == 1, into=spec, name=spec.name
        )
    return level_target


def check_picture(image: object, what: str) -> None:
    if isinstance(image, TargetSpec):
        raise GraphError(f"{what}: target {image.name!r} is declared but not written; give what its pass returned")
    arguments.instance(image, Target, f"{what}: image", "a target that a pass returned, or pg.Input(...)")


def channel_number(channel: object, image: Target, what: str) -> int:
    """Return the channel's number; ``"luma"`` comes after the channels, or is the first of one or two."""
    if arguments.among(channel, ("luma",)):
        stored = image.spec.format
        return 0 if stored is not None and stored.channels < 3 else 4
    if isinstance(channel, bool) or not isinstance(channel, (int, np.integer)) or channel not in range(4):
        raise GraphError(f"{what} must be 0, 1, 2, 3 or 'luma', got {arguments.shown(channel)}")
    return int(channel)


def _check_width(low: float, high: float) -> None:
    if not low < high:
        raise GraphError(f"pg.histogram: low must be below high, got {low!r} and {high!r}")
    width = float(np.float32(high)) - float(np.float32(low))
    if not _WIDTHS[0] <= width <= _WIDTHS[1]:
        raise GraphError(
            f"pg.histogram: high - low must be from {_WIDTHS[0]:g} to {_WIDTHS[1]:g} as float32, got {low!r} "
            f"and {high!r}"
        )


def _end(value: object, what: str) -> object:
    return value if isinstance(value, (Value, Derived)) else arguments.real(value, f"pg.histogram: {what}")


def _declared(into: object, name: object, otherwise: str, format_: str, what: str) -> TargetSpec:
    """Return the target to write; its size comes from the reduced picture."""
    if into is None:
        return target(otherwise if name is None else arguments.text(name, f"{what}: name"), format_)
    if isinstance(into, Target):
        raise GraphError(f"{what} writes all of {into.name!r}; give a new pg.target(...), not a handle")
    spec = arguments.instance(into, TargetSpec, f"{what}: into", "made by pg.target(...)")
    if spec.size is not None:
        raise GraphError(
            f"{what}: target {spec.name!r} is declared with a size, but its size comes from the reduced picture; leave "
            "size, scale and like out"
        )
    return spec


def _named(name: object, spec: TargetSpec) -> str:
    return spec.name if name is None else arguments.text(name, "the name of a pass")
