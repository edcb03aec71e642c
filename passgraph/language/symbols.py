"""The names that kernels use: types, constructors and functions.

They are markers.  The parser reads a kernel's source and recognises these objects by identity; calling
a function such as :func:`dot` in ordinary Python is an error, while ``vec3(1, 0, 0)`` makes a constant
that a kernel may capture.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated, Any, Generic, TypeVar

from passgraph.errors import PassgraphError

T = TypeVar("T")


class Symbol:
    """A function of the kernel language."""

    def __init__(self, name: str) -> None:
        self.name = name

    def __call__(self, *arguments: Any) -> Any:
        raise PassgraphError(f"{self.name}() exists inside kernels only; on the host use numpy")

    def __repr__(self) -> str:
        return f"<passgraph function {self.name}>"


class _Constant(tuple[Any, ...]):
    """A vector or matrix value on the host: numbers in the language's order, without arithmetic."""

    size = 0

    def __new__(cls, *arguments: Any) -> Any:
        numbers: list[Any] = []
        for argument in arguments:
            numbers.extend(argument if isinstance(argument, Iterable) else [argument])
        if len(numbers) == 1:
            numbers = cls._filled(numbers[0])
        if len(numbers) != cls.size:
            raise PassgraphError(f"{cls.__name__} takes {cls.size} numbers, got {len(numbers)}")
        return super().__new__(cls, numbers)

    @classmethod
    def _filled(cls, number: Any) -> list[Any]:
        return [number] * cls.size

    if TYPE_CHECKING:  # what kernels do with a value is checked by the parser, not by Python's checkers

        def __getattr__(self, name: str) -> Any: ...
        def __setattr__(self, name: str, value: Any) -> None: ...
        def __add__(self, other: Any) -> Any: ...
        def __radd__(self, other: Any) -> Any: ...
        def __sub__(self, other: Any) -> Any: ...
        def __rsub__(self, other: Any) -> Any: ...
        def __mul__(self, other: Any) -> Any: ...
        def __rmul__(self, other: Any) -> Any: ...
        def __truediv__(self, other: Any) -> Any: ...
        def __rtruediv__(self, other: Any) -> Any: ...
        def __neg__(self) -> Any: ...
        def __getitem__(self, index: Any) -> Any: ...
        def __setitem__(self, index: Any, value: Any) -> None: ...


class vec2(_Constant):
    size = 2


class vec3(_Constant):
    size = 3


class vec4(_Constant):
    size = 4


class ivec2(_Constant):
    size = 2


class ivec3(_Constant):
    size = 3


class ivec4(_Constant):
    size = 4


class bvec2(_Constant):
    size = 2


class bvec3(_Constant):
    size = 3


class bvec4(_Constant):
    size = 4


class _MatrixConstant(_Constant):
    @classmethod
    def _filled(cls, number: Any) -> list[Any]:
        """One number on the diagonal, as in GLSL."""
        side = math.isqrt(cls.size)
        return [number if i % (side + 1) == 0 else number * 0 for i in range(cls.size)]


class mat2(_MatrixConstant):
    size = 4


class mat3(_MatrixConstant):
    size = 9


class mat4(_MatrixConstant):
    size = 16


class Image:
    """A picture: ``image[dx, dy]``, ``image.texel(p)``, ``image.sample(uv)`` and ``image.size``."""

    if TYPE_CHECKING:
        size: Any

        def __getitem__(self, offset: tuple[Any, Any]) -> Any: ...
        def texel(self, position: Any) -> Any: ...
        def sample(self, uv: Any) -> Any: ...


class Vertex:
    """One vertex of a mesh, as a vertex kernel sees it (object space; see :data:`VERTEX_FIELDS`)."""

    if TYPE_CHECKING:
        position: Any
        normal: Any
        uv: Any
        color: Any
        tangent: Any


if TYPE_CHECKING:
    Const = Annotated[T, "baked"]  # to Python's type checkers a Const[int] is an int
else:

    class Const(Generic[T]):
        """A parameter that is baked into the kernel when the graph is compiled: ``taps: Const[int]``."""


class Array(Generic[T]):
    """A fixed-size array parameter: ``weights: Array[float, 15]``."""

    def __class_getitem__(cls, item: Any) -> Any:
        return cls


TYPE_MARKERS: dict[object, str] = {
    bool: "bool", int: "int", float: "float",
    vec2: "vec2", vec3: "vec3", vec4: "vec4",
    ivec2: "ivec2", ivec3: "ivec3", ivec4: "ivec4",
    bvec2: "bvec2", bvec3: "bvec3", bvec4: "bvec4",
    mat2: "mat2", mat3: "mat3", mat4: "mat4",
    Image: "Image",
}  # fmt: skip


#: Vectors and matrices on the host: flat tuples.
CONSTANTS = tuple(kind for kind in TYPE_MARKERS if isinstance(kind, type) and issubclass(kind, _Constant))


def _functions(names: str) -> dict[str, Symbol]:
    return {name: Symbol(name) for name in names.split()}


#: Functions that Python's namespace lacks; ``abs min max round pow int float bool any all len`` are builtins.
FUNCTIONS = _functions(
    "dot cross length distance normalize faceforward reflect refract outer transpose inverse determinant "
    "mix clamp step smoothstep saturate sign floor ceil trunc fract mod "
    "sqrt inversesqrt exp exp2 log log2 sin cos tan asin acos atan sinh cosh tanh radians degrees "
    "isnan isinf bits_from_float float_from_bits "
    "less less_equal greater greater_equal equal not_equal select "
    "pixel uv output_size front_facing fragment_depth discard"
)

dot = FUNCTIONS["dot"]
cross = FUNCTIONS["cross"]
length = FUNCTIONS["length"]
distance = FUNCTIONS["distance"]
normalize = FUNCTIONS["normalize"]
faceforward = FUNCTIONS["faceforward"]
reflect = FUNCTIONS["reflect"]
refract = FUNCTIONS["refract"]
outer = FUNCTIONS["outer"]
transpose = FUNCTIONS["transpose"]
inverse = FUNCTIONS["inverse"]
determinant = FUNCTIONS["determinant"]
mix = FUNCTIONS["mix"]
clamp = FUNCTIONS["clamp"]
step = FUNCTIONS["step"]
smoothstep = FUNCTIONS["smoothstep"]
saturate = FUNCTIONS["saturate"]
sign = FUNCTIONS["sign"]
floor = FUNCTIONS["floor"]
ceil = FUNCTIONS["ceil"]
trunc = FUNCTIONS["trunc"]
fract = FUNCTIONS["fract"]
mod = FUNCTIONS["mod"]
sqrt = FUNCTIONS["sqrt"]
inversesqrt = FUNCTIONS["inversesqrt"]
exp = FUNCTIONS["exp"]
exp2 = FUNCTIONS["exp2"]
log = FUNCTIONS["log"]
log2 = FUNCTIONS["log2"]
sin = FUNCTIONS["sin"]
cos = FUNCTIONS["cos"]
tan = FUNCTIONS["tan"]
asin = FUNCTIONS["asin"]
acos = FUNCTIONS["acos"]
atan = FUNCTIONS["atan"]
sinh = FUNCTIONS["sinh"]
cosh = FUNCTIONS["cosh"]
tanh = FUNCTIONS["tanh"]
radians = FUNCTIONS["radians"]
degrees = FUNCTIONS["degrees"]
isnan = FUNCTIONS["isnan"]
isinf = FUNCTIONS["isinf"]
bits_from_float = FUNCTIONS["bits_from_float"]
float_from_bits = FUNCTIONS["float_from_bits"]
less = FUNCTIONS["less"]
less_equal = FUNCTIONS["less_equal"]
greater = FUNCTIONS["greater"]
greater_equal = FUNCTIONS["greater_equal"]
equal = FUNCTIONS["equal"]
not_equal = FUNCTIONS["not_equal"]
select = FUNCTIONS["select"]
pixel = FUNCTIONS["pixel"]
uv = FUNCTIONS["uv"]
output_size = FUNCTIONS["output_size"]
front_facing = FUNCTIONS["front_facing"]
fragment_depth = FUNCTIONS["fragment_depth"]
discard = FUNCTIONS["discard"]

__all__ = [
    "Array",
    "Const",
    "Image",
    "Vertex",
    "acos",
    "asin",
    "atan",
    "bits_from_float",
    "bvec2",
    "bvec3",
    "bvec4",
    "ceil",
    "clamp",
    "cos",
    "cosh",
    "cross",
    "degrees",
    "determinant",
    "discard",
    "distance",
    "dot",
    "equal",
    "exp",
    "exp2",
    "faceforward",
    "float_from_bits",
    "floor",
    "fract",
    "fragment_depth",
    "front_facing",
    "greater",
    "greater_equal",
    "inverse",
    "inversesqrt",
    "isinf",
    "isnan",
    "ivec2",
    "ivec3",
    "ivec4",
    "length",
    "less",
    "less_equal",
    "log",
    "log2",
    "mat2",
    "mat3",
    "mat4",
    "mix",
    "mod",
    "normalize",
    "not_equal",
    "outer",
    "output_size",
    "pixel",
    "radians",
    "reflect",
    "refract",
    "saturate",
    "select",
    "sign",
    "sin",
    "sinh",
    "smoothstep",
    "sqrt",
    "step",
    "tan",
    "tanh",
    "transpose",
    "trunc",
    "uv",
    "vec2",
    "vec3",
    "vec4",
]
