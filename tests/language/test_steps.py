"""Functions of the prelude are taken apart once; programs come out as if each call had been."""

from __future__ import annotations

import pytest

import passgraph as pg
from passgraph.formats import format_named
from passgraph.language import lower as lowering
from passgraph.language.lower import Facts, lower
from passgraph.language.operations import OPERATIONS

#: Calls of values and literals, of values that meet again, and of what folds where a literal is given.
CALLS = (
    "sin(x) + cos(x) + sin(y)", "pow(x, 2.2) + pow(x, y) + pow(abs(x), 0.5)", "exp(x) * log(y) + exp2(x) + log2(x)",
    "atan(y, x) + atan(x, 1.0) + asin(x) + acos(x)", "smoothstep(0.1, 0.7, x) + smoothstep(x, y, 0.5)",
    "mod(x, y) + mod(x, 0.3) + fract(x)", "mix(x, y, 0.25) + clamp(x, 0.0, y) + sign(x)",
    "tan(x) + tanh(y) if x > y else sinh(x) + cosh(0.3)",
    "float(int(x) // 3 + sign(int(y)) + clamp(int(x), int(y), 7))",
    "float(bit_count(int(x)) + find_msb(int(y)) + bitfield_extract(int(x), 3, 5))",
    "float(uint(x) // uint(y) % uint(3)) + float(clamp(uint(x), uint(1), uint(y)))",
)  # fmt: skip


def key(text: str, format_: str) -> str:
    return lower(pg.kernel(source=text).program, Facts({}, {}, (format_named(format_).store,))).key


@pytest.mark.parametrize(
    ("call", "format_"),
    [*((call, "rgba32f") for call in CALLS), *(("x + y", name) for name in ("rgba16f", "rgba8", "rgba8_srgb"))],
)
def test_programs_are_the_same_however_often_functions_are_taken_apart(
    call: str, format_: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = (
        f"def k(c: Image) -> vec4:\n    x, y = c[0, 0].x, c[1, 0].y\n    z = {call}\n    return vec4(x, z, {call}, 0.7)"
    )
    made = key(text, format_)
    asked: list[str] = []
    monkeypatch.setattr(lowering, "_prelude_steps", lambda name: asked.append(name))
    assert key(text, format_) == made
    assert asked


def test_steps_are_kept_of_all_functions_and_of_rounding() -> None:
    names = [row.name for row in OPERATIONS.values() if row.kind == "prelude"]
    assert [name for name in (*names, "quantize", "quantize_half") if lowering._prelude_steps(name) is None] == []
