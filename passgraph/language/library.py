"""Functions of the language that are written in the language.

Image reads beyond one texel, functions of several results, packing, and functions of vectors for one float.  Each is
taken apart where it is called, so nothing behind the parser knows it.
"""

from __future__ import annotations

import ast
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

from passgraph.errors import PassgraphError
from passgraph.language.operations import OPERATIONS
from passgraph.language.scope import TEXT_NAMES, FunctionSource, Scope
from passgraph.language.source import Source
from passgraph.language.types import FLOAT, INT, UINT, Scalar, Type

_LIBRARY = '''
def pixel_uv() -> vec2:
    """The centre of this pixel, 0 to 1; (0, 0) is the top left corner of the picture."""
    return (vec2(pixel()) + 0.5) / vec2(output_size())

def sample(image: Image, position: vec2) -> vec4:
    """Bilinear, with weights computed here in float32, so that every backend filters alike."""
    # Farther out the next texel's number would not fit into an int; 2**30 lies beyond every picture.
    p = clamp(position * vec2(image.size) - 0.5, -1073741824.0, 1073741824.0)
    base = floor(p)
    f = p - base
    corner = ivec2(base)
    top = mix(image.texel(corner), image.texel(corner + ivec2(1, 0)), f.x)
    bottom = mix(image.texel(corner + ivec2(0, 1)), image.texel(corner + ivec2(1, 1)), f.x)
    return mix(top, bottom, f.y)

def lod(image: Image, position: vec2) -> float:
    """How often a picture is halved until a texel is as long as what a pixel sees of it, along the longer side."""
    texels = position * vec2(image.size)
    return log2(max(length(dfdx(texels)), length(dfdy(texels))))

def texel_upward(image: Image, position: ivec2) -> vec4:
    """A texel whose row is counted from the bottom up, as OpenGL does."""
    return image.texel(ivec2(position.x, image.size.y - 1 - position.y))

def sample_upward(image: Image, position: vec2) -> vec4:
    """As sample, with (0, 0) the bottom left corner: texels and their weights are those that OpenGL takes."""
    p = clamp(position * vec2(image.size) - 0.5, -1073741824.0, 1073741824.0)
    base = floor(p)
    f = p - base
    corner = ivec2(base.x, image.size.y - 1 - int(base.y))
    lower = mix(image.texel(corner), image.texel(corner + ivec2(1, 0)), f.x)
    upper = mix(image.texel(corner - ivec2(0, 1)), image.texel(corner + ivec2(1, -1)), f.x)
    return mix(lower, upper, f.y)
'''

# Where a name has several functions, each ends in the type of its first argument.

_OF_FLOATS = '''
def modf_{T}(x: {T}) -> tuple[{T}, {T}]:
    """The whole part, toward zero, and the rest, which has the sign of x; of an infinity 0 is left."""
    whole = trunc(x)
    return whole, select(isinf(x), {T}(0.0), x - whole)

def frexp_{T}(x: {T}) -> tuple[{T}, {I}]:
    """x as m * 2**e: m, from 1/2 to below 1 in size, and e; 0, infinities and NaN have an e of 0."""
    {frexp}
'''

_FREXP = """bits = bits_from_float(x)
    exponent = (bits >> 23) & 0xFF
    usual = exponent != 0 and exponent != 0xFF
    mantissa = float_from_bits((bits & -2139095041) | 0x3F000000)
    return (mantissa if usual else x), (exponent - 126 if usual else 0)"""

_PACKING = '''
def pack_unorm4x8(v: vec4) -> uint:
    """Four numbers from 0 to 1 as bytes, the first in the lowest bits; halves to even."""
    b = uvec4(round(clamp(v, 0.0, 1.0) * 255.0))
    return b.x | (b.y << 8) | (b.z << 16) | (b.w << 24)

def pack_snorm4x8(v: vec4) -> uint:
    """Four numbers from -1 to 1 as signed bytes of ±127, the first in the lowest bits; halves to even."""
    b = uvec4(ivec4(round(clamp(v, -1.0, 1.0) * 127.0))) & 0xFF
    return b.x | (b.y << 8) | (b.z << 16) | (b.w << 24)

def pack_unorm2x16(v: vec2) -> uint:
    """Two numbers from 0 to 1 as 16 bits each, the first in the lowest; halves to even."""
    b = uvec2(round(clamp(v, 0.0, 1.0) * 65535.0))
    return b.x | (b.y << 16)

def pack_snorm2x16(v: vec2) -> uint:
    """Two numbers from -1 to 1 as signed 16 bits of ±32767 each, the first in the lowest; halves to even."""
    b = uvec2(ivec2(round(clamp(v, -1.0, 1.0) * 32767.0))) & 0xFFFF
    return b.x | (b.y << 16)

def pack_half2x16(v: vec2) -> uint:
    """Two numbers as binary16, the first in the lowest bits; halves to even, 65520 and above infinite."""
    b = half_bits(v)
    return b.x | (b.y << 16)

def unpack_unorm4x8(bits: uint) -> vec4:
    """What pack_unorm4x8 packed: each byte over 255."""
    return vec4(uvec4(bits, bits >> 8, bits >> 16, bits >> 24) & 0xFF) / 255.0

def unpack_snorm4x8(bits: uint) -> vec4:
    """What pack_snorm4x8 packed: each signed byte over 127, from -1."""
    return max(vec4(ivec4(uvec4(bits << 24, bits << 16, bits << 8, bits)) >> 24) / 127.0, -1.0)

def unpack_unorm2x16(bits: uint) -> vec2:
    """What pack_unorm2x16 packed: each 16 bits over 65535."""
    return vec2(uvec2(bits, bits >> 16) & 0xFFFF) / 65535.0

def unpack_snorm2x16(bits: uint) -> vec2:
    """What pack_snorm2x16 packed: each signed 16 bits over 32767, from -1."""
    return max(vec2(ivec2(uvec2(bits << 16, bits)) >> 16) / 32767.0, -1.0)

def unpack_half2x16(bits: uint) -> vec2:
    """What pack_half2x16 packed."""
    return float_of_half(uvec2(bits, bits >> 16))
'''

_OF_ONE_FLOAT = """
def length_float(x: float) -> float:
    return abs(x)

def distance_float(a: float, b: float) -> float:
    return abs(a - b)

def dot_float(a: float, b: float) -> float:
    return a * b

def normalize_float(x: float) -> float:
    return x if isnan(x) else sign(x)

def faceforward_float(n: float, incident: float, reference: float) -> float:
    return n if reference * incident < 0.0 else -n

def reflect_float(incident: float, normal: float) -> float:
    return incident - 2.0 * (normal * incident) * normal

def refract_float(incident: float, normal: float, ratio: float) -> float:
    cosine = normal * incident
    k = 1.0 - ratio * ratio * (1.0 - cosine * cosine)
    bent = ratio * incident - (ratio * cosine + sqrt(max(k, 0.0))) * normal
    return 0.0 if k < 0.0 else bent
"""


def _of_floats() -> str:
    """The functions of several results, for a float and for each vector of floats, whose components go one by one."""
    texts = [_OF_FLOATS.format(T="float", I="int", frexp=_FREXP)]
    for size in (2, 3, 4):
        each = [f"m{c}, e{c} = frexp_float(x.{c})" for c in "xyzw"[:size]]
        joined = (", ".join(f"{part}{c}" for c in "xyzw"[:size]) for part in "me")
        made = "vec{0}({1}), ivec{0}({2})".format(size, *joined)
        lines = "\n    ".join([*each, f"return {made}"])
        texts.append(_OF_FLOATS.format(T=f"vec{size}", I=f"ivec{size}", frexp=lines))
    return "".join(texts)


def functions_of(source: Source, extra: dict[str, object] | None = None) -> dict[str, FunctionSource]:
    """Every function defined in a text; they see each other and the language."""
    names: dict[str, object] = dict(extra or {})
    functions: dict[str, FunctionSource] = {}
    scope = Scope(
        lambda name: functions[name] if name in functions else names[name] if name in names else TEXT_NAMES[name]
    )
    for node in source.parse().body:
        if isinstance(node, ast.FunctionDef):
            functions[node.name] = FunctionSource(node.name, source, node, scope)
    return functions


@lru_cache(maxsize=1)
def _library() -> dict[str, FunctionSource]:
    return functions_of(Source("<passgraph library>", _LIBRARY + _of_floats() + _PACKING + _OF_ONE_FLOAT))


@lru_cache(maxsize=1)
def _prelude() -> dict[str, FunctionSource]:
    found: dict[str, FunctionSource] = {}
    for name in ("prelude", "prelude_whole"):
        text = Path(__file__).with_name(f"{name}.py").read_text(encoding="utf-8")
        found |= functions_of(Source(f"<passgraph {name}>", text), dict(found))
    return found


def library_function(name: str) -> FunctionSource:
    return _library()[name]


def written_function(name: str, arguments: Sequence[Type]) -> FunctionSource | None:
    """The function of a name that kernels call, for such arguments; None where that name is no function of the library.

    A name that is an operation too is one of the library for single numbers alone.
    """
    functions = _library()
    first = next(iter(arguments), FLOAT)
    kind = f"{name}_{FLOAT if first in (INT, UINT) else first}"
    if name in OPERATIONS:
        fitting = len(arguments) == len(OPERATIONS[name].operands) and all(isinstance(a, Scalar) for a in arguments)
        return functions.get(kind) if fitting else None
    found = functions.get(kind) or functions.get(name)
    return found or functions.get(f"{name}_{FLOAT}")


def prelude_function(name: str) -> FunctionSource:
    """A scalar function of :mod:`.prelude` or :mod:`.prelude_whole`."""
    functions = _prelude()
    if name not in functions:
        raise PassgraphError(f"the prelude has no function {name}")
    return functions[name]
