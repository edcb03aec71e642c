"""Functions of the prelude taken apart once: what each of their calls then needs is to be repeated on other values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from passgraph.language import scalar as s
from passgraph.language.emitter import Emitter


@dataclass(frozen=True)
class Steps:
    """A function's operations in order, of values 1, 2 … that it is given."""

    body: tuple[s.Op | s.Choose, ...]
    result: s.Operand

    def repeated(self, e: Emitter, arguments: Sequence[s.Operand]) -> s.Operand:
        """The same on other values; folded and shared as if it had been taken apart there."""
        found: dict[int, s.Operand] = dict(enumerate(arguments, 1))

        def of(x: s.Operand) -> s.Operand:
            return found[x.id] if isinstance(x, s.Val) else x

        for i in self.body:
            e.step()  # what is folded or shared takes its time too
            if isinstance(i, s.Op):
                found[i.to.id] = e.op(i.operation, *[of(x) for x in i.arguments], span=i.span)
            else:
                found[i.to.id] = e.choose(of(i.condition), of(i.then), of(i.orelse))
        return of(self.result)
