"""The one exit of a function body: what returns early sets a flag, and what follows stands under it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from passgraph.language import ir
from passgraph.language.source import Span
from passgraph.language.types import BOOL

if TYPE_CHECKING:
    from passgraph.language.frame import Builder


class Exit:
    """Whether a function body has been left, in a variable."""

    def __init__(self, builder: Builder, function: str) -> None:
        self.builder, self.name = builder, builder.fresh(f"{function}.returned")

    def open(self, span: Span) -> None:
        """At the beginning of the body."""
        self.builder.emit(ir.Assign(self.name, ir.Literal(BOOL, False, span), span))

    def leave(self, span: Span, *, in_loop: bool) -> None:
        """A return, and the end of the trip that it is in."""
        self.builder.emit(ir.Assign(self.name, ir.Literal(BOOL, True, span), span))
        if in_loop:
            self.builder.emit(ir.Break(span))

    def leave_loop_around(self, span: Span) -> None:
        """Behind a loop inside another: a return has left it, and leaves the one around too."""
        self.builder.emit(ir.If(ir.Local(BOOL, self.name, span), (ir.Break(span),), (), span))

    def unless_left(self, emit: Callable[[], None], span: Span) -> None:
        """What follows, where nothing has returned yet."""
        block = self.builder.captured(emit, span)
        still_here = ir.Apply(BOOL, "logical_not", (ir.Local(BOOL, self.name, span),), span)
        self.builder.emit(ir.If(still_here, block, (), span))
