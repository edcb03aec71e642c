"""Numbers: float64, int64, uint32 and bool arrays with the lanes on axis 0 and components behind.

A value that is the same in every lane has length 1 on axis 0, so what does not vary is computed once.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.reference.domain import Domain
from passgraph.language import ir
from passgraph.language.operations import OPERATIONS
from passgraph.language.types import Array, Type, Value, element_of, shape_of

Numbers: TypeAlias = NDArray[Any]
Lanes: TypeAlias = NDArray[np.bool_]

#: How each scalar type is held.  Ints are wrapped to 32 bits by the operations that can leave them, uints by NumPy.
KINDS: dict[str, type[np.generic]] = {"float": np.float64, "int": np.int64, "uint": np.uint32, "bool": np.bool_}


def together(values: Sequence[Numbers]) -> list[Numbers]:
    """The same values with one length on axis 0."""
    count = max(len(value) for value in values)
    return [value if len(value) == count else np.broadcast_to(value, (count, *value.shape[1:])) for value in values]


def spread(values: Sequence[Numbers]) -> list[Numbers]:
    """Scalars with an axis for components where others are vectors."""
    depth = max(value.ndim for value in values)
    return [
        value if value.ndim == depth else value.reshape(value.shape + (1,) * (depth - value.ndim)) for value in values
    ]


def shaped(numbers: Sequence[ir.Number] | Numbers, type_: Type) -> Numbers:
    """Numbers in component order as one value of a type, for all lanes."""
    return np.asarray(numbers, KINDS[element_of(type_).name]).reshape(1, *shape_of(type_))


class NumberDomain(Domain[Numbers, Lanes]):
    """Each operation is its table row's reference meaning."""

    def constant(self, type_: Type, numbers: Sequence[ir.Number]) -> Numbers:
        return shaped(numbers, type_)

    def trips(self, start: Numbers, stop: Numbers, step: Numbers) -> Iterator[tuple[Numbers, Lanes]]:
        start, stop, step = together([start, stop, step])
        forward = np.sign(step)
        # As many steps as reach or pass the end, rounded up.
        counts = -((forward * (start - stop)) // np.maximum(abs(step), 1))
        counts[step == 0] = 0
        for trip in range(max(0, int(counts.max()))):
            over = trip >= counts
            yield np.where(over, start, start + trip * step), over

    def apply(self, operation: str, arguments: Sequence[Numbers]) -> Numbers:
        row = OPERATIONS[operation]
        arguments = together(arguments) if row.kind == "expanded" else spread(arguments)
        return np.asarray(row.reference(*arguments))

    def select(self, condition: Numbers, then: Numbers, orelse: Numbers) -> Numbers:
        if len(condition) == 1:
            return then if condition[0] else orelse
        condition = condition.reshape(condition.shape + (1,) * (then.ndim - 1))
        return np.where(condition, then, orelse)

    def swizzle(self, value: Numbers, components: tuple[int, ...]) -> Numbers:
        picked: Numbers = value[:, components[0]] if len(components) == 1 else value[:, list(components)]
        return picked

    def construct(self, type_: Value | Array, parts: Sequence[Numbers]) -> Numbers:
        flat = np.concatenate([part.reshape(len(part), -1) for part in together(parts)], axis=1)
        return flat.astype(KINDS[element_of(type_).name], copy=False).reshape(len(flat), *shape_of(type_))

    def index(self, value: Numbers, index: Numbers) -> Numbers:
        clamped = np.clip(index, 0, value.shape[1] - 1)
        if len(clamped) == 1:
            column: Numbers = value[:, clamped[0]]
            return column
        value, clamped = together([value, clamped])
        entry: Numbers = value[np.arange(len(value)), clamped]
        return entry

    def insert(self, value: Numbers, index: Numbers, element: Numbers) -> Numbers:
        old, index, element = together([value, index, element])
        changed = old.copy()
        lanes = np.flatnonzero((index >= 0) & (index < value.shape[1]))
        changed[lanes, index[lanes]] = element[lanes]
        return changed

    # Masks are bool arrays, of length 1 where all lanes agree.

    def everywhere(self) -> Lanes:
        return np.ones(1, np.bool_)

    def nowhere(self) -> Lanes:
        return np.zeros(1, np.bool_)

    def some(self, mask: Lanes) -> bool:
        return bool(mask.any())

    def narrow(self, mask: Lanes, condition: Numbers, holds: bool) -> Lanes:
        return mask & (condition if holds else ~condition)

    def join(self, one: Lanes, other: Lanes) -> Lanes:
        return one | other

    def without(self, mask: Lanes, gone: Lanes) -> Lanes:
        return mask & ~gone

    def merge(self, mask: Lanes, new: Numbers, old: Numbers) -> Numbers:
        return new if mask.all() else self.select(mask, new, old)
