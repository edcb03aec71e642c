"""The operations table as documentation: what docs/kernels.md shows, generated so that it cannot be wrong."""

from __future__ import annotations

import math

from passgraph.language.operations import OF_TERMS, OPERATIONS, Operation

_HEADINGS = {"primitive": "Primitives", "prelude": "Functions of numbers", "expanded": "Vectors and matrices"}
#: How kernels write the rows that are not called by their own name.
_WRITTEN = {
    "add": "a + b", "sub": "a - b", "mul": "a * b", "div": "a / b", "neg": "-a", "floor_divide": "a // b",
    "float_floor_divide": "a // b", "int_mod": "a % b", "mod": "mod(x, y), x % y", "less": "a < b, less(a, b)",
    "less_equal": "a <= b, less_equal(a, b)", "greater": "a > b, greater(a, b)",
    "greater_equal": "a >= b, greater_equal(a, b)", "equal": "a == b, equal(a, b)",
    "not_equal": "a != b, not_equal(a, b)", "logical_and": "a and b", "logical_or": "a or b", "logical_not": "not a",
    "bit_and": "a & b", "bit_or": "a | b", "bit_xor": "a ^ b", "bit_not": "~a", "shift_left": "a << b",
    "shift_right": "a >> b", "to_float": "float(a), vec2(a) …", "to_int": "int(a), ivec2(a) …", "atan2": "atan(y, x)",
    "matmul": "a * b, a @ b", "pow": "pow(x, y), x**y",
}  # fmt: skip


def markdown() -> str:
    """Every row of the table by kind: how it is written, its signature, its meaning, its bound."""
    parts = []
    for kind, heading in _HEADINGS.items():
        rows = [row for row in OPERATIONS.values() if row.kind == kind]
        lines = [f"#### {heading}", "", "| written | signature | meaning | error, ULP |", "|---|---|---|---|"]
        parts.append("\n".join(lines + [_line(row) for row in rows]))
    return "\n\n".join(parts) + "\n"


def _line(row: Operation) -> str:
    written = _WRITTEN.get(row.name, f"{row.name}(…)")
    cells = (f"`{written}`", f"`{row.signature.replace('->', '→')}`", row.doc, _bound(row))
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _bound(row: Operation) -> str:
    text = "exact" if row.ulp == 0 else f"{row.ulp:g}"
    if row.absolute:
        exponent = round(math.log2(row.absolute))
        text += f" + 2^{exponent}"
    return text + (" of the largest term" if row.name in OF_TERMS else "")
