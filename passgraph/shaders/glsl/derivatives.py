"""Derivatives: where rows count from the bottom up, what grows along y has the other sign."""

from __future__ import annotations

from functools import partial

from passgraph.language.quads import derivative
from passgraph.language.source import Span, fail
from passgraph.language.typing_rules import apply
from passgraph.language.values import Part
from passgraph.shaders.glsl.operators import plain
from passgraph.shaders.glsl.unit import Native, Unit


def _grown(name: str, axes: str, unit: Unit, parts: list[Part], span: Span) -> Part:
    if len(parts) != 1:
        fail(span, f"{name}() takes 1 argument, got {len(parts)}")
    value = plain(parts[0], span, f"the argument of {name}()")
    made = derivative(name, axes, value, unit.builder, span)
    return apply("neg", [made], span) if axes == "y" and unit.rows_up else made


#: Drivers may give coarse ones for those without an ending; here all are fine.
DERIVATIVES: dict[str, Native] = {
    name + ending: partial(_grown, name + ending, axes)
    for name, axes in {"dFdx": "x", "dFdy": "y", "fwidth": "xy"}.items()
    for ending in ("", "Fine", "Coarse")
}
