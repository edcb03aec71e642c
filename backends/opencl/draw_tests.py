"""The fixed functions of a draw (comparisons, stencil operations, blending) as OpenCL C expressions."""

from __future__ import annotations

from collections.abc import Sequence

from passgraph.draw_state import Blend, Stencil

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


def blended(blend: Blend, source: Sequence[str], destination: Sequence[str]) -> list[str]:
    """The combination of each channel; a target without alpha counts as opaque."""
    source_alpha = source[3] if len(source) == 4 else "1.0f"
    destination_alpha = destination[3] if len(destination) == 4 else "1.0f"
    results = []
    for k, (s, d) in enumerate(zip(source, destination, strict=True)):
        terms = blend.alpha_terms if k == 3 else (blend.source, blend.destination, blend.equation)
        factors = {"source_color": s, "destination_color": d}
        factors |= {"source_alpha": source_alpha, "destination_alpha": destination_alpha}
        results.append(_equation(terms[2], s, d, _term(s, terms[0], factors), _term(d, terms[1], factors)))
    return results


def _term(value: str, factor: str, factors: dict[str, str]) -> str:
    if factor == "zero":
        return "0.0f"
    if factor == "one":
        return value
    if factor.startswith("one_minus_"):
        return f"{value} * (1.0f - {factors[factor.removeprefix('one_minus_')]})"
    return f"{value} * {factors[factor]}"


def _equation(equation: str, s: str, d: str, source: str, destination: str) -> str:
    """``min`` and ``max`` take no factors, as in OpenGL."""
    if equation == "min":
        return f"({d} < {s} ? {d} : {s})"
    if equation == "max":
        return f"({s} < {d} ? {d} : {s})"
    if equation == "reverse_subtract":
        return f"({destination} - {source})"
    return f"({source} {'-' if equation == 'subtract' else '+'} {destination})"
