"""What the interpreter computes with: a domain of values and a domain of masks.

The walker in :mod:`.interpreter` never looks inside a value.  Numbers (:mod:`.number_domain`) are one domain;
intervals can be another, with masks that know "surely" and "perhaps", without a change to the walker.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from typing import Generic, TypeVar

from passgraph.language import ir
from passgraph.language.types import Array, Type, Value

V = TypeVar("V")  # the values of many lanes (pixels, fragments, vertices) at once
M = TypeVar("M")  # which lanes are meant


class Domain(ABC, Generic[V, M]):
    """Primitive evaluation over all lanes at once."""

    @abstractmethod
    def constant(self, type_: Type, numbers: Sequence[ir.Number]) -> V:
        """One value for all lanes, from numbers in component order."""

    @abstractmethod
    def trips(self, start: V, stop: V, step: V) -> Iterator[tuple[V, M]]:
        """For each trip of ``range(start, stop, step)`` its index, and the lanes whose trips are over.

        The index never wraps; a step of 0 makes no trip.
        """

    @abstractmethod
    def apply(self, operation: str, arguments: Sequence[V]) -> V:
        """A row of the operations table; scalars beside vectors are spread."""

    @abstractmethod
    def select(self, condition: V, then: V, orelse: V) -> V:
        """``then`` in the lanes where ``condition`` (a bool) holds, ``orelse`` in the others."""

    @abstractmethod
    def swizzle(self, value: V, components: tuple[int, ...]) -> V:
        """Some components of a vector; a single one gives a scalar."""

    @abstractmethod
    def construct(self, type_: Value | Array, parts: Sequence[V]) -> V:
        """All components of all parts in order."""

    @abstractmethod
    def index(self, value: V, index: V) -> V:
        """Element, column or entry; the index is clamped into range."""

    @abstractmethod
    def insert(self, value: V, index: V, element: V) -> V:
        """``value`` with one element replaced; an index out of range changes nothing."""

    def widened(self, value: V, slack: V) -> V:
        """A value from which a device may be so far."""
        return value

    # Masks

    @abstractmethod
    def everywhere(self) -> M:
        """All lanes."""

    @abstractmethod
    def nowhere(self) -> M:
        """No lane."""

    @abstractmethod
    def some(self, mask: M) -> bool:
        """Whether any lane is (perhaps) in the mask."""

    @abstractmethod
    def narrow(self, mask: M, condition: V, holds: bool) -> M:
        """The lanes of ``mask`` where ``condition`` is ``holds``."""

    @abstractmethod
    def join(self, one: M, other: M) -> M:
        """Lanes of either."""

    @abstractmethod
    def without(self, mask: M, gone: M) -> M:
        """Lanes of ``mask`` that are not in ``gone``."""

    @abstractmethod
    def merge(self, mask: M, new: V, old: V) -> V:
        """``new`` in the lanes of the mask, ``old`` in the others."""

    def focus(self, mask: M) -> None:
        """Only these lanes will use what is computed from here on."""

    def part(self, mask: M) -> Part[V] | None:
        """Go on with the lanes of ``mask`` alone, where they are so few that moving them together is worth it."""
        return None


class Part(ABC, Generic[V]):
    """Some of the lanes, and a domain that knows of no others until :meth:`end`."""

    @abstractmethod
    def take(self, value: V) -> V:
        """A value of all lanes in these lanes."""

    @abstractmethod
    def put(self, new: V, old: V | None) -> V:
        """``new`` in these lanes, ``old`` in the others; without one, what no other lane reads."""

    @abstractmethod
    def end(self) -> None:
        """Go on with all lanes."""


class Surroundings(ABC, Generic[V]):
    """What a stage reads from outside: parameters, stage values, pictures."""

    @abstractmethod
    def uniform(self, expression: ir.Uniform) -> V:
        """A parameter, Const ones too."""

    @abstractmethod
    def builtin(self, expression: ir.Builtin) -> V:
        """``pixel``, ``vertex.normal``, ``varying.uv`` …"""

    @abstractmethod
    def texel(self, image: str, x: V, y: V, relative: bool) -> V:
        """One texel as vec4 under the image's border rule."""

    @abstractmethod
    def property(self, image: str, name: str) -> ir.Number:
        """What the graph's handle says of an image."""

    @abstractmethod
    def size(self, image: str) -> V:
        """Width and height as ivec2."""
