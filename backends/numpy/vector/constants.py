"""Constant vectors, written down once and short: in long kernels most of LLVM's text would be numbers."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

from passgraph.backends.numpy.machine import ir


class Written(ir.Constant):
    """A constant whose text is known; ``numbers`` are those of each lane, where they are told apart."""

    def __init__(self, kind: Any, text: str, numbers: Sequence[Any] = ()) -> None:
        ir.Value.__init__(self, kind, text)
        self.constant = numbers


def same(kind: Any, value: Any) -> Written:
    """A number in every lane."""
    return Written(kind, f"splat ({value})")


def zeros(kind: Any) -> Written:
    return Written(kind, "zeroinitializer")


def blank(kind: Any) -> Written:
    """A vector (or struct) all of whose lanes that matter will be put in."""
    return Written(kind, "poison")


def lanes_of(numbers: Sequence[int], bits: int = 32) -> Written:
    """Whole numbers, lane by lane."""
    return _numbers(tuple(numbers), bits)


@lru_cache(maxsize=512)
def _numbers(numbers: tuple[int, ...], bits: int) -> Written:
    kind = ir.IntType(bits)
    parts = [ir.Constant(kind, number) for number in numbers]
    text = f"<{', '.join(map(str, parts))}>" if any(numbers) else "zeroinitializer"
    return Written(ir.VectorType(kind, len(numbers)), text, parts)
