"""Detect loops over whole pictures: such kernels are compiled for the sizes in the plan."""

from __future__ import annotations

from passgraph.language import ir


def loops_over_sizes(program: ir.TypedKernel) -> bool:
    """Return True if a bound of a loop depends on the size of an image or of the output, also through variables."""
    bounds: list[ir.Expr] = [
        bound
        for loop in ir.walk(program.body)
        if isinstance(loop, ir.For)
        for bound in (loop.start, loop.stop, loop.step)
    ]
    pending: list[ir.Expr] = [bound for bound in bounds if not isinstance(bound, ir.Literal)]
    if not pending:
        return False
    values: dict[str, list[ir.Expr]] = {}
    for assigned in ir.assignments(program.body):
        values.setdefault(assigned.name, []).append(assigned.value)
    while pending:
        for part in ir.expressions(pending.pop()):
            if isinstance(part, ir.Size) or (isinstance(part, ir.Builtin) and part.name == "output_size"):
                return True
            if isinstance(part, ir.Local):
                pending += values.pop(part.name, [])
    return False
