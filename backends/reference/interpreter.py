"""Walks the typed representation of a kernel, all lanes at once: the living definition of the language.

Control flow is masks.  Both sides of an ``if`` run under theirs; a lane that breaks leaves the mask of its
loop, one that continues leaves it until the next trip.  Expressions are pure, so computing them in lanes that
are not active does no harm.  Where few lanes still go round, a domain may have them computed alone (:class:`Part`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Generic, NoReturn

from passgraph.backends.reference.domain import Domain, M, Part, Surroundings, V
from passgraph.errors import BackendError
from passgraph.language import ir


@dataclass
class _Loop(Generic[M]):
    """The innermost loop: lanes that have left it."""

    broken: M


@dataclass(frozen=True)
class _Together(Generic[V]):
    """Lanes that still go round, by themselves: the variables of all lanes, and what was taken of them."""

    part: Part[V]
    everywhere: dict[str, V]
    taken: dict[str, V]

    def apart(self, values: Mapping[str, V]) -> dict[str, V]:
        """Back to all lanes, with what the variables have become."""
        self.part.end()
        changed = {name: value for name, value in values.items() if self.taken.get(name) is not value}
        put = {name: self.part.put(value, self.everywhere.get(name)) for name, value in changed.items()}
        return self.everywhere | put


class Interpreter(Generic[V, M]):
    """One run of a program in one domain."""

    def __init__(self, program: ir.TypedKernel, domain: Domain[V, M], surroundings: Surroundings[V]) -> None:
        self.program, self.domain, self.surroundings = program, domain, surroundings
        self.locals: dict[str, V] = {}
        self.loops: list[_Loop[M]] = []
        #: By which expression they are: loops come back to the same ones.
        self._constants: dict[int, V] = {}

    def run(self) -> tuple[dict[str, V], V | None]:
        """Results by name, and where fragments are kept (None: everywhere)."""
        self.block(self.program.body, self.domain.everywhere())
        self.domain.focus(self.domain.everywhere())
        results = {result.name: self.value(result.value) for result in self.program.results}
        return results, None if self.program.keep is None else self.value(self.program.keep)

    # Statements

    def block(self, statements: tuple[ir.Stmt, ...], active: M) -> M:
        """Run statements in the active lanes; gives the lanes that reach the end.

        When none left on the way, that is the very mask that came in.
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
                taken = {name: part.take(value) for name, value in self.locals.items()}
                parts.append(_Together(part, self.locals, taken))
                self.locals, active = dict(taken), self.domain.everywhere()
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
        found = self._constants.get(id(expression))
        if found is None:
            numbers = (expression.value,) if isinstance(expression, ir.Literal) else expression.values
            found = self._constants[id(expression)] = self.domain.constant(expression.type, numbers)
        return found

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
    """Around programs that read stage values and nothing else."""

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
