"""The kernels behind ``pg.reduce`` and ``pg.histogram``: one level of a tree, what is kept of its top, and bins."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from passgraph.graph.calls import kernel
from passgraph.graph.targets import MAX_SIDE
from passgraph.language.kernel import function, struct
from passgraph.language.primitives import floor, isnan
from passgraph.language.symbols import Const, Image, ivec2, output_size, pixel, vec2, vec3, vec4
from passgraph.language.vectors import dot

#: How two texels become one.
SUM, MIN, MAX, ARG_MIN, ARG_MAX = range(5)
#: What is reduced to one: everything, each row, each column.
BOTH, ROWS, COLUMNS = range(3)
#: Texels that are joined by pairs, and how many such eights a block has.
SIDE = 8
#: Numbers that are counted in one trip of a loop.
TOGETHER = 8
#: In the place of a channel's number: the luminance of red, green and blue (Rec. 709).
LUMA = 4
INFINITY = float("inf")


@function
def of_channel(color: vec4, channel: int) -> float:
    """One number of a texel."""
    if channel == LUMA:
        return dot(color.rgb, vec3(0.2126, 0.7152, 0.0722))
    return color[channel]


@function
def neutral(how: int) -> vec4:
    """What changes nothing: it stands where the picture ends."""
    if how == MIN:
        return vec4(INFINITY)
    if how == MAX:
        return vec4(-INFINITY)
    return vec4(0.0)


@function
def leaf(color: vec4, at: ivec2, how: int, channel: int) -> vec4:
    """A texel as the tree takes it.  NaN is no candidate for the least nor the largest.

    A candidate's place: how large, where, and 1; 0 in the last component means none, whatever the others are.
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
    """One of two, ``a`` before ``b`` in the picture: left of it, or above."""
    if how == SUM:
        return a + b
    if how == MIN:
        return min(a, b)
    if how == MAX:
        return max(a, b)
    # Of one row, what is in ``a`` is left of what is in ``b``; blocks have several rows.
    larger = b.x > a.x or (not first and b.x == a.x and b.z < a.z)
    return b if b.w > a.w or (b.w == a.w and larger) else a


@function
def at_place(image: Image, at: ivec2, how: int, channel: int, first: bool) -> vec4:
    """What a texel, or the level before, has there."""
    color = image.texel(at)
    if first:
        color = leaf(color, at, how, channel)
    inside = at.x < image.size.x and at.y < image.size.y
    if how >= ARG_MIN:
        return vec4(color.rgb, color.a if inside else 0.0)
    return color if inside else neutral(how)


@function
def eight(image: Image, at: ivec2, step: ivec2, how: int, channel: int, first: bool) -> vec4:
    """Eight in a row, by pairs."""
    line = [vec4(0.0)] * SIDE
    for i in range(SIDE):
        line[i] = at_place(image, at + i * step, how, channel, first)
    for i in range(0, SIDE, 2):
        line[i] = joined(line[i], line[i + 1], how, first)
    left, right = joined(line[0], line[2], how, first), joined(line[4], line[6], how, first)
    return joined(left, right, how, first)


@function
def level(image: Image, how: int, over: int, channel: int, first: bool) -> vec4:
    """A pixel for each 64 texels, 8x8 of them or 64 in a row or a column: eights by pairs, one after another."""
    step, next_line, block = ivec2(1, 0), ivec2(0, 1), ivec2(SIDE, SIDE)
    if over == ROWS:
        next_line, block = ivec2(SIDE, 0), ivec2(SIDE * SIDE, 1)
    if over == COLUMNS:
        step, next_line, block = ivec2(0, 1), ivec2(0, SIDE), ivec2(1, SIDE * SIDE)
    total = neutral(how)
    for i in range(SIDE):
        at = pixel() * block + i * next_line
        # Nothing lies beyond; and a loop with a break stays one, which compiles in a third of the time.
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
def per_texel(total: vec4, size: ivec2, made: ivec2) -> vec4:
    """A sum divided by how many texels it is of."""
    return total / (float(size.x // made.x) * float(size.y // made.y))


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
    """Where the best candidate is; (-1, -1) where there is none."""
    best = top[0, 0]
    return best.gb if best.a > 0.0 else vec2(-1.0)


@kernel
def bin_of(image: Image, low: float, high: float, bins: Const[int], channel: Const[int]) -> float:
    """The number of a texel's bin, from 1; 0 for what is in none."""
    number = of_channel(image[0, 0], channel)
    place = floor((number - low) * (float(bins) / (high - low)))
    return min(place, float(bins - 1)) + 1.0 if number >= low and number <= high else 0.0


@struct
class Counts:
    """Four bins of each quarter of all of them."""

    first: vec4
    second: vec4
    third: vec4
    fourth: vec4


@function
def counted(number: float, wanted: vec4) -> vec4:
    """1 for the bin that is a number's own."""
    return vec4(
        1.0 if number == wanted.x else 0.0,
        1.0 if number == wanted.y else 0.0,
        1.0 if number == wanted.z else 0.0,
        1.0 if number == wanted.w else 0.0,
    )


@kernel
def count_bins(numbers: Image) -> Counts:
    """How often bins' numbers stand in a row: bins from left to right, rows from top to bottom.

    Sixteen bins, as reading a number costs more than comparing it; and several numbers a trip, those beyond the
    picture 0.
    """
    quarter = float(4 * output_size().x)
    wanted = vec4(4 * pixel().x) + vec4(1.0, 2.0, 3.0, 4.0)
    first, second, third, fourth = vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0)
    for x in range(0, MAX_SIDE, TOGETHER):
        if x >= numbers.size.x:
            break
        for i in range(TOGETHER):
            number = numbers.texel(ivec2(x + i, pixel().y)).r
            first += counted(number, wanted)
            second += counted(number, wanted + quarter)
            third += counted(number, wanted + 2.0 * quarter)
            fourth += counted(number, wanted + 3.0 * quarter)
    return Counts(first, second, third, fourth)


@kernel
def sum_counts(first: Image, second: Image, third: Image, fourth: Image) -> Counts:
    """A row for each 64 rows of all four."""
    return Counts(
        level(first, SUM, COLUMNS, 0, False),
        level(second, SUM, COLUMNS, 0, False),
        level(third, SUM, COLUMNS, 0, False),
        level(fourth, SUM, COLUMNS, 0, False),
    )


@kernel
def count_of_bin(first: Image, second: Image, third: Image, fourth: Image) -> float:
    """Bins that lie by fours in four pictures, one after another."""
    quarter = 4 * first.size.x
    at, place = ivec2(pixel().x % quarter // 4, 0), pixel().x // quarter
    if place == 0:
        found = first.texel(at)
    elif place == 1:
        found = second.texel(at)
    elif place == 2:
        found = third.texel(at)
    else:
        found = fourth.texel(at)
    return found[pixel().x % 4]
