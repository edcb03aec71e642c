"""GLSL's built-in functions: rows of the table of operations, reads of pictures, and others written in GLSL."""

from __future__ import annotations

import re
from functools import cache, partial

from passgraph.glsl import syntax as g
from passgraph.glsl.glsl_parser import Parser
from passgraph.glsl.image_functions import DERIVATIVES, READS
from passgraph.glsl.operators import as_int, plain, whole_numbers_alike
from passgraph.glsl.preprocess import preprocessed
from passgraph.glsl.unit import END, Native, Unit
from passgraph.language import ir
from passgraph.language.function_body import inlined
from passgraph.language.library import written_function
from passgraph.language.operations import OPERATIONS, called
from passgraph.language.source import Span, fail
from passgraph.language.types import BOOL, FLOAT, INT, UINT, Array, Matrix, Scalar, Vector, element_of
from passgraph.language.typing_rules import apply
from passgraph.language.values import Part, TupleValue, construct, convert, folded, index_into, select, settled

_WORD = re.compile(r"\w+")

#: Functions with the same name in GLSL and in the table.
_SAME = (
    "radians", "degrees", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "asinh", "acosh",
    "atanh", "pow", "exp", "log", "exp2", "log2", "sqrt", "inversesqrt", "abs", "sign", "floor", "ceil", "trunc",
    "round", "fract", "mod", "step", "smoothstep", "fma", "ldexp", "isnan", "isinf", "length",
    "distance", "dot", "cross", "normalize", "faceforward", "reflect", "refract", "transpose", "determinant",
    "inverse", "any", "all",
)  # fmt: skip
#: GLSL's name → the name in the table.
_OTHERWISE = {
    "roundEven": "round", "lessThan": "less", "lessThanEqual": "less_equal", "greaterThan": "greater",
    "greaterThanEqual": "greater_equal", "not": "logical_not", "outerProduct": "outer", "bitCount": "bit_count",
    "findLSB": "find_lsb", "findMSB": "find_msb", "bitfieldReverse": "bitfield_reverse",
    "bitfieldExtract": "bitfield_extract", "bitfieldInsert": "bitfield_insert",
}  # fmt: skip

#: Functions written in GLSL; ``genType`` stands for float and its vectors.
_GENERIC = """
genType modf(genType x, out genType whole) { whole = trunc(x); return pg_rest(x); }
genType frexp(genType x, out genIType exponent) { exponent = pg_exponent(x); return pg_mantissa(x); }
genUType uaddCarry(genUType x, genUType y, out genUType carry) { carry = genUType(lessThan(x + y, x)); return x + y; }
genUType usubBorrow(genUType x, genUType y, out genUType borrow) { borrow = genUType(lessThan(x, y)); return x - y; }
void umulExtended(genUType x, genUType y, out genUType msb, out genUType lsb) {
    genUType a = x >> 16u, b = x & 65535u, c = y >> 16u, d = y & 65535u;
    genUType one = a * d + ((b * d) >> 16u), other = b * c + (one & 65535u);
    msb = a * c + (one >> 16u) + (other >> 16u);
    lsb = x * y;
}
void imulExtended(genIType x, genIType y, out genIType msb, out genIType lsb) {
    genUType high, low;
    umulExtended(genUType(x), genUType(y), high, low);
    msb = genIType(high) - (x >> 31 & y) - (y >> 31 & x);
    lsb = x * y;
}
"""
_SCALAR = """
vec4 textureGatherOffset(sampler2D s, vec2 P, ivec2 offset, int c) {
    // Devices round places to 1/256 texel; the middle of a texel, where many gather, is a whole number here.
    ivec2 at = ivec2(floor(pg_texels(s, P) - 0.498046875)) + offset;
    return vec4(texelFetch(s, at + ivec2(0, 1), 0)[c], texelFetch(s, at + 1, 0)[c],
                texelFetch(s, at + ivec2(1, 0), 0)[c], texelFetch(s, at, 0)[c]);
}
vec4 textureGatherOffset(sampler2D s, vec2 P, ivec2 offset) { return textureGatherOffset(s, P, offset, 0); }
vec4 textureGather(sampler2D s, vec2 P, int c) { return textureGatherOffset(s, P, ivec2(0), c); }
vec4 textureGather(sampler2D s, vec2 P) { return textureGather(s, P, 0); }
vec4 textureGatherOffsets(sampler2D s, vec2 P, ivec2 offsets[4], int c) {
    return vec4(textureGatherOffset(s, P, offsets[0], c).w, textureGatherOffset(s, P, offsets[1], c).w,
                textureGatherOffset(s, P, offsets[2], c).w, textureGatherOffset(s, P, offsets[3], c).w);
}
vec4 textureGatherOffsets(sampler2D s, vec2 P, ivec2 offsets[4]) { return textureGatherOffsets(s, P, offsets, 0); }
"""


@cache
def _prelude() -> dict[str, tuple[g.Function, ...]]:
    text = _SCALAR
    for size in ("float", "vec2", "vec3", "vec4"):
        own = {
            "genType": size,
            "genIType": _integer_type(size, "i", "int"),
            "genUType": _integer_type(size, "u", "uint"),
        }
        text += _WORD.sub(lambda match, own=own: own.get(match[0], match[0]), _GENERIC)  # type: ignore[misc]
    tokens, _ = preprocessed([(text, "<GLSL functions>")], {}, None)
    functions: dict[str, tuple[g.Function, ...]] = {}
    for node in Parser(tokens, "<GLSL functions>").shader():
        if isinstance(node, g.Function):
            functions[node.name] = (*functions.get(node.name, ()), node)
    return functions


def _integer_type(size: str, letter: str, scalar: str) -> str:
    return scalar if size == "float" else letter + size


def prelude_functions(name: str) -> tuple[g.Function, ...]:
    """Return the overloads of a built-in function that is written in GLSL."""
    return _prelude().get(name, ())


def overloads(unit: Unit, name: str, place: int = END) -> tuple[g.Function, ...]:
    """Return the functions of a name with a body in GLSL: the shader's own that are declared up to a place, and
    built-in ones written in GLSL."""
    own = tuple(function for function in unit.functions.get(name, ()) if unit.declared_at[function] <= place)
    return own if name in BUILTINS else (*prelude_functions(name), *own)


def _row(name: str, unit: Unit, parts: list[Part], span: Span) -> Part:
    """Apply a row of the table, by its name there."""
    arguments = [plain(settled(part), span, f"an argument of {name}()") for part in parts]
    if set(OPERATIONS[name].operands if name in OPERATIONS else ()) == {"N"}:
        arguments = whole_numbers_alike(arguments, span)
    written = written_function(name, [a.type for a in arguments])
    if written is not None:
        return inlined(unit.builder, written, (list(arguments), {}), span)
    if len(arguments) > 1 or any(isinstance(a.type, Matrix) for a in arguments):
        arguments = [a if folded(a) is not None else unit.builder.name_it(a, span) for a in arguments]
    return apply(name, arguments, span)


def _written(name: str, member: int, unit: Unit, parts: list[Part], span: Span) -> Part:
    """Return one of the results of a library function."""
    arguments = [plain(part, span, "an argument") for part in parts]
    function = written_function(name, [a.type for a in arguments])
    assert function is not None
    result = inlined(unit.builder, function, (list(arguments), {}), span)
    return result.members[member] if isinstance(result, TupleValue) else result


def _called(name: str, unit: Unit, parts: list[Part], span: Span) -> Part:
    return _row(called(name, len(parts)), unit, parts, span)


def _limited(name: str, unit: Unit, parts: list[Part], span: Span) -> Part:
    """Apply ``min`` or ``max``; with a constant, NaN becomes the constant, as on devices."""
    if len(parts) == 2 and _is_known(parts[1]) and not _is_known(parts[0]):
        parts = [parts[1], parts[0]]
    return _called(name, unit, parts, span)


def _clamped(unit: Unit, parts: list[Part], span: Span) -> Part:
    if len(parts) == 3 and _is_known(parts[1]):
        return _limited("min", unit, [_limited("max", unit, parts[:2], span), parts[2]], span)
    return _called("clamp", unit, parts, span)


def _is_known(part: Part) -> bool:
    return isinstance(part, ir.Expr) and folded(part) is not None


def _mix(unit: Unit, parts: list[Part], span: Span) -> Part:
    """Interpolate between two values, or select by bools."""
    if len(parts) == 3:
        x, y, a = (plain(part, span, "an argument of mix()") for part in parts)
        if not isinstance(a.type, (Array, Matrix)) and element_of(a.type) is BOOL:
            return select([a, y, x], span, unit.builder.name_it)
    return _row("mix", unit, parts, span)


def _compared(name: str, unit: Unit, parts: list[Part], span: Span) -> Part:
    """Apply ``equal`` or ``notEqual``, also to bools."""
    values = [plain(part, span, f"an argument of {name}()") for part in parts]
    if all(isinstance(v.type, Vector) and v.type.element is BOOL for v in values):
        values = [apply("to_int", [v], span) for v in values]
    return apply(name, values, span)


def _multiplied(unit: Unit, parts: list[Part], span: Span) -> Part:
    """Apply ``matrixCompMult``, component by component."""
    values = [unit.builder.name_it(plain(part, span, "a matrix"), span) for part in parts]
    if len(values) != 2 or not isinstance(values[0].type, Matrix) or values[0].type != values[1].type:
        fail(span, "matrixCompMult() takes two matrices of one type")
    type_ = values[0].type
    at = [ir.Literal(INT, i, span) for i in range(type_.columns)]
    columns = tuple(apply("mul", [index_into(v, i, span) for v in values], span) for i in at)
    return ir.Construct(type_, columns, span)


def _bits(name: str, kind: Scalar, unit: Unit, parts: list[Part], span: Span) -> Part:
    """Reinterpret floats as integers, or integers as floats, component by component."""
    argument = plain(parts[0], span, "an argument") if len(parts) == 1 else None
    if argument is None or not isinstance(argument.type, (Scalar, Vector)):
        fail(span, "one number or vector is taken here")
    value = unit.builder.name_it(as_int(argument, span), span)
    if isinstance(value.type, Scalar):
        return convert(apply(name, [value], span), kind, span)
    assert isinstance(value.type, Vector)
    element = value.type.element
    components = [apply(name, [ir.Swizzle(element, value, (i,), span)], span) for i in range(value.type.size)]
    return convert(
        construct(Vector(element_of(components[0].type), len(components)), components, span, unit.builder.name_it),
        kind,
        span,
    )


_PACKS = ("Unorm4x8", "Snorm4x8", "Unorm2x16", "Snorm2x16", "Half2x16")
BUILTINS: dict[str, Native] = {
    **{name: partial(_called, name) for name in _SAME},
    **{name: partial(_row, row) for name, row in _OTHERWISE.items()},
    "min": partial(_limited, "min"),
    "max": partial(_limited, "max"),
    "clamp": _clamped,
    "mix": _mix,
    "equal": partial(_compared, "equal"),
    "notEqual": partial(_compared, "not_equal"),
    "matrixCompMult": _multiplied,
    "floatBitsToInt": partial(_bits, "bits_from_float", INT),
    "floatBitsToUint": partial(_bits, "bits_from_float", UINT),
    "intBitsToFloat": partial(_bits, "float_from_bits", FLOAT),
    "uintBitsToFloat": partial(_bits, "float_from_bits", FLOAT),
    **{f"pack{kind}": partial(_row, f"pack_{kind.lower()}") for kind in _PACKS},
    **{f"unpack{kind}": partial(_row, f"unpack_{kind.lower()}") for kind in _PACKS},
    "pg_rest": partial(_written, "modf", 1),
    "pg_mantissa": partial(_written, "frexp", 0),
    "pg_exponent": partial(_written, "frexp", 1),
    **READS,
    **DERIVATIVES,
}
