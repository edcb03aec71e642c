"""Composite types, compared with NumPy: non-square matrices, arrays of structs, of arrays and of images.

Pictures and parameters hold small whole numbers, so every sum and result is exact.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.verify.conformance.case import Case, Picture, graph_of, whole_numbers

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

ARRAYS = """
class Lamp:
    place: vec3
    shares: Array[float, 2]

def row(numbers: Array[int, 3], k: int) -> int:
    return numbers[k] * 10 + numbers[len(numbers) - 1]

def run(color: Image, lamps: Array[Lamp, 3], grid: Array[Array[int, 3], 2], n: int) -> vec4:
    p = pixel() - 2
    kept, counts, wide = lamps, grid, [[0.0] * 10] * 9
    kept[p.x].shares[p.y] = color[0, 0].x
    kept[p.x - 1].place.y += 7.0
    kept[n], kept[1] = kept[1], Lamp(color[0, 0].yzw, kept[p.y].shares)
    counts[p.y][p.x] += 50
    counts[p.x - 2] = [1, 2, p.y]
    wide[p.y][p.x] = color[0, 0].z
    total = 0.0
    for i in range(3):
        total += kept[i].place.y * kept[i].shares[1] - kept[i].shares[0] * float(i)
    numbers = float(row(counts[p.y], p.x))
    return vec4(total, numbers, kept[p.x].place.z + lamps[n].shares[p.x], wide[p.y + 1][p.x] + wide[p.y][p.x - p.y])
"""

IMAGES = """
class Layer:
    picture: Image
    others: Array[Image, 2]
    gain: float

def read(layer: Layer, k: int, by: ivec2) -> vec4:
    return layer.picture[1, 0] * layer.gain + layer.others[k].texel(pixel() + by)

def run(color: Image, images: Array[Image, 3], layers: Array[Layer, 2]) -> vec4:
    p, total = pixel(), color[0, 0]
    for i in range(3):
        total += images[i][i - 1, 1] * float(i + 1)
    total += images[p.x % 5 - 1].texel(p.yx) * 16.0
    total += images[int(color[0, 0].x) - 2].texel(p + images[p.y].size - output_size()) * 8.0
    for i in range(2):
        total += read(layers[i], p.y % 2, ivec2(i, -1))
    total += read(Layer(color, [images[1], images[0]], 2.0), p.x % 3, -p)
    return total + read(layers[p.x - 8], p.x % 2, p)
"""


LONG = """
class Lamp:
    place: vec3
    count: int

def at(words: Array[uint, 1500], i: int) -> uint:
    return words[i]

def run(color: Image, n: int, words: Array[uint, 1500], lamps: Array[Lamp, 1030], turns: Array[mat3x2, 2100],
        flags: Array[bvec3, 1100], rows: Array[Array[float, 64], 64]) -> vec4:
    p, c = pixel() - 2, color[0, 0]
    i = p.y * output_size().x + p.x
    word = at(words, i * 4)
    total = vec4(float(word & 0xFFFF), float(word >> 16), rows[p.y][p.x], float(lamps[i * n].count))
    for k in range(3):
        total.xy += turns[i * 5 + k] * c.xyz if flags[i * 3 + k].z else vec2(lamps[1029 - k].place.y)
    return total + lamps[1028].place.x
"""

TABLES = """
GRID = ((1, 2, 3, 4, 5), (6, 7, 8, 9, 10), (11, 12, 13, 14, 15))
PAIRS = (((1.0, 2.0), (3.0, 4.0), (5.0, 6.0)), ((7.0, 8.0), (9.0, 10.0), (11.0, 12.0)))
DEEP = ((((1.0,), (2.0,)), ((3.0,), (4.0,))), (((5.0,), (6.0,)), ((7.0,), (8.0,))))

def row(numbers: Array[int, 5], k: int) -> int:
    return numbers[k] * 100 + len(numbers)

def run(color: Image, grid: Array[Array[int, 5], 3] = GRID) -> vec4:
    p = pixel() - 2
    pair = PAIRS[p.y][p.x]
    return color[0, 0] + vec4(float(GRID[p.y][p.x]), pair.x + pair[p.x] * 16.0, DEEP[p.x][p.y][p.x - p.y][0],
        float(row(GRID[p.x], p.y) + grid[p.y - 1][p.x + 1]))
"""

RUN_VALUE = """
def run(color: Image, table: Array[float, 1500]) -> vec4:
    return color[0, 0] + table[pixel().x * 70]
"""


def cases() -> Iterator[Case]:
    """Yield each kernel with its expected result."""
    yield _oblong()
    yield _arrays()
    yield _tables()
    yield _images()
    yield _long()
    yield _run_values()


def _case(name: str, text: str, one: Callable[[NDArray[Any], int, int], Any], **values: Any) -> Case:
    """Return the case of a kernel of one picture; ``one`` computes its result from a texel, its column and its row."""
    picture = whole_numbers(SIZE, 11)
    graph = partial(graph_of, text, **values)
    return Case(GROUP, name, graph, SIZE, ({"color": picture},), exact={"result0": _of_each(picture, one)})


def _of_each(picture: Picture, one: Callable[[NDArray[Any], int, int], Any]) -> Picture:
    texels = picture.astype(np.float64)
    return np.array([[one(texels[y, x], x, y) for x in range(SIZE[0])] for y in range(SIZE[1])], np.float32)


def _oblong() -> Case:
    """Test matrix layout: NumPy's are ``m[row][column]``; a mat2x3 has two columns and three rows."""
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


def _end(index: int, length: int) -> int:
    """Return the entry that an index reads, clamped to the array."""
    return min(max(index, 0), length - 1)


def _arrays() -> Case:
    """Test indices from pixels, out of range on both sides."""
    places, shares = np.arange(9.0).reshape(3, 3) - 3.0, np.arange(6.0).reshape(3, 2) + 1.0
    grid, n = np.arange(6).reshape(2, 3) - 2, 2
    lamps = [SimpleNamespace(place=place, shares=share) for place, share in zip(places, shares, strict=True)]

    def one(c: NDArray[Any], x: int, y: int) -> list[float]:
        x, y = x - 2, y - 2
        at, share, counts, wide = places.copy(), shares.copy(), grid.copy(), np.zeros((9, 10))
        if 0 <= x < 3 and 0 <= y < 2:
            share[x, y] = c[0]
        if 0 <= x - 1 < 3:
            at[x - 1, 1] = at[_end(x - 1, 3), 1] + 7.0
        drawn = c[1:], share[_end(y, 3)].copy()
        at[n], share[n] = at[1].copy(), share[1].copy()
        at[1], share[1] = drawn
        if 0 <= y < 2 and 0 <= x < 3:
            counts[y, x] += 50
        if 0 <= x - 2 < 2:
            counts[x - 2] = 1, 2, y
        if 0 <= y < 9 and 0 <= x < 10:
            wide[y, x] = c[2]
        total = sum(at[i, 1] * share[i, 1] - share[i, 0] * i for i in range(3))
        row = counts[_end(y, 2)]
        third = at[_end(x, 3), 2] + shares[n, _end(x, 2)]
        last = wide[_end(y + 1, 9), _end(x, 10)] + wide[_end(y, 9), _end(x - y, 10)]
        return [total, row[_end(x, 3)] * 10 + row[2], third, last]

    return _case("arrays of structs and of arrays", ARRAYS, one, lamps=lamps, grid=grid.tolist(), n=n)


def _tables() -> Case:
    """Test nested constants with indices out of range; an index past a row reads the end of that row."""
    grid, pairs = np.arange(1, 16).reshape(3, 5), np.arange(1.0, 13.0).reshape(2, 3, 2)
    deep = np.arange(1.0, 9.0).reshape(2, 2, 2)

    def one(c: NDArray[Any], x: int, y: int) -> NDArray[Any]:
        x, y = x - 2, y - 2
        pair = pairs[_end(y, 2), _end(x, 3)]
        row = grid[_end(x, 3), _end(y, 5)] * 100 + 5
        far = grid[_end(y - 1, 3), _end(x + 1, 5)]
        third = deep[_end(x, 2), _end(y, 2), _end(x - y, 2)]
        first, second = grid[_end(y, 3), _end(x, 5)], pair[0] + pair[_end(x, 2)] * 16.0
        return np.asarray(c + np.array([first, second, third, row + far]))

    return _case("tables in rows", TABLES, one)


def _long() -> Case:
    """Test arrays of more than 1,024 entries, indices out of range on both sides, and words of any bits."""
    rng = np.random.default_rng(17)
    words = rng.integers(0, 1 << 32, 1500, np.uint32)
    places, counts = rng.integers(-9, 9, (1030, 3)), rng.integers(-(1 << 23), 1 << 23, 1030)
    turns, flags = rng.integers(-4, 5, (2100, 2, 3)).astype(float), rng.random((1100, 3)) > 0.5
    rows, n = rng.integers(0, 99, (64, 64)).astype(float), 3
    lamps = [SimpleNamespace(place=place, count=count) for place, count in zip(places, counts.tolist(), strict=True)]

    def one(c: NDArray[Any], x: int, y: int) -> NDArray[Any]:
        x, y = x - 2, y - 2
        i = y * SIZE[0] + x
        word = int(words[_end(i * 4, 1500)])
        total = np.array(
            [word & 0xFFFF, word >> 16, rows[_end(y, 64), _end(x, 64)], counts[_end(i * n, 1030)]], np.float64
        )
        for k in range(3):
            turned = turns[_end(i * 5 + k, 2100)] @ c[:3]
            total[:2] += turned if flags[_end(i * 3 + k, 1100), 2] else places[1029 - k, 1]
        return np.asarray(total + places[1028, 0])

    return _case("long arrays", LONG, one, n=n, words=words, lamps=lamps, turns=turns, flags=flags, rows=rows)


def _run_values() -> Case:
    """Test a long array as a run value: a read-only one, another read-only one, and the same again."""
    picture, tables = whole_numbers(SIZE, 11), np.array(np.arange(3000.0).reshape(2, 1500), np.float32)
    tables.flags.writeable = False
    frames = tuple({"color": picture, "table": tables[k]} for k in (0, 1, 1))
    entries = tables[1, (70 * np.arange(SIZE[0])).clip(0, 1499)]
    exact = {"result0": picture + entries[:, None]}
    graph = partial(graph_of, RUN_VALUE, table=pg.Value("table", pg.Array))
    return Case(GROUP, "long arrays that runs bring", graph, SIZE, frames, exact=exact)


def _images() -> Case:
    """Test the choice of an image: by a literal, a loop's index, or a pixel's value."""
    names = ("color", "a", "b", "c")
    pictures = {name: np.roll(whole_numbers(SIZE, 11), 3 * k, axis=1) + k for k, name in enumerate(names)}
    color, a, b, c = (pictures[name].astype(np.float64) for name in names)

    def at(image: NDArray[Any], x: int, y: int) -> NDArray[Any]:
        return np.asarray(image[_end(y, SIZE[1]), _end(x, SIZE[0])])

    def read(layer: tuple[Any, Any, float], k: int, x: int, y: int, to: tuple[int, int]) -> NDArray[Any]:
        picture, images, gain = layer
        return np.asarray(at(picture, x + 1, y) * gain + at(images[_end(k, 2)], *to))

    images, layers = (a, b, c), ((b, (c, a), 3.0), (color, (b, c), -1.0))

    def one(texel: NDArray[Any], x: int, y: int) -> NDArray[Any]:
        total = texel + sum(at(images[i], x + i - 1, y + 1) * (i + 1) for i in range(3))
        total = total + at(images[_end(x % 5 - 1, 3)], y, x) * 16.0 + at(images[_end(int(texel[0]) - 2, 3)], x, y) * 8.0
        for i in range(2):
            total = total + read(layers[i], y % 2, x, y, (x + i, y - 1))
        total = total + read(layers[_end(x - 8, 2)], x % 2, x, y, (2 * x, 2 * y))
        return np.asarray(total + read((color, (b, a), 2.0), x % 3, x, y, (0, 0)))

    exact = {"result0": _of_each(pictures["color"], one)}
    return Case(GROUP, "images of arrays and structs", _image_graph, SIZE, (pictures,), exact=exact)


def _image_graph() -> Mapping[str, pg.Target]:
    color, a, b, c = (pg.Input(name) for name in ("color", "a", "b", "c"))
    layers = [
        SimpleNamespace(picture=b, others=[c, a], gain=3.0),
        SimpleNamespace(picture=color, others=[b, c], gain=-1.0),
    ]
    return {"result0": pg.kernel(source=IMAGES)(color, [a, b, c], layers, into=pg.target("result0", "rgba32f"))}
