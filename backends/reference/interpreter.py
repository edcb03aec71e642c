"""Interpret the typed representation of a kernel on all lanes at once: the executable definition of the language.

Control flow uses masks.  Both sides of an ``if`` run under their masks; a lane that breaks leaves the mask of its loop,
and one that continues leaves it until the next iteration.  Expressions are pure, so computing them in inactive lanes is
harmless.  When few lanes remain in a loop, a domain may compute them separately (:class:`Part`).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, NoReturn, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import BackendError
from passgraph.language import ir
from passgraph.language.operations import OPERATIONS
from passgraph.language.types import Array, Type, Value, element_of, shape_of

V = TypeVar("V")  # the values of many lanes (pixels, fragments, vertices) at once
M = TypeVar("M")  # a mask of lanes


class Domain(ABC, Generic[V, M]):
    """Primitive evaluation over all lanes at once."""

    @abstractmethod
    def constant(self, type_: Type, numbers: Sequence[ir.Number]) -> V:
        """Return one value for all lanes, from numbers in component order."""

    @abstractmethod
    def trips(self, start: V, stop: V, step: V) -> Iterator[tuple[V, M]]:
        """Yield, for each iteration of ``range(start, stop, step)``, its index and the lanes that have finished.

        The index never wraps; a step of 0 makes no iterations.
        """

    @abstractmethod
    def apply(self, operation: str, arguments: Sequence[V]) -> V:
        """Apply a row of the operations table; scalars are broadcast to vectors."""

    @abstractmethod
    def select(self, condition: V, then: V, orelse: V) -> V:
        """Return ``then`` in the lanes where ``condition`` (a bool) holds, ``orelse`` in the others."""

    @abstractmethod
    def swizzle(self, value: V, components: tuple[int, ...]) -> V:
        """Return some components of a vector; a single one gives a scalar."""

    @abstractmethod
    def construct(self, type_: Value | Array, parts: Sequence[V]) -> V:
        """Concatenate all components of all parts."""

    @abstractmethod
    def index(self, value: V, index: V) -> V:
        """Return an element, column or entry; the index is clamped into range."""

    @abstractmethod
    def insert(self, value: V, index: V, element: V) -> V:
        """Return ``value`` with one element replaced; an index out of range changes nothing."""

    def widened(self, value: V, slack: V) -> V:
        """Return a value widened by the possible error of a device."""
        return value

    # Masks

    @abstractmethod
    def everywhere(self) -> M:
        """Return the mask of all lanes."""

    @abstractmethod
    def nowhere(self) -> M:
        """Return the empty mask."""

    @abstractmethod
    def some(self, mask: M) -> bool:
        """Return True if any lane is (or may be) in the mask."""

    @abstractmethod
    def narrow(self, mask: M, condition: V, holds: bool) -> M:
        """Return the lanes of ``mask`` where ``condition`` is ``holds``."""

    @abstractmethod
    def join(self, one: M, other: M) -> M:
        """Return the union of two masks."""

    @abstractmethod
    def without(self, mask: M, removed: M) -> M:
        """Return the lanes of ``mask`` that are not in ``removed``."""

    @abstractmethod
    def merge(self, mask: M, new: V, old: V) -> V:
        """Return ``new`` in the lanes of the mask, ``old`` in the others."""

    def focus(self, mask: M) -> None:
        """Declare that only these lanes will use later results."""

    def part(self, mask: M) -> Part[V] | None:
        """Continue with the lanes of ``mask`` only, if they are few enough that compacting them pays."""
        return None


class Part(ABC, Generic[V]):
    """A subset of the lanes; the domain computes only these until :meth:`end`."""

    @abstractmethod
    def take(self, value: V) -> V:
        """Return these lanes of a value of all lanes."""

    @abstractmethod
    def put(self, new: V, old: V | None) -> V:
        """Return ``new`` in these lanes, ``old`` in the others; without ``old``, other lanes are undefined."""

    @abstractmethod
    def end(self) -> None:
        """Return to all lanes."""


class Surroundings(ABC, Generic[V]):
    """The inputs of a stage: parameters, builtins, pictures."""

    @abstractmethod
    def uniform(self, expression: ir.Uniform) -> V:
        """Return a parameter, including Const ones."""

    @abstractmethod
    def builtin(self, expression: ir.Builtin) -> V:
        """Return ``pixel``, ``vertex.normal``, ``varying.uv`` …"""

    @abstractmethod
    def texel(self, image: str, x: V, y: V, relative: bool) -> V:
        """Return one texel as vec4 under the image's border rule."""

    @abstractmethod
    def property(self, image: str, name: str) -> ir.Number:
        """Return a property of an image's handle."""

    @abstractmethod
    def size(self, image: str) -> V:
        """Return the width and height as ivec2."""


Numbers: TypeAlias = NDArray[Any]
Lanes: TypeAlias = NDArray[np.bool_]

#: Host dtype of each scalar type.  Int operations that overflow wrap to 32 bits; NumPy wraps uints.
KINDS: dict[str, type[np.generic]] = {"float": np.float64, "int": np.int64, "uint": np.uint32, "bool": np.bool_}


def together(values: Sequence[Numbers]) -> list[Numbers]:
    """Return the same values with one length on axis 0."""
    count = max(len(value) for value in values)
    return [value if len(value) == count else np.broadcast_to(value, (count, *value.shape[1:])) for value in values]


def spread(values: Sequence[Numbers]) -> list[Numbers]:
    """Return the values with a component axis added to scalars if others are vectors."""
    depth = max(value.ndim for value in values)
    return [
        value if value.ndim == depth else value.reshape(value.shape + (1,) * (depth - value.ndim)) for value in values
    ]


def shaped(numbers: Sequence[ir.Number] | Numbers, type_: Type) -> Numbers:
    """Return numbers in component order as one value of a type, for all lanes."""
    return np.asarray(numbers, KINDS[element_of(type_).name]).reshape(1, *shape_of(type_))


class NumberDomain(Domain[Numbers, Lanes]):
    """Each operation is computed by its table row's reference function."""

    def constant(self, type_: Type, numbers: Sequence[ir.Number]) -> Numbers:
        return shaped(numbers, type_)

    def trips(self, start: Numbers, stop: Numbers, step: Numbers) -> Iterator[tuple[Numbers, Lanes]]:
        start, stop, step = together([start, stop, step])
        forward = np.sign(step)
        # The number of steps to reach or pass the end, rounded up.
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

    # Masks are bool arrays, of length 1 if all lanes agree.

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

    def without(self, mask: Lanes, removed: Lanes) -> Lanes:
        return mask & ~removed

    def merge(self, mask: Lanes, new: Numbers, old: Numbers) -> Numbers:
        return new if mask.all() else self.select(mask, new, old)


@dataclass
class _Loop(Generic[M]):
    """The innermost loop: the lanes that have left it."""

    broken: M


@dataclass(frozen=True)
class _Together(Generic[V]):
    """The remaining lanes of a loop, separately: the variables of all lanes, and their values in these lanes."""

    part: Part[V]
    everywhere: dict[str, V]
    taken: dict[str, V]

    def apart(self, values: Mapping[str, V]) -> dict[str, V]:
        """Return to all lanes, with the new values of the variables."""
        self.part.end()
        changed = {name: value for name, value in values.items() if self.taken.get(name) is not value}
        spread = {name: self.part.put(value, self.everywhere.get(name)) for name, value in changed.items()}
        return self.everywhere | spread


class Interpreter(Generic[V, M]):
    """A run of a program in one domain."""

    def __init__(self, program: ir.TypedKernel, domain: Domain[V, M], surroundings: Surroundings[V]) -> None:
        self.program, self.domain, self.surroundings = program, domain, surroundings
        self.locals: dict[str, V] = {}
        self.loops: list[_Loop[M]] = []
        #: Cached constants by expression: loops evaluate them repeatedly.
        self._constants: dict[int, V] = {}

    def run(self) -> tuple[dict[str, V], V | None]:
        """Return results by name, and the mask of kept fragments (None: all)."""
        self.block(self.program.body, self.domain.everywhere())
        self.domain.focus(self.domain.everywhere())
        results = {result.name: self.value(result.value) for result in self.program.results}
        return results, None if self.program.keep is None else self.value(self.program.keep)

    # Statements

    def block(self, statements: tuple[ir.Stmt, ...], active: M) -> M:
        """Run statements in the active lanes; return the lanes that reach the end.

        If no lane left on the way, that is the same mask object.
        """
        focused = False
        for statement in statements:
            if not focused:
                if not self.domain.some(active):
                    return active
                self.domain.focus(active)
            focused = isinstance(statement, ir.Assign)
            if isinstance(statement, ir.Assign):
                self._assign(statement, active)
            elif isinstance(statement, ir.If):
                active = self._if(statement, active)
            elif isinstance(statement, ir.For):
                self._for(statement, active)
            else:
                if isinstance(statement, ir.Break):
                    self.loops[-1].broken = self.domain.join(self.loops[-1].broken, active)
                return self.domain.nowhere()
        return active

    def _assign(self, statement: ir.Assign, active: M) -> None:
        value = self.value(statement.value)
        old = self.locals.get(statement.name)
        self.locals[statement.name] = value if old is None else self.domain.merge(active, value, old)

    def _if(self, statement: ir.If, active: M) -> M:
        condition = self.value(statement.condition)
        then = self.domain.narrow(active, condition, True)
        orelse = self.domain.narrow(active, condition, False)
        after_then, after_else = self.block(statement.then, then), self.block(statement.orelse, orelse)
        if after_then is then and after_else is orelse:
            return active
        return self.domain.join(after_then, after_else)

    def _for(self, statement: ir.For, active: M) -> None:
        start, stop, step = (self.value(bound) for bound in (statement.start, statement.stop, statement.step))
        parts: list[_Together[V]] = []
        for index, over in self.domain.trips(start, stop, step):
            active = self.domain.without(active, over)
            if not self.domain.some(active):
                break
            self._trip(statement, index)
            self.loops.append(_Loop(self.domain.nowhere()))
            self.block(statement.body, active)
            active = self.domain.without(active, self.loops.pop().broken)
            if not self.domain.some(active):
                break
            if (part := self.domain.part(active)) is not None:
                locals_of_part = {name: part.take(value) for name, value in self.locals.items()}
                parts.append(_Together(part, self.locals, locals_of_part))
                self.locals, active = dict(locals_of_part), self.domain.everywhere()
        for together in reversed(parts):
            self.locals = together.apart(self.locals)

    def _trip(self, statement: ir.For, index: V) -> None:
        self.locals[statement.name] = index

    # Expressions

    def value(self, expression: ir.Expr) -> V:
        domain = self.domain
        if isinstance(expression, ir.Apply):
            return domain.apply(expression.operation, [self.value(a) for a in expression.arguments])
        if isinstance(expression, ir.Local):
            return self.locals[expression.name]
        if isinstance(expression, (ir.Literal, ir.Table)):
            return self._constant(expression)
        if isinstance(expression, ir.Swizzle):
            return domain.swizzle(self.value(expression.value), expression.components)
        if isinstance(expression, ir.Construct):
            return domain.construct(expression.type, [self.value(a) for a in expression.arguments])
        if isinstance(expression, ir.Select):
            then, orelse = self.value(expression.then), self.value(expression.orelse)
            return domain.select(self.value(expression.condition), then, orelse)
        if isinstance(expression, ir.Index):
            return domain.index(self.value(expression.value), self.value(expression.index))
        if isinstance(expression, ir.Insert):
            value, index = self.value(expression.value), self.value(expression.index)
            return domain.insert(value, index, self.value(expression.element))
        if isinstance(expression, ir.Filtered):
            return domain.widened(self.value(expression.value), self.value(expression.slack))
        return self._outside(expression)

    def _constant(self, expression: ir.Literal | ir.Table) -> V:
        value = self._constants.get(id(expression))
        if value is None:
            numbers = (expression.value,) if isinstance(expression, ir.Literal) else expression.values
            value = self._constants[id(expression)] = self.domain.constant(expression.type, numbers)
        return value

    def _outside(self, expression: ir.Uniform | ir.Builtin | ir.Texel | ir.Size | ir.Property) -> V:
        if isinstance(expression, ir.Uniform):
            return self.surroundings.uniform(expression)
        if isinstance(expression, ir.Builtin):
            return self.surroundings.builtin(expression)
        if isinstance(expression, ir.Property):
            number = self.surroundings.property(expression.image, expression.name)
            return self.domain.constant(expression.type, (number,))
        if isinstance(expression, ir.Texel):
            x, y = self.value(expression.x), self.value(expression.y)
            return self.surroundings.texel(expression.image, x, y, expression.relative)
        return self.surroundings.size(expression.image)


class StageValues(Surroundings[V]):
    """Inputs of programs that read only stage values."""

    def __init__(self, values: Mapping[str, V]) -> None:
        self.values = values

    def builtin(self, expression: ir.Builtin) -> V:
        return self.values[expression.name]

    def uniform(self, expression: ir.Uniform) -> NoReturn:
        raise BackendError(f"there is no parameter {expression.name} here")

    def texel(self, image: str, x: V, y: V, relative: bool) -> NoReturn:
        raise BackendError(f"there is no image {image} here")

    def property(self, image: str, name: str) -> NoReturn:
        raise BackendError(f"there is no image {image} here")

    def size(self, image: str) -> NoReturn:
        raise BackendError(f"there is no image {image} here")
