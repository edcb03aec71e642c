"""Names of GLSL, HLSL, OpenCL, Metal, Python and NumPy that kernels do not have, each with what is written instead."""

from __future__ import annotations

import re
from collections.abc import Iterable
from difflib import get_close_matches

from passgraph.language import symbols
from passgraph.language.operations import BUILTINS, FUNCTIONS
from passgraph.language.types import NAMED

#: Every name that the language itself has.
OWN = (*NAMED, *symbols.FUNCTIONS, *FUNCTIONS, *BUILTINS.values(), "Const", "Array", "Vertex", "len", "range", "pi")
#: Longest name that is compared with others.
_LONGEST = 40

_SAMPLE, _TEXEL, _SIZE = "image.sample(uv)", "image.texel(p)", "image.size"
#: Functions and values, each with the text of a kernel that gives the same.  What a text calls the language has, or the
#: row says nothing.
FORMS: dict[str, str] = {
    "lerp": "mix(a, b, t)", "frac": "fract(x)", "rsqrt": "inversesqrt(x)", "rcp": "1.0 / x", "recip": "1.0 / x",
    "atan2": "atan(y, x)", "arctan2": "atan(y, x)", "arctan": "atan(x)", "arcsin": "asin(x)", "arccos": "acos(x)",
    "fmod": "x - y * trunc(x / y)", "mul": "a * b", "matrixCompMult": "a * b",
    "matmul": "a @ b", "mad": "fma(a, b, c)", "power": "pow(x, y)", "powf": "pow(x, y)",
    "square": "x * x", "cbrt": "sign(x) * pow(abs(x), 1.0 / 3.0)",
    "hypot": "length(vec2(x, y))", "norm": "length(v)", "magnitude": "length(v)", "normalized": "normalize(v)",
    "exponential": "exp(x)", "maximum": "max(a, b)", "minimum": "min(a, b)", "fmax": "max(a, b)",
    "fmin": "min(a, b)", "clip": "clamp(x, low, high)", "absolute": "abs(x)", "fabs": "abs(x)", "rint": "round(x)",
    "roundEven": "round(x)", "where": "a if test else b", "sum": "dot(v, vec3(1.0))", "deg2rad": "radians(x)",
    "rad2deg": "degrees(x)", "lessThan": "less(v, w)", "lessThanEqual": "less_equal(v, w)",
    "greaterThan": "greater(v, w)", "greaterThanEqual": "greater_equal(v, w)", "notEqual": "not_equal(v, w)",
    "floatBitsToInt": "bits_from_float(x)", "asint": "bits_from_float(x)",
    "floatBitsToUint": "uint(bits_from_float(x))",
    "asuint": "uint(bits_from_float(x))", "as_int": "bits_from_float(x)", "intBitsToFloat": "float_from_bits(n)",
    "uintBitsToFloat": "float_from_bits(int(u))", "asfloat": "float_from_bits(n)", "as_float": "float_from_bits(n)",
    "bitCount": "bit_count(n)", "popcount": "bit_count(n)", "countbits": "bit_count(n)", "findLSB": "find_lsb(n)",
    "findMSB": "find_msb(n)", "firstbitlow": "find_lsb(n)", "firstbithigh": "find_msb(n)",
    "bitfieldReverse": "bitfield_reverse(n)", "reversebits": "bitfield_reverse(n)",
    "bitfieldExtract": "bitfield_extract(n, offset, bits)", "bitfieldInsert": "bitfield_insert(n, other, offset, bits)",
    "f32tof16": "half_bits(x)", "f16tof32": "float_of_half(u)",
    **{f"pack{kind}4x8": f"pack_{kind.lower()}4x8(rgba)" for kind in ("Unorm", "Snorm")},
    **{f"pack{kind}2x16": f"pack_{kind.lower()}2x16(xy)" for kind in ("Unorm", "Snorm", "Half")},
    **{f"unpack{kind}": f"unpack_{kind.lower()}(u)"
       for kind in ("Unorm4x8", "Snorm4x8", "Unorm2x16", "Snorm2x16", "Half2x16")},
    "ddx": "dfdx(x)", "ddy": "dfdy(x)",
    **dict.fromkeys(
        ("texture", "texture2D", "tex2D", "tex2Dlod", "texture2DLod", "textureLod", "sample", "Sample", "SampleLevel"),
        _SAMPLE,
    ),
    **dict.fromkeys(("texelFetch", "imageLoad", "read_imagef", "Load", "load", "fetch", "read", "at"), _TEXEL),
    **dict.fromkeys(("textureSize", "imageSize", "get_image_dim", "GetDimensions", "shape", "resolution"), _SIZE),
    **dict.fromkeys(("width", "get_image_width"), f"{_SIZE}.x"),
    **dict.fromkeys(("height", "get_image_height"), f"{_SIZE}.y"),
    **dict.fromkeys(("gl_FragCoord", "fragCoord", "SV_Position"), "pixel()"),
    **dict.fromkeys(("iResolution", "RENDERSIZE", "gl_NumWorkGroups"), "output_size()"),
    **dict.fromkeys(("get_global_id", "gl_GlobalInvocationID"), "pixel()"),
    **dict.fromkeys(("isf_FragNormCoord", "gl_TexCoord", "texCoord", "vUv", "v_uv"), "uv()"),
    "gl_FrontFacing": "front_facing()",
}  # fmt: skip
#: Types, each with the kernel's.
TYPES: dict[str, str] = {
    **{f"{kind}{n}": f"vec{n}" for kind in ("float", "half", "double", "dvec", "fvec") for n in (2, 3, 4)},
    **{f"{kind}{n}": f"ivec{n}" for kind in ("int", "short") for n in (2, 3, 4)},
    **{f"{kind}{n}": f"uvec{n}" for kind in ("uint", "ushort") for n in (2, 3, 4)},
    **{f"bool{n}": f"bvec{n}" for n in (2, 3, 4)},
    **{f"{kind}{n}x{n}": f"mat{n}" for kind in ("float", "half", "mat") for n in (2, 3, 4)},
    **{f"Vec{n}": f"vec{n}" for n in (2, 3, 4)},
    **dict.fromkeys(("half", "double", "float16", "float32", "float64", "f32", "number"), "float"),
    **dict.fromkeys(("short", "long", "int32", "int64", "i32"), "int"),
    **dict.fromkeys(("ushort", "uint8", "uint16", "uint32", "u32"), "uint"),
    **dict.fromkeys(("boolean", "bool_"), "bool"),
    **dict.fromkeys(("sampler2D", "Texture2D", "image2d_t", "texture2d", "Texture", "ndarray"), "Image"),
}
#: What is not one expression, in words.
WORDS: dict[str, str] = {
    "gl_Position": "a vertex kernel returns a struct with position: vec4",
    "gl_FragColor": "a kernel returns its colour",
    "gl_FragDepth": "a fragment kernel cannot change its depth; fragment_depth() reads it",
    "imageStore": "a kernel returns what its pixel becomes, and writes nothing else",
    "write_imagef": "a kernel returns what its pixel becomes, and writes nothing else",
    "print": "a kernel prints nothing; return a second result, or look at a pixel with passgraph inspect",
    "iTime": "a time is a parameter: time: float",
    "TIME": "a time is a parameter: time: float",
    "time": "a time is a parameter: time: float",
    "random": "a kernel has no random numbers; make a hash of pixel(), or take a picture of noise",
    "rand": "a kernel has no random numbers; make a hash of pixel(), or take a picture of noise",
    "enumerate": "count with range: for i in range(len(values)), and values[i] inside",
    "zip": "count with range: for i in range(len(values)), and one[i], other[i] inside",
    **dict.fromkeys(("PI", "M_PI"), "write math.pi (pi in the text of kernels)"),
    "pi": "write math.pi, with: import math",
}


def mending(name: str, known: Iterable[str] = ()) -> str:
    """What to write for a name that means nothing here, to be put behind a message; empty where nothing is near.

    ``known`` are further names that have a meaning.

    >>> mending("lerp"), mending("float4"), mending("smoothstp"), mending("strenght", ["strength"]), mending("zzz")
    ('; write mix(a, b, t)', '; write vec4', "; did you mean 'smoothstep'?", "; did you mean 'strength'?", '')
    """
    if name in WORDS:
        return f"; {WORDS[name]}"
    if name in TYPES:
        return f"; write {TYPES[name]}"
    form = FORMS.get(name)
    if form is not None and _has(form):
        return f"; write {form}"
    if name.endswith("f") and name[:-1] in FUNCTIONS:  # as in C
        return f"; write {_call(name[:-1])}"
    if len(name) > _LONGEST:
        return ""
    found = get_close_matches(name, dict.fromkeys((*known, *OWN)), n=1, cutoff=0.75)
    return f"; did you mean {found[0]!r}?" if found else ""


def own_spelling(name: str) -> str:
    """What to write for somebody else's function of a name, such as ``sin`` of NumPy; empty where there is nothing.

    >>> own_spelling("sin"), own_spelling("arctan2"), own_spelling("abs"), own_spelling("fft")
    ('; write sin(x), with: from passgraph import sin', '; write atan(y, x)', '; write abs(x)', '')
    """
    if name in FUNCTIONS or name in symbols.FUNCTIONS:
        return f"; write {_call(name)}, with: from passgraph import {name}"
    if name in NAMED or name in BUILTINS.values():
        return f"; write {name}(x)"
    return mending(name) if name in WORDS or name in TYPES or name in FORMS else ""


def method_spelling(name: str) -> str:
    """A method as the function that it is, such as ``.length()``.

    >>> method_spelling("length"), method_spelling("dot"), method_spelling("norm"), method_spelling("zzz")
    ('; write length(v)', '; write dot(v, …)', '; write length(v)', '')
    """
    row = FUNCTIONS.get(name)
    if row is not None:
        return f"; write {name}({', '.join(['v', '…'][: len(row.operands)])})"
    return mending(name) if name in FORMS else f"; write {name}(v)" if name in BUILTINS.values() else ""


def _has(form: str) -> bool:
    return all(called in OWN for called in re.findall(r"(?<![.\w])[a-z_]\w*(?=\()", form))


def _call(name: str) -> str:
    """A function of the language with letters for what it takes."""
    row = FUNCTIONS.get(name)
    return f"{name}({', '.join('xyz'[: len(row.operands)]) if row is not None else 'x'})"
