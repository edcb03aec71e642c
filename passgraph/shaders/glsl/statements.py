"""Statements of one function: branches, exits, switches.

``return`` and ``discard`` set a flag; what follows a branch that may leave is put under the flag, or into the other
branch where it belongs there alone.  Loops are :mod:`.loops`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from passgraph.language import ir
from passgraph.language.source import Span, fail
from passgraph.language.types import BOOL, INT, UINT
from passgraph.language.typing_rules import apply
from passgraph.shaders.glsl import syntax as g
from passgraph.shaders.glsl.folding import constant
from passgraph.shaders.glsl.loops import emit_loop
from passgraph.shaders.glsl.operators import arithmetic
from passgraph.shaders.glsl.typing import fitted
from passgraph.shaders.glsl.walk import leaves_function

if TYPE_CHECKING:
    from passgraph.shaders.glsl.body import Body


@dataclass
class Around:
    """A loop, or a switch, around what is being read.  ``skips`` names the flag of a switch that holds ``continue``."""

    loop: g.Loop | None
    skips: str = ""


class Statements:
    """Reads the statements of one function into the builder's current block."""

    def __init__(self, body: Body) -> None:
        self.body = body
        self.around: list[Around] = []

    def block(self, nodes: Sequence[g.Statement]) -> bool:
        """Statements with names of their own; true when every path through them leaves the function."""
        self.body.scopes.append({})
        done = self.run(nodes)
        self.body.scopes.pop()
        return done

    def run(self, nodes: Sequence[g.Statement]) -> bool:
        """Statements among the names that are there; true when every path through them leaves the function."""
        for position, node in enumerate(nodes, 1):
            if isinstance(node, g.If):
                done, went_on = self._if(node, nodes[position:])
                if done or went_on:
                    return done
            elif isinstance(node, g.Return):
                self._return(node)
                return True
            elif isinstance(node, g.Jump):
                return self._jump(node)
            elif self._other(node):
                return True
            if isinstance(node, (g.If, g.Loop, g.Switch, g.Block)) and leaves_function(node):
                if not self.around:
                    return self._guarded(nodes[position:], node.span)
                if isinstance(node, (g.Loop, g.Switch)):
                    # A return has left the inner loop; this one is left as well.
                    returned = ir.Local(BOOL, self.body.returned, node.span)
                    self.body.builder.emit(ir.If(returned, (ir.Break(node.span),), (), node.span))
        return False

    def _other(self, node: g.Statement) -> bool:
        """A statement that is neither a branch nor a jump; true when every path through it leaves the function."""
        if isinstance(node, g.Block):
            return self.block(node.statements)
        if isinstance(node, g.Declaration):
            self.body.declare(node)
        elif isinstance(node, g.Struct):
            self.body.declare_struct(node)
        elif isinstance(node, g.Evaluate):
            self.body.expressions.evaluate(node.value)
        elif isinstance(node, g.Loop):
            emit_loop(self.body, node)
        elif isinstance(node, g.Switch):
            self._switch(node)
        return False

    # Branches

    def _if(self, node: g.If, rest: Sequence[g.Statement]) -> tuple[bool, bool]:
        """A branch: whether every path leaves the function, and whether ``rest`` has become part of it."""
        unit, span = self.body.unit, node.condition.span
        condition = self.body.expressions.condition(node.condition)
        with unit.captured(span) as then:
            then_done = self.block([node.then])
        takes_rest = then_done and node.orelse is None
        with unit.captured(span) as orelse:
            # The rest goes on with the names of this block.
            otherwise = [] if node.orelse is None else [node.orelse]
            else_done = self.run(rest) if takes_rest else self.block(otherwise)
        self.body.builder.emit(ir.If(condition, tuple(then), tuple(orelse), span))
        return then_done and else_done, takes_rest

    def _guarded(self, rest: Sequence[g.Statement], span: Span) -> bool:
        """What follows, under the condition that nothing has left the function yet."""
        if not rest:
            return False
        with self.body.unit.captured(span) as block:
            done = self.run(rest)
        here = apply("logical_not", [ir.Local(BOOL, self.body.returned, span)], span)
        self.body.builder.emit(ir.If(here, tuple(block), (), span))
        return done

    # Exits

    def _return(self, node: g.Return) -> None:
        body, span = self.body, node.span
        if body.result is None:
            if node.value is not None and body.expressions.evaluate(node.value) is not None:
                fail(span, f"{body.name} is void and returns no value")
        elif node.value is None:
            fail(span, f"{body.name} must return {body.result_type}")
        else:
            part = body.expressions.part(node.value)
            what = f"the result of {body.name}"
            part = fitted(part, body.result.type, node.value.span, what)
            body.builder.store(body.result, part, node.value.span, what)
        self._leave(span)

    def _leave(self, span: Span) -> None:
        self.body.builder.emit(ir.Assign(self.body.returned, ir.Literal(BOOL, True, span), span))
        if self.around:
            self.body.builder.emit(ir.Break(span))

    def _jump(self, node: g.Jump) -> bool:
        span = node.span
        if node.kind == "discard":
            self.body.unit.discard(span)
            self._leave(span)
            return True
        if not self.around or (node.kind == "continue" and all(a.loop is None for a in self.around)):
            fail(span, f"{node.kind} belongs inside a loop")
        if node.kind == "break":
            self.body.builder.emit(ir.Break(span))
        else:
            self.go_on(span)
        return False

    def go_on(self, span: Span) -> None:
        """``continue``: the loop's update comes first; a switch is left, and goes on behind itself."""
        around, builder = self.around[-1], self.body.builder
        if around.loop is None:
            around.skips = around.skips or builder.fresh("continued")
            builder.emit(ir.Assign(around.skips, ir.Literal(BOOL, True, span), span))
            builder.emit(ir.Break(span))
            return
        self.end_trip(around.loop)
        builder.emit(ir.Continue(span))

    def end_trip(self, loop: g.Loop) -> None:
        """What a loop does behind its body."""
        if loop.update is not None:
            self.body.expressions.evaluate(loop.update)
        if loop.late and loop.condition is not None:
            self.check(loop.condition)

    def check(self, condition: g.Expr) -> None:
        """Leaves the loop where its condition does not hold."""
        span = condition.span
        fails = apply("logical_not", [self.body.expressions.condition(condition)], span)
        self.body.builder.emit(ir.If(fails, (ir.Break(span),), (), span))

    def start(self, node: g.Statement) -> None:
        """What stands first in the parentheses of a ``for``."""
        self._other(node)

    def trip(self, loop: g.Loop) -> None:
        """One trip of a loop."""
        self.around.append(Around(loop))
        self.block([loop.body])
        self.around.pop()
        self.end_trip(loop)

    # Switches

    def _switch(self, node: g.Switch) -> None:
        """One trip of a loop, so that ``break`` leaves it: each group runs where its label fits or the one before fell
        through."""
        unit, builder, span = self.body.unit, self.body.builder, node.span
        value = builder.name_it(self.body.expressions.value(node.value), span, keep_locals=False)
        if value.type not in (INT, UINT):
            fail(node.value.span, f"a switch takes an int or a uint, got {value.type}")
        fits = [None if case.value is None else self._label(value, case.value) for case in node.cases]
        runs = ir.Local(BOOL, builder.fresh("runs"), span)
        around = Around(None)
        self.around.append(around)
        self.body.scopes.append({})
        with unit.captured(span) as block:
            builder.emit(ir.Assign(runs.name, ir.Literal(BOOL, False, span), span))
            for case, fit in zip(node.cases, fits, strict=True):
                begins = self._otherwise(fits, span) if fit is None else fit
                builder.emit(ir.Assign(runs.name, apply("logical_or", [runs, begins], case.span), case.span))
                with unit.captured(case.span) as group:
                    self.run(case.statements)
                builder.emit(ir.If(runs, tuple(group), (), case.span))
        self.body.scopes.pop()
        self.around.pop()
        if around.skips:
            builder.emit(ir.Assign(around.skips, ir.Literal(BOOL, False, span), span))
        zero, one = (ir.Literal(INT, i, span) for i in (0, 1))
        builder.emit(ir.For(builder.fresh("switch"), zero, one, one, tuple(block), span))
        if around.skips:
            with unit.captured(span) as on:
                self.go_on(span)
            builder.emit(ir.If(ir.Local(BOOL, around.skips, span), tuple(on), (), span))

    def _label(self, value: ir.Expr, label: g.Expr) -> ir.Expr:
        number = constant(self.body.expressions.value(label))
        if not isinstance(number, ir.Literal) or number.type not in (INT, UINT):
            fail(label.span, "a label must be a whole number that is known here")
        return arithmetic("==", value, number, label.span, self.body.builder.name_it)

    def _otherwise(self, fits: Sequence[ir.Expr | None], span: Span) -> ir.Expr:
        """That no label fits, for ``default``."""
        result: ir.Expr = ir.Literal(BOOL, True, span)
        for fit in fits:
            if fit is not None:
                result = apply("logical_and", [result, apply("logical_not", [fit], span)], span)
        return result
