"""Formats in bounds: what a backend may read of texels, and what a target may store of results."""

from __future__ import annotations

import numpy as np

from passgraph.backends.base import quantised
from passgraph.backends.reference.stage import encode_srgb
from passgraph.formats import Format
from passgraph.verify.oracle import interval as iv
from passgraph.verify.oracle.interval import Interval
from passgraph.verify.oracle.interval_functions import increasing

#: Error of encoding in ULP of the sum of the result and :data:`SRGB_OFFSET` (which the last operation subtracts): the
#: power (16), its exponent as float32 (1), the product and its factor (2), the sum (1).
SRGB_ENCODE_ULP, SRGB_OFFSET = 20.0, 0.055
#: Error of reading in ULP of a normalized value: GL leaves the rounding of this quotient open (1), and the reference
#: rounds to nearest (0.5).
UNORM_READ_ULP = 1.5
#: Error of decoding in ULP of the result: the fraction (1.5), the sum (1) and the quotient (2.5) go through a power of
#: 2.4, which loses 16 itself; on the linear part, the fraction and the quotient.
SRGB_DECODE_ULP = 2.4 * (UNORM_READ_ULP + 1.0 + 2.5) + 16.0


def loaded(
    texels: np.ndarray[tuple[int, ...], np.dtype[np.float64]], format_: Format | None, channels: int
) -> Interval:
    """Return what a backend may read where the reference reads these texels (lanes, 4)."""
    exact = Interval.as_read(texels)
    if format_ is None or not format_.steps:
        return exact
    read = as_read(exact)
    if format_.srgb:
        slack = SRGB_DECODE_ULP * iv.ULP * texels
        colour = iv.rounded(texels - slack, texels + slack, exact.nan, 0.5)
        read = iv.where(np.arange(4) < 3, colour, read)
    # A constant 1 and missing channels are not decoded.
    is_exact = (
        (texels == 0)
        | ((np.abs(texels) == 1) & ((np.arange(4) == 3) | (not format_.srgb)))
        | (np.arange(4) >= channels)
    )
    return iv.where(is_exact, exact, read)


def as_read(steps: Interval) -> Interval:
    """Return a format's steps as fractions: a quotient that may round either way, except for 0 and 1."""
    read = iv.rounded(steps.lo, steps.hi, steps.nan, UNORM_READ_ULP)
    lo, hi = (np.where((x == 0) | (np.abs(x) == 1), x, y) for x, y in ((steps.lo, read.lo), (steps.hi, read.hi)))
    return Interval(lo, hi, steps.nan)


def stored(format_: Format, value: Interval) -> Interval:
    """Return what a target may hold for a kernel's result (…, channels)."""
    with np.errstate(all="ignore"):
        if format_.srgb:
            colour = value.map(lambda x: x[..., :3])
            curve = increasing(encode_srgb, colour, SRGB_ENCODE_ULP, SRGB_OFFSET)
            value = Interval(
                np.concatenate([curve.lo, value.lo[..., 3:]], axis=-1),
                np.concatenate([curve.hi, value.hi[..., 3:]], axis=-1),
                value.nan,
            )
        if not format_.steps:
            rounded = value.both(lambda x: quantised(x, format_).astype(np.float64))
            return rounded if format_.unit else iv.flushed(rounded)
        steps = float(format_.steps)
        clamped = value.both(lambda x: np.clip(np.nan_to_num(x, nan=0.0), 0.0, 1.0))
        scaled = iv.mul(clamped, Interval.point(np.full((1,) * clamped.ndim, steps)))
        lo, hi = (np.rint(x) for x in (scaled.lo, scaled.hi))
        lo = np.where(value.nan, 0.0, lo)  # NaN is stored as 0
        return as_read(Interval(lo / steps, hi / steps, np.zeros(lo.shape, np.bool_)))
