"""GLSL's functions as kernels define them, written in GLSL: where drivers are free, they do as backends do here.

Drivers compute sines, powers and the like to some digits, each its own, and shaders make noise of the last ones.  An
original whose functions are those of passgraph/language/prelude.py makes the same noise, so that all the rest of a
shader can be held against what is made of it here.  The functions themselves are held against NumPy elsewhere.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Collection, Iterator
from functools import cache
from pathlib import Path

import passgraph.language

_LIBRARY = Path(passgraph.language.__file__).with_name("prelude.py")
#: By name in the library: of which arguments of vectors, "v", and of numbers beside them, "f", GLSL has them.
_SCALAR = {
    **dict.fromkeys(
        ("sin", "cos", "tan", "asin", "acos", "sinh", "cosh", "tanh", "exp", "log", "exp2", "log2", "fract"), ("v",)
    ),
    "inversesqrt": ("v",),
    "atan": ("v", "vv"), "pow": ("vv",), "mod": ("vv", "vf"), "mix": ("vvv", "vvf"), "smoothstep": ("vvv", "ffv"),
}  # fmt: skip
#: Functions of vectors by their definition, of numbers and of vectors.
_VECTOR = """
float pg_dot(T a, T b) { precise float sum = SUM; return sum; }
float pg_length(T a) { precise float size = sqrt(pg_dot(a, a)); return size; }
float pg_distance(T a, T b) { precise T way = a - b; return pg_length(way); }
T pg_normalize(T a) { float size = pg_length(a); precise T unit = size == 0.0 ? a : a / size; return unit; }
T pg_mix(T a, T b, bT c) { return mix(a, b, c); }
"""
#: Comparisons choose by mix: compilers make b < a ? b : a the least, which of NaN and a number is the number.
_NUMBERS = """
float pg_least(float a, float b) { precise float least = mix(a, b, b < a); return least; }
float pg_most(float a, float b) { precise float most = mix(a, b, a < b); return most; }
int pg_least(int a, int b) { return min(a, b); }
int pg_most(int a, int b) { return max(a, b); }
float pg_dot(float a, float b) { precise float product = a * b; return product; }
float pg_length(float a) { return abs(a); }
float pg_distance(float a, float b) { precise float way = a - b; return abs(way); }
"""
_ANGLE = "float pg_atan(float y, float x) { return pg_atan2(y, x); }"
#: As pictures are read whose border is "clamp": ``sample_upward`` of passgraph/language/library.py.
_TEXTURE = """
vec4 pg_texel(sampler2D s, ivec2 at) { return texelFetch(s, clamp(at, ivec2(0), textureSize(s, 0) - 1), 0); }
float pg_near(float p) { return pg_least(pg_most(p, -1073741824.0), 1073741824.0); }
vec4 pg_texture(sampler2D s, vec2 at) {
    precise vec2 p = at * vec2(textureSize(s, 0)) - 0.5;
    p = vec2(pg_near(p.x), pg_near(p.y));
    precise vec2 first = floor(p), f = p - first;
    ivec2 corner = ivec2(first);
    vec4 low = pg_mix(pg_texel(s, corner), pg_texel(s, corner + ivec2(1, 0)), f.x);
    vec4 high = pg_mix(pg_texel(s, corner + ivec2(0, 1)), pg_texel(s, corner + ivec2(1, 1)), f.x);
    return pg_mix(low, high, f.y);
}
vec4 pg_texture(sampler2D s, vec2 at, float bias) { return pg_texture(s, at); }
"""
#: What drivers are free in, apart from the order of additions and products.
NAMES = frozenset({*_SCALAR, "dot", "length", "distance", "normalize", "texture"})
_OPERATORS: dict[type[ast.AST], str] = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.RShift: ">>", ast.LShift: "<<", ast.BitAnd: "&",
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=", ast.And: "&&",
    ast.Or: "||", ast.USub: "-",
}  # fmt: skip
#: What backends spell themselves: the name in GLSL and the type of the result, where it is not the argument's.
_PRIMITIVES = {
    "bits_from_float": ("floatBitsToInt", "int"), "float_from_bits": ("intBitsToFloat", "float"),
    "floor": ("floor", ""), "sqrt": ("sqrt", ""), "abs": ("abs", ""), "round": ("roundEven", ""),
    "min": ("pg_least", ""), "max": ("pg_most", ""), "int": ("int", "int"), "float": ("float", "float"),
}  # fmt: skip


def used(text: str) -> list[str]:
    """Those of :data:`NAMES` that a shader's text calls and does not define itself."""
    own = re.findall(r"\b(?:float|vec[234])\s+(\w+)\s*\(", text)
    read = {"texture": r"texture|texture2D|IMG_\w*PIXEL|get\w+Color"}
    return sorted(n for n in NAMES if n not in own and re.search(rf"\b(?:{read.get(n, n)})\s*\(", text))


@cache
def _functions() -> str:
    library = {node.name: node for node in ast.parse(_LIBRARY.read_text()).body if isinstance(node, ast.FunctionDef)}
    wanted: dict[str, str] = {}
    for name in (*_SCALAR, "atan2"):
        _translate(name, library, wanted)
    vectors = (line for count in (2, 3, 4) for line in _of_vectors(f"vec{count}", "xyzw"[:count]))
    return "\n".join([_NUMBERS, *wanted.values(), _ANGLE, *vectors, _TEXTURE])


def definitions(names: Collection[str]) -> str:
    """What goes after the line of ``#version``: functions, and macros that put some of :data:`NAMES` in their place."""
    return _functions() + "\n" + "".join(f"#define {name} pg_{name}\n" for name in sorted(names))


def precise(text: str) -> str:
    """A shader whose variables and results are all precise: a driver computes them as they are written.

    Of ``a * (1.0 - t) + b * t`` Mesa 25 makes another expression, where only what is drawn at last is precise.
    """
    lines, result = [], ""
    for line in text.splitlines():
        if head := re.match(r"(\w+) \w+\(.*{$", line):
            result = head[1]
        line = re.sub(r"^( +)(float|vec[234]) ", r"\1precise \2 ", line) if result else line
        lines.append(re.sub(r"\breturn (.+);", rf"{{ precise {result} result = \1; return result; }}", line))
    return "\n".join(lines)


def _of_vectors(type_: str, parts: str) -> Iterator[str]:
    """Functions of numbers component by component, and those of vectors."""
    for name, kinds in _SCALAR.items():
        for kind in kinds:
            given = list(zip(kind, "abc", strict=False))
            taken = ", ".join(f"{type_ if one == 'v' else 'float'} {letter}" for one, letter in given)
            calls = [
                f"pg_{name}({', '.join(letter + (f'.{part}' if one == 'v' else '') for one, letter in given)})"
                for part in parts
            ]
            yield f"{type_} pg_{name}({taken}) {{ return {type_}({', '.join(calls)}); }}"
    sum_ = " + ".join(f"a.{part} * b.{part}" for part in parts)
    yield re.sub(r"\b(b?)T\b", rf"\1{type_}", _VECTOR).replace("SUM", sum_)


def _translate(name: str, library: dict[str, ast.FunctionDef], wanted: dict[str, str]) -> None:
    """A function of the library, after those that it calls."""
    if name in wanted:
        return
    for call in ast.walk(library[name]):
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id in library:
            _translate(call.func.id, library, wanted)
    wanted[name] = _Written(library[name], library).text


class _Written:
    """One function of the library in GLSL: assignments and a return."""

    def __init__(self, node: ast.FunctionDef, library: dict[str, ast.FunctionDef]) -> None:
        self.library = library
        self.types = {one.arg: ast.unparse(one.annotation) for one in node.args.args if one.annotation}
        # Some names of variables are words of GLSL.
        taken = ", ".join(f"{type_} {name}_" for name, type_ in self.types.items())
        lines = [self._line(one) for one in node.body if not isinstance(one, ast.Expr)]
        self.text = f"{_result(node)} pg_{node.name}({taken}) {{ {' '.join(lines)} }}"

    def _line(self, node: ast.stmt) -> str:
        match node:
            case ast.Return(value=ast.expr() as value):
                # In a caller, precise does not reach what a function computes: Mesa 25 makes mix another expression.
                text, type_ = self._of(value)
                return f"precise {type_} result = {text}; return result;"
            case ast.Assign([ast.Name(id=name)], value):
                text, type_ = self._of(value)
                declared = "" if name in self.types else f"precise {type_} "
                self.types[name] = type_
                return f"{declared}{name}_ = {text};"
        raise NotImplementedError(ast.unparse(node))

    def _of(self, node: ast.expr) -> tuple[str, str]:
        """Text and type."""
        match node:
            case ast.Constant(value=float() | int() as value):
                return repr(value), type(value).__name__
            case ast.Name(id=name):
                return f"{name}_", self.types[name]
            case ast.UnaryOp(operator, operand):
                text, type_ = self._of(operand)
                return f"({_OPERATORS[type(operator)]}{text})", type_
            case ast.BinOp(left, operator, right):
                (a, type_), (b, other) = self._of(left), self._of(right)
                assert type_ == other, ast.unparse(node)
                return f"({a} {_OPERATORS[type(operator)]} {b})", type_
            case ast.Compare(left, [operator], [right]):
                return f"({self._of(left)[0]} {_OPERATORS[type(operator)]} {self._of(right)[0]})", "bool"
            case ast.BoolOp(operator, values):
                return f"({f' {_OPERATORS[type(operator)]} '.join(self._of(one)[0] for one in values)})", "bool"
            case ast.IfExp(test, body, otherwise):
                text, type_ = self._of(body)
                return f"({self._of(test)[0]} ? {text} : {self._of(otherwise)[0]})", type_
            case ast.Call(ast.Name(id=name), arguments):
                given = [self._of(one) for one in arguments]
                own = name in self.library
                called, type_ = (f"pg_{name}", _result(self.library[name])) if own else _PRIMITIVES[name]
                return f"{called}({', '.join(text for text, _ in given)})", type_ or given[0][1]
        raise NotImplementedError(ast.unparse(node))


def _result(node: ast.FunctionDef) -> str:
    assert node.returns is not None
    return ast.unparse(node.returns)
