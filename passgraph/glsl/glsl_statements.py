"""Lower the statements of a function: branches, exits, switches.

``return`` and ``discard`` set a flag. Statements after a branch that may leave are guarded by the flag, or become a
part of the other branch if only that continues. Loops are in :mod:`.loops`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from passgraph.glsl import syntax as g
from passgraph.glsl.loops import emit_loop
from passgraph.glsl.operators import as_int, fitted
from passgraph.glsl.walk import leaves_function
from passgraph.language import ir
from passgraph.language.looping import Section, switch
from passgraph.language.source import Span, fail, place_in
from passgraph.language.types import INT, UINT
from passgraph.language.values import constant

if TYPE_CHECKING:
    from passgraph.glsl.glsl_body import Body


class Statements:
    """Lower the statements of a function into the builder's current block."""

    def __init__(self, body: Body) -> None:
        self.body = body
        self.around: list[g.Loop | g.Switch] = []  # loops and switches that a break may leave, innermost last

    def block(self, nodes: Sequence[g.Statement]) -> bool:
        """Lower statements in a new scope; return True if every path through them leaves the function."""
        self.body.scopes.append({})
        returned = self.run(nodes)
        self.body.scopes.pop()
        return returned

    def run(self, nodes: Sequence[g.Statement]) -> bool:
        """Lower statements in the current scope; return True if every path through them leaves the function."""
        for position, node in enumerate(nodes, 1):
            if isinstance(node, g.If):
                returned, went_on = self._if(node, nodes[position:])
                if returned or went_on:
                    return returned
            elif isinstance(node, g.Return):
                self._return(node)
                return True
            elif isinstance(node, g.Jump):
                return self._jump(node)
            elif self.plain(node):
                return True
            if isinstance(node, (g.If, g.Loop, g.Switch, g.Block)) and leaves_function(node, self.body.unit.leaving):
                if not self.around:
                    return self._guarded(nodes[position:], node.span)
                if isinstance(node, (g.Loop, g.Switch)):
                    # A return has left the inner loop; this one is left as well.
                    self.body.exit.leave_loop_around(node.span)
        return False

    def plain(self, node: g.Statement) -> bool:
        """Lower a statement that is neither a branch nor a jump; return True if every path leaves the function."""
        if isinstance(node, g.Block):
            return self.block(node.statements)
        if isinstance(node, g.Declaration):
            self.body.declare(node)
        elif isinstance(node, g.Struct):
            self.body.declare_struct(node)
        elif isinstance(node, g.Evaluate):
            self.body.expressions.effect(node.value)
        elif isinstance(node, g.Loop):
            emit_loop(self.body, node)
        elif isinstance(node, g.Switch):
            self._switch(node)
        return False

    # Branches

    def _if(self, node: g.If, rest: Sequence[g.Statement]) -> tuple[bool, bool]:
        """Lower a branch; return True if every path leaves the function, and True if it includes ``rest``."""
        unit, span = self.body.unit, node.condition.span
        condition = self.body.expressions.condition(node.condition)
        if isinstance(condition, ir.Literal):
            # Dead code is not lowered, since shaders select between large variants by constants.
            branch = node.then if condition.value else node.orelse
            returned = branch is not None and self.block([branch])
            return returned, returned
        then, then_done = unit.captured(lambda: self.block([node.then]), span)
        takes_rest = then_done and node.orelse is None
        otherwise = [] if node.orelse is None else [node.orelse]

        def other() -> bool:
            # The rest shares this block's scope.
            return self.run(rest) if takes_rest else self.block(otherwise)

        orelse, else_done = unit.captured(other, span)
        self.body.builder.emit(ir.If(condition, then, orelse, span))
        return then_done and else_done, takes_rest

    def _guarded(self, rest: Sequence[g.Statement], span: Span) -> bool:
        """Emit the rest under the condition that the function has not returned."""
        if not rest:
            return False
        returned: list[bool] = []
        self.body.exit.unless_left(lambda: returned.append(self.run(rest)), span)
        return returned[0]

    # Exits

    def _return(self, node: g.Return) -> None:
        body, span = self.body, node.span
        if body.result is None:
            if node.value is not None and body.expressions.evaluate(node.value) is not None:
                fail(span, f"{body.name} is void and returns no value")
        else:
            assert node.value is not None  # the parser's rule
            part = body.expressions.part(node.value)
            what = f"the result of {body.name}"
            part = fitted(part, body.result.type, node.value.span, what)
            body.builder.store(body.result, part, node.value.span, what)
        body.exit.leave(span, in_loop=bool(self.around))

    def _jump(self, node: g.Jump) -> bool:
        span, builder = node.span, self.body.builder
        if node.kind == "discard":
            builder.discard(span)
            self.body.exit.leave(span, in_loop=bool(self.around))
            return True
        builder.emit(ir.Break(span) if node.kind == "break" else ir.Continue(span))
        return False

    # Loops and switches

    def inside(self, node: g.Loop | g.Switch, statements: Sequence[g.Statement]) -> tuple[ir.Stmt, ...]:
        """Lower the statements inside a loop or switch."""
        self.around.append(node)
        block, _ = self.body.unit.captured(lambda: self.run(statements), node.span)
        self.around.pop()
        return block

    def _switch(self, node: g.Switch) -> None:
        span = node.span
        value = self.body.expressions.value(node.value)
        if value.type not in (INT, UINT):
            fail(node.value.span, f"a switch takes an int or a uint, got {value.type}")
        self.body.scopes.append({})
        sections = []
        known: dict[int | None, Span] = {}
        for case in node.cases:
            number = None if case.value is None else self._label(case.value)
            if number in known:
                what = "default" if number is None else f"case {number}"
                fail(case.span, f"this switch has {what} already{place_in(known[number], case.span)}; leave out one")
            known[number] = case.span
            labels = () if number is None else (number,)
            sections.append(Section(labels, self.inside(node, case.statements), case.value is None))
        self.body.scopes.pop()
        switch(self.body.builder, as_int(value, span), sections, span)

    def _label(self, label: g.Expr) -> int:
        number = constant(as_int(self.body.expressions.value(label), label.span))
        if not isinstance(number, ir.Literal) or number.type != INT:
            fail(label.span, "a label must be a whole number that is known here")
        return int(number.value)
