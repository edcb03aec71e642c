"""Arrays of structs, of arrays and of images: read entries, and construct arrays.

Each plain part of an entry is stored in one flat array, so an index costs as much as in a plain array.  An index out of
range reads the nearest end of its own dimension.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, TypeAlias, cast

from passgraph.language import ir
from passgraph.language.source import Span, fail
from passgraph.language.types import (
    INT,
    MAX_ARRAY_LENGTH,
    Array,
    ImageType,
    Matrix,
    Scalar,
    Struct,
    Type,
    Value,
    Vector,
    flat_type,
    innermost,
    is_plain,
    longest,
    shape_of,
)
from passgraph.language.typing_rules import apply, unify, widen
from passgraph.language.values import (
    COMPOSITE,
    ArrayValue,
    ImageChoice,
    ImageValue,
    Namer,
    Part,
    Parts,
    StructValue,
    TupleValue,
    check_index,
    index_into,
    type_of,
)

if TYPE_CHECKING:
    from passgraph.language.function_body import Builder


def entry(array: ArrayValue, index: ir.Expr, span: Span, name: Namer) -> Part:
    """Read ``array[index]``: a value, a struct, an image, or an array at an offset in the same flat arrays."""
    check_index(index, array.type.length, array.type, span)
    place = name(index, span)
    if array.first is not None:
        place = name(_sum(array.first, _clamped(place, array.type.length, span), span), span)
    elif not reads_plainly(array.type.element):
        place = name(_clamped(place, array.type.length, span), span)
    return _entry_at(array.parts, array.type.element, place, span, name)


def reads_plainly(type_: Type) -> bool:
    """Return True if an entry is read from flat arrays as long as the array itself, which clamp the index."""
    if isinstance(type_, Struct):
        return all(reads_plainly(inner) for _, inner in type_.fields)
    return isinstance(type_, (Scalar, Vector, Matrix))


def _entry_at(parts: Parts, type_: Type, place: ir.Expr, span: Span, name: Namer) -> Part:
    """Read the entry at a position in range."""
    if isinstance(type_, Struct):
        assert isinstance(parts, dict)
        return StructValue(type_, {n: _entry_at(parts[n], t, place, span, name) for n, t in type_.fields})
    if isinstance(type_, Array):
        return ArrayValue(type_, parts, name(nth(place, type_.length, 0, span), span))
    if isinstance(parts, tuple):
        return parts[int(place.value)] if isinstance(place, ir.Literal) else ImageChoice(parts, place)
    assert not isinstance(parts, dict)
    return index_into(parts, place, span)


def _sum(one: ir.Expr, other: ir.Expr, span: Span) -> ir.Expr:
    one, other = (other, one) if isinstance(one, ir.Literal) else (one, other)
    return nth(one, 1, int(other.value), span) if isinstance(other, ir.Literal) else apply("add", [one, other], span)


def _clamped(index: ir.Expr, length: int, span: Span) -> ir.Expr:
    if isinstance(index, ir.Literal):
        return index
    low, high = ir.Literal(INT, 0, span), ir.Literal(INT, length - 1, span)
    return apply("min", [apply("max", [index, low], span), high], span)


def nth(index: ir.Expr, each: int, k: int, span: Span) -> ir.Expr:
    """Return ``index * each + k``, folded if the index is a number, so that the entry stays known."""
    if isinstance(index, ir.Literal):
        return ir.Literal(INT, int(index.value) * each + k, span)
    first = index if each == 1 else apply("mul", [index, ir.Literal(INT, each, span)], span)
    return apply("add", [first, ir.Literal(INT, k, span)], span) if k else first


def parts_of_type(type_: Type, leaf: Callable[[str, Array], Parts], name: str) -> Parts:
    """Return the parts of an array: ``leaf`` gives each flat array by its dotted name."""
    assert isinstance(type_, Array)
    flat = flat_type(type_)
    if not isinstance(flat.element, Struct):
        return leaf(name, flat)
    fields = flat.element.fields
    return {n: parts_of_type(Array(cast(Value, t), flat.length), leaf, f"{name}.{n}") for n, t in fields}


def array_part(type_: Array, leaf: Callable[[str, Array], Parts], name: str) -> Part:
    """Return an array stored in flat arrays: one value if it is plain."""
    parts = parts_of_type(type_, leaf, name)
    return cast(ir.Expr, parts) if is_plain(type_) else ArrayValue(type_, parts)


def of_constant(constant: ir.Literal | ir.Table | ir.Construct) -> Part:
    """Return a captured constant as a value: a table of tables is stored in one flat table."""
    if isinstance(constant, ir.Table) and not is_plain(constant.type):
        return ArrayValue(constant.type, ir.Table(flat_type(constant.type), constant.values, constant.span))
    return constant


def mapped(parts: Parts, each: Callable[[ir.Expr], ir.Expr]) -> Parts:
    """Return the same parts with each flat array replaced."""
    if isinstance(parts, tuple):
        return parts
    return {n: mapped(part, each) for n, part in parts.items()} if isinstance(parts, dict) else each(parts)


def alone(array: ArrayValue, span: Span) -> ArrayValue:
    """Return the same array in flat arrays that hold nothing else."""
    return array if array.first is None else ArrayValue(array.type, _cut(array, array.parts, array.type, span))


def _cut(array: ArrayValue, parts: Parts, type_: Array, span: Span) -> Parts:
    flat = flat_type(type_)
    if isinstance(flat.element, Struct):
        assert isinstance(parts, dict)
        fields = flat.element.fields
        return {n: _cut(array, parts[n], Array(cast(Value, t), flat.length), span) for n, t in fields}
    if isinstance(parts, tuple):
        return parts  # images are not copied
    assert not isinstance(parts, dict)
    assert array.first is not None
    first, each = array.first, flat.length // array.type.length
    places = (nth(first, each, k, span) for k in range(flat.length))
    return ir.Construct(flat, tuple(index_into(parts, place, span) for place in places), span)


def plain_value(part: Part, span: Span) -> Part:
    """Return an array of plain values as one value, if it is an entry of another array."""
    if isinstance(part, ArrayValue) and is_plain(part.type):
        return cast(ir.Expr, alone(part, span).parts)
    return part


# Construction

#: Parts of one or more entries: a list of values for each flat array.
Lists: TypeAlias = "list[ir.Expr] | tuple[ImageValue, ...] | dict[str, Lists]"


def array_of(members: Sequence[Part], span: Span, builder: Builder) -> Part:
    """Build ``[a, b, …]`` from any values that arrays hold; the size of nested arrays is checked before they are
    copied."""
    for member in members:
        if isinstance(member, (ImageChoice, TupleValue)):
            what = "an image that an index chooses" if isinstance(member, ImageChoice) else "a tuple"
            fail(span, f"array elements are values, arrays, structs or images by name, got {what}")
    types = [type_of(member) for member in members]
    for type_ in types[1:]:
        if type_ != types[0] and not _alike(types[0], type_):
            fail(span, f"the elements of an array must have one type, got {types[0]} and {type_}")
    array = Array(cast(Value, types[0]), len(members))
    if longest(array) > MAX_ARRAY_LENGTH:
        fail(span, f"an array has at most {MAX_ARRAY_LENGTH} elements, got {longest(array)}")
    builder.count_expression(span, longest(array))
    lists = [spread(plain_value(member, span), span, builder.name_it) for member in members]
    parts = _joined(lists, span)
    if isinstance(parts, (dict, tuple)):
        return ArrayValue(array, parts)
    assert isinstance(parts.type, Array)
    return parts if is_plain(array) else ArrayValue(_with_element(array, parts.type.element), parts)


def _alike(one: Type, other: Type) -> bool:
    """Return True if two element types may be mixed; widening of numbers is checked one by one."""
    plain = (Scalar, Vector, Matrix)
    if not (isinstance(innermost(one), plain) and isinstance(innermost(other), plain)):
        return False
    return shape_of(one) == shape_of(other)


def _with_element(type_: Array, entry_type: Value | Array | Struct | ImageType) -> Array:
    """Return the same nested array type with another plain value type."""
    inner = type_.element
    return Array(_with_element(inner, entry_type) if isinstance(inner, Array) else entry_type, type_.length)


def spread(part: Part, span: Span, name: Namer) -> Lists:
    """Return the plain values and images of a part, in the order of its flat arrays."""
    if isinstance(part, StructValue):
        return {n: spread(plain_value(field, span), span, name) for n, field in part.fields.items()}
    if isinstance(part, ImageValue):
        return (part,)
    if isinstance(part, ArrayValue):
        return _entries_of(alone(part, span).parts, span, name)
    assert not isinstance(part, (ImageChoice, TupleValue))
    return _entries_of(part, span, name) if isinstance(part.type, Array) else [part]


def _entries_of(parts: Parts, span: Span, name: Namer) -> Lists:
    if isinstance(parts, tuple):
        return parts
    if isinstance(parts, dict):
        return {n: _entries_of(part, span, name) for n, part in parts.items()}
    assert isinstance(parts.type, Array)
    if isinstance(parts, ir.Construct) and len(parts.arguments) == parts.type.length:
        return list(parts.arguments)
    array = name(parts, span)
    return [index_into(array, ir.Literal(INT, k, span), span) for k in range(parts.type.length)]


def _joined(lists: list[Lists], span: Span) -> Parts:
    first = lists[0]
    if isinstance(first, dict):
        return {n: _joined([cast("dict[str, Lists]", one)[n] for one in lists], span) for n in first}
    if isinstance(first, tuple):
        return tuple(image for one in lists for image in cast("tuple[ImageValue, ...]", one))
    members = [member for one in lists for member in cast("list[ir.Expr]", one)]
    common = members[0]
    for member in members[1:]:
        common, _ = unify(common, member, span, "the elements of an array")
    typed = tuple(widen(member, common.type, span, "an array element") for member in members)
    return ir.Construct(Array(cast(Value, common.type), len(typed)), typed, span)


# Images


def each_image(builder: Builder, choice: ImageChoice, read: Callable[[ImageValue], Part], span: Span) -> Part:
    """Emit ``read`` for the image that an index selects: a branch for each, so that the others are not read."""
    name = builder.fresh("chosen")
    types: list[Value | Array] = []

    def branch(images: tuple[ImageValue, ...], first: int) -> None:
        if len(images) == 1:
            value = read(images[0])
            assert not isinstance(value, COMPOSITE)
            types.append(value.type)
            builder.emit(ir.Assign(name, value, span))
            return
        half = len(images) // 2
        below = apply("less", [choice.index, ir.Literal(INT, first + half, span)], span)
        then = builder.captured(lambda: branch(images[:half], first), span)
        orelse = builder.captured(lambda: branch(images[half:], first + half), span)
        builder.emit(ir.If(below, then, orelse, span))

    branch(choice.images, 0)
    return ir.Local(types[0], name, span)
