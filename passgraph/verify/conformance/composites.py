"""Types made of other types: matrices that are not square, against NumPy's numbers.

Pictures and parameters hold small whole numbers, so that every sum is exact and what comes out is known to the bit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.verify.conformance.case import Case, Picture

GROUP = "composites"
SIZE = (23, 17)

OBLONG = """
def run(color: Image, turn: mat2x3, several: Array[mat4x2, 3], wide: mat3x4) -> vec4:
    c = color[0, 0]
    m = mat3x2(c.xy, c.zw, c.yx)
    m[pixel().x % 4] = vec2(2.0, -1.0)
    square = transpose(turn) * turn + m * turn
    column = several[pixel().y % 3][pixel().x % 4]
    four = (wide * turn)[1] + wide * outer(c.xyz, c.xy)[1] + vec4(mat2x3(wide)[1], mat4x2(3.0)[1].y)
    return four + vec4(square * column, dot(column, m[0]), (c.xyz * turn).y)
"""


def cases() -> Iterator[Case]:
    """Each kernel with what it must give."""
    yield _oblong()


def _whole() -> Picture:
    """Whole numbers from 0 to 7."""
    return np.random.default_rng(11).integers(0, 8, (SIZE[1], SIZE[0], 4)).astype(np.float32)


def _graph(text: str, **values: Any) -> Mapping[str, pg.Target]:
    kernel = pg.kernel(source=text)
    return {"result": kernel(pg.Input("color"), into=pg.target("result", "rgba32f"), **values)}


def _case(name: str, text: str, one: Callable[[NDArray[Any], int, int], Any], **values: Any) -> Case:
    """A kernel of one picture, and what it computes from a texel and its column and row."""
    picture = _whole()
    rows = [[one(picture[y, x].astype(np.float64), x, y) for x in range(SIZE[0])] for y in range(SIZE[1])]
    exact = {"result": np.array(rows, np.float32)}
    return Case(GROUP, name, partial(_graph, text, **values), SIZE, ({"color": picture},), exact=exact)


def _oblong() -> Case:
    """NumPy's matrices are ``m[row][column]``; a mat2x3 has two columns and three rows."""
    turn, wide = np.arange(6.0).reshape(3, 2) - 2.0, np.arange(12.0).reshape(4, 3) - 5.0
    several = np.arange(24.0).reshape(3, 2, 4) - 10.0

    def one(c: NDArray[Any], x: int, y: int) -> NDArray[Any]:
        m = np.stack([c[:2], c[2:], c[1::-1]], axis=1)
        if x % 4 < 3:
            m[:, x % 4] = 2.0, -1.0
        square = turn.T @ turn + m @ turn
        column = several[y % 3][:, x % 4]
        four = (wide @ turn)[:, 1] + wide @ np.outer(c[:3], c[:2])[:, 1] + np.array([*wide[:3, 1], 3.0])
        return np.asarray(four + np.array([*(square @ column), column @ m[:, 0], (c[:3] @ turn)[1]]))

    return _case("matrices that are not square", OBLONG, one, turn=turn, several=several, wide=wide)
