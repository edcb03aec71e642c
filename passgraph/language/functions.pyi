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
    "sign",
    "clamp",
    "saturate",
    "fract",
    "mod",
    "fma",
    "ldexp",
    "inversesqrt",
    "step",
    "smoothstep",
    "mix",
    "exp2",
    "exp",
    "log2",
    "log",
    "log10",
    "sin",
    "cos",
    "tan",
    "asin",
    "acos",
    "atan",
    "sinh",
    "cosh",
    "tanh",
    "asinh",
    "acosh",
    "atanh",
    "radians",
    "degrees",
    "isfinite",
]

@overload
def sign(x: _N, /) -> _N:
    """-1, 0 or 1; 0 for 0 and for NaN; 0 or 1."""
@overload
def sign(x: Any, /) -> Any: ...

@overload
def clamp(x: _N, y: _N, z: _N, /) -> _N:
    """min(max(x, low), high)."""
@overload
def clamp(x: _V, y: _V | float, z: _V | float, /) -> _V: ...
@overload
def clamp(x: float, y: _V, z: _V | float, /) -> _V: ...
@overload
def clamp(x: float, y: float, z: _V, /) -> _V: ...
@overload
def clamp(x: Any, y: Any, z: Any, /) -> Any: ...
@overload
def clamp(x: Any, y: Any, z: Any, /) -> Any: ...

def saturate(x: _F, /) -> _F:
    """clamp(x, 0, 1)."""

def fract(x: _F, /) -> _F:
    """x - floor(x), capped below 1."""

@overload
def mod(x: _F, y: _F, /) -> _F:
    """x - y * floor(x / y): the sign of y, smaller than y; exact for |x / y| < 2^20, |y| >= 2^-100; written x % y too."""
@overload
def mod(x: _V, y: _V | float, /) -> _V: ...
@overload
def mod(x: float, y: _V, /) -> _V: ...
@overload
def mod(x: Any, y: Any, /) -> Any: ...

@overload
def fma(x: _F, y: _F, z: _F, /) -> _F:
    """a * b + c, rounded once or twice."""
@overload
def fma(x: _V, y: _V | float, z: _V | float, /) -> _V: ...
@overload
def fma(x: float, y: _V, z: _V | float, /) -> _V: ...
@overload
def fma(x: float, y: float, z: _V, /) -> _V: ...
@overload
def fma(x: Any, y: Any, z: Any, /) -> Any: ...

@overload
def ldexp(x: _F, y: Any, /) -> _F:
    """x times 2 to the power n, for any int n."""
@overload
def ldexp(x: Any, y: Any, /) -> Any: ...

def inversesqrt(x: _F, /) -> _F:
    """1 / sqrt(x), x > 0."""

@overload
def step(x: _F, y: _F, /) -> _F:
    """0 where x < edge, else 1."""
@overload
def step(x: _V, y: _V | float, /) -> _V: ...
@overload
def step(x: float, y: _V, /) -> _V: ...
@overload
def step(x: Any, y: Any, /) -> Any: ...

@overload
def smoothstep(x: _F, y: _F, z: _F, /) -> _F:
    """Hermite step between two finite edges; equal edges give step."""
@overload
def smoothstep(x: _V, y: _V | float, z: _V | float, /) -> _V: ...
@overload
def smoothstep(x: float, y: _V, z: _V | float, /) -> _V: ...
@overload
def smoothstep(x: float, y: float, z: _V, /) -> _V: ...
@overload
def smoothstep(x: Any, y: Any, z: Any, /) -> Any: ...

@overload
def mix(x: _F, y: _F, z: _F, /) -> _F:
    """x * (1 - a) + y * a."""
@overload
def mix(x: _V, y: _V | float, z: _V | float, /) -> _V: ...
@overload
def mix(x: float, y: _V, z: _V | float, /) -> _V: ...
@overload
def mix(x: float, y: float, z: _V, /) -> _V: ...
@overload
def mix(x: Any, y: Any, z: Any, /) -> Any: ...

def exp2(x: _F, /) -> _F:
    """2 to the power x."""

def exp(x: _F, /) -> _F:
    """e to the power x."""

def log2(x: _F, /) -> _F:
    """logarithm to base 2, x >= 0."""

def log(x: _F, /) -> _F:
    """natural logarithm, x >= 0."""

def log10(x: _F, /) -> _F:
    """logarithm to base 10, x >= 0."""

def sin(x: _F, /) -> _F:
    """sine, radians, |x| <= 8192; beyond, a number from -1 to 1."""

def cos(x: _F, /) -> _F:
    """cosine, radians, |x| <= 8192; beyond, a number from -1 to 1."""

def tan(x: _F, /) -> _F:
    """tangent, radians, |x| <= 8192; beyond, any number."""

def asin(x: _F, /) -> _F:
    """arc sine, radians, -1 <= x <= 1."""

def acos(x: _F, /) -> _F:
    """arc cosine, radians, -1 <= x <= 1."""

@overload
def atan(x: _F, /) -> _F:
    """arc tangent, radians; angle of the vector (x, y), written atan(y, x); atan(0, 0) is 0."""
@overload
def atan(x: _F, y: _F, /) -> _F: ...
@overload
def atan(x: _V, y: _V | float, /) -> _V: ...
@overload
def atan(x: float, y: _V, /) -> _V: ...
@overload
def atan(x: Any, y: Any, /) -> Any: ...

def sinh(x: _F, /) -> _F:
    """hyperbolic sine."""

def cosh(x: _F, /) -> _F:
    """hyperbolic cosine."""

def tanh(x: _F, /) -> _F:
    """hyperbolic tangent."""

def asinh(x: _F, /) -> _F:
    """inverse hyperbolic sine."""

def acosh(x: _F, /) -> _F:
    """inverse hyperbolic cosine, x >= 1."""

def atanh(x: _F, /) -> _F:
    """inverse hyperbolic tangent, -1 <= x <= 1."""

def radians(x: _F, /) -> _F:
    """degrees to radians."""

def degrees(x: _F, /) -> _F:
    """radians to degrees."""

def isfinite(x: _F, /) -> Any:
    """whether it is a number and not infinite."""
