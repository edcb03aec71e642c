"""Bounds of the device's own functions, from what its specification promises (:mod:`passgraph.language.native`)."""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import TypeAlias

import numpy as np

from passgraph.backends.reference.interpreter import Domain
from passgraph.language.native import Accuracy
from passgraph.language.operations import OPERATIONS
from passgraph.verify.oracle import interval as iv
from passgraph.verify.oracle.decisions import Track
from passgraph.verify.oracle.interval import Bounded, Interval, Lanes, as_interval
from passgraph.verify.oracle.interval_functions import Function, functions_of

#: The domain that evaluates formulas.
Bounds: TypeAlias = Domain[Bounded, Lanes]
_OPERATORS: Mapping[type[ast.AST], str] = {ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul", ast.Div: "div"}


@cache
def _exact_functions() -> dict[str, Function]:
    """Return functions that widen exact results by the rounding to float32 only."""
    rows = {name: replace(row, ulp=0.0, absolute=0.0) for name, row in OPERATIONS.items()}
    rows["inversesqrt"] = replace(rows["inversesqrt"], course="falls")
    return functions_of(rows)


def native_bound(
    domain: Bounds, track: Track, name: str, accuracy: Accuracy, arguments: Sequence[Interval]
) -> Interval:
    """Return the bound of a function that the device computes; where nothing is promised, any number and NaN."""
    arguments = [iv.flushed(a) for a in arguments]
    shape = np.broadcast_shapes(*(a.shape for a in arguments))
    promised = np.broadcast_to(_is_promised(accuracy, arguments), shape)
    if not promised.all():
        track.names[f"{name} of the device"] += int((~promised).sum())
    if not accuracy.promises:
        return Interval.anything(shape)
    allowed = []
    if accuracy.ulp is not None or accuracy.absolute:
        exact = _exact_functions()[name](*arguments)
        allowed.append(_widened(exact, accuracy, arguments[0]))
    if accuracy.formula:
        allowed.append(_inherited(domain, accuracy.formula, arguments))
    bound = allowed[0] if len(allowed) == 1 else iv.hull(*allowed)
    return iv.where(promised, bound, Interval.anything(shape))


def _widened(exact: Interval, accuracy: Accuracy, x: Interval) -> Interval:
    units = (accuracy.ulp or 0.0) + accuracy.ulp_by_size * x.magnitude
    near_one = np.where((x.lo <= 2.0) & (x.hi >= 0.5), accuracy.near_one, 0.0)
    least = np.maximum(accuracy.absolute, near_one)
    lo, hi = (np.nan_to_num(np.maximum(units * iv.spacing(end), least), nan=0.0) for end in (exact.lo, exact.hi))
    return iv.rounded(exact.lo - lo, exact.hi + hi, exact.nan, 0.5)


def _is_promised(accuracy: Accuracy, arguments: Sequence[Interval]) -> Lanes:
    """Return where something is promised: for numbers in the promised range, infinities not among them."""
    x, least = arguments[0], accuracy.least
    promised = (x.lo >= accuracy.low) & (x.hi <= accuracy.high) & accuracy.promises
    for a in arguments:
        promised = promised & np.isfinite(a.magnitude) & ~a.nan & ((a.lo >= least) | (a.hi <= -least) | (least == 0.0))
    if accuracy.ordered:
        promised = promised & (x.hi < arguments[1].lo)
    return np.asarray(promised)


def _inherited(domain: Bounds, formula: str, arguments: Sequence[Interval]) -> Interval:
    """Return the bound of a formula in x, y and z: each of its operations may be as wrong as a device's."""

    def value(node: ast.expr) -> Bounded:
        if isinstance(node, ast.Name):
            return arguments["xyz".index(node.id)]
        if isinstance(node, ast.Constant):
            return Interval.point(np.full(arguments[0].shape, float(str(node.value))))
        if isinstance(node, ast.UnaryOp):
            return domain.apply("neg", [value(node.operand)])
        if isinstance(node, ast.BinOp):
            return domain.apply(_OPERATORS[type(node.op)], [value(node.left), value(node.right)])
        assert isinstance(node, ast.Call)
        assert isinstance(node.func, ast.Name)
        return domain.apply(node.func.id, [value(argument) for argument in node.args])

    return as_interval(value(_parsed(formula)))


@cache
def _parsed(formula: str) -> ast.expr:
    return ast.parse(formula, mode="eval").body
