"""Names that kernels use besides operations: types, constructors, stage builtins.

They are markers.  The parser reads a kernel's source and recognizes these objects by identity.  Calling a function such
as :func:`pixel` in ordinary Python is an error, while ``vec3(1, 0, 0)`` makes a constant that a kernel may capture.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Annotated, Any, Generic, Self, TypeVar

from passgraph.arguments import shown
from passgraph.errors import PassgraphError
from passgraph.records import dataclass

#: The largest uint: 32 bits.
UINT_MAX = 2**32 - 1

T = TypeVar("T")
N = TypeVar("N")

if TYPE_CHECKING:
    uint = int  # type checkers treat a uint as an int
else:

    class uint(int):
        """An integer from 0 to 4294967295 on the host; kernels that capture it get a uint."""

        def __new__(cls, value: int = 0) -> uint:
            try:
                number = super().__new__(cls, value)
            except (TypeError, ValueError, OverflowError):
                number = -1
            if not 0 <= number <= UINT_MAX:
                raise PassgraphError(f"a uint is a whole number from 0 to {UINT_MAX}, got {shown(value)}")
            return number


@dataclass(frozen=True, eq=False, repr=False)
class Symbol:
    """A function of the kernel language."""

    name: str

    def __call__(self, *arguments: Any) -> Any:
        raise PassgraphError(f"{self.name}() exists inside kernels only; on the host use numpy")

    def __repr__(self) -> str:
        return f"<passgraph function {self.name}>"


def _flat(values: Iterable[Any]) -> Iterator[Any]:
    for value in values:
        value = value.tolist() if hasattr(value, "tolist") else value
        if isinstance(value, (list, tuple)):
            yield from _flat(value)
        else:
            yield value


class _Constant(tuple[Any, ...]):
    """A vector or matrix value on the host: numbers in component order, without arithmetic."""

    size = 0

    def __new__(cls, *arguments: Any) -> Self:
        numbers: list[Any] = []
        for argument in arguments:
            # NumPy arrays, including 0-dimensional ones, are converted to Python numbers; the rows of a matrix are its
            # columns.
            values = argument.tolist() if hasattr(argument, "tolist") else argument
            numbers.extend(_flat(values) if isinstance(values, (list, tuple)) else [values])
        for number in numbers:
            if not isinstance(number, (int, float)):
                raise PassgraphError(f"{cls.__name__} takes numbers, got {shown(number)}")
        if len(numbers) == 1:
            numbers = cls._filled(numbers[0])
        if len(numbers) != cls.size:
            raise PassgraphError(f"{cls.__name__} takes {cls.size} numbers, got {len(numbers)}")
        return super().__new__(cls, numbers)

    @classmethod
    def _filled(cls, number: Any) -> list[Any]:
        return [number] * cls.size

    if TYPE_CHECKING:  # operations in kernels are checked by the parser, not by type checkers

        def __getattr__(self, name: str) -> Any: ...
        def __setattr__(self, name: str, value: Any) -> None: ...
        def __add__(self, other: Any) -> Self: ...
        def __radd__(self, other: Any) -> Self: ...
        def __sub__(self, other: Any) -> Self: ...
        def __rsub__(self, other: Any) -> Self: ...
        def __mul__(self, other: Any) -> Self: ...
        def __rmul__(self, other: Any) -> Self: ...
        def __truediv__(self, other: Any) -> Self: ...
        def __rtruediv__(self, other: Any) -> Self: ...
        def __neg__(self) -> Self: ...
        def __abs__(self) -> Self: ...
        def __floordiv__(self, other: Any) -> Self: ...
        def __mod__(self, other: Any) -> Self: ...
        def __pow__(self, other: Any) -> Self: ...
        def __and__(self, other: Any) -> Self: ...
        def __or__(self, other: Any) -> Self: ...
        def __xor__(self, other: Any) -> Self: ...
        def __lshift__(self, other: Any) -> Self: ...
        def __rshift__(self, other: Any) -> Self: ...
        def __invert__(self) -> Self: ...
        def __lt__(self, other: Any) -> Any: ...
        def __le__(self, other: Any) -> Any: ...
        def __gt__(self, other: Any) -> Any: ...
        def __ge__(self, other: Any) -> Any: ...
        def __getitem__(self, index: Any) -> Any: ...
        def __setitem__(self, index: Any, value: Any) -> None: ...


if TYPE_CHECKING:
    S = TypeVar("S")
    V2 = TypeVar("V2")
    V3 = TypeVar("V3")
    V4 = TypeVar("V4")

    class _Two(_Constant, Generic[S, V2]):
        """The components of a vector of numbers ``S``, and the types of its shorter swizzles."""

        x: S
        y: S
        r: S
        g: S
        xy: V2
        rg: V2

    class _Three(_Two[S, V2], Generic[S, V2, V3]):
        z: S
        b: S
        xyz: V3
        rgb: V3

    class _Four(_Three[S, V2, V3], Generic[S, V2, V3, V4]):
        w: S
        a: S
        xyzw: V4
        rgba: V4
else:
    _Two = _Three = _Four = _Constant


class vec2(_Two[float, "vec2"]):
    size = 2


class vec3(_Three[float, "vec2", "vec3"]):
    size = 3


class vec4(_Four[float, "vec2", "vec3", "vec4"]):
    size = 4


class ivec2(_Two[int, "ivec2"]):
    size = 2


class ivec3(_Three[int, "ivec2", "ivec3"]):
    size = 3


class ivec4(_Four[int, "ivec2", "ivec3", "ivec4"]):
    size = 4


class uvec2(_Two[int, "uvec2"]):
    size = 2


class uvec3(_Three[int, "uvec2", "uvec3"]):
    size = 3


class uvec4(_Four[int, "uvec2", "uvec3", "uvec4"]):
    size = 4


class bvec2(_Two[bool, "bvec2"]):
    size = 2


class bvec3(_Three[bool, "bvec2", "bvec3"]):
    size = 3


class bvec4(_Four[bool, "bvec2", "bvec3", "bvec4"]):
    size = 4


class _MatrixConstant(_Constant):
    rows = 0

    if TYPE_CHECKING:

        def __mul__(self, other: Any) -> Any: ...

    @classmethod
    def _filled(cls, number: Any) -> list[Any]:
        """Return a diagonal matrix for one number, as in GLSL."""
        return [number if i // cls.rows == i % cls.rows else number * 0 for i in range(cls.size)]


class mat2(_MatrixConstant):
    size, rows = 4, 2


class mat2x3(_MatrixConstant):
    size, rows = 6, 3


class mat2x4(_MatrixConstant):
    size, rows = 8, 4


class mat3x2(_MatrixConstant):
    size, rows = 6, 2


class mat3(_MatrixConstant):
    size, rows = 9, 3


class mat3x4(_MatrixConstant):
    size, rows = 12, 4


class mat4x2(_MatrixConstant):
    size, rows = 8, 2


class mat4x3(_MatrixConstant):
    size, rows = 12, 3


class mat4(_MatrixConstant):
    size, rows = 16, 4


class Image:
    """A picture: ``image[dx, dy]``, ``image.texel(p)``, ``image.sample(uv)``, ``image.size``, and more."""

    if TYPE_CHECKING:
        size: ivec2
        levels: int
        slices: int

        def __getitem__(self, offset: tuple[Any, Any]) -> vec4: ...
        def texel(self, position: Any, level: Any = ...) -> vec4: ...
        def sample(self, uv: Any, lod: Any = ...) -> vec4: ...
        def nearest(self, uv: Any) -> vec4: ...
        def gather(self, uv: Any, channel: Any) -> vec4: ...
        def sample3(self, position: Any) -> vec4: ...
        def size_of(self, level: Any) -> ivec2: ...
        def lod(self, uv: Any) -> float: ...


class Vertex:
    """One vertex of a mesh in a vertex kernel, in object space; :data:`passgraph.language.signature.VERTEX_FIELDS` has
    the values of missing attributes."""

    if TYPE_CHECKING:
        position: vec3
        normal: vec3
        uv: vec2
        color: vec4
        tangent: vec4
        instance: int


if TYPE_CHECKING:
    Const = Annotated[T, "baked"]  # type checkers treat a Const[int] as an int
else:

    class Const(Generic[T]):
        """A parameter that is baked into the kernel when the graph is compiled: ``taps: Const[int]``."""


class Array(Generic[T, N]):
    """A fixed-size array parameter: ``weights: Array[float, 15]``, to type checkers ``Array[float, Literal[15]]``."""

    if TYPE_CHECKING:

        def __getitem__(self, index: Any) -> T: ...
        def __len__(self) -> int: ...

    def __class_getitem__(cls, item: Any) -> Any:
        return cls


TYPE_MARKERS: dict[object, str] = {
    bool: "bool", int: "int", uint: "uint", float: "float",
    vec2: "vec2", vec3: "vec3", vec4: "vec4",
    ivec2: "ivec2", ivec3: "ivec3", ivec4: "ivec4",
    uvec2: "uvec2", uvec3: "uvec3", uvec4: "uvec4",
    bvec2: "bvec2", bvec3: "bvec3", bvec4: "bvec4",
    mat2: "mat2", mat3: "mat3", mat4: "mat4",
    mat2x3: "mat2x3", mat2x4: "mat2x4", mat3x2: "mat3x2", mat3x4: "mat3x4", mat4x2: "mat4x2", mat4x3: "mat4x3",
    Image: "Image",
}  # fmt: skip


#: Vectors and matrices on the host: flat tuples.
CONSTANTS = tuple(kind for kind in TYPE_MARKERS if isinstance(kind, type) and issubclass(kind, _Constant))


pixel, uv, output_size = Symbol("pixel"), Symbol("uv"), Symbol("output_size")
front_facing, fragment_depth = Symbol("front_facing"), Symbol("fragment_depth")
select, discard = Symbol("select"), Symbol("discard")
dfdx, dfdy, fwidth = Symbol("dfdx"), Symbol("dfdy"), Symbol("fwidth")
dFdx, dFdy = dfdx, dfdy  # as GLSL spells them
_STAGE = (pixel, uv, output_size, front_facing, fragment_depth, select, discard, dfdx, dfdy, fwidth)

modf, frexp = Symbol("modf"), Symbol("frexp")
pack_unorm4x8, unpack_unorm4x8 = Symbol("pack_unorm4x8"), Symbol("unpack_unorm4x8")
pack_snorm4x8, unpack_snorm4x8 = Symbol("pack_snorm4x8"), Symbol("unpack_snorm4x8")
pack_unorm2x16, unpack_unorm2x16 = Symbol("pack_unorm2x16"), Symbol("unpack_unorm2x16")
pack_snorm2x16, unpack_snorm2x16 = Symbol("pack_snorm2x16"), Symbol("unpack_snorm2x16")
pack_half2x16, unpack_half2x16 = Symbol("pack_half2x16"), Symbol("unpack_half2x16")
#: Functions defined in :mod:`.library`.
WRITTEN = (
    modf, frexp, pack_unorm4x8, pack_snorm4x8, pack_unorm2x16, pack_snorm2x16, pack_half2x16,
    unpack_unorm4x8, unpack_snorm4x8, unpack_unorm2x16, unpack_snorm2x16, unpack_half2x16,
)  # fmt: skip

#: Functions that are not operations.
FUNCTIONS = {**{symbol.name: symbol for symbol in (*_STAGE, *WRITTEN)}, "dFdx": dFdx, "dFdy": dFdy}

__all__ = [
    "Array", "Const", "Image", "Vertex", "bvec2", "bvec3", "bvec4", "dFdx", "dFdy", "dfdx", "dfdy", "discard",
    "fragment_depth", "frexp", "front_facing", "fwidth", "ivec2", "ivec3", "ivec4", "mat2", "mat2x3", "mat2x4", "mat3",
    "mat3x2", "mat3x4", "mat4", "mat4x2", "mat4x3", "modf", "output_size", "pack_half2x16", "pack_snorm2x16",
    "pack_snorm4x8", "pack_unorm2x16", "pack_unorm4x8", "pixel", "select", "uint", "unpack_half2x16",
    "unpack_snorm2x16", "unpack_snorm4x8", "unpack_unorm2x16", "unpack_unorm4x8", "uv", "uvec2", "uvec3", "uvec4",
    "vec2", "vec3", "vec4",
]  # fmt: skip
