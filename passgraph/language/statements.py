"""Statements: branches, `match`, loops and exits."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, TypeVar

from passgraph.language import ir, symbols
from passgraph.language.assignments import Variable
from passgraph.language.signature import resolve
from passgraph.language.source import NOWHERE, Span, fail
from passgraph.language.types import BOOL, INT
from passgraph.language.typing_rules import widen
from passgraph.language.values import decided

if TYPE_CHECKING:
    from passgraph.language.function_body import Builder, Frame


Node = TypeVar("Node", bound=ast.AST)

#: Most nested branches from one statement.
MAX_CASES = 100


def always_matches(case: ast.match_case) -> bool:
    """Return True for ``case _``."""
    pattern = case.pattern
    return isinstance(pattern, ast.MatchAs) and pattern.name is None and pattern.pattern is None and case.guard is None


def branches(node: ast.Match, subject: str, span: Callable[[ast.AST], Span]) -> list[ast.stmt]:
    """Rewrite a ``match`` as if statements on a subject named ``subject``.

    Raises
    ------
    KernelError
        For patterns other than integers, their alternatives and ``_``, and for cases after ``_``.
    """
    if len(node.cases) > MAX_CASES:
        fail(span(node.subject), f"this match has {len(node.cases)} cases; at most {MAX_CASES}")
    rest: list[ast.stmt] = []
    for case in reversed(node.cases):
        if always_matches(case):
            if case is not node.cases[-1]:
                fail(span(case.pattern), "case _ matches everything; put it last")
            rest = case.body
            continue
        condition = _condition(case.pattern, subject, span)
        if case.guard is not None:
            condition = _placed(ast.BoolOp(ast.And(), [condition, case.guard]), case.pattern)
        rest = [_placed(ast.If(condition, case.body, rest), case.pattern)]
    return rest


def _condition(pattern: ast.pattern, subject: str, span: Callable[[ast.AST], Span]) -> ast.expr:
    if isinstance(pattern, ast.MatchOr):
        return _placed(ast.BoolOp(ast.Or(), [_condition(part, subject, span) for part in pattern.patterns]), pattern)
    if isinstance(pattern, ast.MatchValue) and _is_whole(pattern.value):
        name = _placed(ast.Name(subject, ast.Load()), pattern)
        return _placed(ast.Compare(name, [ast.Eq()], [pattern.value]), pattern)
    if isinstance(pattern, ast.MatchAs) and pattern.name is not None:
        fail(
            span(pattern),
            f"case {pattern.name}: gives a value a name, as in Python; write if and == to compare with {pattern.name}",
        )
    fail(span(pattern), "a case is a whole number, several with | between them, or _")


def _is_whole(node: ast.expr) -> bool:
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        node = node.operand
    return isinstance(node, ast.Constant) and type(node.value) is int


def _placed(node: Node, where: ast.AST) -> Node:
    return ast.copy_location(node, where)


_REFUSED: dict[type[ast.stmt], str] = {
    ast.FunctionDef: "functions inside functions; mark one outside with @pg.function",
    ast.ClassDef: "classes inside functions", ast.Import: "import", ast.ImportFrom: "import",
    ast.Try: "try", ast.With: "with", ast.Raise: "raise", ast.Assert: "assert", ast.Delete: "del",
    ast.Global: "global", ast.Nonlocal: "nonlocal",
}  # fmt: skip

#: Longer conditions are not repeated in an error.
_SHOWN_CONDITION = 60
#: Deepest nesting of blocks after inlining; drivers' compilers use recursion.
MAX_BLOCKS = 100


class Exit:
    """Tracks in a variable if a function body has returned."""

    def __init__(self, builder: Builder, function: str) -> None:
        self.builder, self.name = builder, builder.fresh(f"{function}.returned")

    def open(self, span: Span) -> None:
        """Declare it at the beginning of the body."""
        self.builder.emit(ir.Assign(self.name, ir.Literal(BOOL, False, span), span))

    def leave(self, span: Span, *, in_loop: bool) -> None:
        """Handle a return, and end the iteration that it is in."""
        self.builder.emit(ir.Assign(self.name, ir.Literal(BOOL, True, span), span))
        if in_loop:
            self.builder.emit(ir.Break(span))

    def leave_loop_around(self, span: Span) -> None:
        """Leave the enclosing loop if a return has left the inner one."""
        self.builder.emit(ir.If(ir.Local(BOOL, self.name, span), (ir.Break(span),), (), span))

    def unless_left(self, emit: Callable[[], None], span: Span) -> None:
        """Emit the rest under the condition that nothing has returned yet."""
        block = self.builder.captured(emit, span)
        still_here = ir.Apply(BOOL, "logical_not", (ir.Local(BOOL, self.name, span),), span)
        self.builder.emit(ir.If(still_here, block, (), span))


class Statements:
    """Parses the statements of one function body into the builder's current block."""

    def __init__(self, frame: Frame) -> None:
        self.frame = frame
        self.loops: list[str] = []  # indices of the enclosing loops, as written
        self._here = NOWHERE  # the branch or loop whose blocks are being parsed

    def span(self, node: ast.AST) -> Span:
        return self.frame.source.span(node)

    def block(self, nodes: Iterable[ast.stmt]) -> bool:
        """Parse statements into the current block; true when every path through them returns."""
        pending = list(nodes)
        for position, node in enumerate(pending, 1):
            if isinstance(node, ast.Match):
                pending[position:position] = self._match(node)
            elif isinstance(node, (ast.If, ast.For)):
                always_leaves = None
                if isinstance(node, ast.If):
                    condition = self._condition(node)
                    if isinstance(condition, ir.Literal):
                        # Code that never runs is not parsed; code that runs is, next in this loop.
                        pending[position:position] = node.body if condition.value else node.orelse
                        continue
                    always_leaves = self._if(node, condition, pending, position)
                else:
                    self._for(node)
                if always_leaves is None and _returns(node):
                    always_leaves = self._guarded(pending, position, node)
                if always_leaves is not None:
                    return always_leaves
            elif isinstance(node, ast.Return):
                self._return(node)
                return True
            elif self._is_discard(node):
                self._discard(node)
                return True
            elif isinstance(node, (ast.Break, ast.Continue)):
                span = self.span(node)
                if not self.loops:
                    fail(span, "break and continue belong inside a for loop")
                self.frame.emit(ir.Break(span) if isinstance(node, ast.Break) else ir.Continue(span))
                return False
            else:
                self._simple(node)
        return False

    def _captured(self, nodes: Iterable[ast.stmt]) -> tuple[tuple[ir.Stmt, ...], bool]:
        """Parse the statements of a block; also return True if every path through them returns."""
        returns: list[bool] = []
        body = self.frame.builder.captured(lambda: returns.append(self.block(nodes)), self._here)
        return body, returns[0]

    def _condition(self, node: ast.If) -> ir.Expr:
        self._here = self.span(node.test)
        return decided(self.frame.expressions.condition(node.test))

    def _if(self, node: ast.If, condition: ir.Expr, pending: list[ast.stmt], position: int) -> bool | None:
        """Parse a branch, and the statements from ``position`` on if the branch affects them.

        Return True if every path through both returns; None: the following statements still need parsing.
        """
        frame, span = self.frame, self.span(node.test)
        then_returns, else_returns = self._always_returns(node.body), self._always_returns(node.orelse)
        # Statements after a branch that returned belong to the other branch only.
        then_nodes = [*node.body, *pending[position:]] if else_returns and not then_returns else node.body
        else_nodes = [*node.orelse, *pending[position:]] if then_returns and not else_returns else node.orelse
        before = set(frame.assigned)
        then, then_done = self._captured(then_nodes)
        after_then, frame.assigned = frame.assigned, before
        orelse, else_done = self._captured(else_nodes)
        # A branch that returned does not affect assignments after it.
        if else_done or _jumps(orelse):
            frame.assigned = after_then
        elif not (then_done or _jumps(then)):
            frame.assigned &= after_then
        frame.emit(ir.If(condition, then, orelse, span))
        return then_done and else_done if then_returns or else_returns else None

    def _guarded(self, pending: list[ast.stmt], position: int, node: ast.stmt) -> bool | None:
        """Emit the statements from ``position`` on, under the condition that nothing has returned yet."""
        frame, span = self.frame, self.span(node)
        self._here = span
        if self.loops:
            # A return has left the inner loop; propagate it to the enclosing one.
            if isinstance(node, ast.For):
                frame.exit.leave_loop_around(span)
            return None
        if position == len(pending):
            return False
        leaves: list[bool] = []
        frame.exit.unless_left(lambda: leaves.append(self.block(pending[position:])), span)
        return leaves[0]

    def _match(self, node: ast.Match) -> list[ast.stmt]:
        """Return the branches equivalent to a match; its subject is computed once."""
        frame, span = self.frame, self.span(node.subject)
        subject = frame.expressions.value(node.subject)
        if subject.type != INT:
            fail(span, f"match takes an int, got {subject.type}; write if and elif")
        # No name in the text has a space.
        name = frame.builder.fresh("match subject")
        frame.parts[name] = frame.name_it(subject, span, keep_locals=False)
        return branches(node, name, self.span)

    # Loops

    def _for(self, node: ast.For) -> None:
        frame, span = self.frame, self.span(node.iter)
        self._here = span
        if node.orelse:
            fail(self.span(node.orelse[0]), "the kernel language has no for ... else")
        if not isinstance(node.target, ast.Name):
            fail(self.span(node.target), "a for loop has one index: for i in range(n)")
        start, stop, step = self._range(node.iter, span)
        name = node.target.id
        if name in self.loops:
            fail(self.span(node.target), f"{name!r} is the index of a loop around; give this one another name")
        index = Variable(INT, frame.builder.fresh(name), loop_index=True)
        outer = frame.variables.pop(name, None)
        if outer is not None and outer.type is not INT:
            fail(self.span(node.target), f"{name!r} is {outer.type} already; give the index another name")
        before = set(frame.assigned)
        frame.variables[name] = index
        frame.assigned.add(name)
        self.loops.append(name)
        body, _ = self._captured(node.body)
        self.loops.pop()
        frame.assigned = before
        del frame.variables[name]
        if outer is not None:
            # The name was an int before the loop and has the last index after it, as in Python.
            frame.variables[name] = outer
            body = (ir.Assign(outer.name, ir.Local(INT, index.name, span), span), *body)
        frame.emit(ir.For(index.name, start, stop, step, body, span))

    def _range(self, node: ast.expr, span: Span) -> tuple[ir.Expr, ir.Expr, ir.Expr]:
        expressions = self.frame.expressions
        is_range = isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "range"
        if not is_range or self.frame.knows("range"):
            fail(span, "a for loop runs over range(...): for i in range(len(values))")
        assert isinstance(node, ast.Call)
        if node.keywords or not 1 <= len(node.args) <= 3:
            fail(span, "range() takes 1 to 3 whole numbers")
        bounds = [widen(expressions.value(a), INT, self.span(a), "a bound of range()") for a in node.args]
        zero, one = ir.Literal(INT, 0, span), ir.Literal(INT, 1, span)
        if len(bounds) == 1:
            return zero, bounds[0], one
        return bounds[0], bounds[1], bounds[2] if len(bounds) == 3 else one

    # Exits

    def _return(self, node: ast.Return) -> None:
        frame, span = self.frame, self.span(node)
        if node.value is None:
            fail(span, f"{frame.function.name} must return {frame.result_type}")
        part = frame.expressions.part(node.value)
        frame.store(frame.result, part, span, f"the result of {frame.function.name}")
        frame.exit.leave(span, in_loop=bool(self.loops))

    def _is_discard(self, node: ast.stmt) -> bool:
        if not (isinstance(node, ast.Expr) and isinstance(node.value, ast.Call)):
            return False
        function = node.value.func
        if not _may_be_discard(function) or self.frame.knows(_first_name(function)):
            return False
        return resolve(function, self.frame.scope, self.frame.source) is symbols.discard

    def _discard(self, node: ast.stmt) -> None:
        frame, span = self.frame, self.span(node)
        assert isinstance(node, ast.Expr)
        assert isinstance(node.value, ast.Call)
        if node.value.args or node.value.keywords:
            fail(span, "discard() takes no arguments; put it below an if")
        if frame.stage not in ("pixel", "fragment"):
            fail(span, f"discard() exists in pixel and fragment kernels, not in a {frame.stage} kernel")
        frame.builder.discard(span)
        frame.exit.leave(span, in_loop=bool(self.loops))

    def _always_returns(self, nodes: list[ast.stmt]) -> bool:
        """Return True if a block returns on every path, judged by its structure."""
        for node in nodes:
            if isinstance(node, ast.Return) or self._is_discard(node):
                return True
            if isinstance(node, ast.If) and all(map(self._always_returns, (node.body, node.orelse))):
                return True
            cases = node.cases if isinstance(node, ast.Match) and always_matches(node.cases[-1]) else []
            if cases and all(self._always_returns(case.body) for case in cases):
                return True
        return False

    # Other statements

    def _simple(self, node: ast.stmt) -> None:
        span = self.span(node)
        if isinstance(node, (ast.Assign, ast.AugAssign, ast.AnnAssign)):
            self.frame.assignments.statement(node, span)
        elif isinstance(node, ast.Pass) or (isinstance(node, ast.Expr) and _is_docstring(node.value)):
            return
        elif isinstance(node, ast.Expr):
            fail(span, "this value is not used; a kernel has no side effects")
        elif isinstance(node, ast.While):
            condition = ast.unparse(node.test)
            shown = condition if len(condition) <= _SHOWN_CONDITION else "..."
            fail(
                span,
                "the kernel language has no while; write a loop with a bound: for i in range(1000): and below it "
                f"if not ({shown}): break",
            )
        else:
            fail(span, f"the kernel language has no {_REFUSED.get(type(node), type(node).__name__)}")


def _is_docstring(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and (isinstance(node.value, str) or node.value is ...)


def _jumps(block: tuple[ir.Stmt, ...]) -> bool:
    return bool(block) and isinstance(block[-1], (ir.Break, ir.Continue))


def _first_name(node: ast.expr) -> str:
    while isinstance(node, ast.Attribute):
        node = node.value
    return node.id if isinstance(node, ast.Name) else ""


def _may_be_discard(function: ast.expr) -> bool:
    return "discard" in (getattr(function, "id", ""), getattr(function, "attr", "")) and bool(_first_name(function))


def _returns(node: ast.stmt) -> bool:
    """Return True if a return (or discard) is inside."""
    for part in ast.walk(node):
        if isinstance(part, ast.Return) or (isinstance(part, ast.Call) and _may_be_discard(part.func)):
            return True
    return False
