"""Long arrays: parameters of kernels that are stored in memory and read by entry."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import KernelLengthError
from passgraph.language import ir
from passgraph.language.source import Span, fail
from passgraph.language.types import (
    MAX_ARRAY_LENGTH,
    Array,
    Matrix,
    Type,
    component_count,
    element_of,
    held_as,
    is_plain,
    plain_parts,
)
from passgraph.language.uniform_layout import components, in_order
from passgraph.records import dataclass

#: Most bytes of a long array.
MAX_BUFFER_BYTES = 1 << 28
#: Texels of a row: within every device's limit, and a power of two, so that positions need no division.
WIDTH_BITS = 11
WIDTH = 1 << WIDTH_BITS
#: Bits of an int in each of its two numbers.
HALF_BITS = 16
#: NumPy types of components.
_NUMBERS: dict[str, type[np.generic]] = {"float": np.float32, "int": np.int32, "uint": np.uint32, "bool": np.bool_}


def is_buffer(type_: Type) -> bool:
    """Return True if a parameter's type, or a plain part of it, is a long array."""
    return isinstance(type_, Array) and is_plain(type_) and type_.length > MAX_ARRAY_LENGTH


def buffers_in(type_: Type, name: str) -> Iterator[tuple[str, Array]]:
    """Yield the long arrays in a type, by dotted names."""
    for path, part in plain_parts(type_, name):
        if is_buffer(part):
            yield path, cast(Array, part)


@dataclass(frozen=True, slots=True)
class Layout:
    """The layout of an array in its picture: ``texels`` for each entry, width and height."""

    channels: int
    texels: int
    size: tuple[int, int]


def layout_of(type_: Array) -> Layout:
    """Return the layout of an array.

    >>> from passgraph.language.types import INT, VEC3
    >>> layout_of(Array(VEC3, 5000)), layout_of(Array(INT, 1500)).channels
    (Layout(channels=3, texels=1, size=(2048, 3)), 2)
    """
    entry = cast(Type, type_.element)
    count = component_count(entry)
    if held_as(type_) == "int":
        count *= 2
        channels = 4 if count % 4 == 0 else 2
    else:
        channels = entry.rows if isinstance(entry, Matrix) else count
    texels = count // channels
    total = type_.length * texels
    width = min(total, WIDTH)
    return Layout(channels, texels, (width, -(-total // width)))


def check_sizes(parameters: tuple[ir.Parameter, ...]) -> None:
    """Raise an error for arrays that take too much memory."""
    for parameter in parameters:
        for name, type_ in buffers_in(parameter.type, parameter.name):
            layout = layout_of(type_)
            bytes_ = 4 * layout.channels * layout.texels * type_.length
            if bytes_ > MAX_BUFFER_BYTES:
                fail(
                    parameter.span,
                    f"{name} of type {type_} takes {bytes_ / 2**20:.0f} MiB; an array may take "
                    f"{MAX_BUFFER_BYTES >> 20} MiB",
                )


def check_local(type_: Type, what: str, span: Span) -> None:
    """Raise an error for a variable or result that would contain a long array."""
    for _, long in buffers_in(type_, ""):
        fail(
            span,
            f"{what} would hold {long}; arrays of more than {MAX_ARRAY_LENGTH} elements are parameters, read by index",
            KernelLengthError,
        )


def check_reads(parameters: tuple[ir.Parameter, ...], *roots: ir.Stmt | ir.Expr) -> None:
    """Raise an error for uses of a long array as one value: only its entries can be read."""
    long = any(True for parameter in parameters for _ in buffers_in(parameter.type, parameter.name))
    pending: list[ir.Stmt | ir.Expr] = list(roots) if long else []
    while pending:
        node = pending.pop()
        for part in ir.parts_of(node):
            indexed = isinstance(node, ir.Index) and part is node.value
            if isinstance(part, ir.Uniform) and is_buffer(part.type) and not indexed:
                fail(
                    node.span,
                    f"{part.name} has {cast(Array, part.type).length} entries, which are read by index; an array of "
                    f"more than {MAX_ARRAY_LENGTH} is not copied, assigned to or compared",
                )
            pending.append(part)


# Host values


def checked_numbers(value: object, type_: Array, name: str) -> NDArray[Any]:
    """Return a host value in component order, flat: unchanged if its dtype fits, else as float64.

    Raises
    ------
    InputError
        If shape, kind or range do not fit, with the parameter's name.
    """
    flat = in_order(value, type_) if isinstance(value, np.ndarray) and value.dtype == number_of(type_) else None
    return components(value, type_, name) if flat is None else flat


def number_of(type_: Array) -> type[np.generic]:
    """Return the NumPy type of a component."""
    return _NUMBERS[element_of(type_).name]


def as_held(flat: NDArray[Any], type_: Array) -> NDArray[Any]:
    """Return :func:`checked_numbers` in their own type: uints are reinterpreted from ints."""
    kind = number_of(type_)
    return flat.astype(np.int64).astype(kind) if held_as(type_) == "int" else flat.astype(kind)


def picture_of(value: object, type_: Array, name: str) -> NDArray[np.float32]:
    """Return the picture, (height, width, channels), that stores an array; it may be the value's own memory."""
    layout, flat = layout_of(type_), checked_numbers(value, type_, name)
    if held_as(type_) == "int":
        bits = flat.astype(np.int64, copy=False)
        halves = np.empty((len(bits), 2), np.float32)
        halves[:, 0], halves[:, 1] = bits & (1 << HALF_BITS) - 1, bits >> HALF_BITS & (1 << HALF_BITS) - 1
        flat = halves.reshape(-1)
    width, height = layout.size
    capacity = width * height * layout.channels
    if len(flat) < capacity:
        padded = np.zeros(capacity, np.float32)
        with np.errstate(over="ignore"):  # values that round to infinity were rejected before
            padded[: len(flat)] = flat
        flat = padded
    return np.ascontiguousarray(flat, np.float32).reshape(height, width, layout.channels)


def numbers_in(picture: NDArray[np.float32], type_: Array) -> NDArray[Any]:
    """Return the components in such a picture: float32, int32 (for uints too) or bool."""
    layout = layout_of(type_)
    flat = picture.reshape(-1)[: type_.length * layout.texels * layout.channels]
    if held_as(type_) != "int":
        return flat if held_as(type_) == "float" else flat != 0.0
    halves = flat.reshape(-1, 2).astype(np.uint32)
    return (halves[:, 0] | halves[:, 1] << HALF_BITS).view(np.int32)
