"""The reference column: the same expressions with NumPy, on the processor."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from passgraph.verify.probes.probe import Language


class ProcessorBench:
    """NumPy's float32 and int32."""

    language: Language = "numpy"

    def evaluate(self, function: Callable[..., Any], rows: Sequence[Sequence[float | int]]) -> Any:
        """Return the results of a function of the columns; whole columns of ints stay ints."""
        columns = [np.array([row[k] for row in rows]) for k in range(len(rows[0]))]
        floats = [column if column.dtype.kind == "i" else column.astype(np.float32) for column in columns]
        with np.errstate(all="ignore"):
            return function(*floats)
