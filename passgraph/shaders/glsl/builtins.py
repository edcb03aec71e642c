"""GLSL's own functions: rows of the table of operations, reads of pictures, and the rest in GLSL."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial

from passgraph.language import ir
from passgraph.language.operations import called
from passgraph.language.source import Span, fail
from passgraph.language.types import BOOL, FLOAT, INT, Array, Matrix, Scalar, Vector, element_of
from passgraph.language.typing_rules import apply, widen
from passgraph.language.values import Part, index_into, select
from passgraph.shaders.glsl import syntax as g
from passgraph.shaders.glsl.derivatives import DERIVATIVES
from passgraph.shaders.glsl.images import READS
from passgraph.shaders.glsl.operators import plain
from passgraph.shaders.glsl.parse import Parser
from passgraph.shaders.glsl.preprocess import preprocessed
from passgraph.shaders.glsl.unit import Native, Unit

#: Functions that are called here as there.
_SAME = (
    "radians", "degrees", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "pow", "exp", "log",
    "exp2", "log2", "sqrt", "inversesqrt", "abs", "sign", "floor", "ceil", "trunc", "round", "fract", "mod", "min",
    "max", "clamp", "step", "smoothstep", "isnan", "isinf", "length", "distance", "dot", "cross", "normalize",
    "faceforward", "reflect", "refract", "transpose", "determinant", "inverse", "any", "all",
)  # fmt: skip
#: GLSL's name → the row's.
_OTHERWISE = {
    "roundEven": "round", "lessThan": "less", "lessThanEqual": "less_equal", "greaterThan": "greater",
    "greaterThanEqual": "greater_equal", "not": "logical_not", "outerProduct": "outer",
}  # fmt: skip
#: What functions of vectors are for scalars.
_OF_SCALARS: dict[str, Callable[[list[ir.Expr], Span], ir.Expr]] = {
    "length": lambda a, span: apply("abs", a, span),
    "distance": lambda a, span: apply("abs", [apply("sub", a, span)], span),
    "dot": lambda a, span: apply("mul", a, span),
    "normalize": lambda a, span: apply("sign", a, span),
}

#: What is written in GLSL itself; ``genType`` stands for float and its vectors.
_GENERIC = """
genType fma(genType a, genType b, genType c) { return a * b + c; }
genType modf(genType x, out genType whole) { whole = trunc(x); return x - whole; }
genType asinh(genType x) { return sign(x) * log(abs(x) + sqrt(x * x + 1.0)); }
genType acosh(genType x) { return log(x + sqrt(x * x - 1.0)); }
genType atanh(genType x) { return 0.5 * log((1.0 + x) / (1.0 - x)); }
"""
_SCALAR = """
float reflect(float I, float N) { return I - 2.0 * N * I * N; }
float faceforward(float N, float I, float R) { return R * I < 0.0 ? N : -N; }
vec4 textureGather(sampler2D s, vec2 P, int c) {
    ivec2 at = ivec2(floor(P * vec2(textureSize(s, 0)) - 0.5));
    return vec4(texelFetchOffset(s, at, 0, ivec2(0, 1))[c], texelFetchOffset(s, at, 0, ivec2(1, 1))[c],
                texelFetchOffset(s, at, 0, ivec2(1, 0))[c], texelFetch(s, at, 0)[c]);
}
vec4 textureGather(sampler2D s, vec2 P) { return textureGather(s, P, 0); }
"""


@cache
def _prelude() -> dict[str, tuple[g.Function, ...]]:
    text = _SCALAR + "".join(_GENERIC.replace("genType", name) for name in ("float", "vec2", "vec3", "vec4"))
    tokens, _ = preprocessed([(text, "<GLSL functions>")], {}, None)
    found: dict[str, tuple[g.Function, ...]] = {}
    for node in Parser(tokens, "<GLSL functions>").shader():
        if isinstance(node, g.Function):
            found[node.name] = (*found.get(node.name, ()), node)
    return found


def prelude_functions(name: str) -> tuple[g.Function, ...]:
    """Overloads of a function that is written in GLSL."""
    return _prelude().get(name, ())


def overloads(unit: Unit, name: str) -> tuple[g.Function, ...]:
    """Functions of a name that are written in GLSL: the shader's own, and those that stand for built-in ones."""
    own = tuple(unit.functions.get(name, ()))
    return own if name in unit.natives or name in BUILTINS else (*prelude_functions(name), *own)


def _row(name: str, unit: Unit, parts: list[Part], span: Span) -> Part:
    """A row of the table by the name that it has there."""
    arguments = [plain(part, span, f"an argument of {name}()") for part in parts]
    scalars = all(isinstance(a.type, Scalar) for a in arguments)
    if scalars and name in _OF_SCALARS and arguments:
        floats = [widen(a, FLOAT, span, f"an argument of {name}()") for a in arguments]
        return _OF_SCALARS[name](floats, span)
    if len(arguments) > 1 or any(isinstance(a.type, Matrix) for a in arguments):
        arguments = [unit.builder.name_it(a, span) for a in arguments]
    return apply(name, arguments, span)


def _called(name: str, unit: Unit, parts: list[Part], span: Span) -> Part:
    return _row(called(name, len(parts)), unit, parts, span)


def _mix(unit: Unit, parts: list[Part], span: Span) -> Part:
    """Between two values, or one of the two by bools."""
    if len(parts) == 3:
        x, y, a = (plain(part, span, "an argument of mix()") for part in parts)
        if not isinstance(a.type, (Array, Matrix)) and element_of(a.type) is BOOL:
            return select([a, y, x], span, unit.builder.name_it)
    return _row("mix", unit, parts, span)


def _compared(name: str, unit: Unit, parts: list[Part], span: Span) -> Part:
    """``equal`` and ``notEqual``, of bools too."""
    values = [plain(part, span, f"an argument of {name}()") for part in parts]
    if all(isinstance(v.type, Vector) and v.type.element is BOOL for v in values):
        values = [apply("to_int", [v], span) for v in values]
    return apply(name, values, span)


def _multiplied(unit: Unit, parts: list[Part], span: Span) -> Part:
    """``matrixCompMult``: component by component."""
    values = [unit.builder.name_it(plain(part, span, "a matrix"), span) for part in parts]
    if len(values) != 2 or not isinstance(values[0].type, Matrix) or values[0].type != values[1].type:
        fail(span, "matrixCompMult() takes two matrices of one type")
    type_ = values[0].type
    at = [ir.Literal(INT, i, span) for i in range(type_.columns)]
    columns = tuple(apply("mul", [index_into(v, i, span) for v in values], span) for i in at)
    return ir.Construct(type_, columns, span)


def _bits(name: str, unit: Unit, parts: list[Part], span: Span) -> Part:
    """Bits of floats, component by component."""
    value = unit.builder.name_it(plain(parts[0], span, "an argument"), span)
    if isinstance(value.type, Scalar):
        return apply(name, [value], span)
    assert isinstance(value.type, Vector)
    element = value.type.element
    made = [apply(name, [ir.Swizzle(element, value, (i,), span)], span) for i in range(value.type.size)]
    scalar = made[0].type
    assert isinstance(scalar, Scalar)
    return ir.Construct(Vector(scalar, len(made)), tuple(made), span)


BUILTINS: dict[str, Native] = {
    **{name: partial(_called, name) for name in _SAME},
    **{name: partial(_row, row) for name, row in _OTHERWISE.items()},
    "mix": _mix,
    "equal": partial(_compared, "equal"),
    "notEqual": partial(_compared, "not_equal"),
    "matrixCompMult": _multiplied,
    "floatBitsToInt": partial(_bits, "bits_from_float"),
    "intBitsToFloat": partial(_bits, "float_from_bits"),
    **READS,
    **DERIVATIVES,
}
