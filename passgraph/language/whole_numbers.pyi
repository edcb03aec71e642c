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
    "quotient",
    "remainder",
    "bit_count",
    "find_lsb",
    "find_msb",
    "bitfield_reverse",
    "bitfield_extract",
    "bitfield_insert",
    "half_bits",
    "float_of_half",
]

def quotient(x: _I, y: _I, /) -> _I:
    """a / b toward zero, as in C; quotient(a, 0) is 0."""

def remainder(x: _I, y: _I, /) -> _I:
    """a - quotient(a, b) * b, with the sign of a, as in C; remainder(a, 0) is 0."""

def bit_count(x: _I, /) -> Any:
    """how many bits are 1."""

def find_lsb(x: _I, /) -> Any:
    """the place of the lowest bit that is 1; -1 of 0."""

@overload
def find_msb(x: _I, /) -> Any:
    """the place of the highest bit that is 1, below 0 that is 0; -1 of 0 and of -1; the place of the highest bit that is 1; -1 of 0."""
@overload
def find_msb(x: Any, /) -> Any: ...

def bitfield_reverse(x: _I, /) -> _I:
    """the bits in the opposite order."""

@overload
def bitfield_extract(x: _I, y: Any, z: Any, /) -> _I:
    """so many bits from an offset on, the highest going on above (a, offset, bits); the offset is taken from 0 to 31, the bits from 0 to what is left above it; the same with zeros above."""
@overload
def bitfield_extract(x: Any, y: Any, z: Any, /) -> Any: ...

def bitfield_insert(x: _I, y: _I, z: Any, w: Any, /) -> _I:
    """a with its bits from an offset on replaced by the lowest so many of another (a, other, offset, bits), which are taken as in bitfield_extract."""

def half_bits(x: _F, /) -> Any:
    """the 16 bits of the nearest binary16, halves to even; of NaN some NaN's."""

def float_of_half(x: Any, /) -> Any:
    """the number whose binary16 the lowest 16 bits are."""
