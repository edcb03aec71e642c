"""Random typed expressions of the kernel language, each within a given range.

Ranges propagate from results to operands, so that operands avoid poles and undefined results (as in dEQP's
randomshaders); their ends are multiples of 1/8, which float32 holds.  Literals come first in every choice, so shrinking
prefers them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from hypothesis import strategies as st

from passgraph.language.operation import WHOLE, Operation, Range
from passgraph.language.operations import OPERATIONS
from passgraph.language.quad_derivatives import DERIVATIVES

UNIT: Range = (0.0, 1.0)
#: Numbers that break naive arithmetic, and such whole numbers; for wild expressions only.
WILD_FLOATS = ("0.0", "1.0", "-0.5", "2.25", "3.0e38", "1.0e-30", "-7.0", "8388609.0")
WILD_INTS = ("0", "1", "-1", "2", "7", "31", "-2147483648", "2147483647")
WILD_UINTS = ("0", "1", "2", "31", "2147483647", "0x80000000", "0xFFFFFFFF")


def _tame(row: Operation) -> tuple[Range, ...]:
    return tuple(row.ordinary(operand) for operand in range(len(row.operands)))


def result_of(row: Operation) -> Range:
    """Return whole numbers that bound the results for tame operands, from the operation's meaning on a grid."""
    grid = np.meshgrid(*(np.linspace(low, high, 33) for low, high in _tame(row)))
    results = row.reference(*(axis.ravel() for axis in grid))
    return float(np.floor(results.min())), float(np.ceil(results.max()))


#: Functions of floats → ranges of their operands, range of their result.
CALLS: dict[str, tuple[tuple[Range, ...], Range]] = {
    row.name: (_tame(row), result_of(row)) for row in OPERATIONS.values() if row.of_numbers and row.call
}
#: Functions of vectors only → ranges of their operands; results may be anything.
OF_VECTORS: dict[str, tuple[Range, ...]] = {
    row.name: _tame(row) for row in OPERATIONS.values() if {*row.operands, row.result} == {"V"}
}


_MAY_BE = {"N": "GIU", "I": "IU", "S": "I"}


def _rows(signature: str) -> tuple[str, ...]:
    """Return the operations of a signature; ``N`` stands for ints, uints and floats, ``I`` for ints and uints."""
    letters = signature.replace("->", " ").split()
    rows = []
    for row in OPERATIONS.values():
        has = (*row.operands, row.result)
        fits = (letter in _MAY_BE.get(h, h) for h, letter in zip(has, letters, strict=False))
        if len(has) == len(letters) and all(fits) and not row.converts:
            rows.append(row.name)
    return tuple(rows)


INTS, PAIRS_OF_INTS = _rows("I -> I"), _rows("I I -> I")
COMPARISONS, TESTS = _rows("I I -> B"), _rows("G -> B")


def _mixed(kind: str) -> dict[str, tuple[str, ...]]:
    """Return operations with an int (or uint) result from ints and uints mixed, or from three or more, with their
    operands."""
    types = {"I": kind, "S": "int", "U": "uint"}
    mixed = {}
    for row in OPERATIONS.values():
        operands = tuple(types.get(letter, "") for letter in row.operands)
        new = len(operands) > 2 or set(operands) != {kind}
        if types.get(row.result) == kind and "" not in operands and new and row.call not in ("clamp", kind):
            mixed[row.name] = operands
    return mixed


MIXED = {kind: _mixed(kind) for kind in ("int", "uint")}
UINTS, PAIRS_OF_UINTS = _rows("U -> U"), _rows("U U -> U")
LOGIC, FOLDS = (*_rows("B B -> B"), *_rows("B -> B")), _rows("B -> b")
SIZE = {"vec2": 2, "vec3": 3, "vec4": 4, "mat2": 2, "mat3": 3, "mat2x3": 2, "mat3x2": 3}
COMPONENTS = "xyzw"


@dataclass(frozen=True)
class Features:
    """The features that generated kernels may use.

    Attributes
    ----------
    wild : True ignores ranges: poles, overflow, NaN and every whole number occur
    reads : True allows texels next to the pixel, stage values, parameters and derivatives
    """

    wild: bool = False
    reads: bool = True


class Expressions:
    """Generates expressions; ``names`` has the visible variables by type, all of them within :data:`WHOLE`."""

    def __init__(self, draw: st.DrawFn, features: Features) -> None:
        self.draw, self.features = draw, features
        self.names: dict[str, list[str]] = {}
        self.indices: list[str] = []  # of the enclosing loops: constant ints, as texel offsets must be

    def pick(self, *options: str) -> str:
        return self.draw(st.sampled_from(options))

    def number(self, low: float, high: float) -> str:
        """Return a literal, a multiple of 1/8."""
        if self.features.wild and (low, high) == WHOLE:
            return self.pick(*WILD_FLOATS)
        return repr(self.draw(st.integers(math.ceil(low * 8), math.floor(high * 8))) / 8)

    def fit(self, text: str, has: Range, range_: Range) -> str:
        """Clamp the expression to the wanted range if it may lie outside."""
        if self.features.wild or (range_[0] <= has[0] and has[1] <= range_[1]):
            return text
        return f"clamp({text}, {float(range_[0])!r}, {float(range_[1])!r})"

    def expr(self, type_: str, depth: int = 3, range_: Range = WHOLE) -> str:
        """Return an expression of a type; each component lies within ``range_``."""
        known = self.names.get(type_, [])
        kinds = ["literal", *["name"] * bool(known), *["operation"] * (3 if depth > 0 else 0)]
        kind = self.pick(*kinds)
        if kind == "literal":
            return self._literal(type_, range_)
        if kind == "name":
            return (
                self.fit(self.pick(*known), WHOLE, range_) if type_ in SIZE or type_ == "float" else self.pick(*known)
            )
        if type_ in SIZE and type_.startswith("vec"):
            return self._vector(type_, depth - 1, range_)
        text: str = getattr(self, f"_{type_}")(depth - 1, *((range_,) if type_ == "float" else ()))
        return text

    def _literal(self, type_: str, range_: Range) -> str:
        if type_ == "float":
            return self.number(*range_)
        if type_ == "bool":
            return self.pick("True", "False")
        if type_ == "int":
            return self.pick(*WILD_INTS) if self.features.wild else str(self.draw(st.integers(-8, 8)))
        if type_ == "uint":
            small = str(self.draw(st.integers(0, 8)))
            return f"uint({self.pick(*WILD_UINTS) if self.features.wild else small})"
        if type_ == "ivec2":
            return f"ivec2({self._literal('int', range_)}, {self._literal('int', range_)})"
        if type_ == "bvec3":
            return "less(vec3(1.0, 2.0, 3.0), vec3(2.0))"
        if type_.startswith("mat"):
            return f"{type_}({self.number(-1, 1)})"
        return f"{type_}({', '.join(self.number(*range_) for _ in range(SIZE[type_]))})"

    # Floats

    def _float(self, d: int, range_: Range) -> str:
        forms: list[Callable[[int, Range], str]] = [
            self._sum, self._sum, *[self._call] * 5, self._product, self._quotient, self._chosen,
            self._part, self._part, self._of_vector, self._from_int, self._helped, self._power,
            *[self._derivative] * self.features.reads,
        ]  # fmt: skip
        return forms[self.draw(st.integers(0, len(forms) - 1))](d, range_)

    def _sum(self, d: int, range_: Range, type_: str = "float") -> str:
        middle, quarter = (range_[0] + range_[1]) / 2, (range_[1] - range_[0]) / 4
        one = self.expr(type_, d, (middle - quarter, middle + quarter) if not self.features.wild else WHOLE)
        other = self.expr(type_, d, (-quarter, quarter) if not self.features.wild else WHOLE)
        return self.fit(f"({one} {self.pick('+', '-')} {other})", (-math.inf, math.inf), range_)

    def _product(self, d: int, range_: Range, type_: str = "float") -> str:
        factor = self.expr(self.pick("float", type_), d, (-1, 1))
        return self.fit(f"({self.expr(type_, d)} * {factor})", WHOLE, range_)

    def _quotient(self, d: int, range_: Range) -> str:
        divisor = (
            self.expr("float", d, (1, 8))
            if self.features.wild or self.pick("+", "-") == "+"
            else (self.expr("float", d, (-8, -1)))
        )
        return self.fit(f"({self.expr('float', d)} {self.pick('/', '/', '//')} {divisor})", WHOLE, range_)

    def _power(self, d: int, range_: Range) -> str:
        return self.fit(f"({self.expr('float', d, (-2, 2))} ** {self.pick('2', '3')})", WHOLE, range_)

    def _call(self, d: int, range_: Range) -> str:
        name = self.pick(*CALLS)
        if name == "clamp":  # reversed constant bounds are an error
            return f"clamp({self.expr('float', d)}, {float(range_[0])!r}, {float(range_[1])!r})"
        return self._function(name, "float", d, range_)

    def _function(self, name: str, type_: str, d: int, range_: Range) -> str:
        operands, result = CALLS[name]
        texts = [self.expr(type_, d, operand) for operand in operands]
        return self.fit(OPERATIONS[name].as_written(*texts, by_name=True), result, range_)

    def _chosen(self, d: int, range_: Range, type_: str = "float") -> str:
        return f"({self.expr(type_, d, range_)} if {self.expr('bool', d)} else {self.expr(type_, d, range_)})"

    def _part(self, d: int, range_: Range) -> str:
        type_ = self.pick("vec3", "vec2", "vec4")
        form = self.pick("swizzle", "index", "array", "matrix")
        if form == "swizzle":
            return f"{self.expr(type_, d, range_)}.{self.pick(*COMPONENTS[: SIZE[type_]])}"
        # 0 + …: a literal out of range is an error.
        index = f"[0 + {self.expr('int', min(d, 1))}]"
        if form == "index":
            return f"{self.expr(type_, d, range_)}{index}"
        if form == "array":
            return self.fit(f"{self.pick(*self.names.get('array', ['[1.0, 2.0, 4.0]']))}{index}", WHOLE, range_)
        return self.fit(f"{self.expr('mat3', min(d, 1))}{index}.{self.pick('x', 'y', 'z')}", WHOLE, range_)

    def _of_vector(self, d: int, range_: Range) -> str:
        type_ = self.pick("vec3", "vec2", "vec4")
        form = self.pick("dot", "length", "distance", "determinant")
        if form == "determinant":
            return self.fit(f"determinant({self.expr(self.pick('mat2', 'mat3'), d)})", (-math.inf, math.inf), range_)
        if form == "length":
            return self.fit(f"length({self.expr(type_, d, (-4, 4))})", (0, 8), range_)
        one, other = self.expr(type_, d, (-1, 1)), self.expr(type_, d, (-2, 2))
        return self.fit(f"{form}({one}, {other})", WHOLE, range_)

    def _derivative(self, d: int, range_: Range, type_: str = "float") -> str:
        return self.fit(f"{self.pick(*DERIVATIVES)}({self.expr(type_, d, (-2, 2))})", WHOLE, range_)

    def _from_int(self, d: int, range_: Range) -> str:
        form = self.pick("float", "power", *["bits", "half"] * self.features.wild)
        if form == "power":
            return self.fit(f"ldexp({self.expr('float', d)}, {self.expr('int', d)})", (-math.inf, math.inf), range_)
        if form in ("bits", "half"):
            name, type_ = ("float_from_bits", "int") if form == "bits" else ("float_of_half", "uint")
            return f"{name}({self.expr(type_, d)})"
        return self.fit(f"float({self.expr(self.pick('int', 'uint'), d)})", (-math.inf, math.inf), range_)

    def _helped(self, d: int, range_: Range) -> str:
        if self.pick("loop", "blend") == "loop":
            return self.fit(f"helper({self.expr('float', d)}, {self.expr('int', d)})", (-math.inf, math.inf), range_)
        call = f"blend({self.expr('vec3', d)}, {self.expr('vec3', d)}, {self.expr('float', d, UNIT)})"
        return self.fit(f"{call}.{self.pick('x', 'y', 'z')}", WHOLE, range_)

    # Whole numbers and truth

    def _int(self, d: int) -> str:
        stage = ["stage"] * self.features.reads
        form = self.pick("binary", "binary", "binary", "chosen", "from", "unary", "mixed", *stage)
        if form == "mixed":
            return self._of_both("int", d)
        if form in ("binary", "unary"):
            return self._applied(self.pick(*(PAIRS_OF_INTS if form == "binary" else INTS)), "int", d)
        if form == "chosen":
            return f"({self.expr('int', d)} if {self.expr('bool', d)} else {self.expr('int', d)})"
        if form == "from":
            cast = self.pick("int", *["bits_from_float"] * self.features.wild)
            return f"{cast}({self.expr(self.pick('float', 'bool', 'uint') if cast == 'int' else 'float', d)})"
        return f"{self.pick('pixel()', 'output_size()', 'd.size', self.expr('ivec2', d))}.{self.pick('x', 'y')}"

    def _uint(self, d: int) -> str:
        form = self.pick("binary", "binary", "binary", "chosen", "from", "unary", "mixed", "clamp")
        if form == "mixed":
            return self._of_both("uint", d)
        if form == "clamp":
            return f"clamp({self.expr('uint', d)}, 1, 0x80000001)"
        if form in ("binary", "unary"):
            return self._applied(self.pick(*(PAIRS_OF_UINTS if form == "binary" else UINTS)), "uint", d)
        if form == "chosen":
            return f"({self.expr('uint', d)} if {self.expr('bool', d)} else {self.expr('uint', d)})"
        if self.features.wild and self.pick("uint", "half") == "half":
            return f"half_bits({self.expr('float', d)})"
        return f"uint({self.expr(self.pick('int', 'float', 'bool'), d)})"

    def _of_both(self, kind: str, d: int) -> str:
        """Return an operation on ints and uints mixed."""
        name = self.pick(*MIXED[kind])
        return OPERATIONS[name].as_written(*(self.expr(type_, d) for type_ in MIXED[kind][name]))

    def _ivec2(self, d: int) -> str:
        if self.pick("make", "sum") == "make":
            return f"ivec2({self.expr('int', d)}, {self.expr('int', d)})"
        first = "pixel()" if self.features.reads else self.expr("ivec2", d)
        return f"({first} {self.pick('+', '-', '*', '&')} {self.expr('ivec2', d)})"

    def _bool(self, d: int) -> str:
        form = self.pick("float", "int", "uint", "logic", "nan", "vector")
        if form in ("float", "int", "uint"):
            return self._applied(self.pick(*COMPARISONS), form, d)
        if form == "logic":
            return self._applied(self.pick(*LOGIC), "bool", d)
        return (
            self._applied(self.pick(*TESTS), "float", d)
            if form == "nan"
            else self._applied(self.pick(*FOLDS), "bvec3", d)
        )

    def _bvec3(self, d: int) -> str:
        return self._applied(self.pick(*COMPARISONS), "vec3", d, by_name=True)

    def _applied(self, name: str, type_: str, d: int, by_name: bool = False) -> str:
        """Return an operation on operands of one type."""
        row = OPERATIONS[name]
        return row.as_written(*(self.expr(type_, d) for _ in row.operands), by_name=by_name)

    # Vectors and matrices

    def _vector(self, type_: str, d: int, range_: Range) -> str:
        forms = ["make", "sum", "product", "call", "call", "chosen", "swizzle", "matrix", "own"]
        reads = self.features.reads and type_ == "vec4"
        form = self.pick(*forms, *["derivative"] * self.features.reads, *["read"] * reads)
        if form == "make":
            return self._construct(type_, d, range_)
        if form == "sum":
            return self._sum(d, range_, type_)
        if form == "product":
            return self._product(d, range_, type_)
        if form == "chosen":
            return self._chosen(d, range_, type_)
        if form == "swizzle":
            source = self.pick("vec3", "vec2", "vec4")
            letters = "".join(self.pick(*COMPONENTS[: SIZE[source]]) for _ in range(SIZE[type_]))
            return f"{self.expr(source, d, range_)}.{letters}"
        if form == "call":
            return self._function(self.pick(*(n for n in CALLS if n != "clamp")), type_, d, range_)
        if form == "derivative":
            return self._derivative(d, range_, type_)
        if form == "read":
            return self.fit(self._read(d), (-math.inf, math.inf), range_)
        return self._linear(type_, d, range_) if form == "matrix" else self._own(type_, d, range_)

    def _construct(self, type_: str, d: int, range_: Range) -> str:
        if type_ == "vec4" and self.pick("parts", "numbers") == "parts":
            return f"vec4({self.expr('vec3', d, range_)}, {self.expr('float', d, range_)})"
        return f"{type_}({', '.join(self.expr('float', d, range_) for _ in range(SIZE[type_]))})"

    def _linear(self, type_: str, d: int, range_: Range) -> str:
        if type_ == "vec4":
            return self._construct(type_, d, range_)
        matrix, vector = self.expr("mat" + type_[3], d), self.expr(type_, d, (-1, 1))
        form = self.pick("times", "transposed", "outer", "inverse", "oblong")
        if form == "oblong":
            oblong, other = ("mat3x2", "vec3") if type_ == "vec2" else ("mat2x3", "vec2")
            text = f"({self.expr(oblong, d)} * {self.expr(other, d, (-1, 1))})"
            return self.fit(text, (-math.inf, math.inf), range_)
        if form == "inverse":  # of a matrix whose diagonal is the largest
            return self.fit(f"(inverse({matrix} * 0.125 + {'mat' + type_[3]}(2.0)) * {vector})", WHOLE, range_)
        texts = {
            "times": f"({matrix} * {vector})",
            "transposed": f"(transpose({matrix}) * {vector})",
            "outer": f"outer({vector}, {vector})[1]",
        }
        return self.fit(texts[form], (-math.inf, math.inf), range_)

    def _own(self, type_: str, d: int, range_: Range) -> str:
        """Return an expression that only vectors have."""
        form = self.pick(*OF_VECTORS, *["cross", "select"] * (type_ == "vec3"), "refract")
        if form == "cross":
            return self.fit(f"cross({self.expr(type_, d, (-2, 2))}, {self.expr(type_, d, (-1, 1))})", WHOLE, range_)
        if form == "select":
            return f"select({self.expr('bvec3', d)}, {self.expr(type_, d, range_)}, {self.expr(type_, d, range_)})"
        if form == "refract":
            unit = f"normalize({self.expr(type_, d, (0.125, 1))})"
            return self.fit(f"refract({unit}, normalize({self.expr(type_, d, (-1, 1))}), 0.75)", (-2, 2), range_)
        text = f"{form}({', '.join(self.expr(type_, d, operand) for operand in OF_VECTORS[form])})"
        return self.fit(text, (-math.inf, math.inf), range_)

    def _read(self, d: int) -> str:
        form = self.pick(
            "near", "texel", "far", "sample", "indexed", "chosen", "nearest", "gather", "level", "lod", "volume"
        )
        if form == "near":
            return f"c[{self.draw(st.integers(-3, 3))}, {self.draw(st.integers(-3, 3))}]"
        if form == "chosen":
            return (
                f"lamps[{self.pick('0', '1', 'n', 'pixel().x')}].map.texel(pixel() - {self.expr('ivec2', min(d, 1))})"
            )
        if form == "indexed" and self.indices:
            return f"c[{self.pick(*self.indices)} - 1, {self.pick(*self.indices, '0')} // 2]"
        if form == "texel":
            return f"d.texel(pixel() - {self.expr('ivec2', min(d, 1))})"
        if form == "far":
            return f"d.texel({self.expr('ivec2', d)})"
        if form == "level":
            return f"d.texel({self.expr('ivec2', min(d, 1))}, {self.expr('int', min(d, 1))})"
        place = f"uv() * {self.number(-2, 2)} + {self.expr('vec2', min(d, 2), UNIT)}"
        if form == "volume":
            return f"e.sample3(vec3({place}, {self.expr('float', min(d, 1), UNIT)}))"
        more = {
            "gather": f", {self.draw(st.integers(0, 3))}",
            "lod": f", {self.expr('float', min(d, 1), (-1, 6))}",
        }
        called = form if form in ("nearest", "gather") else "sample"
        return f"d.{called}({place}{more.get(form, '')})"

    def _mat2(self, d: int) -> str:
        return f"mat2({self.expr('vec2', d, (-1, 1))}, {self.expr('vec2', d, (-1, 1))})"

    def _mat2x3(self, d: int) -> str:
        form = self.pick("columns", "outer", "product")
        if form == "outer":
            return f"outer({self.expr('vec3', d, (-1, 1))}, {self.expr('vec2', d, (-1, 1))})"
        if form == "product":
            return f"({self.expr('mat3', d)} * {self.expr('mat2x3', d)})"
        return f"mat2x3({self.expr('vec3', d, (-1, 1))}, {self.expr('vec3', d, (-1, 1))})"

    def _mat3x2(self, d: int) -> str:
        return f"transpose({self.expr('mat2x3', d)})"

    def _mat3(self, d: int) -> str:
        form = self.pick("columns", "product", "outer", "transpose")
        if form == "columns":
            return f"mat3({', '.join(self.expr('vec3', d, (-1, 1)) for _ in range(3))})"
        if form == "product":
            return f"({self.expr('mat3', d)} * {self.expr('mat3', d)})"
        if form == "outer":
            return f"outer({self.expr('vec3', d, (-1, 1))}, {self.expr('vec3', d, (-1, 1))})"
        return f"transpose({self.expr('mat3', d)})"
