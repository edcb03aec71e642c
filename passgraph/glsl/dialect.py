"""What a version of GLSL forbids: names of variables, operators, and an order of qualifiers.

Sources: OpenGL Shading Language 1.10, 1.20, 1.30, 1.40, 1.50, 3.30, 4.00 to 4.60, and ES 1.00, 3.00 to 3.20, section
"Keywords" of each.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

_ALWAYS = """
    const uniform break continue do for while if else in out inout float int void bool true false discard
    return struct asm class union enum typedef template this goto switch default inline noinline public static extern
    external interface long short double half fixed unsigned input output sizeof cast namespace using
    hvec2 hvec3 hvec4 fvec2 fvec3 fvec4 dvec2 dvec3 dvec4 vec2 vec3 vec4 ivec2 ivec3 ivec4 bvec2 bvec3 bvec4
    mat2 mat3 mat4 sampler1D sampler2D sampler3D samplerCube sampler1DShadow sampler2DShadow sampler2DRect
    sampler2DRectShadow sampler3DRect
"""
_MATRICES = "mat2x2 mat2x3 mat2x4 mat3x2 mat3x3 mat3x4 mat4x2 mat4x3 mat4x4"
_IMAGES = " ".join(
    f"{letter}image{kind}"
    for letter in ("", "i", "u")
    for kind in ("1D", "2D", "3D", "Cube", "1DArray", "2DArray", "Buffer")
)
_SAMPLERS = " ".join(
    f"{letter}sampler{kind}"
    for letter in ("", "i", "u")
    for kind in ("1D", "2D", "3D", "Cube", "1DArray", "2DArray", "2DRect", "Buffer", "2DMS", "2DMSArray")
)
#: Words of all versions but 1.10.
_PRECISION = "lowp mediump highp precision invariant"
#: Words of GLSL 1.30 and ES 3.00, and of all later versions.
_NEWER = f"""
    layout centroid flat smooth noperspective case uint uvec2 uvec3 uvec4 attribute varying common partition active
    superp filter samplerCubeShadow sampler1DArrayShadow sampler2DArrayShadow
    {_MATRICES} {_IMAGES}
"""
#: Words of ES 3.00 and GLSL 4.20.
_LATEST = f"""
    coherent volatile restrict readonly writeonly resource atomic_uint patch sample subroutine {_SAMPLERS}
"""


#: Operators on the bits of integers, and the remainder; ES 1.00, 1.10 and 1.20 reserve them.
_INTEGER_OPERATORS = frozenset(["%", "&", "|", "^", "~", "<<", ">>", "%=", "&=", "|=", "^=", "<<=", ">>="])


@dataclass(frozen=True)
class Dialect:
    """A version of GLSL; 0 is a text without ``#version``, which gets what all versions have in common.

    >>> [("filter" in Dialect(number, es).reserved) for number, es in ((0, False), (330, False), (300, True))]
    [False, True, True]
    """

    version: int = 0
    es: bool = False
    extensions: frozenset[str] = frozenset()

    @property
    def name(self) -> str:
        """Return the name of the version, for errors."""
        return f"GLSL {'ES ' if self.es else ''}{self.version / 100:.2f}" if self.version else "GLSL"

    @property
    def reserved(self) -> frozenset[str]:
        """Return the words that a text may not declare."""
        return _reserved(self.version, self.es)

    @property
    def has_ordered_qualifiers(self) -> bool:
        """Return True if qualifiers of a parameter have an order: const, in or out, precision."""
        return 0 < self.version < (310 if self.es else 420)

    @property
    def has_constant_locals(self) -> bool:
        """Return True if the value of a local ``const`` must be constant, too."""
        return 0 < self.version < 420 or self.es

    @property
    def has_arrays_of_arrays(self) -> bool:
        return self._since(430, 310) or "GL_ARB_arrays_of_arrays" in self.extensions

    @property
    def has_braces(self) -> bool:
        """Return True if lists in braces may stand behind a declaration."""
        return self._since(420, None) or "GL_ARB_shading_language_420pack" in self.extensions

    @property
    def has_long_results(self) -> bool:
        """Return True if functions may return arrays, also those in structs."""
        return not self.es or self.version > 100

    @property
    def declares_once(self) -> bool:
        """Return True if a function has one prototype at most (ES 1.00, section 4.2.6)."""
        return self.es and self.version == 100

    @property
    def suffixes_whole_numbers(self) -> bool:
        """Return True if ``1f`` is a number, as drivers of desktop GLSL have it."""
        return not self.es

    def _since(self, desktop: int, es: int | None) -> bool:
        """Return True in text without a version, and from a version on; None for never."""
        first = es if self.es else desktop
        return self.version == 0 or (first is not None and self.version >= first)

    def owns_function(self, name: str, types: Sequence[str]) -> bool:
        """Return True if a text may not declare a function of a built-in one's name, with parameters of these types.

        GLSL ES 1.00 allows other types than the built-in functions take (section 8), ES 3.00 none (section 6.1).
        """
        if not self.es:
            return False
        if self.version >= 300:
            return name in _FUNCTIONS | _NEWER_FUNCTIONS
        return name in _FUNCTIONS | _OLDER_FUNCTIONS and all(one.startswith(_OF_FUNCTIONS) for one in types)

    def lacks(self, operator: str) -> bool:
        """Return True if an operator is reserved."""
        is_old = self.version in (100, 110, 120) and "GL_EXT_gpu_shader4" not in self.extensions
        return is_old and operator in _INTEGER_OPERATORS


#: Types of parameters of the functions of ES 1.00.
_OF_FUNCTIONS = ("float", "vec", "mat", "sampler")
#: Built-in functions of GLSL ES 1.00 and 3.00 (section 8 of each); of 1.00 alone; of 3.00 alone.
_FUNCTIONS = frozenset(
    ["radians", "degrees", "sin", "cos", "tan", "asin", "acos", "atan", "pow", "exp", "log", "exp2", "log2", "sqrt",
     "inversesqrt", "abs", "sign", "floor", "ceil", "fract", "mod", "min", "max", "clamp", "mix", "step", "smoothstep",
     "length", "distance", "dot", "cross", "normalize", "faceforward", "reflect", "refract", "matrixCompMult",
     "lessThan", "lessThanEqual", "greaterThan", "greaterThanEqual", "equal", "notEqual", "any", "all", "not"]
)  # fmt: skip
_OLDER_FUNCTIONS = frozenset(["texture2D", "texture2DProj", "texture2DLod", "texture2DProjLod", "textureCube"])
_NEWER_FUNCTIONS = frozenset(
    ["sinh", "cosh", "tanh", "asinh", "acosh", "atanh", "trunc", "round", "roundEven", "modf", "isnan", "isinf",
     "floatBitsToInt", "floatBitsToUint", "intBitsToFloat", "uintBitsToFloat", "packSnorm2x16", "unpackSnorm2x16",
     "packUnorm2x16", "unpackUnorm2x16", "packHalf2x16", "unpackHalf2x16", "outerProduct", "transpose", "determinant",
     "inverse", "textureSize", "texture", "textureProj", "textureLod", "textureOffset", "texelFetch",
     "texelFetchOffset", "textureProjOffset", "textureLodOffset", "textureProjLod", "textureProjLodOffset",
     "textureGrad", "textureGradOffset", "textureProjGrad", "textureProjGradOffset", "dFdx", "dFdy", "fwidth"]
)  # fmt: skip


@lru_cache(maxsize=32)
def _reserved(version: int, es: bool) -> frozenset[str]:
    words = set(_ALWAYS.split())
    if version == 0:
        return frozenset(words)
    words |= set(_PRECISION.split()) if version != 110 else set()
    if version <= 120:
        words |= {"attribute", "varying", "packed", "volatile"}
        words |= {"flat", "superp"} if es else set()
        words |= set(_MATRICES.split()) | {"centroid"} if version == 120 else set()
        return frozenset(words)
    words |= set(_NEWER.split())
    if es or version >= 420:
        words |= set(_LATEST.split())
    else:
        words |= {"packed", "volatile"}
    return frozenset(words)


_INPUT, _OUTPUT = frozenset(["in", "varying"]), frozenset(["out"])
#: Built-in variables that a text may declare again: their types, and the qualifiers of which they have one.
REDECLARED = {
    "gl_FragCoord": ("vec4", _INPUT), "gl_TexCoord": ("vec4", _INPUT), "gl_Color": ("vec4", _INPUT),
    "gl_SecondaryColor": ("vec4", _INPUT), "gl_ClipDistance": ("float", _INPUT), "gl_CullDistance": ("float", _INPUT),
    "gl_FragDepth": ("float", _OUTPUT), "gl_FragData": ("vec4", _OUTPUT), "gl_FragColor": ("vec4", _OUTPUT),
    "gl_SampleMask": ("int", _OUTPUT), "gl_Position": ("vec4", _OUTPUT), "gl_PointSize": ("float", _OUTPUT),
    "gl_LastFragData": ("vec4", frozenset(["inout", "in", "mediump", "highp"])),
}  # fmt: skip
