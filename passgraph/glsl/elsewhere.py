"""Messages for words that are not defined in fragment shaders here: of other stages and of parts of GLSL that are not
read, of HLSL and Cg, and misspelled ones."""

from __future__ import annotations

import re
from collections.abc import Iterable
from difflib import get_close_matches

_STAGES = {
    "compute": re.compile(
        r"local_size_[xyz](_id)?|shared|gl_(Global|Local)Invocation(ID|Index)|gl_WorkGroup(ID|Size)|gl_NumWorkGroups"
        r"|barrier|(groupM|m)emoryBarrier\w*|[iu]?image(1D|2D|3D|Cube|2DRect|Buffer|1DArray|2DArray|CubeArray|2DMS)"
        r"|image(Load|Store|Size|Atomic\w+)|atomic(_uint|Counter\w*|Add|Min|Max|And|Or|Xor|Exchange|CompSwap)"
    ),
    "geometry": re.compile(r"EmitVertex|EndPrimitive|(Emit|End)Stream\w+|gl_PrimitiveIDIn|max_vertices"),
    "tessellation": re.compile(r"gl_Tess\w+|gl_PatchVerticesIn|patch"),
    "vertex": re.compile(r"gl_(Position|PointSize|VertexID|InstanceID|Vertex|MultiTexCoord\d)|ftransform"),
}

_KINDS_OF_PICTURES = "1D|2D|3D|Cube|1DArray|2DArray|CubeArray|2DRect|Buffer|2DMS|2DMSArray"
#: Other parts of GLSL that are not read, with the reasons. `docs/shaders.md` lists them.
_NOT_READ = (
    (
        re.compile(r"double|d(vec[234]|mat[234](x[234])?)|(u?int|float)(8|16|64)_t|[iuf](8|16|64)vec[234]"),
        "numbers have 32 bits; write float, int or uint",
    ),
    (
        re.compile(
            rf"[iu]sampler({_KINDS_OF_PICTURES})|sampler({_KINDS_OF_PICTURES})Shadow"
            r"|sampler(Cube|1DArray|2DArray|CubeArray|Buffer|2DMS|2DMSArray|External2DY2YEXT)"
            r"|(texture|shadow)(Cube|[12]DArray)\w*|shadow[12]D\w*"
        ),
        "pictures are flat, or volumes, and hold floats; write sampler2D or sampler3D",
    ),
    (
        re.compile(rf"[iu]?texture({_KINDS_OF_PICTURES})|sampler|samplerShadow|[iu]?subpassInput(MS)?|subpassLoad"),
        "textures and samplers are one; write uniform sampler2D",
    ),
    (re.compile("subroutine"), "functions are called by their names; choose between them with if or switch"),
    (
        re.compile(r"gl_Sample(ID|Position|Mask|MaskIn)|gl_NumSamples|interpolateAt(Centroid|Sample|Offset)"),
        "a pixel has one sample, in its center",
    ),
    (
        re.compile(
            r"gl_(Layer|ViewportIndex|PrimitiveID|ClipDistance|CullDistance|HelperInvocation|LastFragData|LastFragColor)\w*"
        ),
        "a pass over a picture has none",
    ),
    (
        re.compile(
            r"gl_(LightSource|LightModel|Front\w*|Back\w*|Fog|Point|ClipPlane|Texture\w+|EyePlane\w|ObjectPlane\w"
            r"|ModelView\w*|Projection\w*|NormalMatrix|NormalScale)"
        ),
        "fixed functions have no lights, materials, matrices or fog; declare uniforms for them",
    ),
    (re.compile(r"noise[1-4]"), "most drivers give 0, and no two the same; write a noise of your own"),
)


def elsewhere(word: str) -> str | None:
    """Return the reason why an undeclared word of GLSL is not available; None for other words.

    >>> elsewhere("imageStore")
    'imageStore belongs to compute shaders, which are not read here: a fragment shader gives its own pixel a color'
    >>> elsewhere("double")
    'double is not read here: numbers have 32 bits; write float, int or uint'
    >>> elsewhere("texture")
    """
    for stage, words in _STAGES.items():
        if words.fullmatch(word):
            reason = "which are not read here: a fragment shader gives its own pixel a color"
            return f"{word} belongs to {stage} shaders, {reason}"
    reason = next((reason for words, reason in _NOT_READ if words.fullmatch(word)), "")
    return f"{word} is not read here: {reason}" if reason else None


#: Functions of GLSL and its extensions of which some are not read here.
_BUILT_IN = re.compile(
    r"(sparseT|t)ex(ture[A-Z1-3]|elFetch[A-Z1-3])\w*|(dFd[xy]|fwidth)(Fine|Coarse)|(un)?packDouble2x32"
    r"|subgroup[A-Z]\w*|(all|any)Invocations?[A-Z]\w*"
)


def is_built_in(name: str) -> bool:
    """Return True for a name that GLSL or an extension of it gives to a function.

    >>> is_built_in("textureCube"), is_built_in("textured"), is_built_in("blur")
    (True, False, False)
    """
    return _BUILT_IN.fullmatch(name) is not None or elsewhere(name) is not None


#: Functions of HLSL and Cg → their equivalents in GLSL.
_FUNCTIONS = {
    "lerp": "mix(a, b, t)", "frac": "fract(x)", "saturate": "clamp(x, 0.0, 1.0)", "atan2": "atan(y, x)",
    "rsqrt": "inversesqrt(x)", "ddx": "dFdx(v)", "ddy": "dFdy(v)", "mul": "a * b", "mad": "a * b + c",
    "tex2D": "texture(s, uv)", "tex2Dlod": "textureLod(s, uv, level)", "tex2Dproj": "textureProj(s, p)",
    "fmod": "a - b * trunc(a / b)", "clip": "if (x < 0.0) discard;", "asfloat": "intBitsToFloat(i)",
    "asint": "floatBitsToInt(x)", "asuint": "floatBitsToUint(x)",
}  # fmt: skip
#: Types of HLSL and Cg.
_VECTOR = re.compile(r"(float|half|fixed|double|int|uint|bool)([234])(?:x([234]))?")
_KINDS = {"int": "i", "uint": "u", "bool": "b"}
#: Longest word for which similar ones are searched, since the search is slow for long words.
_LONGEST = 64


def mending(word: str, names: Iterable[str]) -> str:
    """Return a suggestion for an unknown word, to append to a message; empty if nothing is similar.

    >>> mending("lerp", ()), mending("float3x3", ()), mending("colr", ["color", "k"]), mending("zzz", ["color"])
    ('; write mix(a, b, t)', '; write mat3', "; did you mean 'color'?", '')
    """
    if word in _FUNCTIONS:
        return f"; write {_FUNCTIONS[word]}"
    if (type_name := type_of(word)) is not None:
        return f"; write {type_name}"
    matches = get_close_matches(word, dict.fromkeys(names), n=1, cutoff=0.75) if len(word) <= _LONGEST else ()
    return f"; did you mean {matches[0]!r}?" if matches else ""


def type_of(word: str) -> str | None:
    """Return GLSL's name of a type of HLSL and Cg.

    >>> type_of("half4"), type_of("uint2"), type_of("float2x3"), type_of("vec4")
    ('vec4', 'uvec2', 'mat3x2', None)
    """
    match = _VECTOR.fullmatch(word)
    if match is None:
        return None
    kind, rows, columns = match.groups()
    if columns is None:
        return f"{_KINDS.get(kind, '')}vec{rows}"
    return f"mat{rows}" if rows == columns else f"mat{columns}x{rows}"  # GLSL counts columns first
