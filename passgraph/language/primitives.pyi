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
    "floor",
    "ceil",
    "trunc",
    "sqrt",
    "less",
    "less_equal",
    "greater",
    "greater_equal",
    "equal",
    "not_equal",
    "isnan",
    "isinf",
    "bits_from_float",
    "float_from_bits",
]

def floor(x: _F, /) -> _F:
    """the largest whole number not above."""

def ceil(x: _F, /) -> _F:
    """the smallest whole number not below."""

def trunc(x: _F, /) -> _F:
    """the whole part."""

def sqrt(x: _F, /) -> _F:
    """the square root, x >= 0."""

@overload
def less(x: _N, y: _N, /) -> Any:
    """a < b; written a < b too; written a < b too."""
@overload
def less(x: Any, y: Any, /) -> Any: ...
@overload
def less(x: Any, y: Any, /) -> Any: ...

@overload
def less_equal(x: _N, y: _N, /) -> Any:
    """a <= b; written a <= b too; written a <= b too."""
@overload
def less_equal(x: Any, y: Any, /) -> Any: ...
@overload
def less_equal(x: Any, y: Any, /) -> Any: ...

@overload
def greater(x: _N, y: _N, /) -> Any:
    """a > b; written a > b too; written a > b too."""
@overload
def greater(x: Any, y: Any, /) -> Any: ...
@overload
def greater(x: Any, y: Any, /) -> Any: ...

@overload
def greater_equal(x: _N, y: _N, /) -> Any:
    """a >= b; written a >= b too; written a >= b too."""
@overload
def greater_equal(x: Any, y: Any, /) -> Any: ...
@overload
def greater_equal(x: Any, y: Any, /) -> Any: ...

@overload
def equal(x: _N, y: _N, /) -> Any:
    """a == b; written a == b too."""
@overload
def equal(x: Any, y: Any, /) -> Any: ...

@overload
def not_equal(x: _N, y: _N, /) -> Any:
    """a != b; written a != b too."""
@overload
def not_equal(x: Any, y: Any, /) -> Any: ...

def isnan(x: _F, /) -> Any:
    """whether it is not a number."""

def isinf(x: _F, /) -> Any:
    """whether it is infinite."""

def bits_from_float(x: float, /) -> int:
    """the bits of a float32."""

def float_from_bits(i: int, /) -> float:
    """the float32 with these bits."""
