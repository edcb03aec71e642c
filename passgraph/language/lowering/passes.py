"""Run a list of passes, with the representation checked before, between and after them if wanted."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import TypeAlias

from passgraph.language.lowering.check import check
from passgraph.language.scalar import ScalarProgram

Pass: TypeAlias = Callable[[ScalarProgram], ScalarProgram]

#: Set to check every program before and after each pass: tests do; it takes as long as lowering.
CHECK_VARIABLE = "PASSGRAPH_CHECK_PROGRAMS"


def lowered(program: ScalarProgram, passes: Sequence[Pass]) -> ScalarProgram:
    """Return the program after each of the passes, in order.

    Raises
    ------
    Malformed
        If :data:`CHECK_VARIABLE` is set and a program breaks the rules of :mod:`.check`.
    """
    checks = bool(os.environ.get(CHECK_VARIABLE))
    if checks:
        check(program, "before lowering")
    for change in passes:
        program = change(program)
        if checks:
            check(program, f"after {getattr(change, '__name__', type(change).__name__)}")
    return program
