"""Mistakes in how derivatives are written into kernels, which the reference runs too, and in what draws hand in."""

from __future__ import annotations

from tests.mutation.mutant import Mutant


def _quads(function: str, old: str, new: str) -> Mutant:
    return Mutant(function, old, new, "numpy", ("derivatives/",))


def _beside(backend: str, function: str, old: str, new: str) -> Mutant:
    return Mutant(function, old, new, backend, ("derivatives/beside a triangle",))


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
    _quads("_Quads._enter", "self._at(variable, pixel, before, live)", "variable"),
    _quads("Feeding._needed", "both = (pixel, pixel ^ AXES[self.derivatives[node]]) if", "both = (pixel,) if"),
    _quads("_Quads._moved", 'ir.other_pixel(expression.name, "".join(axes))', "expression.name"),
    _beside("numpy", "interpolated", "if axis in axes else at", "if axis not in axes else at"),
    _beside("gl", "ShaderPrinter._stepped", "1 - 2 *", "2 * "),
    _beside("gl", "ShaderPrinter._varying", "pg_varying{vector} * {inverse_w}", "pg_varying{vector}"),
    _beside("gl", "ShaderPrinter._varying", "self._stepped(inverse_w, axes)", "inverse_w"),
    _beside("gl", "ShaderPrinter._depth", "self._stepped(f'{self.fragment}.z', axes)", "f'{self.fragment}.z'"),
    _beside("opencl", "pg_covered", "(x & 1) != 0 ? -256L : 256L", "(x & 1) != 0 ? 256L : -256L"),
    _beside("opencl", "pg_covered", "(k & 2) != 0 ? down", "(k & 1) != 0 ? down"),
    _beside("opencl", "pg_covered", "e1 + dy * (t[0] - t[4])", "e1 + dy * (t[4] - t[0])"),
    _beside("opencl", "_shade", "{a}) * {place}.y", "{a}) * there[0].y"),
    _beside("opencl", "_pixel_rows", "if pixel)", "if pixel == 1)"),
)
