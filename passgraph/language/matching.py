"""``match`` on an int, as the branches that it stands for."""

from __future__ import annotations

import ast
from collections.abc import Callable
from typing import TypeVar

from passgraph.language.source import Span, fail

Node = TypeVar("Node", bound=ast.AST)

#: Branches that one statement becomes, one inside the other.
MAX_CASES = 100


def always_matches(case: ast.match_case) -> bool:
    """Whether it is ``case _``."""
    pattern = case.pattern
    return isinstance(pattern, ast.MatchAs) and pattern.name is None and pattern.pattern is None and case.guard is None


def branches(node: ast.Match, subject: str, span: Callable[[ast.AST], Span]) -> list[ast.stmt]:
    """What does the same as a ``match`` whose subject has the name ``subject``.

    Raises
    ------
    KernelError
        For patterns other than whole numbers, their alternatives and ``_``, and for what follows ``_``.
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


def _placed(made: Node, where: ast.AST) -> Node:
    return ast.copy_location(made, where)
