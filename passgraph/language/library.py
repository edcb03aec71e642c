"""Functions of the kernel language that are written in it.

Image reads beyond one texel, functions with several results, packing, and functions of vectors with one float argument.
Each is inlined by the parser, so later stages do not know them.
"""

from __future__ import annotations

import ast
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

from passgraph.errors import PassgraphError
from passgraph.language.border_rules import BORDERS
from passgraph.language.operations import OPERATIONS
from passgraph.language.scope import TEXT_NAMES, FunctionSource, Scope
from passgraph.language.source import Source
from passgraph.language.types import FLOAT, INT, UINT, Scalar, Type

#: File name in spans of its functions.
LIBRARY = "<passgraph library>"
_LIBRARY = '''
def pixel_uv() -> vec2:
    """The centre of this pixel, 0 to 1; (0, 0) is the top left corner of the picture."""
    return (vec2(pixel()) + 0.5) / vec2(output_size())

def nearest(image: Image, position: vec2) -> vec4:
    """The texel in which a position lies."""
    return image.texel(ivec2(floor(position * vec2(image.size))))

def between(position: vec2, size: ivec2) -> vec2:
    """How far a position lies from the middle of the first texel, in texels."""
    # Farther out the next texel's number would not fit into an int; 2**30 lies beyond every picture.
    return clamp(position * vec2(size) - 0.5, -1073741824.0, 1073741824.0)

def linear(image: Image, position: vec2) -> vec4:
    """Bilinear, with weights computed here in float32, so that every backend filters alike."""
    p = between(position, image.size)
    base = floor(p)
    f = p - base
    corner = ivec2(base)
    top = mix(image.texel(corner), image.texel(corner + ivec2(1, 0)), f.x)
    bottom = mix(image.texel(corner + ivec2(0, 1)), image.texel(corner + ivec2(1, 1)), f.x)
    return mix(top, bottom, f.y)

def texel(image: Image, position: ivec2) -> vec4:
    """A texel by its column and row."""
    return image.texel(position)

def lod(image: Image, position: vec2) -> float:
    """How often a picture is halved until a texel is as long as what a pixel sees of it, along the longer side."""
    texels = position * vec2(image.size)
    return log2(max(length(dfdx(texels)), length(dfdy(texels))))

def lod_along(image: Image, across: vec2, down: vec2) -> float:
    """As lod, of a position that grows so much from pixel to pixel."""
    size = vec2(image.size)
    return log2(max(length(across * size), length(down * size)))

def sample(image: Image, position: vec2) -> vec4:
    """By the filter of the handle."""
    if image.is_nearest:
        return nearest(image, position)
    if image.bits > 0:
        return coarse(image, position)
    return linear(image, position)

def coarse(image: Image, position: vec2) -> vec4:
    """As linear, or as a device filters: weights of 8 bits each way; results of 8 bits where the texels have 8."""
    p = between(position, image.size)
    corner = ivec2(floor(p))
    a, b = image.texel(corner), image.texel(corner + ivec2(1, 0))
    c, d = image.texel(corner + ivec2(0, 1)), image.texel(corner + ivec2(1, 1))
    low, high = min(min(a, b), min(c, d)), max(max(a, b), max(c, d))
    # llvmpipe weights channels of 8 bits in 8 bits, twice: two steps.
    rounding = vec4(0.0078125) if image.bits == 8 else max(abs(low), abs(high)) * 9.5367431640625e-07
    slack = (high - low) / 128.0 + rounding
    # No specification says what a device makes of NaN and of places far outside.  Where those are not all alike, as
    # they are under clamp and zero, the place itself is rounded: from 2**14 on by a quarter of a weight's unit or more.
    near = all(abs(p) < vec2(1048576.0 if image.border <= 1 else 16384.0))
    return image._filtered(position, linear(image, position), slack if near else vec4(1.0) / 0.0)

def gather(image: Image, position: vec2, channel: int) -> vec4:
    """A channel of the four texels that a bilinear sample weights."""
    corner = ivec2(floor(between(position, image.size)))
    below, above = image.texel(corner + ivec2(0, 1)), image.texel(corner)
    beside_below, beside = image.texel(corner + ivec2(1, 1)), image.texel(corner + ivec2(1, 0))
    return vec4(below[channel], beside_below[channel], beside[channel], above[channel])

def size_of(image: Image, level: int) -> ivec2:
    """Width and height of a level: halves, rounded down."""
    return max(image.size >> clamp(level, 0, image.levels - 1), ivec2(1))

def below(image: Image, mips: Image, p: ivec2, level: int) -> vec4:
    """A texel of a level from 1 on, where :mod:`passgraph.plan.mipmaps` put it."""
    size = size_of(image, level)
    at = ivec2(placed(p.x, size.x, image.border), placed(p.y, size.y, image.border))
    height = image.size.y
    first = height - (height >> (level - 1)) + level - 1
    # The picture of levels has the border rule of the image: far outside it is blank too.
    return mips.texel(ivec2(-1) if image.is_blank and any(at != p) else at + ivec2(0, first))

def texel_of(image: Image, mips: Image, p: ivec2, level: int) -> vec4:
    """A texel of a level; beyond the last one, of that one."""
    if image.levels == 1:
        return image.texel(p)
    at = min(level, image.levels - 1)
    if at <= 0:
        return image.texel(p)
    return below(image, mips, p, at)

def linear_of(image: Image, mips: Image, position: vec2, level: int, lowest: int, upward: bool) -> vec4:
    """Bilinear in a level that there is, from a ``lowest`` one on; ``upward``, rows are counted from the bottom."""
    size = size_of(image, level)
    p = between(position, size)
    base = floor(p)
    f = p - base
    corner, up = ivec2(base), ivec2(0, 1)
    if upward:
        corner, up = ivec2(corner.x, size.y - 1 - corner.y), ivec2(0, -1)
    a, b, c, d = vec4(0), vec4(0), vec4(0), vec4(0)
    if lowest == 0 and level == 0:
        for i in range(4):
            a, b, c, d = b, c, d, image.texel(corner + up * (i // 2) + ivec2(i % 2, 0))
    else:
        for i in range(4):
            a, b, c, d = b, c, d, below(image, mips, corner + up * (i // 2) + ivec2(i % 2, 0), level)
    return mix(mix(a, b, f.x), mix(c, d, f.x), f.y)

def sample_between(image: Image, mips: Image, position: vec2, lod: float) -> vec4:
    """By the filter of the handle between two levels, or in the nearest one."""
    return sample_beside(image, mips, position, lod, ivec2(0), False)

def lod_within(image: Image, lod: float) -> float:
    """Between which levels, or which one, a picture is read that is to be read at a level of detail."""
    # Of max() a NaN as the second argument is ignored.
    at = min(max(0.0, lod), float(image.levels - 1))
    # Halves go to the larger level, as in OpenGL.
    return ceil(at - 0.5) if image.is_nearest else at

def sample_beside(image: Image, mips: Image, position: vec2, lod: float, offset: ivec2, upward: bool) -> vec4:
    """As sample_between, so many texels of each level farther; ``upward``, rows are counted from the bottom."""
    if image.levels == 1:
        here = moved(position, image.size, offset)
        if upward:
            return sample_upward(image, here)
        return sample(image, here)
    at = lod_within(image, lod)
    base = floor(at)
    if image.is_nearest:
        level = int(base)
        size = size_of(image, level)
        texels = moved(position, size, offset) * vec2(size)
        # Farther out the row counted from the top would not fit into an int.
        p = ivec2(floor(clamp(texels, -1073741824.0, 1073741824.0) if upward else texels))
        return texel_of(image, mips, ivec2(p.x, size.y - 1 - p.y) if upward else p, level)
    # A loop of two trips, so that a read is half as long while it is not unrolled.
    upper, lower = vec4(0), vec4(0)
    for k in range(2):
        level = min(int(base) + k, image.levels - 1)
        here = moved(position, size_of(image, level), offset)
        upper, lower = lower, linear_of(image, mips, here, level, k, upward)
    return mix(upper, lower, at - base)

def moved(position: vec2, size: ivec2, offset: ivec2) -> vec2:
    """A position so many texels farther."""
    if all(offset == ivec2(0)):
        return position
    return position + vec2(offset) / vec2(size)

def layered(image: Image, size: ivec2, p: ivec3) -> vec4:
    """A texel of a volume, whose slices lie below one another."""
    x, y = placed(p.x, size.x, image.border), placed(p.y, size.y, image.border)
    z = placed(p.z, image.slices, image.border)
    at = ivec2(x, y + z * size.y)
    return image.texel(ivec2(-1) if image.is_blank and any(ivec3(x, y, z) != p) else at)

def sample3(image: Image, position: vec3) -> vec4:
    """Trilinear in a volume, or the texel of it in which a position lies."""
    size = image.size // ivec2(1, image.slices)
    if image.is_nearest:
        return layered(image, size, ivec3(floor(position * vec3(size, image.slices))))
    p = clamp(position * vec3(size, image.slices) - 0.5, -1073741824.0, 1073741824.0)
    base = floor(p)
    f = p - base
    a = ivec3(base)
    result = [vec4(0)] * 2
    for k in range(2):
        top = mix(layered(image, size, a + ivec3(0, 0, k)), layered(image, size, a + ivec3(1, 0, k)), f.x)
        bottom = mix(layered(image, size, a + ivec3(0, 1, k)), layered(image, size, a + ivec3(1, 1, k)), f.x)
        result[k] = mix(top, bottom, f.y)
    return mix(result[0], result[1], f.z)

def texel_upward(image: Image, position: ivec2) -> vec4:
    """A texel whose row is counted from the bottom up, as OpenGL does."""
    return image.texel(ivec2(position.x, image.size.y - 1 - position.y))

def texel_of_upward(image: Image, mips: Image, p: ivec2, level: int) -> vec4:
    """As texel_of; in each level rows are counted from the bottom up."""
    if image.levels == 1:
        return texel_upward(image, p)
    return texel_of(image, mips, ivec2(p.x, size_of(image, level).y - 1 - p.y), level)

def sample_upward(image: Image, position: vec2) -> vec4:
    """As sample, with (0, 0) the bottom left corner: texels and their weights are those that OpenGL takes."""
    if image.is_nearest:
        # Farther out the row counted from the top would not fit into an int.
        return texel_upward(image, ivec2(floor(clamp(position * vec2(image.size), -1073741824.0, 1073741824.0))))
    if image.bits > 0:
        return coarse(image, vec2(position.x, 1.0 - position.y))
    p = between(position, image.size)
    base = floor(p)
    f = p - base
    corner = ivec2(base.x, image.size.y - 1 - int(base.y))
    lower = mix(image.texel(corner), image.texel(corner + ivec2(1, 0)), f.x)
    upper = mix(image.texel(corner - ivec2(0, 1)), image.texel(corner + ivec2(1, -1)), f.x)
    return mix(lower, upper, f.y)

def placed(i: int, size: int, rule: int) -> int:
    """Where along an axis of ``size`` texels a read of texel ``i`` finds its texel, by the number of a border rule."""
'''

# Overloads of a function end in the type of their first argument.

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
    fraction = bits & 0x7FFFFF
    # A denormal is fraction * 2**-149: its highest bit becomes the one that other numbers do not store.
    top = find_msb(fraction)
    denormal = exponent == 0
    digits = (fraction << (23 - top)) & 0x7FFFFF if denormal else fraction
    usual = exponent != 0xFF and (not denormal or fraction != 0)
    mantissa = float_from_bits((bits >> 31 << 31) | 0x3F000000 | digits)
    return (mantissa if usual else x), ((top - 148 if denormal else exponent - 126) if usual else 0)"""

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
    """Return the functions with several results, for a float and for each vector of floats, component-wise."""
    texts = [_OF_FLOATS.format(T="float", I="int", frexp=_FREXP)]
    for size in (2, 3, 4):
        each = [f"m{c}, e{c} = frexp_float(x.{c})" for c in "xyzw"[:size]]
        joined = (", ".join(f"{part}{c}" for c in "xyzw"[:size]) for part in "me")
        vectors = "vec{0}({1}), ivec{0}({2})".format(size, *joined)
        lines = "\n    ".join([*each, f"return {vectors}"])
        texts.append(_OF_FLOATS.format(T=f"vec{size}", I=f"ivec{size}", frexp=lines))
    return "".join(texts)


def functions_of(source: Source, extra: dict[str, object] | None = None) -> dict[str, FunctionSource]:
    """Return every function defined in a text; they see each other and the language."""
    names: dict[str, object] = dict(extra or {})
    functions: dict[str, FunctionSource] = {}
    scope = Scope(
        lambda name: functions[name] if name in functions else names[name] if name in names else TEXT_NAMES[name]
    )
    for node in source.parse().body:
        if isinstance(node, ast.FunctionDef):
            functions[node.name] = FunctionSource.of_node(source, node, scope)
    return functions


def _rules() -> str:
    """Return the body of ``placed``: a return for each rule."""
    lines = [f"    if rule == {number}:\n        return {row.place}" for number, row in enumerate(BORDERS.values())]
    return "\n".join([*lines, "    return i\n"])


@lru_cache(maxsize=1)
def _library() -> dict[str, FunctionSource]:
    return functions_of(Source(LIBRARY, _LIBRARY + _rules() + _of_floats() + _PACKING + _OF_ONE_FLOAT))


@lru_cache(maxsize=1)
def _prelude() -> dict[str, FunctionSource]:
    functions: dict[str, FunctionSource] = {}
    for name in ("prelude", "prelude_whole"):
        text = Path(__file__).with_name(f"{name}.py").read_text(encoding="utf-8")
        functions |= functions_of(Source(f"<passgraph {name}>", text), dict(functions))
    return functions


def library_function(name: str) -> FunctionSource:
    return _library()[name]


def written_function(name: str, arguments: Sequence[Type]) -> FunctionSource | None:
    """Return the library function with this name for such arguments; None if there is none.

    A name that is also an operation is a library function for single numbers only.
    """
    functions = _library()
    first = next(iter(arguments), FLOAT)
    kind = f"{name}_{FLOAT if first in (INT, UINT) else first}"
    if name in OPERATIONS:
        fitting = len(arguments) == len(OPERATIONS[name].operands) and all(isinstance(a, Scalar) for a in arguments)
        return functions.get(kind) if fitting else None
    source = functions.get(kind) or functions.get(name)
    return source or functions.get(f"{name}_{FLOAT}")


def prelude_function(name: str) -> FunctionSource:
    """Return a scalar function of :mod:`.prelude` or :mod:`.prelude_whole`."""
    functions = _prelude()
    if name not in functions:
        raise PassgraphError(f"the prelude has no function {name}")
    return functions[name]
