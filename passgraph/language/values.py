"""Values during parsing: kinds of expressions, known constants, construction, conversion, selection."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from passgraph.language import ir
from passgraph.language.meanings import int_of_bits, uint_of_bits
from passgraph.language.operations import OPERATIONS
from passgraph.language.source import Span, fail
from passgraph.language.types import (
    BOOL,
    FLOAT,
    IMAGE,
    INT,
    UINT,
    Array,
    ImageType,
    Matrix,
    Scalar,
    Struct,
    TupleType,
    Type,
    Value,
    Vector,
    component_count,
    element_of,
    flat_type,
    is_plain,
    shape_of,
)
from passgraph.language.typing_rules import apply, unify, widen
from passgraph.records import dataclass


@dataclass(frozen=True)
class StructValue:
    """A struct split into one value per field."""

    struct: Struct
    fields: dict[str, Part]


@dataclass(frozen=True)
class ImageValue:
    name: str


@dataclass(frozen=True)
class ImageChoice:
    """A choice of an image by index; an index outside takes the nearest end."""

    images: tuple[ImageValue, ...]
    index: ir.Expr


@dataclass(frozen=True)
class ArrayValue:
    """An array of structs, arrays or images, split into parts; or an entry of one that is itself an array.

    ``parts`` has one flat array for each plain part of an entry: under the fields' names for structs.  The array begins
    at entry ``first`` of them, counted in its own entries; None means that it is their whole content.
    """

    type: Array
    parts: Parts
    first: ir.Expr | None = None


@dataclass(frozen=True)
class TupleValue:
    members: tuple[Part, ...]


Parts: TypeAlias = "ir.Expr | tuple[ImageValue, ...] | dict[str, Parts]"
Part: TypeAlias = ir.Expr | StructValue | ImageValue | ImageChoice | ArrayValue | TupleValue
#: Parts that are not one value.
COMPOSITE = (StructValue, ImageValue, ImageChoice, ArrayValue, TupleValue)
#: Puts a value into a variable, so that an expression that uses it several times does not grow.
Namer: TypeAlias = Callable[[ir.Expr, Span], ir.Expr]

_SWIZZLES = ("xyzw", "rgba", "stpq")


def part_type(part: Part) -> str:
    if isinstance(part, StructValue):
        return part.struct.name
    if isinstance(part, (ImageValue, ImageChoice)):
        return "Image"
    if isinstance(part, TupleValue):
        return "tuple"
    return str(part.type)  # including arrays


def type_of(part: Part) -> Type:
    if isinstance(part, StructValue):
        return part.struct
    if isinstance(part, TupleValue):
        return TupleType(tuple(type_of(member) for member in part.members))
    return IMAGE if isinstance(part, (ImageValue, ImageChoice)) else part.type


def swizzle(base: ir.Expr, name: str, span: Span) -> ir.Expr:
    assert isinstance(base.type, Vector)
    components = swizzle_components(name, base.type, span)
    type_ = base.type.element if len(components) == 1 else Vector(base.type.element, len(components))
    return ir.Swizzle(type_, base, components, span)


def swizzle_components(name: str, type_: Vector, span: Span) -> tuple[int, ...]:
    for letters in _SWIZZLES:
        if name and all(letter in letters for letter in name):
            components = tuple(letters.index(letter) for letter in name)
            if len(components) > 4:
                fail(span, f"a swizzle has at most 4 letters, got .{name}")
            if max(components) >= type_.size:
                fail(span, f"{type_} has no component {letters[max(components)]!r}")
            return components
    from passgraph.language.scope import method_spelling

    letters = "; swizzles use xyzw, rgba or stpq, one set at a time"
    fail(span, f"{type_} has no attribute {name!r}{method_spelling(name) or letters}")


def with_components(name: str, base: ir.Expr, value: ir.Expr, span: Span, named: Namer) -> ir.Expr:
    """Return ``base`` after ``base.name = value``, for a swizzle that names each component once."""
    if not isinstance(base.type, Vector):
        fail(span, f"{base.type} has no attribute {name!r}")
    components = swizzle_components(name, base.type, span)
    if len(set(components)) != len(components):
        fail(span, f".{name} names a component twice and cannot be assigned to")
    scalar = base.type.element
    type_: Scalar | Vector = scalar if len(components) == 1 else Vector(scalar, len(components))
    value = named(widen(value, type_, span, f".{name}"), span)
    parts: list[ir.Expr] = []
    for i in range(base.type.size):
        if i not in components:
            parts.append(ir.Swizzle(scalar, base, (i,), span))
        elif len(components) == 1:
            parts.append(value)
        else:
            parts.append(ir.Swizzle(scalar, value, (components.index(i),), span))
    return ir.Construct(base.type, tuple(parts), span)


# Constructors and conversions


def construct(type_: Scalar | Vector | Matrix, arguments: list[ir.Expr], span: Span, name: Namer) -> ir.Expr:
    """Return ``float(x)``, ``vec3(a, b)``, ``mat3(m4)``: GLSL's constructors."""
    for argument in arguments:
        if not isinstance(argument.type, (Scalar, Vector, Matrix)):
            fail(span, f"{type_}() does not take {argument.type}")
    if isinstance(type_, Scalar):
        if len(arguments) != 1 or not isinstance(arguments[0].type, Scalar):
            fail(span, f"{type_}() takes one scalar")
        return convert(arguments[0], type_, span)
    if isinstance(type_, Matrix):
        return _construct_matrix(type_, arguments, span, name)
    count = sum(component_count(a.type) for a in arguments)
    if len(arguments) == 1 and isinstance(arguments[0].type, Scalar):
        component = name(convert(arguments[0], type_.element, span), span)
        return ir.Construct(type_, (component,) * type_.size, span)
    if len(arguments) == 1 and isinstance(arguments[0].type, Vector) and count > type_.size:
        return convert(swizzle(arguments[0], "xyzw"[: type_.size], span), type_.element, span)
    if count != type_.size or any(isinstance(a.type, Matrix) for a in arguments):
        fail(span, f"{type_}() takes {type_.size} components, got {count}")
    if len(arguments) == 1:
        return convert(arguments[0], type_.element, span)
    return ir.Construct(type_, tuple(convert(a, type_.element, span) for a in arguments), span)


def _construct_matrix(type_: Matrix, arguments: list[ir.Expr], span: Span, name: Namer) -> ir.Expr:
    columns, rows = type_.columns, type_.rows
    zero, one = ir.Literal(FLOAT, 0.0, span), ir.Literal(FLOAT, 1.0, span)
    if len(arguments) == 1 and isinstance(arguments[0].type, Scalar):
        diagonal = name(convert(arguments[0], FLOAT, span), span)
        parts = tuple(diagonal if c == r else zero for c in range(columns) for r in range(rows))
        return ir.Construct(type_, parts, span)
    if len(arguments) == 1 and isinstance(arguments[0].type, Matrix):
        source_type, matrix = arguments[0].type, name(arguments[0], span)
        cells = []
        for c in range(columns):
            for r in range(rows):
                cell: ir.Expr = one if c == r else zero
                if c < source_type.columns and r < source_type.rows:
                    column = ir.Index(source_type.column, matrix, ir.Literal(INT, c, span), span)
                    cell = ir.Swizzle(FLOAT, column, (r,), span)
                cells.append(cell)
        return ir.Construct(type_, tuple(cells), span)
    count = sum(component_count(a.type) for a in arguments)
    if count != columns * rows or any(isinstance(a.type, Matrix) for a in arguments):
        fail(span, f"{type_}() takes {columns * rows} components (columns first), got {count}")
    return ir.Construct(type_, tuple(convert(a, FLOAT, span) for a in arguments), span)


def convert(value: ir.Expr, element: Scalar, span: Span) -> ir.Expr:
    """Return an explicit conversion of a scalar or vector to components of another type."""
    assert isinstance(value.type, (Scalar, Vector))
    if element_of(value.type) is element:
        return value
    source = element_of(value.type)
    if element is BOOL:
        zero = ir.Literal(FLOAT, 0.0, span) if source is FLOAT else ir.Literal(source, 0, span)
        return apply("not_equal", [value, zero], span)
    if isinstance(value, ir.Literal) and element is FLOAT:
        return ir.Literal(FLOAT, float(value.value), span)
    if isinstance(value, ir.Literal) and {source, element} == {INT, UINT}:
        number = int(value.value)
        return ir.Literal(element, uint_of_bits(number) if element is UINT else int_of_bits(number), span)
    if element is UINT:
        integer = convert(value, INT, span) if source is BOOL else value
        return apply("uint_from_float" if source is FLOAT else "uint_from_int", [integer], span)
    return apply("to_float" if element is FLOAT else "to_int", [value], span)


def index_into(base: ir.Expr, index: ir.Expr, span: Span) -> ir.Expr:
    type_ = base.type
    element: Value
    if isinstance(type_, Array):
        count, element = type_.length, cast("Value", type_.element)
    elif isinstance(type_, Matrix):
        count, element = type_.columns, type_.column
    elif isinstance(type_, Vector):
        count, element = type_.size, type_.element
    else:
        fail(span, f"{type_} cannot be indexed")
    check_index(index, count, type_, span)
    return ir.Index(element, base, index, span)


def check_index(index: ir.Expr, count: int, type_: Type, span: Span) -> None:
    """Check that a literal index is in range."""
    if isinstance(index, ir.Literal) and not 0 <= int(index.value) < count:
        fail(span, f"index {index.value} is outside {type_} (0 to {count - 1})")


# Choices


def choose(condition: ir.Expr, then: Part, orelse: Part, span: Span) -> Part:
    """Return a conditional value, field by field for structs; ``condition`` may be used several times."""
    if isinstance(then, StructValue) and isinstance(orelse, StructValue) and then.struct == orelse.struct:
        fields = {n: choose(condition, then.fields[n], orelse.fields[n], span) for n in then.fields}
        return StructValue(then.struct, fields)
    if isinstance(then, ArrayValue):
        fail(span, f"a conditional cannot choose between values of type {then.type}; use if statements")
    if isinstance(then, COMPOSITE) or isinstance(orelse, COMPOSITE):
        fail(
            span,
            f"both sides of a conditional must have one type, got {part_type(then)} and {part_type(orelse)}",
        )
    one, other = unify(then, orelse, span, "both sides of a conditional")
    if isinstance(one.type, Array):
        fail(span, f"a conditional cannot choose between values of type {one.type}; use if statements")
    return ir.Select(one.type, condition, one, other, span)


def of_bools(value: ir.Expr) -> bool:
    """Return True for a bool or a vector of them: the conditions of ``mix`` and ``select``."""
    return isinstance(value.type, (Scalar, Vector)) and element_of(value.type) is BOOL


def select(arguments: list[ir.Expr], span: Span, name: Namer) -> ir.Expr:
    """Return ``select(bvec, a, b)``, component by component."""
    condition, then, orelse = arguments
    then, orelse = unify(then, orelse, span, "both sides of select()")
    if isinstance(then.type, Array):
        fail(span, f"select() takes scalars, vectors and matrices, got {then.type}")
    if condition.type == BOOL:
        return ir.Select(then.type, condition, then, orelse, span)
    if not (isinstance(condition.type, Vector) and condition.type.element is BOOL):
        fail(span, f"select() takes bool or a bvec first, got {condition.type}")
    if not isinstance(then.type, Vector) or then.type.size != condition.type.size:
        fail(span, f"select() takes {condition.type.size} components on each side, got {then.type}")
    condition, then, orelse = (name(part, span) for part in (condition, then, orelse))
    assert isinstance(then.type, Vector)
    element, parts = then.type.element, []
    for i in range(then.type.size):
        c = ir.Swizzle(BOOL, condition, (i,), span)
        a, b = (ir.Swizzle(element, side, (i,), span) for side in (then, orelse))
        parts.append(ir.Select(element, c, a, b, span))
    return ir.Construct(then.type, tuple(parts), span)


def coerce(part: Part, type_: Type, span: Span, what: str) -> Part:
    """Convert a value to a declared type."""
    if isinstance(type_, Struct):
        if isinstance(part, StructValue) and part.struct == type_:
            return part
        fail(span, f"{what} must be {type_}, got {part_type(part)}")
    if isinstance(type_, ImageType):
        if isinstance(part, (ImageValue, ImageChoice)):
            return part
        fail(span, f"{what} must be an Image, got {part_type(part)}")
    if isinstance(part, ArrayValue) and part.type == type_:
        return part
    if isinstance(part, ArrayValue) and isinstance(type_, Array) and _widens(part, type_):
        return ArrayValue(type_, widen(cast(ir.Expr, part.parts), flat_type(type_), span, what))
    if isinstance(part, COMPOSITE):
        fail(span, f"{what} must be {type_}, got {part_type(part)}")
    return widen(part, type_, span, what)


def _widens(array: ArrayValue, type_: Array) -> bool:
    """Return True for nested arrays of int literals that may become floats."""
    plain = is_plain(flat_type(type_)) and is_plain(flat_type(array.type))
    return plain and array.first is None and shape_of(array.type) == shape_of(type_)


def check_clamp(arguments: list[ir.Expr], span: Span) -> None:
    """Check that constant bounds of clamp() are in the right order."""
    if len(arguments) == 3:
        bounds = [a for a in arguments[1:] if isinstance(a, ir.Literal)]
        first = arguments[0].type
        of_uints = isinstance(first, (Scalar, Vector)) and element_of(first) is UINT
        values = [uint_of_bits(int(a.value)) if of_uints and a.bits else a.value for a in bounds]
        if len(values) == 2 and values[0] > values[1]:
            fail(span, f"clamp() has its bounds the wrong way round: {values[0]} > {values[1]}")


Numbers: TypeAlias = tuple[ir.Number, ...]
_DTYPES = {"float": np.float64, "int": np.int64, "uint": np.uint32, "bool": np.bool_}


def folded(value: ir.Expr) -> Numbers | None:
    """Return the numbers of a value in component order; None if unknown.

    Floats are rounded to float32 after each operation.
    """
    if isinstance(value, ir.Literal):
        return (value.value,)
    if isinstance(value, ir.Table):
        return value.values
    if isinstance(value, ir.Construct):
        parts = [folded(part) for part in value.arguments]
        return None if None in parts else tuple(number for part in parts if part is not None for number in part)
    if isinstance(value, ir.Swizzle):
        numbers = folded(value.value)
        return None if numbers is None else tuple(numbers[i] for i in value.components)
    if isinstance(value, ir.Index):
        numbers, at = folded(value.value), folded(value.index)
        if numbers is None or at is None:
            return None
        width = component_count(value.type)
        start = min(max(int(at[0]) * width, 0), len(numbers) - width)
        return numbers[start : start + width]
    if isinstance(value, ir.Select):
        condition = folded(value.condition)
        return None if condition is None else folded(value.then if condition[0] else value.orelse)
    return _applied(value) if isinstance(value, ir.Apply) else None


def _applied(value: ir.Apply) -> Numbers | None:
    row = OPERATIONS[value.operation]
    if isinstance(value.type, Matrix) or any(isinstance(part.type, (Matrix, Array)) for part in value.arguments):
        return None
    arguments = [folded(part) for part in value.arguments]
    arrays: list[NDArray[Any]] = []
    for part, numbers in zip(value.arguments, arguments, strict=True):
        if numbers is None:
            return None
        array: NDArray[Any] = np.array(numbers, _DTYPES[_element(part.type)])
        if array.dtype.kind == "f":
            array = array.astype(np.float32).astype(np.float64)
        # Reference functions of vectors take a batch on the first axis; a scalar is a batch of one.
        arrays.append(array[None] if row.kind == "expanded" and isinstance(part.type, Vector) else array)
    with np.errstate(all="ignore"):
        result = np.asarray(row.reference(*arrays)).ravel()
        if _element(value.type) == "float":
            result = result.astype(np.float32)
    return tuple(result.tolist())


def _element(type_: Type) -> str:
    return type_.name if isinstance(type_, Scalar) else type_.element.name if isinstance(type_, Vector) else FLOAT.name


def settled(part: Part) -> Part:
    """Replace known integers and bools by literals: array lengths depend on them.

    Floats stay, since their computation is rounded at run time.
    """
    if not isinstance(part, (ir.Apply, ir.Index, ir.Swizzle)) or _element(part.type) == FLOAT.name:
        return part
    return constant(part)


def decided(condition: ir.Expr) -> ir.Expr:
    """Replace a condition by a literal if only known integers and bools decide it, so that dead code need not be
    parsed."""
    parts = ir.expressions(condition)
    is_whole = all(isinstance(p.type, (Scalar, Vector)) and _element(p.type) != FLOAT.name for p in parts)
    return constant(condition) if is_whole else condition


def constant(value: ir.Expr) -> ir.Expr:
    """Return the same value, as a literal if it is known."""
    numbers = None if isinstance(value, (ir.Literal, ir.Table)) else folded(value)
    if numbers is None:
        return value
    if isinstance(value.type, Scalar):
        return ir.Literal(value.type, numbers[0], value.span)
    if isinstance(value.type, Array):
        return ir.Table(value.type, numbers, value.span)
    element = value.type.element if isinstance(value.type, Vector) else FLOAT
    return ir.Construct(value.type, tuple(ir.Literal(element, n, value.span) for n in numbers), value.span)
