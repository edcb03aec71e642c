"""Vectors and matrices over intervals: as :mod:`passgraph.language.expand` takes them apart, some bounded closer."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.reference.interpreter import KINDS
from passgraph.language import expand
from passgraph.language import scalar as s
from passgraph.language.operations import OPERATIONS
from passgraph.language.types import Matrix, Scalar, Type, Vector
from passgraph.verify.oracle import interval as iv
from passgraph.verify.oracle.interval import Bounded, Interval, as_interval, mapped

if TYPE_CHECKING:
    from passgraph.verify.oracle.domain import IntervalDomain


def expanded(domain: IntervalDomain, operation: str, arguments: Sequence[Bounded]) -> Bounded:
    """An operation that has no bound of its own: that of its parts."""
    if operation == "normalize":
        return _normalize(domain, as_interval(arguments[0]))
    if operation == "length":
        return _length(as_interval(arguments[0]))
    if operation == "distance":
        return _length(iv.sub(as_interval(arguments[0]), as_interval(arguments[1])))
    if operation == "inverse":
        return _inverse(domain, as_interval(arguments[0]))
    types = [_type_of(a) for a in arguments]
    taken = {id(a): _components(a) for a in arguments}  # the same components of the same vector: squares
    parts = [taken[id(a)] for a in arguments]
    emitter = _Emitter(domain)
    results = expand.EXPANSIONS[operation](emitter, parts, types)  # type: ignore[arg-type]
    shape = _shape_after(operation, arguments)
    made = [emitter.value(r) for r in results]
    if not isinstance(made[0], Interval):
        bools = np.stack(np.broadcast_arrays(*made), axis=-1)  # type: ignore[arg-type]
        return np.asarray(bools.reshape(len(bools), *shape))
    stacked = _stack([as_interval(m) for m in made])
    return stacked.map(lambda x: x.reshape(len(x), *shape))


# Vectors and columns are brought near 1 by a power of two and back: whichever it is, no rounding changes but where
# something would overflow or vanish.


def _length(v: Interval) -> Interval:
    power = _power_of(v.magnitude.max(axis=1))
    near = [_times(v.map(lambda x, i=i: x[:, i]), power) for i in range(v.shape[1])]  # type: ignore[misc]
    total = iv.square(near[0])
    for part in near[1:]:
        total = iv.add(total, iv.square(part))
    made = _times(iv.sqrt(total), 1.0 / power)
    return iv.rounded(made.lo, made.hi, made.nan, 0.5)


def _inverse(domain: IntervalDomain, m: Interval) -> Interval:
    power = _power_of(m.magnitude.max(axis=2))  # of each column
    near = _times(m, power[:, :, None])
    size = m.shape[1]
    emitter = _Emitter(domain)
    cells = expand.plain_inverse(emitter, expand.columns(_components(near), size))  # type: ignore[arg-type]
    made = _stack([as_interval(emitter.value(cell)) for cell in cells]).map(lambda x: x.reshape(len(x), size, size))
    made = _times(made, power[:, None, :])
    return iv.rounded(made.lo, made.hi, made.nan, 0.5)


def _normalize(domain: IntervalDomain, v: Interval) -> Interval:
    """v / |v| component by component: with s the other components' squares, x / √(x² + s) rises with x."""
    v = _times(v, _power_of(v.magnitude.max(axis=1))[:, None])
    parts = [v.map(lambda x, i=i: x[:, i]) for i in range(v.shape[1])]  # type: ignore[misc]
    squares = [iv.square(p) for p in parts]
    total = squares[0]
    for other in squares[1:]:
        total = iv.add(total, other)
    length = iv.sqrt(total)
    results = []
    for i, p in enumerate(parts):
        rest_lo = np.sum([q.lo for j, q in enumerate(squares) if j != i], axis=0)
        rest_hi = np.sum([q.hi for j, q in enumerate(squares) if j != i], axis=0)
        candidates = [_unit(x, rest) for x in (p.lo, p.hi) for rest in (rest_lo, rest_hi)]
        lo, hi = np.min(candidates, axis=0), np.max(candidates, axis=0)
        # The sum of n squares loses n ULP, its root half of that and 3; each may be two of the quotient's, which
        # loses 2.5 itself.
        results.append(iv.rounded(lo, hi, p.nan | length.nan, 2.0 * (0.5 * len(parts) + 3.0) + 2.5))
    made = _stack(results)
    zero = domain.apply("equal", [length, Interval.point(np.zeros_like(length.lo))])
    assert not isinstance(zero, Interval)
    made = iv.where(zero[:, None], Interval.point(np.zeros_like(made.lo)), made)
    strange = ~np.isfinite(v.magnitude.max(axis=1))[:, None]
    return iv.where(strange, Interval.anything(made.shape), made)


class _Emitter:
    """Stands in for the emitter of scalar code: computes instead."""

    def __init__(self, domain: IntervalDomain) -> None:
        self.domain = domain

    def value(self, operand: Any) -> Bounded:
        return self.domain.constant(Scalar("float"), (operand.value,)) if isinstance(operand, s.Lit) else operand

    def op(self, name: str, *operands: Any) -> Bounded:
        if name == "mul" and operands[0] is operands[1] and isinstance(operands[0], Interval):
            return iv.square(operands[0])
        return self.domain.apply(name, [self.value(o) for o in operands])

    def choose(self, condition: Any, then: Any, orelse: Any) -> Bounded:
        return self.domain.select(condition, self.value(then), self.value(orelse))


def _power_of(size: NDArray[np.float64]) -> NDArray[np.float64]:
    """The power of two that brings a size to [1/2, 1); 1 for 0 and what is not finite."""
    return np.where(np.isfinite(size) & (size > 0), np.ldexp(1.0, -np.frexp(size)[1]), 1.0)


def _times(a: Interval, power: NDArray[np.float64]) -> Interval:
    """Exact: no bound leaves the range of float64."""
    return a.both(lambda end: end * power)


def _unit(x: NDArray[np.float64], rest: NDArray[np.float64]) -> NDArray[np.float64]:
    length = np.sqrt(x * x + rest)
    return np.where(length > 0, x / np.where(length > 0, length, 1.0), 0.0)


def _components(value: Bounded) -> list[Any]:
    """Components in order (columns of a matrix one behind the other), each (lanes,)."""
    flat = mapped(value, lambda x: x.reshape(len(x), -1))
    count = flat.shape[1]
    return [mapped(flat, lambda x, i=i: x[:, i]) for i in range(count)]  # type: ignore[misc]


def _stack(parts: list[Interval]) -> Interval:
    lo, hi, nan = (np.stack(np.broadcast_arrays(*(getattr(p, n) for p in parts)), axis=-1) for n in ("lo", "hi", "nan"))
    return Interval(lo, hi, nan)


def _type_of(value: Bounded) -> Type:
    kind = "float" if isinstance(value, Interval) else {np.dtype(v): k for k, v in KINDS.items()}[value.dtype]
    element = Scalar(kind)
    if value.ndim == 1:
        return element
    return Vector(element, value.shape[1]) if value.ndim == 2 else Matrix(*value.shape[1:])


def _shape_after(operation: str, arguments: Sequence[Bounded]) -> tuple[int, ...]:
    first = arguments[0].shape[1:]
    if OPERATIONS[operation].result in ("f", "b"):
        return ()
    if operation == "outer":
        return (*arguments[1].shape[1:], *first)
    if operation == "matmul":
        last = arguments[1].shape[1:]
        if len(first) == len(last) == 2:
            return (last[0], first[1])
        return first[1:] if len(first) == 2 else last[:1]
    return first[::-1] if operation == "transpose" else first
