"""Evaluate straight-line instructions for many inputs at once, rounded as backends do."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.language import scalar as s
from passgraph.language.operations import OPERATIONS

_DTYPES = {"float": np.float64, "int": np.int64, "bool": np.bool_}


def computed(body: Sequence[s.Instruction], inputs: Mapping[str, NDArray[Any]], result: s.Operand) -> NDArray[Any]:
    """Return ``result`` for given builtins: operations by their reference, rounded to float32."""
    values: dict[int, NDArray[Any]] = {}

    def value(operand: s.Operand) -> NDArray[Any]:
        if isinstance(operand, s.Val):
            return values[operand.id]
        return np.array([operand.value], _DTYPES[operand.type])

    with np.errstate(all="ignore"):
        for i in body:
            if isinstance(i, s.LoadBuiltin):
                array: NDArray[Any] = inputs[i.name.kind].astype(_DTYPES[i.to.type])
            elif isinstance(i, s.Choose):
                array = np.where(value(i.condition), value(i.then), value(i.orelse))
            else:
                assert isinstance(i, s.Op)
                array = np.asarray(OPERATIONS[i.operation].reference(*map(value, i.arguments)))
            is_float = s.results_of(i)[0].type == "float"
            values[s.results_of(i)[0].id] = array.astype(np.float32).astype(np.float64) if is_float else array
        return value(result)
