"""Diagnose a divergent picture: undo common mistakes of ports one by one, and find the one that corrects it.

A picture that is within its bounds after flipping was flipped.  For an unexplained one, describe where the error lies:
along the edge, or in one channel.  The diagnosis does not affect the verdict.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from passgraph.formats import Format
from passgraph.srgb import linear_to_srgb, srgb_to_linear
from passgraph.verify.conformance.case import Picture
from passgraph.verify.oracle.interval import Interval, spacing

#: Width in pixels of the border that counts as the edge.
EDGE_PX = 2
#: Errors of more units in the last place are not a matter of precision; half precision has 2^-11.
MOST_ULPS = 2.0**13
#: Tolerance of a guessed transfer curve in steps of the format, and tolerance of depth.
CURVE_STEPS, DEPTH_ROOM = 1.5, 2.0**-20
_WITHIN = "it would be within its bounds"


@dataclass(frozen=True, eq=False)
class Found:
    """A target that is outside its bounds.

    Attributes
    ----------
    got, expected : (height, width, channels), the backend's picture and the reference's
    allowed : bounds of the same shape
    format : of the target
    before : the bounds of the same target one run earlier; None in the first run
    """

    got: Picture
    expected: Picture
    allowed: Interval
    format: Format
    before: Interval | None = None

    @property
    def beyond(self) -> NDArray[np.bool_]:
        return self.allowed.without(self.got)


def cause(divergence: Found) -> str:
    """Return the first mistake that explains a divergence, or where it lies, as a sentence; empty if unknown.

    >>> expected = np.arange(12, dtype=np.float32).reshape(3, 2, 2)
    >>> from passgraph.formats import FORMATS
    >>> cause(Found(expected[::-1], expected, Interval.point(expected), FORMATS["rg32f"]))
    'Upside down it would be within its bounds: row 0 is on top'
    """
    for guess in (_older, _nothing, _turned, _moved, _exchanged, _depth, _curve, _kinds, _rounded, _place):
        with np.errstate(all="ignore"):  # divergent pictures may hold any values
            sentence = next(guess(divergence), "")
        if sentence:
            return sentence
    return ""


def _older(divergence: Found) -> Iterator[str]:
    if divergence.before is not None and not divergence.before.without(divergence.got).any():
        yield "It is what the run before should have made: what that run was given is still in use"


def _nothing(divergence: Found) -> Iterator[str]:
    if not divergence.got.any() and divergence.expected.any():
        yield "All of it is 0: nothing was written"


def _turned(divergence: Found) -> Iterator[str]:
    got, rows, columns = divergence.got, divergence.got.shape[0], divergence.got.shape[1]
    if rows > 1 and not divergence.allowed.without(got[::-1]).any():
        yield f"Upside down {_WITHIN}: row 0 is on top"
    if columns > 1 and not divergence.allowed.without(got[:, ::-1]).any():
        yield f"Mirrored {_WITHIN}: column 0 is on the left"
    if rows == columns > 1 and not divergence.allowed.without(got.transpose(1, 0, 2)).any():
        yield f"With rows and columns exchanged {_WITHIN}: sizes are (width, height), arrays (height, width)"


def _moved(divergence: Found) -> Iterator[str]:
    """Test for pictures moved by a pixel; the border is ignored, since its source is unknown."""
    rows, columns = divergence.got.shape[:2]
    for down, right in ((0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (1, -1), (-1, 1), (-1, -1)):
        to = _shifted(down, rows), _shifted(right, columns)
        came = _shifted(-down, rows), _shifted(-right, columns)
        if divergence.beyond[came].any() and not divergence.allowed.take(came).without(divergence.got[to]).any():
            steps = ", ".join(f"{-by:+d} {what}" for by, what in ((right, "column"), (down, "row")) if by)
            yield f"Moved by {steps} {_WITHIN}: a place is off by one"


def _shifted(by: int, count: int) -> slice:
    return slice(max(by, 0), count + min(by, 0))


def _exchanged(divergence: Found) -> Iterator[str]:
    if divergence.format.channels < 3:
        return
    order = [2, 1, 0, 3][: divergence.format.channels]
    if not divergence.allowed.without(divergence.got[..., order]).any():
        yield f"With red and blue exchanged {_WITHIN}: channels are red, green, blue, alpha"


def _depth(divergence: Found) -> Iterator[str]:
    if not divergence.format.is_depth:
        return
    got, one = divergence.got, np.float32(1.0)
    if _nearly(one - got, divergence.expected, DEPTH_ROOM):
        yield f"As 1 - depth {_WITHIN}: 0 is near"
    # A value cleared to 1 was not computed.
    if _nearly(np.where(got == one, one, got / 2 + one / 2), divergence.expected, DEPTH_ROOM):
        yield f"As depth / 2 + 1/2 {_WITHIN}: clip space reaches from z = -w to z = w"


def _curve(divergence: Found) -> Iterator[str]:
    expected, format_ = divergence.expected, divergence.format
    if format_.is_depth or format_.channels < 3 or not ((expected >= 0.0) & (expected <= 1.0)).all():
        return
    curves: tuple[tuple[Callable[[Picture], Picture], str], ...] = (
        (linear_to_srgb, "It is encoded as sRGB once too often"),
        (srgb_to_linear, "It is decoded from sRGB once too often, or not encoded"),
    )
    for curve, sentence in curves:
        colours = expected.copy()
        colours[..., :3] = curve(colours[..., :3])
        if _nearly(colours, divergence.got, CURVE_STEPS * max(format_.unit, DEPTH_ROOM)):
            yield sentence


def _nearly(one: Picture, other: Picture, room: float) -> bool:
    return bool((np.abs(one - other) <= room).all())


def _kinds(divergence: Found) -> Iterator[str]:
    got, beyond = divergence.got[divergence.beyond], divergence.expected[divergence.beyond]
    if (np.isnan(beyond) & ~np.isnan(got)).all():
        yield "Only NaN is missing: a comparison with NaN is false, and no compiler may assume that there is none"
    if (np.isnan(got) & ~np.isnan(beyond)).all():
        yield "Only NaN is there too often: min(a, b) is b if b < a else a, and max alike"
    if (np.isinf(beyond) & np.isfinite(got)).all():
        yield "Only infinity is missing: what is too large for a float is infinite"


def _rounded(divergence: Found) -> Iterator[str]:
    got, expected = (picture[divergence.beyond].astype(np.float64) for picture in (divergence.got, divergence.expected))
    if not (np.isfinite(got) & np.isfinite(expected)).all():
        return
    apart, format_ = got - expected, divergence.format
    step: float | NDArray[np.float64]
    if format_.steps:
        step = 1.0 / format_.steps
    elif format_.bits == 16:
        step = np.spacing(np.abs(expected).astype(np.float16)).astype(np.float64)
    else:
        units = np.abs(apart) / spacing(expected)
        if (units <= MOST_ULPS).all():
            yield f"It is off by {units.max():.3g} units in the last place at most: an operation is less precise"
        return
    if (np.abs(apart) <= 1.01 * step).all():
        way = "down" if (apart < 0).all() else "up" if (apart > 0).all() else "otherwise"
        yield f"It is off by one step of {format_.name}, rounded {way}: the nearest is due, of halves the even one"


def _place(divergence: Found) -> Iterator[str]:
    beyond = divergence.beyond
    for edge in range(1, EDGE_PX + 1):
        inner = beyond[edge:-edge, edge:-edge]
        if inner.size and not inner.any():
            yield f"Only pixels at the edge, {edge} wide, are wrong: look at what is read outside of a picture"
    channels = np.flatnonzero(beyond.any(axis=(0, 1)))
    if len(channels) == 1 < beyond.shape[2]:
        yield f"Only channel {channels[0]} is wrong"
