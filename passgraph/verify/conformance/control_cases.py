"""Loops with bounds from data, ``match`` and ``discard()``; Python runs each kernel's text for the expected result.

Numbers are whole and small, so every sum is exact.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

import passgraph as pg
from passgraph.verify.conformance.case import Case, Picture, graph_of

SIZE = (23, 9)

#: Name → a kernel ``run`` over a picture of whole numbers from -6 to 11, and many over a number ``n``.
KERNELS: dict[str, str] = {
    # More than 64 trips, the limit of unrolling; loops with jumps are never unrolled.
    "a long loop": """
def run(color: Image) -> vec4:
    total = vec4(0.0)
    for i in range(70):
        total += color.texel(ivec2(i % 23, i // 23)) * float(i)
    return total
""",
    "a loop down": """
def run(color: Image) -> vec4:
    total = color[0, 0]
    for i in range(9, -4, -3):
        if (pixel().x + i) % 2 == 0:
            continue
        total = total * 2.0 + float(i)
    return total
""",
    "break": """
def run(color: Image) -> vec4:
    total = color[0, 0]
    for i in range(40):
        if i * 2 > pixel().x + pixel().y:
            break
        total += float(i)
    return total
""",
    "continue": """
def run(color: Image) -> vec4:
    total = color[0, 0]
    for i in range(12):
        if (i + pixel().x) % 3 == 0:
            continue
        total += float(i)
    return total
""",
    "loops in loops": """
def run(color: Image) -> vec4:
    total = color[0, 0]
    for i in range(5):
        for j in range(7):
            if j > i + pixel().x % 3:
                break
            if (i + j) % 2 == 1:
                continue
            total += float(10 * i + j)
        if i >= pixel().y % 4 + 1:
            break
        total += 100.0
    return total
""",
    "return in a loop": """
def run(color: Image) -> vec4:
    for i in range(20):
        if i * i >= pixel().x:
            return color[0, 0] + float(i)
    return vec4(-1.0)
""",
    "branches that read": """
def run(color: Image) -> vec4:
    result = vec4(0.0)
    if pixel().x % 2 == 0:
        result = color[1, 0] * 2.0
    elif pixel().y % 2 == 0:
        result = color[0, 1] + color[0, -1]
        if result.x > 6.0:
            result += color[-1, -1]
    else:
        result = -color[0, 0]
    return result
""",
    "bools chosen": """
def run(color: Image, wanted: Const[bool] = True, other: Const[bool] = False) -> vec4:
    c = color[0, 0]
    low = c.x > 3.0 if c.y > 2.0 else c.z < 4.0
    high = (c.w > 1.0 if wanted else c.w > 100.0) if low else c.x == c.y
    return vec4(float(low), float(high), c.x if wanted else -1.0, -1.0 if other else c.y)
""",
    "columns beside channels": """
def run(color: Image) -> vec4:
    return color[-1, 1] + vec4(float(pixel().x))
""",
    "bounds from data": """
def run(c: Image, n: int) -> vec4:
    p = c[0, 0]
    a, b, d = 0.0, 0.0, 0.0
    for i in range(clamp(int(p.x), -3, 9)):
        a += float(i + 1)
    for i in range(clamp(n, -9, 9), clamp(int(p.y), -9, 9), clamp(int(p.z), -2, 2)):
        if i == 2:
            continue
        b = b * 2.0 + float(i)
        if b > 900.0:
            break
    for i in range(clamp(int(p.w), 0, 5), -4, -3):
        d = d * 3.0 + float(i)
    return vec4(a, b, d, float(n))
""",
    "loops and offsets within a parameter's range": """
def run(c: Image, n: Annotated[int, Range(-4, 7, "trips")]) -> vec4:
    a, b = 0.0, 0.0
    for i in range(n):
        a = a * 2.0 + c[i, n].x
    for i in range(n, 8, 2):
        b += c[0, i - n].y * float(i)
    return vec4(a, b, c[n, -n].z, float(n))
""",
    "loops inside loops": """
def run(c: Image, n: int) -> vec4:
    p = c[0, 0]
    rows = [0.0] * 4
    seen = 0
    for i in range(min(max(n, 0), 5)):
        for j in range(i, clamp(int(p.x), 0, 6)):
            for k in range(clamp(int(p.y), 0, 3) + j % 2):
                seen += 1
                rows[(i + j) % 4] += float(10 * j + k)
                if seen > 20:
                    return vec4(rows[0], rows[1], rows[2], float(seen))
                if k == 2:
                    break
            if j == 4:
                break
        if seen % 5 == 3:
            continue
        rows[3] += 1000.0
    return vec4(rows[0], rows[1], rows[2], rows[3])
""",
    "offsets within bounds": """
def run(c: Image, n: int) -> vec4:
    p = c[0, 0]
    t, u = 0.0, 0.0
    for i in range(clamp(int(p.x), -3, 2), clamp(int(p.y), -1, 4)):
        t = t * 2.0 + c[i, 0].x
        for j in range(clamp(n, 0, 2), -2, -1):
            u += c[i, j].y * float(j + 3)
    return vec4(t, u, c[clamp(int(p.z), -4, 4), clamp(int(p.w), -1, 1)].z, c[n & 3, 0].w)
""",
    "around a pixel": """
def run(c: Image, n: int) -> vec4:
    total, count = 0.0, 0
    r = clamp(n, 0, 3)
    for y in range(max(pixel().y - r, 0), min(pixel().y + r + 1, c.size.y)):
        for x in range(max(pixel().x - 2, 0), min(pixel().x + 3, c.size.x)):
            total += c.texel(ivec2(x, y)).x
            count += 1
    return vec4(total, float(count), float(r), 0.0)
""",
    "a whole picture": """
def run(c: Image, n: int) -> vec4:
    most, total, places = -100.0, 0.0, 0
    for y in range(c.size.y):
        for x in range(pixel().x, c.size.x, output_size().x):
            v = c.texel(ivec2(x, y))
            if v.x > most:
                most = v.x
                places = y * c.size.x + x
            total += v.y
    return vec4(most, total, float(places), 0.0)
""",
    "bounds near the ends of int": """
def run(c: Image, n: int) -> vec4:
    p = c[0, 0]
    count, last, back = 0, 0, 0
    near = 2147483640 + clamp(int(p.x), 0, 7)
    for i in range(near, 2147483647, clamp(int(p.y), 1, 5)):
        count += 1
        last = i - 2147483640
    for i in range(clamp(int(p.z), -3, 3) - 2147483640, -2147483647 - 1, -3):
        back += i + 2147483647
    for i in range(0, clamp(n + int(p.w), -9, 9) * 200000000, 300000000):
        count += 100 + i // 300000000
    return vec4(float(count), float(last), float(back), 0.0)
""",
    "bounds from floats that are not numbers": """
def run(c: Image, n: int) -> vec4:
    p = c[0, 0]
    infinite = p.x / 0.0
    a, b, d = 0, 0, 0
    for i in range(int(clamp(infinite, -2.5, 7.5))):
        a += i + 1
    for i in range(int(min(max(p.y, 0.0), 5.9) * 1.5), 9):
        b += i
    for i in range(clamp(int(infinite), 0, 3), int(min(4.0, infinite - infinite)) + 5):
        d += i + 10
    return vec4(float(a), float(b), float(d), 0.0)
""",
    "match": """
def run(c: Image, n: int) -> vec4:
    p = c[0, 0]
    a, b = 0.0, p.y
    match int(p.x) + n:
        case 0:
            a = 1.0
        case 1 | 2 if p.y > 2.0:
            a = 2.0
        case -1 | 2:
            return vec4(-1.0)
        case 3 | 0x4 | 5:
            for i in range(clamp(int(p.z), 0, 4)):
                match i:
                    case 1: continue
                    case 3: break
                a += float(i + 3)
        case _:
            b = -b
    match n:
        case 7: b += 100.0
    return vec4(a, b, p.z, p.w)
""",
    "discard": """
def lifted(v: float, limit: float) -> float:
    if v > limit:
        discard()
    return v * 2.0

def run(c: Image, n: int) -> tuple[vec4, vec4]:
    p = c[0, 0]
    t = 1.0
    if p.w < -4.0:
        discard()
    for i in range(clamp(int(p.y), 0, 4)):
        if p.z == float(i + n):
            discard()
        t += lifted(p.x, 9.0)
        if i == 2:
            t += lifted(p.z, 6.0)
    return vec4(t, p.x, p.y, p.z), vec4(t + 1.0)
""",
}
#: Kernel → output size, if it differs from the input picture's.
SMALL = {"a whole picture": (3, 1)}


def cases() -> Iterator[Case]:
    picture = np.random.default_rng(5).integers(-6, 12, (SIZE[1], SIZE[0], 4)).astype(np.float32)
    for name, text in KERNELS.items():
        image, *number = re.findall(
            r"(\w+): ", text[text.index("def run(") : text.index(") ->", text.index("def run("))]
        )[:2]
        runs = [{"n": n} for n in (7, -4, 3)] if number == ["n"] else [{}]
        frames = tuple({image: picture, **values} for values in runs)
        size = SMALL.get(name)
        graph = partial(graph_of, text, size, **({"n": pg.Value("n", int)} if "n" in runs[-1] else {}))
        exact = _by_python(text, picture, size or SIZE, runs[-1])
        yield Case("language", name, graph, size or SIZE, frames, exact=exact)


# The same text as Python


class _Discarded(Exception):
    """The pixel was discarded."""


@dataclass(frozen=True)
class _Vector:
    """A vector with components by letter."""

    numbers: tuple[Any, ...]

    def __getattr__(self, letter: str) -> Any:
        return self.numbers["xyzw".index(letter)]

    def __add__(self, other: Any) -> _Vector:
        return _Vector(tuple(a + b for a, b in zip(self.numbers, _spread(other), strict=True)))

    def __mul__(self, other: Any) -> _Vector:
        return _Vector(tuple(a * b for a, b in zip(self.numbers, _spread(other), strict=True)))

    def __neg__(self) -> _Vector:
        return self * -1.0


def _spread(value: Any) -> tuple[Any, ...]:
    return value.numbers if isinstance(value, _Vector) else (value,) * 4


@dataclass(frozen=True)
class _Seen:
    """A picture as seen from one pixel."""

    picture: Picture
    x: int
    y: int

    @property
    def size(self) -> _Vector:
        return _Vector((self.picture.shape[1], self.picture.shape[0]))

    def __getitem__(self, offset: tuple[int, int]) -> _Vector:
        return self.texel(_Vector((self.x + offset[0], self.y + offset[1])))

    def texel(self, at: _Vector) -> _Vector:
        height, width = self.picture.shape[:2]
        row, column = min(max(at.y, 0), height - 1), min(max(at.x, 0), width - 1)
        return _Vector(tuple(np.float64(number) for number in self.picture[row, column]))


def _discard() -> None:
    raise _Discarded


def _clamped_int(value: float) -> int:
    return 0 if math.isnan(value) else int(min(max(value, -(2.0**31)), 2.0**31 - 1))


def _names(x: int, y: int, size: tuple[int, int]) -> dict[str, Any]:
    """Return Python meanings of the language's names, for one pixel."""

    def lower(a: Any, b: Any) -> Any:
        return b if b < a else a

    def upper(a: Any, b: Any) -> Any:
        return b if a < b else a

    return {
        "Image": object, "vec4": lambda *parts: _Vector(parts * (4 // len(parts))), "ivec2": lambda *p: _Vector(p),
        "pixel": lambda: _Vector((x, y)), "output_size": lambda: _Vector(size), "discard": _discard,
        "int": _clamped_int, "min": lower, "max": upper, "clamp": lambda v, low, high: lower(upper(v, low), high),
        "range": lambda *bounds: range(*bounds) if bounds[2:] != (0,) else (),
    }  # fmt: skip


def _by_python(text: str, picture: Picture, size: tuple[int, int], values: dict[str, int]) -> dict[str, Picture]:
    """Run the text in Python, pixel by pixel; discarded pixels are zero."""
    results: list[list[tuple[Any, ...]] | None] = []
    code = compile(f"from __future__ import annotations\n{text}", "<kernel>", "exec")
    with np.errstate(all="ignore"):
        for y in range(size[1]):
            for x in range(size[0]):
                names = _names(x, y, size)
                exec(code, names)
                try:
                    found = names["run"](_Seen(picture, x, y), **values)
                    results.append([v.numbers for v in (found if isinstance(found, tuple) else (found,))])
                except _Discarded:
                    results.append(None)
    count = max(len(pixel) for pixel in results if pixel is not None)
    zeros = [(0.0,) * 4] * count
    return {
        f"result{k}": np.array([(pixel or zeros)[k] for pixel in results], np.float32).reshape(size[1], size[0], 4)
        for k in range(count)
    }
