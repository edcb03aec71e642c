"""The fixed functions of a draw (comparisons, stencil operations) as OpenCL C expressions."""

from __future__ import annotations

from passgraph.graph.draw_state import Stencil

SIGNS = {
    "less": "<",
    "equal": "==",
    "less_equal": "<=",
    "greater": ">",
    "not_equal": "!=",
    "greater_equal": ">=",
}


def compare(how: str, new: str, stored: str) -> str:
    if how in ("always", "never"):
        return "true" if how == "always" else "false"
    return f"{new} {SIGNS[how]} {stored}"


def stencil_update(operation: str, stencil: Stencil) -> str:
    """The statement of one stencil operation, under the write mask."""
    old = "(int)pg_stencils[at]"
    new = {
        "keep": old,
        "zero": "0",
        "replace": str(stencil.reference),
        "increment": f"min({old} + 1, 255)",
        "increment_wrap": f"({old} + 1)",
        "decrement": f"max({old} - 1, 0)",
        "decrement_wrap": f"({old} - 1)",
        "invert": f"(~{old})",
    }[operation]
    if operation == "keep" or not stencil.write_mask:
        return ""
    keep = 255 & ~stencil.write_mask
    return f"pg_stencils[at] = (uchar)(({old} & {keep}) | ({new} & {stencil.write_mask}));"
