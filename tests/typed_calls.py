"""What type checkers make of calling kernels on targets: read by mypy in test_typed_calls.py, not run by it."""

# mypy: disable-error-code="no-any-return"
from __future__ import annotations

from typing import Any, assert_type

import passgraph as pg
from passgraph import Image, vec2, vec4


@pg.struct
class Surface:
    color: vec4
    height: float


@pg.kernel
def one(color: Image) -> vec4:
    return color[0, 0]


@pg.kernel
def number(color: Image) -> float:
    return color[0, 0].x


@pg.kernel(known_sizes=True)
def of_known_size(color: Image) -> vec2:
    return vec2(color.size)


@pg.kernel
def two(color: Image) -> tuple[vec4, float]:
    return color[0, 0], color[0, 0].x


@pg.kernel
def three(color: Image) -> tuple[vec4, float, vec2]:
    return color[0, 0], color[0, 0].x, color[0, 0].xy


@pg.kernel
def fields(color: Image) -> Surface:
    return Surface(color[0, 0], 1.0)


frame = pg.Input("frame")
assert_type(one(frame), pg.Target)
assert_type(number(frame), pg.Target)
assert_type(of_known_size(frame), pg.Target)
assert_type(two(frame), tuple[pg.Target, pg.Target])
assert_type(three(frame), tuple[pg.Target, pg.Target, pg.Target])
assert_type(fields(frame), Any)
assert_type(pg.kernel(source="def half(c: Image) -> vec4: return c[0, 0] * 0.5")(frame), Any)
