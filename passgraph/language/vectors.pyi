# Written by passgraph.language.stubs from the table of operations.
# mypy: disable-error-code="overload-cannot-match"
from typing import Any, TypeVar, overload

from passgraph.language.symbols import (
    ivec2, ivec3, ivec4, mat2, mat3, mat4, uint, uvec2, uvec3, uvec4, vec2, vec3, vec4,
)

_I = TypeVar("_I", int, uint, ivec2, ivec3, ivec4, uvec2, uvec3, uvec4)
_F = TypeVar("_F", float, vec2, vec3, vec4)
_N = TypeVar("_N", int, float, vec2, vec3, vec4)
_V = TypeVar("_V", vec2, vec3, vec4)
_M = TypeVar("_M", mat2, mat3, mat4)

__all__ = [
    "dot",
    "cross",
    "length",
    "distance",
    "normalize",
    "faceforward",
    "reflect",
    "refract",
    "transpose",
    "determinant",
    "inverse",
    "outer",
]

def dot(v: _V, w: _V, /) -> float:
    """sum of products, first component first."""

def cross(v: vec3, w: vec3, /) -> vec3:
    """vector product."""

def length(v: _V, /) -> float:
    """Euclidean length."""

def distance(v: _V, w: _V, /) -> float:
    """length(a - b)."""

def normalize(v: _V, /) -> _V:
    """the vector at length 1; zero stays zero."""

def faceforward(v: _V, w: _V, n: _V, /) -> _V:
    """(n, incident, reference): n where dot(reference, incident) < 0, else -n."""

def reflect(v: _V, w: _V, /) -> _V:
    """incident mirrored by a unit normal."""

def refract(v: _V, w: _V, z: float, /) -> _V:
    """incident refracted at a unit normal; zero on total reflection."""

def transpose(m: _M, /) -> _M:
    """rows and columns swapped."""

def determinant(x: Any, /) -> float:
    """determinant."""

def inverse(x: Any, /) -> Any:
    """inverse; NaN where the determinant is 0, of columns brought near 1."""

def outer(v: _V, w: _V, /) -> Any:
    """column vector times row vector, of any two sizes (GLSL outerProduct)."""
