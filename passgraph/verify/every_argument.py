"""Measure a function of one number over all 2³² float32 arguments: :func:`measure_every`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import Backend
from passgraph.errors import InputError
from passgraph.language.native import Accuracy, Math
from passgraph.language.operations import OPERATIONS, Operation
from passgraph.verify.function_errors import SMALLEST_NORMAL, measurable, program_of, promised_by, ulp_errors
from passgraph.verify.oracle.decisions import Track
from passgraph.verify.oracle.domain import IntervalDomain
from passgraph.verify.oracle.interval import Interval, as_interval

#: Functions of one number that round: others are exact, or choose between numbers.
OF_ONE_NUMBER: tuple[str, ...] = tuple(
    name for name, row in OPERATIONS.items() if len(row.operands) == 1 and row.of_numbers and row.ulp > 0
)
ARGUMENTS = 1 << 32
#: A chunk of arguments is a square picture of this side, in pixels.
SIDE = 1024
#: Consecutive chunks are this far apart, so that an interrupted measurement has seen numbers of all sizes.
_STRIDE = 1597
#: Results are judged in blocks of this many, whose float64 arrays stay in the cache.
_BLOCK = 1 << 15


@dataclass(frozen=True)
class EveryError:
    """Errors of a function's float32 results over the arguments that have been measured.

    Attributes
    ----------
    count : number of arguments measured, of 2³²
    worst, worst_at : largest error in units in the last place of the exact result, and its argument, within the
        function's domain.  Denormal arguments are left out, as they may count as 0
    outside, outside_at : number of results outside of the oracle's bounds, and one argument of such a result; None
        if there is none
    promised : what the language promises, or for native math the device's specification
    """

    name: str
    math: Math
    promised: str
    count: int = 0
    worst: float = 0.0
    worst_at: float = 0.0
    outside: int = 0
    outside_at: float | None = None

    def __str__(self) -> str:
        """Return one line: the errors, what is promised, and how many of all arguments were measured."""
        part = "" if self.count == ARGUMENTS else f" in {self.count / ARGUMENTS:.1%} of all arguments"
        bounds = "" if self.outside_at is None else f"; {self.outside:,} outside of bounds, as at {self.outside_at!r}"
        return (
            f"{self.name}: at most {self.worst:.3f} ULP{part}, at {self.worst_at!r}; promised: {self.promised}{bounds}"
        )


def measure_every(backend: Backend, name: str, math: Math = "exact", side: int = SIDE) -> Iterator[EveryError]:
    """Measure a function over all float32 arguments on an open backend; yield what is found after each chunk.

    Exact results are NumPy's float64.  Results that are not within the promised number of units are held to the
    oracle's bounds, which know about denormals, infinities, NaN and domains.

    Parameters
    ----------
    name
        One of :data:`OF_ONE_NUMBER`; for native math one that the device computes itself, or by contracted products.
    side
        A chunk has ``side`` squared arguments: a power of two.

    Examples
    --------
    >>> from itertools import islice
    >>> from passgraph.backends.registry import open_backend
    >>> with open_backend("numpy") as backend:
    ...     *_, found = islice(measure_every(backend, "exp", side=64), 20)
    >>> found.count, found.worst < 3, found.outside
    (81920, True, 0)
    """
    native = backend.limits.native if math == "native" else {}
    if name not in (known := measurable(backend, math, OF_ONE_NUMBER)):
        have = f"those are {', '.join(known)}" if known else "it has none"
        raise InputError(f"{backend.name} measures no function {name!r} of one number in {math} math; {have}")
    row, chunk = OPERATIONS[name], side * side
    found = EveryError(name, math, promised_by(row, math, backend))
    with program_of(backend, row, math, "r32f") as program:
        for number in range(ARGUMENTS // chunk):
            first = number * _STRIDE % (ARGUMENTS // chunk) * chunk
            x = np.arange(first, first + chunk, dtype=np.uint32).view(np.float32)
            results = np.asarray(program(samples=x.reshape(side, side, 1))["measured"], np.float32).reshape(-1)
            for begin in range(0, chunk, _BLOCK):
                block = slice(begin, begin + _BLOCK)
                found = _with_block(found, row, native.get(name), x[block], results[block])
            yield found


def _with_block(
    found: EveryError, row: Operation, accuracy: Accuracy | None, x: NDArray[np.float32], results: NDArray[np.float32]
) -> EveryError:
    """Return what is found with the results of some more arguments."""
    with np.errstate(all="ignore"):
        numbers = x.astype(np.float64)
        errors = ulp_errors(results, row.reference(numbers))
        outside = _outside(row, accuracy, x, results, errors)
        low, high = row.domain_of(0).promised if accuracy is None else (accuracy.low, accuracy.high)
        counts = (numbers >= low) & (numbers <= high) & ((np.abs(numbers) >= SMALLEST_NORMAL) | (numbers == 0.0))
        errors = np.where(counts, errors, 0.0)
    at = int(np.argmax(errors))
    if errors[at] > found.worst:
        found = replace(found, worst=float(errors[at]), worst_at=float(x[at]))
    if len(outside) and found.outside_at is None:
        found = replace(found, outside_at=float(x[outside[0]]))
    return replace(found, count=found.count + len(x), outside=found.outside + len(outside))


def _outside(
    row: Operation, accuracy: Accuracy | None, x: NDArray[np.float32], results: NDArray[np.float32],
    errors: NDArray[np.float64],
) -> NDArray[np.intp]:  # fmt: skip
    """Return the indices of results outside of the oracle's bounds; asking it only of those that are not near enough
    takes a third of the time."""
    if accuracy is not None and not accuracy.promises:
        return np.zeros(0, np.intp)
    (unsure,) = np.nonzero(~(errors <= (row.ulp if accuracy is None else accuracy.ulp or 0.0)))
    if not len(unsure):
        return unsure
    track = Track(np.empty((len(unsure), 0), np.int8), np.arange(len(unsure)))
    domain = IntervalDomain(track, {} if accuracy is None else {row.name: accuracy})
    bound = as_interval(domain.apply(row.name, [Interval.as_read(x[unsure])]))
    return unsure[bound.without(results[unsure])]
