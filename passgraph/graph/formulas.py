"""Sizes that are computed from the output's: formulas as plain data, which travel."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import TypeAlias

from passgraph.errors import GraphError

#: A number, "width" or "height" of the output in pixels, or an operation of :data:`OPERATIONS` on formulas.
Formula: TypeAlias = "float | str | tuple[Formula | str, ...]"
#: Formulas in one another.
MAX_DEPTH = 32


def _divided(divide: Callable[[float, float], float]) -> Callable[[float, float], float]:
    def checked(a: float, b: float) -> float:
        if b == 0:
            raise GraphError("the formula of a size divides by zero")
        return divide(a, b)

    return checked


#: Name → number of operands, and meaning; comparisons come to 1 or 0.
OPERATIONS: dict[str, tuple[int, Callable[..., float]]] = {
    "add": (2, lambda a, b: a + b), "sub": (2, lambda a, b: a - b), "mul": (2, lambda a, b: a * b),
    "div": (2, _divided(operator.truediv)), "min": (2, min), "max": (2, max),
    "floor": (1, math.floor), "ceil": (1, math.ceil), "neg": (1, lambda a: -a), "abs": (1, abs),
    "rest": (2, _divided(math.fmod)), "less": (2, lambda a, b: float(a < b)), "equal": (2, lambda a, b: float(a == b)),
}  # fmt: skip


def check_formula(formula: object, where: str, depth: int = 0) -> None:
    """GraphError where it is none."""
    if isinstance(formula, str) and formula in ("width", "height"):
        return
    if isinstance(formula, (int, float)) and not isinstance(formula, bool) and math.isfinite(formula):
        return
    if isinstance(formula, tuple) and formula and isinstance(formula[0], str) and depth < MAX_DEPTH:
        count, _ = OPERATIONS.get(formula[0], (-1, None))
        if len(formula) == count + 1:
            for part in formula[1:]:
                check_formula(part, where, depth + 1)
            return
    raise GraphError(
        f"{where}: the formula of a size is a number, 'width', 'height' or one of {', '.join(OPERATIONS)} with its "
        f"operands in a tuple, at most {MAX_DEPTH} deep"
    )


def evaluated(formula: Formula, size: tuple[int, int]) -> float:
    """What a formula comes to where the output has this size.

    >>> evaluated(("max", ("floor", ("div", "width", 12.0)), 1.0), (100, 50))
    8
    """
    if isinstance(formula, str):
        return size[0] if formula == "width" else size[1]
    if not isinstance(formula, tuple):
        return formula
    _, meaning = OPERATIONS[str(formula[0])]
    return meaning(*(evaluated(part, size) for part in formula[1:]))


def computed_side(formula: Formula, size: tuple[int, int], where: str) -> int:
    """Whole pixels, at least one; the limit of sides is the planner's."""
    value = evaluated(formula, size)
    if not math.isfinite(value) or abs(value) > 2**31:
        raise GraphError(f"{where}: the formula of a size comes to {value:g} pixels")
    return max(1, math.floor(value))
