"""Border rules as programs: backends print them; hosts evaluate them by the reference function of each operation."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.language import scalar as s
from passgraph.language.border_rules import BORDERS as BORDERS


@cache
def border_program(rule: str) -> s.ScalarProgram:
    """Return a lowered rule: ints ``i`` and ``size`` are builtins, the texel is its only output; no branches.

    >>> for instruction in border_program("repeat").body:
    ...     print(instruction)
    LoadBuiltin(to=%1, name='i')
    LoadBuiltin(to=%2, name='size')
    Op(to=%3, operation='int_mod', on='int', arguments=(%1, %2))
    """
    return _lowered(f"def place(i: int, size: int) -> int: return {BORDERS[rule].place}")


@cache
def period_program(rule: str) -> s.ScalarProgram:
    """Return the lowered period of a rule that has one: the int ``size`` is a builtin, the period the only output."""
    return _lowered(f"def place(size: int) -> int: return {BORDERS[rule].period}")


def _lowered(text: str) -> s.ScalarProgram:
    from passgraph.language.library import functions_of
    from passgraph.language.lower import lower
    from passgraph.language.parse import parse_kernel
    from passgraph.language.source import Source

    return lower(parse_kernel(functions_of(Source("<passgraph borders>", text))["place"], "border"))


def border_place(rule: str, place: NDArray[np.int64] | int, size: int) -> NDArray[np.int64]:
    """Return the texel that a read finds along an axis of ``size`` texels; ``"zero"`` reads 0 where that moves it.

    >>> {rule: border_place(rule, np.arange(-2, 5), 3).tolist() for rule in ("repeat", "mirror", "reflect-101")}
    {'repeat': [1, 2, 0, 1, 2, 0, 1], 'mirror': [1, 0, 0, 1, 2, 2, 1], 'reflect-101': [2, 1, 0, 1, 2, 1, 0]}
    """
    near = nearer(rule, np.asarray(place), size)
    return np.asarray(computed(border_program(rule), {"i": near, "size": np.int64(size)}))


def nearer(rule: str, place: Any, size: int) -> Any:
    """Return an index, or an offset of indices inside, near the picture, at which the rule finds the same texel.

    >>> nearer("clamp", -(2**31), 64), nearer("repeat", 2**31 - 1, 64), nearer("mirror", -(2**31), 5)
    (np.int64(-128), np.int64(127), np.int64(2))
    """
    if BORDERS[rule].period:
        return place % computed(period_program(rule), {"size": np.int64(size)})
    return np.clip(place, -2 * size, 2 * size)


def _by_reference(operation: str, *arguments: Any) -> Any:
    from passgraph.language.operations import OPERATIONS

    return OPERATIONS[operation].reference(*arguments)


def computed(
    program: s.ScalarProgram, inputs: dict[str, Any], apply: Callable[..., Any] = _by_reference,
    number: Callable[[Any], Any] = np.int64,
) -> Any:  # fmt: skip
    """Return the output of a branchless int program; ``apply`` computes an operation, ``number`` makes a literal."""
    values: dict[int, Any] = {}

    def value(operand: s.Operand) -> Any:
        return values[operand.id] if isinstance(operand, s.Val) else number(operand.value)

    for i in program.body:
        if isinstance(i, s.LoadBuiltin):
            values[i.to.id] = inputs[i.name.kind]
        else:
            assert isinstance(i, s.Op)
            values[i.to.id] = apply(i.operation, *map(value, i.arguments))
    return value(program.outputs[0].values[0])
