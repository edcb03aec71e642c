"""Random kernels: declarations, branches, loops with jumps, early returns, arrays, structs, functions."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from passgraph.graph.targets import FILTERS
from passgraph.language.borders import BORDERS
from passgraph.verify.fuzz.random_expressions import Expressions, Features

Picture = NDArray[np.float32]

SIDE = 64
#: Special values: zeros, ones, halves where rounding ties, denormals, range ends, NaN.
SPECIAL = np.array([
    0.0, -0.0, 1.0, -1.0, 0.5, 1.5, 2.5, -3.75, 7.0, 31.0, 1e-40, -1e-40, 1.17549435e-38, 1e-20, 1e20, 3e38, -3e38,
    8388609.0, 2147483648.0, -2147483648.0, np.inf, -np.inf, np.nan,
], np.float32)  # fmt: skip


def values(seed: int, size: tuple[int, int], special: bool = True) -> Picture:
    """Return values (height, width, 4), mostly in [-2, 2]; a few rows have multiples of 1/8 or, by choice, special
    values."""
    random = np.random.default_rng(seed)
    width, height = size
    pixels = random.uniform(-2, 2, (height, width, 4)).astype(np.float32)
    pixels[::5] = np.round(pixels[::5] * 8) / 8
    if special:
        # Every eighth row has them in all combinations next to each other; the others keep the promised range.
        rows = pixels[3::8]
        rows[...] = random.choice(SPECIAL, rows.shape)
    return pixels


def unit(seed: int, size: tuple[int, int], channels: int = 4) -> Picture:
    """Return values (height, width, channels) in [0, 1)."""
    return np.random.default_rng(seed).random((size[1], size[0], channels)).astype(np.float32)


#: Declarations that a kernel may use; unused ones are left out of its text.
DECLARATIONS = {
    "helper": """def helper(a: float, n: int) -> float:
    for i in range(3):
        if i == n:
            return a * 0.5
        a += float(i)
    return a
""",
    "blend": "def blend(a: vec3, b: vec3, t: float) -> vec3: return a * (1.0 - t) + b * t\n",
    "Pair": "class Pair:\n    scale: float\n    shift: vec3\n",
    "Lamp": "class Lamp:\n    share: float\n    toward: vec3\n    map: Image\n",
    "TABLE": "TABLE = (0.25, -1.0, 3.5, 2.0)\n",
}
#: Parameters with the values of their runs; unused ones are left out.
PARAMETERS: dict[str, tuple[str, Any]] = {
    "c": ("Image", None),
    "d": ("Image", None),
    "e": ("Image", None),
    "gain": ("float", 1.375),
    "toward": ("vec3", (0.6, -0.48, 0.64)),
    "whole": ("int", 5),
    "seed": ("uint", 3_000_000_000),
    "turn": ("mat3", ((0.36, 0.48, -0.8), (-0.8, 0.6, 0.0), (0.48, 0.64, 0.6))),
    "weights": ("Array[float, 4]", (0.125, -0.5, 2.0, 1.0)),
    "pair": ("Pair", {"scale": -0.75, "shift": (0.5, 0.25, -1.5)}),
    "grid": ("Array[Array[float, 3], 2]", ((0.5, -1.25, 2.0), (3.0, 0.125, -0.75))),
    "lamps": (
        "Array[Lamp, 2]",
        (
            {"share": 0.875, "toward": (0.25, -0.5, 1.0), "map": "c"},
            {"share": -2.5, "toward": (1.5, 0.75, -0.25), "map": "d"},
        ),
    ),
    "curve": ("Array[float, 1500]", tuple((37 * k % 129 - 64) / 8.0 for k in range(1500))),
    "words": ("Array[int, 1100]", tuple(29 * k % 17 - 8 for k in range(1100))),
    "taps": ("Annotated[int, Range(0, 6)]", 4),
    "reach": ("Const[int]", 3),
    "across": ("Const[bool]", True),
}
#: Structs that are named only in parameter types.
_DECLARED = {"Pair": "pair", "Lamp": "lamps"}
FORMATS = ("rgba32f", "rgba16f", "rgba8", "rgba16", "rgba8_srgb")


class Writer(Expressions):
    """Writes a kernel; hypothesis draws every choice, so failures can be shrunk."""

    def __init__(self, draw: st.DrawFn, features: Features) -> None:
        super().__init__(draw, features)
        self.lines: list[str] = []
        self.depth = 1
        self.count = 0
        self.names = {
            "float": ["x", "y"], "int": ["n"], "vec2": ["u"], "vec3": ["v"], "vec4": ["p"], "mat3": ["m"],
            "array": ["a", "TABLE", "rows[n]"],
        }  # fmt: skip
        if features.reads:
            more = {"float": ["gain", "pair.scale", "lamps[n].share"], "int": ["whole", "reach", "words[n]"],
                    "uint": ["seed"], "vec3": ["toward", "pair.shift", "lamps[n].toward"],
                    "mat3": ["turn"], "array": ["weights", "grid[n]", "curve"], "bool": ["across"]}  # fmt: skip
            self.names = {type_: [*self.names.get(type_, []), *more.get(type_, [])] for type_ in {**self.names, **more}}
        self.written = {"float": ["x", "y"], "vec2": ["u"], "vec3": ["v"], "vec4": ["p"], "mat3": ["m"]}

    def line(self, text: str) -> None:
        self.lines.append("    " * self.depth + text)

    def block(self, size: int, nest: int) -> None:
        for _ in range(self.draw(st.integers(1, size))):
            self.statement(nest)

    def statement(self, nest: int) -> None:
        kinds = ["set", "set", "new", "add", "element", "swizzle", "column"]
        kinds += ["if", "if", "for", "match"] * (nest > 0) + ["return", "discard"] + ["jump"] * bool(self.indices)
        kind = self.pick(*kinds)
        if kind == "if":
            self._branch(nest)
        elif kind == "for":
            self._loop(nest)
        elif kind == "match":
            self._match(nest)
        elif kind == "return":
            self.line(f"if {self.expr('bool')}: return {self.expr('vec4')}")
        elif kind == "discard":
            self.line(f"if {self.expr('bool')}: {self.pick('return p', 'discard()')}")
        elif kind == "jump":
            self.line(f"if {self.expr('bool')}: {self.pick('break', 'continue')}")
        else:
            getattr(self, f"_{kind}")()

    def _set(self) -> None:
        type_ = self.pick(*self.written)
        self.line(f"{self.pick(*self.written[type_])} = {self.expr(type_)}")

    def _new(self) -> None:
        self.count += 1
        type_ = self.pick("float", "vec3", "int", "vec2", "bool", "uint")
        name = f"{type_[0]}{self.count}"
        self.line(f"{name} = {self.expr(type_)}")
        self.names[type_] = [*self.names.get(type_, []), name]

    def _add(self) -> None:
        name = self.pick(*self.written["float"])
        if self.features.wild:
            self.line(f"{name} {self.pick('+=', '-=', '*=')} {self.expr('float')}")
        else:
            self.line(f"{name} = clamp({name} {self.pick('+', '-', '*')} {self.expr('float')}, -8.0, 8.0)")

    def _element(self) -> None:
        # 0 + …: a literal out of range is an error.
        index, other = f"[0 + {self.expr('int', 2)}]", f"[0 + {self.expr('int', 1)}]"
        if self.pick("array", "rows") == "array":
            self.line(f"a{index} = {self.expr('float')}")
        elif self.pick("entry", "row") == "entry":
            self.line(f"rows{index}{other} = {self.expr('float')}")
        else:
            self.line(f"rows{index} = [{self.expr('float')}, {self.expr('float')}]")

    def _swizzle(self) -> None:
        self.line(
            self.pick(
                f"v.xy = {self.expr('vec3')}.zx",
                f"v.z = {self.expr('float')}",
                f"p.gb = {self.expr('vec3')}.xy",
            )
        )

    def _column(self) -> None:
        self.line(f"m[0 + {self.expr('int', 1)}] = {self.expr('vec3', 2, (-1, 1))}")

    def _branch(self, nest: int) -> None:
        self.inside(f"if {self.expr('bool')}:", nest)
        if self.draw(st.booleans()):
            self.inside(f"elif {self.expr('bool')}:", nest)
        if self.draw(st.booleans()):
            self.inside("else:", nest)

    def _loop(self, nest: int) -> None:
        self.count += 1
        index = f"i{self.count}"
        bounds = ("1", "3", "1, 6, 2", "4, 0, -1", "70", "0", *["reach", "taps"] * self.features.reads)
        # Texels are read at offsets up to the loop's index, so only short loops make their index available.
        trips = self.pick(*bounds, "data", "data")
        if trips == "data":
            trips = self._from_data()
        known = self.names["int"]
        self.names["int"] = [*known, index]
        self.indices.append(index)
        self.inside(f"for {index} in range({trips}):", min(nest, 2))
        self.indices.pop()
        self.names["int"] = known

    def _from_data(self) -> str:
        """Return loop bounds that depend on a pixel, with a limit to the trips and the index."""
        ends = [f"clamp({self.expr('int', 2)}, {low}, {low + self.draw(st.integers(0, 4))})" for low in (-2, 0)]
        form = self.pick("stop", "start", "steps", "masked")
        if form == "stop":
            return ends[1]
        if form == "masked":
            return f"({self.expr('int', 2)}) & 3"
        if form == "start":
            return ", ".join(ends)
        # A step known to be 0 is an error.  A texel makes it unknown; no other text has this factor.
        return f"{ends[0]}, {ends[1]}, clamp({self.expr('int', 2)} + int(c[0, 0].w * 2.1), -2, 2)"

    def _match(self, nest: int) -> None:
        self.line(f"match {self.expr('int', 2)}:")
        self.depth += 1
        for pattern in ("0", "1 | -2", "2 | 3"):
            guard = f" if {self.expr('bool', 1)}" if self.draw(st.booleans()) else ""
            self.inside(f"case {pattern}{guard}:", min(nest, 1))
        if self.draw(st.booleans()):
            self.inside("case _:", min(nest, 1))
        self.depth -= 1

    def inside(self, head: str, nest: int) -> None:
        """Write a nested block: names introduced in it end with it."""
        names = {type_: list(known) for type_, known in self.names.items()}
        self.line(head)
        self.depth += 1
        self.block(3, nest - 1)
        self.depth -= 1
        self.names = names


@st.composite
def kernel_texts(draw: st.DrawFn, features: Features = Features()) -> str:  # noqa: B008
    """Generate the text of a kernel ``k`` over an image ``c``."""
    writer = Writer(draw, features)
    writer.line("p = c[0, 0]")
    writer.line("x, y, u, v = p.x, p.y, p.zw, p.xyz")
    writer.line("n, a, m = int(p.w), [p.x, p.y, 1.0, 4.0], mat3(p.z)")
    writer.line("rows = [[p.x, 2.0], [p.y, -0.5], [1.0, p.z]]")
    writer.block(5, 2)
    writer.line(f"return {writer.expr('vec4')}")
    body = "\n".join(writer.lines)
    if draw(st.booleans()):
        body += " + vec4(x, y, v.z, a[n]) + vec4(m * v, u.x)"
    return kernel_around(body)


def kernel_around(body: str) -> str:
    """Return a kernel around some lines, with the declarations and parameters that they use."""
    used = set(re.findall(r"\w+", body))
    needed = [text for name, text in DECLARATIONS.items() if name in used or _DECLARED.get(name) in used]
    parameters = ", ".join(f"{n}: {type_}" for n, (type_, _) in PARAMETERS.items() if n in used or n == "c")
    return "\n".join([*needed, f"def k({parameters}) -> vec4:", body, ""])


@st.composite
def kernels(draw: st.DrawFn, features: Features | None = None, side: int = SIDE) -> dict[str, Any]:
    """Generate a kernel with its pictures: a case of kind ``kernel``.  By default one in four is wild."""
    features = features or Features(wild=draw(st.integers(0, 3)) == 3)
    return {
        "kind": "kernel",
        "text": draw(kernel_texts(features)),
        "format": draw(st.sampled_from(FORMATS)),
        "border": draw(st.sampled_from(tuple(BORDERS))),
        "filter": draw(st.sampled_from(FILTERS)),
        "special": draw(st.booleans()),
        "seed": draw(st.integers(0, 3)),
        "side": side,
    }
