"""What a version of GLSL forbids: names of variables, operators, and an order of qualifiers.

Sources: OpenGL Shading Language 1.10, 1.20, 1.30, 1.40, 1.50, 3.30, 4.00 to 4.60, and ES 1.00, 3.00 to 3.20, section
"Keywords" of each.
"""

from __future__ import annotations

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

    def lacks(self, operator: str) -> bool:
        """Return True if an operator is reserved."""
        return operator in _INTEGER_OPERATORS and self.version in (100, 110, 120)


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


#: Built-in variables that a text may declare again, with qualifiers.
REDECLARED = frozenset(
    ["gl_FragCoord", "gl_FragDepth", "gl_TexCoord", "gl_ClipDistance", "gl_CullDistance", "gl_Color",
     "gl_SecondaryColor", "gl_FragData", "gl_FragColor", "gl_LastFragData", "gl_SampleMask", "gl_PerVertex",
     "gl_Position", "gl_PointSize"]
)  # fmt: skip
