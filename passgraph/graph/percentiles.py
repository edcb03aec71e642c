# mypy: disable-error-code="no-any-return"
"""``pg.percentile``: the number below which a share of a picture's numbers lies, by two histograms."""

from __future__ import annotations

from passgraph import arguments
from passgraph.errors import GraphError
from passgraph.formats import format_named
from passgraph.graph.calls import kernel
from passgraph.graph.reductions import Channel, channel_number, check_picture, histogram, of_channel, reduce
from passgraph.graph.run_values import Derived, Value
from passgraph.graph.targets import MOST_BINS, Absolute, Target, TargetSpec, target
from passgraph.language.primitives import ceil
from passgraph.language.symbols import Const, Image, ivec2, vec4


@kernel
def number_of(image: Image, channel: Const[int]) -> float:
    return of_channel(image[0, 0], channel)


@kernel
def place_between(numbers: Image, least: Image, largest: Image) -> float:
    """Return the place of a number between the least and the largest one, 0 to 1."""
    low, high = least.texel(ivec2(0, 0)).r, largest.texel(ivec2(0, 0)).r
    return (numbers[0, 0].r - low) / (high - low) if high > low else numbers[0, 0].r - low


@kernel
def place_in_bin(places: Image, found: Image) -> float:
    """Return the place within the bin that was found: scaling by a power of two and the difference are exact."""
    bin = found.texel(ivec2(0, 0)).r
    place = places[0, 0].r * float(MOST_BINS) - bin
    return place if place < 1.0 or bin == float(MOST_BINS - 1) else 2.0


@kernel
def bin_at(counts: Image, percent: float) -> vec4:
    """Return the bin that holds the number of a rank, the count of the bins before it, and the rank."""
    total = 0.0
    for i in range(MOST_BINS):
        total += counts.texel(ivec2(i, 0)).r
    rank, before, bin = max(ceil(total * (percent / 100.0)), 1.0), 0.0, 0.0
    for i in range(MOST_BINS - 1):
        count = counts.texel(ivec2(i, 0)).r
        if before + count >= rank:
            break
        before += count
        bin += 1.0
    return vec4(bin, before, rank, 0.0)


@kernel
def number_at(counts: Image, found: Image, least: Image, largest: Image) -> float:
    """Return the middle of the second histogram's bin that holds the number of the rank; ends are exact."""
    first = found[0, 0]
    total, bin = first.y, 0.0
    for i in range(MOST_BINS - 1):
        total += counts.texel(ivec2(i, 0)).r
        if total >= first.z:
            break
        bin += 1.0
    low, high = least[0, 0].r, largest[0, 0].r
    if first.x + bin == 0.0 or not high > low:
        return low
    if first.x + bin == float(2 * (MOST_BINS - 1)):
        return high
    place = (first.x + (bin + 0.5) / float(MOST_BINS)) / float(MOST_BINS)
    return low + (high - low) * place


def percentile(
    image: Target,
    percent: float | Value | Derived,
    *,
    channel: Channel = "luma",
    name: str | None = None,
) -> Target:
    """Return the least number of a picture that is at least as large as a share of all its numbers.

    Two histograms of 2048 bins find it, between the least and the largest number; NaN does not count.  It works in
    tiles too (`passgraph.tiled`), and does not depend on them.

    Parameters
    ----------
    image
        Any handle: an input, a target, or last run's content.
    percent
        0 to 100, or a run value.
    channel
        0 to 3, or ``"luma"``: Rec. 709 weights on red, green and blue; the first of formats with one or two.
    name
        Name of the passes and of the target; default: such as ``frame.percentile``.

    Returns
    -------
    A target of 1x1 pixels, r32f.  Its error is at most 2^-22 of the difference between the largest and the least
    number, as of ``numpy.percentile(…, method="inverted_cdf")``; with more than 2^24 pixels, ranks are rounded too.

    Raises
    ------
    GraphError
        For arguments out of range.

    Examples
    --------
    >>> import numpy as np
    >>> import passgraph as pg
    >>> middle = percentile(pg.Input("frame", "r32f"), 50.0)
    >>> with pg.compile(middle, backend="reference") as program:
    ...     found = program(frame=np.float32([[5, 1, 4], [2, 3, 100]]))["frame.percentile"]
    >>> round(float(found[0, 0, 0]), 3)
    3.0
    """
    check_picture(image, "pg.percentile")
    number = channel_number(channel, image, "pg.percentile: channel")
    if not isinstance(percent, (Value, Derived)):
        arguments.real(percent, "pg.percentile: percent", 0.0, 100.0, error=GraphError)
    name = f"{image.name}.percentile" if name is None else arguments.text(name, "pg.percentile: name")
    spec = target(f"{name} numbers", "r32f", like=image)
    numbers: Target = number_of(image, number, into=spec, name=spec.name)
    least, largest = (reduce(numbers, how, into=target(f"{name} {how}", "r32f")) for how in ("min", "max"))
    spec = target(f"{name} places", "r32f", like=image)
    places: Target = place_between(numbers, least, largest, into=spec, name=spec.name)
    counts = histogram(places, MOST_BINS, channel=0, name=f"{name} counts")
    spec = TargetSpec(f"{name} bin", format_named("rgba32f"), Absolute(1, 1))
    found: Target = bin_at(counts, percent, into=spec, name=spec.name)
    spec = target(f"{name} places in bin", "r32f", like=image)
    nearer: Target = place_in_bin(places, found, into=spec, name=spec.name)
    counts = histogram(nearer, MOST_BINS, channel=0, name=f"{name} counts in bin")
    result = TargetSpec(name, format_named("r32f"), Absolute(1, 1))
    return number_at(counts, found, least, largest, into=result, name=name)
