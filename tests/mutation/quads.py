"""Mistakes in how derivatives are written into kernels; the reference runs what comes of them too."""

from __future__ import annotations

from tests.mutation.mutant import Mutant


def _quads(function: str, old: str, new: str) -> Mutant:
    return Mutant(function, old, new, "numpy", ("derivatives/",))


MUTANTS = (
    _quads("_Quads._difference", "(pixel & ~bit, pixel | bit)", "(pixel | bit, pixel & ~bit)"),
    _quads("_Quads._odd", 'apply("equal", [last, ir.Literal(INT, 1)]', 'apply("equal", [last, ir.Literal(INT, 0)]'),
    _quads("_Quads._step", "ir.Literal(INT, -1), ir.Literal(INT, 1)", "ir.Literal(INT, 1), ir.Literal(INT, -1)"),
    _quads("_Quads._pixel", "int(axis in axes)", "int(axis not in axes)"),
    _quads("_Quads._moved", "if pixel & bit]", "if pixel]"),
    _quads("_Quads._inside", "else world.alone(p) for p", "else world for p"),
    _quads("_Quads._inside", "if here in self.feeding.holding else", "if False else"),
    _quads("_Quads._for", "frozenset(live | handed)", "frozenset(live)"),
    _quads("_Quads._if", "live |= in_else", "pass"),
    _quads("_Quads._enter", "self._at(held, pixel, before, live)", "held"),
    _quads("Feeding._needed", "both = (pixel, pixel ^ AXES[self.derivatives[node]]) if", "both = (pixel,) if"),
)
