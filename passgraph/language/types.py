"""The types of the kernel language, as plain data.

Scalars are ``bool``, ``int`` (32 bits, two's complement), ``uint`` (32 bits, from 0) and ``float`` (IEEE 754 binary32);
vectors, matrices and fixed-size arrays are built from them.  Structs, and arrays of other than plain values, exist only
in source: the parser splits them (:func:`plain_parts`), so later stages do not know them.
"""

from __future__ import annotations

from dataclasses import field
from typing import TypeAlias

from passgraph.records import dataclass


@dataclass(frozen=True, slots=True)
class Scalar:
    """``bool``, ``int``, ``uint`` or ``float``."""

    name: str

    def __str__(self) -> str:
        return self.name


@dataclass(frozen=True, slots=True)
class Vector:
    """Two to four scalars of one type."""

    element: Scalar
    size: int

    def __str__(self) -> str:
        return {"float": "", "int": "i", "uint": "u", "bool": "b"}[self.element.name] + f"vec{self.size}"


@dataclass(frozen=True, slots=True)
class Matrix:
    """A matrix of floats with columns as in GLSL: ``m[i]`` is column i, ``m * v`` transforms v."""

    columns: int
    rows: int

    def __str__(self) -> str:
        return f"mat{self.columns}" if self.columns == self.rows else f"mat{self.columns}x{self.rows}"

    @property
    def column(self) -> Vector:
        """Return the type of one column."""
        return Vector(FLOAT, self.rows)


@dataclass(frozen=True, slots=True)
class Array:
    """A fixed number of values of one type."""

    element: Value | Array | Struct | ImageType
    length: int

    def __str__(self) -> str:
        return f"Array[{self.element}, {self.length}]"


@dataclass(frozen=True, slots=True)
class ImageType:
    """A picture that a kernel reads; its texels are always vec4 (missing channels are 0, 0, 1)."""

    def __str__(self) -> str:
        return "Image"


@dataclass(frozen=True, slots=True)
class Struct:
    """Named fields.

    ``parts`` is the count of plain values, images and arrays of such in it, and ``depth`` of nested structs. They are
    known from the fields' own, so that texts whose structs double at each level are refused before they are split.
    """

    name: str
    fields: tuple[tuple[str, Type], ...]
    defaults: tuple[tuple[str, object], ...] = field(default=(), compare=False)
    parts: int = field(init=False, compare=False, repr=False)
    depth: int = field(init=False, compare=False, repr=False)

    def __post_init__(self) -> None:
        types = [innermost(type_) for _, type_ in self.fields]
        object.__setattr__(self, "parts", sum(map(part_count, types)))
        object.__setattr__(self, "depth", 1 + max((t.depth for t in types if isinstance(t, Struct)), default=0))

    def __str__(self) -> str:
        return self.name

    def field_type(self, name: str) -> Type | None:
        return dict(self.fields).get(name)


@dataclass(frozen=True, slots=True)
class TupleType:
    """Several results of one kernel."""

    members: tuple[Type, ...]

    def __str__(self) -> str:
        return "tuple[" + ", ".join(map(str, self.members)) + "]"


Value: TypeAlias = Scalar | Vector | Matrix
Type: TypeAlias = Scalar | Vector | Matrix | Array | ImageType | Struct | TupleType

BOOL, INT, UINT, FLOAT = Scalar("bool"), Scalar("int"), Scalar("uint"), Scalar("float")
VEC2, VEC3, VEC4 = (Vector(FLOAT, n) for n in (2, 3, 4))
IVEC2, IVEC3, IVEC4 = (Vector(INT, n) for n in (2, 3, 4))
IMAGE = ImageType()

#: Longest array that is a value; longer ones are parameters, read by index (:mod:`.long_arrays`).
MAX_ARRAY_LENGTH = 1024

#: Types that an annotation or a constructor call may name.
NAMED: dict[str, Type] = {
    "bool": BOOL, "int": INT, "uint": UINT, "float": FLOAT,
    "vec2": VEC2, "vec3": VEC3, "vec4": VEC4,
    "ivec2": IVEC2, "ivec3": IVEC3, "ivec4": IVEC4,
    "uvec2": Vector(UINT, 2), "uvec3": Vector(UINT, 3), "uvec4": Vector(UINT, 4),
    "bvec2": Vector(BOOL, 2), "bvec3": Vector(BOOL, 3), "bvec4": Vector(BOOL, 4),
    **{str(matrix): matrix for matrix in (Matrix(c, r) for c in (2, 3, 4) for r in (2, 3, 4))},
    "Image": IMAGE,
}  # fmt: skip


def element_of(type_: Type) -> Scalar:
    """Return the scalar element of a scalar, vector, matrix or array."""
    if isinstance(type_, Scalar):
        return type_
    if isinstance(type_, Vector):
        return type_.element
    if isinstance(type_, Matrix):
        return FLOAT
    if isinstance(type_, Array):
        return element_of(type_.element)
    raise TypeError(f"{type_} has no element type")


def innermost(type_: Type) -> Type:
    """Return the innermost element type of an array; other types as they are."""
    return innermost(type_.element) if isinstance(type_, Array) else type_


def flat_type(array: Array) -> Array:
    """Flatten nested arrays: Array[Array[T, 3], 2] has six T, those of its first array first."""
    if not isinstance(array.element, Array):
        return array
    inner = flat_type(array.element)
    return Array(inner.element, array.length * inner.length)


def sides_of(type_: Type) -> tuple[int, ...]:
    """Return the lengths of nested arrays, the outermost first."""
    return (type_.length, *sides_of(type_.element)) if isinstance(type_, Array) else ()


def part_count(type_: Type) -> int:
    """Count the :func:`plain_parts` of a type without splitting it."""
    inner = innermost(type_)
    if isinstance(inner, TupleType):
        return sum(map(part_count, inner.members))
    return inner.parts if isinstance(inner, Struct) else 1


def is_plain(type_: Type) -> bool:
    """Return True for types that exist after parsing: scalars, vectors, matrices, and arrays of them."""
    entry = type_.element if isinstance(type_, Array) else type_
    return isinstance(entry, (Scalar, Vector, Matrix))


def parts_by_path(type_: Type, path: tuple[str, ...] = ()) -> list[tuple[tuple[str, ...], Type]]:
    """Split a value into plain values, images and arrays of such, each with the fields that lead to it.

    An array of structs is one array for each field.

    >>> [(path, str(part)) for path, part in parts_by_path(Array(Struct("S", (("a", FLOAT), ("b", VEC2))), 3))]
    [(('a',), 'Array[float, 3]'), (('b',), 'Array[vec2, 3]')]
    """
    if isinstance(type_, TupleType):
        return [part for i, inner in enumerate(type_.members) for part in parts_by_path(inner, (*path, str(i)))]
    if isinstance(type_, Struct):
        return [part for field, inner in type_.fields for part in parts_by_path(inner, (*path, field))]
    if not isinstance(type_, Array):
        return [(path, type_)]
    flat = flat_type(type_)
    if not isinstance(flat.element, Struct):
        return [(path, flat)]
    return [(inner, flat_type(Array(part, flat.length))) for inner, part in parts_by_path(flat.element, path)]  # type: ignore[arg-type]


def plain_parts(type_: Type, name: str = "") -> list[tuple[str, Type]]:
    """Return :func:`parts_by_path` by dotted names, such as ``light.color``."""
    return [(".".join((name, *path)), part) for path, part in parts_by_path(type_)]


def image_names(type_: Type, name: str) -> list[str]:
    """Return the images of a parameter: itself, or those in its fields and entries, such as ``maps.2`` and
    ``light.map``."""
    names: list[str] = []
    for path, part in plain_parts(type_, name):
        if isinstance(part, ImageType):
            names.append(path)
        elif isinstance(part, Array) and isinstance(part.element, ImageType):
            names += [f"{path}.{k}" for k in range(part.length)]
    return names


def image_count(type_: Type) -> int:
    """Count the names of :func:`image_names`."""
    parts = (part for _, part in plain_parts(type_) if isinstance(innermost(part), ImageType))
    return sum(part.length if isinstance(part, Array) else 1 for part in parts)


def longest(type_: Type) -> int:
    """Return the length of the longest array in a type, with nested arrays flattened."""
    if isinstance(type_, Struct):
        return max((longest(inner) for _, inner in type_.fields), default=1)
    return type_.length * longest(type_.element) if isinstance(type_, Array) else 1


def held_as(type_: Type) -> str:
    """Return the scalar type of its components in a program: a uint is the int with the same bits."""
    element = element_of(type_)
    return "int" if element is UINT else element.name


def component_count(type_: Type) -> int:
    """Count the scalars in a value of this type."""
    if isinstance(type_, Scalar):
        return 1
    if isinstance(type_, Vector):
        return type_.size
    if isinstance(type_, Matrix):
        return type_.columns * type_.rows
    if isinstance(type_, Array):
        return type_.length * component_count(type_.element)
    raise TypeError(f"{type_} has no components")


def shape_of(type_: Type) -> tuple[int, ...]:
    """Return the array shape of one value: () for scalars, (n,) for vectors, (columns, rows) for matrices."""
    if isinstance(type_, Scalar):
        return ()
    if isinstance(type_, Vector):
        return (type_.size,)
    if isinstance(type_, Matrix):
        return (type_.columns, type_.rows)
    if isinstance(type_, Array):
        return (type_.length, *shape_of(type_.element))
    raise TypeError(f"{type_} has no shape")


def with_element(type_: Scalar | Vector, element: Scalar) -> Scalar | Vector:
    """Return the same shape with another scalar type."""
    return element if isinstance(type_, Scalar) else Vector(element, type_.size)
