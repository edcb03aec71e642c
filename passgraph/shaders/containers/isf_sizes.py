"""Sizes of ISF passes: ``$WIDTH / 4``, ``max(floor($HEIGHT * 0.02), 1.0)``, with parameters as ``$name``."""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping
from typing import Any

from passgraph.errors import InputError
from passgraph.graph.formulas import MAX_DEPTH, Formula

#: Characters of a formula.
MAX_LENGTH = 500
_SIDES = {"WIDTH": "width", "HEIGHT": "height"}
_SIGNS: dict[type[ast.operator], str] = {ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul", ast.Div: "div"}
_FUNCTIONS = {"floor": 1, "ceil": 1, "abs": 1, "min": 2, "max": 2}


def size_formula(text: str, values: Mapping[str, Any], where: str) -> Formula:
    """The formula that a text is, with what parameters are now; the text is parsed and never executed.

    >>> size_formula("max(floor($WIDTH*0.25),$least)", {"least": 2.0}, "WIDTH")
    ('max', ('floor', ('mul', 'width', 0.25)), 2.0)
    """
    plain = re.sub(r"\$(\w+)", r"pg_\1", text)
    if len(text) > MAX_LENGTH:
        raise InputError(f"{where}: a size has at most {MAX_LENGTH} characters, got {len(text)}")
    try:
        tree = ast.parse(plain.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise InputError(f"{where}: {text!r} is no formula of $WIDTH and $HEIGHT") from None
    return _formula(tree, values, text, where, 0)


def _formula(node: ast.expr, values: Mapping[str, Any], text: str, where: str, depth: int) -> Formula:
    if depth >= MAX_DEPTH:
        raise InputError(f"{where}: {text!r} nests deeper than {MAX_DEPTH}")

    def part(inner: ast.expr) -> Formula:
        return _formula(inner, values, text, where, depth + 1)

    if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)) and not isinstance(node.value, bool):
        return float(node.value)
    if isinstance(node, ast.Name) and node.id.startswith("pg_"):
        return _named(node.id.removeprefix("pg_"), values, text, where)
    if isinstance(node, ast.BinOp) and type(node.op) in _SIGNS:
        return _SIGNS[type(node.op)], part(node.left), part(node.right)
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.USub, ast.UAdd)):
        return ("neg", part(node.operand)) if isinstance(node.op, ast.USub) else part(node.operand)
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
        name = node.func.id
        if _FUNCTIONS.get(name) == len(node.args):
            return name, *(part(argument) for argument in node.args)
    raise InputError(
        f"{where}: {text!r} has {ast.unparse(node)!r}; a size has numbers, $WIDTH, $HEIGHT, $parameters, + - * / and "
        f"{', '.join(_FUNCTIONS)}"
    )


def _named(name: str, values: Mapping[str, Any], text: str, where: str) -> Formula:
    if name in _SIDES:
        return _SIDES[name]
    if name not in values:
        raise InputError(f"{where}: {text!r} has ${name}, which is no parameter; there are $WIDTH and $HEIGHT")
    return float(values[name])
