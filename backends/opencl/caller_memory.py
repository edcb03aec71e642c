"""Pictures in memory of a caller: buffers, pyopencl arrays, and images.

A description is checked against the size of the memory before anything runs.  It holds its own reference to the memory,
so the caller may release theirs.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, field, replace
from typing import Any
from weakref import ReferenceType, ref

import numpy as np
from numpy.typing import NDArray

from passgraph import arguments
from passgraph.backends.base import DevicePicture
from passgraph.backends.opencl.storage import ImageLayout
from passgraph.cached import cached_property
from passgraph.errors import InputError
from passgraph.formats import FORMATS, Format, colour_format

#: Most steps in a search for a common pixel; beyond that, interleaved ranges count as overlapping.
OVERLAP_WORK: Any = 10_000  # NumPy 2.4 declares 0 and -1 only
_ORDERS = ("rgba", "bgra", "argb", "abgr", "rgb", "bgr", "rg", "r")


@dataclass(frozen=True, eq=False)
class OpenCLPicture(DevicePicture):
    """A caller's picture, to be passed for an input or in ``into=``.

    Attributes
    ----------
    memory : a pyopencl object with its own reference to the memory
    context : the caller's
    is_stored : True if the numbers are in the format of the input or target; else they are in ``format``
    given : the caller's object, as a memory pool reclaims memory when that is garbage-collected
    layout : where the picture lies in its buffer, or in a copy of its image
    """

    memory: Any
    context: Any
    is_stored: bool
    given: Any = field(repr=False)
    layout: ImageLayout

    @property
    def has_array(self) -> bool:
        """Return True if it is a ``pyopencl.array.Array``."""
        return False

    @property
    def array(self) -> Any:
        """Return the array, or None if it was garbage-collected."""
        return None

    @property
    def is_readable(self) -> bool:
        return not self.memory.flags & _flags().WRITE_ONLY

    @property
    def is_writable(self) -> bool:
        return not self.memory.flags & _flags().READ_ONLY

    def holds(self, format_: Format) -> bool:
        """Return True if its channel type and count are those of a format."""
        own = self.format
        same_layout = (own.number, own.channels) == (format_.number, format_.channels) and not format_.stencil
        return same_layout and (self.is_stored or own.srgb == format_.srgb)


@dataclass(frozen=True, eq=False)
class BufferPicture(OpenCLPicture):
    """A picture in a buffer.

    Attributes
    ----------
    offset : its first byte in the buffer; positions in ``layout`` count from there
    array_there : returns the ``pyopencl.array.Array``, which is not kept alive; None if it is not an array
    """

    offset: int
    array_there: ReferenceType[Any] | None = field(default=None, repr=False)

    @property
    def has_array(self) -> bool:
        return self.array_there is not None

    @property
    def array(self) -> Any:
        return None if self.array_there is None else self.array_there()

    @cached_property
    def in_memory(self) -> tuple[tuple[str, int], int]:
        """Return the identity of the memory and the byte at which the buffer begins."""
        return _memory_of(self.memory)

    def overlaps(self, other: DevicePicture) -> bool:
        if not isinstance(other, BufferPicture) or self.in_memory[0] != other.in_memory[0]:
            return False
        try:
            return np.shares_memory(self._places(), other._places(), max_work=OVERLAP_WORK)
        except np.exceptions.TooHardError:
            return True

    def _places(self) -> NDArray[Any]:
        """Return an array with the same addresses, never read: addresses in the memory, counted from 1."""
        number, layout = np.dtype(self.format.number), self.layout
        lowest = min(layout.places)
        start = self.in_memory[1] + self.offset + (layout.first + lowest - layout.span[0]) * number.itemsize + 1
        # Adjacent channels count as one wide number.
        width = max(layout.places) - lowest + 1
        shape, strides = (self.size[1], self.size[0], width), (layout.row, layout.pixel, 1)
        places: NDArray[Any] = np.asarray(_Addresses(start, shape, strides, number))
        return places

    @cached_property
    def _description(self) -> str:
        what = "buffer" if self.array_there is None else "pyopencl array"
        row = abs(self.layout.row) * self.format.bits // 8
        return f"{self.format.name} picture of {self.size[0]}x{self.size[1]} pixels in a {what}, rows {row} bytes apart"

    def __str__(self) -> str:
        return self._description


class _Addresses:
    """An array interface for memory that is never accessed."""

    def __init__(self, start: int, shape: tuple[int, ...], strides: tuple[int, ...], number: np.dtype[Any]) -> None:
        self.__array_interface__ = {
            "version": 3,
            "data": (start, True),
            "shape": shape,
            "typestr": number.str,
            "strides": tuple(stride * number.itemsize for stride in strides),
        }


@dataclass(frozen=True, eq=False)
class ImagePicture(OpenCLPicture):
    """A picture in an OpenCL image, copied to and from a buffer."""

    def is_in(self, storage: Any) -> bool:
        return False

    def overlaps(self, other: DevicePicture) -> bool:
        return isinstance(other, ImagePicture) and self.memory.int_ptr == other.memory.int_ptr

    def __str__(self) -> str:
        return f"{self.format.name} picture of {self.size[0]}x{self.size[1]} pixels in an image"


def _flags() -> Any:
    import pyopencl as cl

    return cl.mem_flags


def parent_of(memory: Any) -> tuple[bool, Any]:
    """Return True and the parent if a buffer is a sub-buffer; the parent is None if the driver has forgotten it."""
    import pyopencl as cl

    try:
        parent = memory.associated_memobject
    except cl.LogicError:  # released, on some drivers
        return True, None
    return parent is not None, parent


def _memory_of(memory: Any) -> tuple[tuple[str, int], int]:
    """Return the identity of a buffer's memory: sub-buffers share it, as do buffers over one host array."""
    is_part, parent = parent_of(memory)
    offset = memory.offset if is_part else 0
    if is_part and parent is None:
        return ("a part", 0), offset
    owner = parent if is_part else memory
    if memory.flags & _flags().USE_HOST_PTR:
        return ("host", 0), owner.get_host_array((owner.size,), np.uint8).ctypes.data + offset
    return ("device", owner.int_ptr), offset


# Pictures from the caller's objects


def buffer_picture(
    context: Any, memory: Any, size: tuple[int, int], format_: Format, *, offset: int = 0, row_pitch: int | None = None,
    pixel_pitch: int | None = None, order: str | None = None, origin: str = "top",
) -> BufferPicture:  # fmt: skip
    """Return a picture in a buffer; see `passgraph.hosts.opencl.Host.buffer`."""
    what = "host.buffer"
    width, height = size
    number = format_.bits // 8
    _check_memory(context, memory, f"{what}: the buffer")
    if format_.stencil:
        raise InputError(f"{what}: {format_.name} keeps its stencil apart; give depth32f")
    channels = _channels(order, format_, what)
    pixel = _bytes_to_numbers(pixel_pitch, len(order or channels) * number, number, f"{what}: pixel_pitch")
    row = _bytes_to_numbers(row_pitch, width * pixel * number, number, f"{what}: row_pitch")
    start = _bytes_to_numbers(offset, 0, number, f"{what}: offset")
    arguments.one_of(origin, "origin", ("top", "bottom"), InputError)
    if pixel <= max(channels) or (height > 1 and row < (width - 1) * pixel + max(channels) + 1):
        raise InputError(
            f"{what}: pixels {pixel * number} bytes apart in rows {row * number} bytes apart overlap; a pixel of "
            f"{format_.name} needs {(max(channels) + 1) * number} bytes, and a row {width} times as many"
        )
    first, row = ((height - 1) * row, -row) if origin == "bottom" else (0, row)
    layout = ImageLayout(format_, size, first, row, pixel, channels)
    return _in_buffer(context, memory, start * number, layout, what)


def array_picture(context: Any, array: Any, format_: Format | None) -> BufferPicture:
    """Return a picture from a ``pyopencl.array.Array`` (height, width, channels) or (height, width).

    Without a format its numbers count as stored.
    """
    what = f"the pyopencl array {array.shape} of {array.dtype}"
    shape, strides = tuple(map(int, array.shape)), tuple(map(int, array.strides))
    if len(shape) == 2:
        shape, strides = (*shape, 1), (*strides, array.dtype.itemsize)
    if len(shape) != 3 or not all(shape) or shape[2] > 4:
        raise InputError(f"{what} is no picture; give one of shape (height, width) or (height, width, 1 to 4)")
    own = colour_format(array.dtype.str[1:], shape[2]) if array.dtype.isnative else None
    if own is None:
        raise InputError(f"{what} holds numbers of no format; give uint8, uint16, float16 or float32")
    if format_ is not None and (format_.number, format_.channels) != (own.number, own.channels):
        raise InputError(f"{what} holds the numbers of {own.name}; {format_.name} has other ones")
    memory, number = array.base_data, own.bits // 8
    _check_memory(context, memory, what)
    if any(stride % number for stride in strides):
        raise InputError(f"{what} has strides {array.strides} that are no whole numbers of {number} bytes")
    row, pixel, channel = (stride // number for stride in strides)
    places = tuple(k * channel for k in range(shape[2]))
    layout = ImageLayout(format_ or own, (shape[1], shape[0]), 0, row, pixel, places)
    picture = _in_buffer(
        context, memory, int(array.offset), layout, what, is_stored=format_ is None, array_there=ref(array)
    )
    if layout.overlaps_itself:
        raise InputError(f"{what} has pixels that share memory (strides {array.strides}); give a contiguous array")
    return picture


def _in_buffer(
    context: Any, memory: Any, start: int, layout: ImageLayout, what: str, *,
    is_stored: bool = False, array_there: ReferenceType[Any] | None = None,
) -> BufferPicture:  # fmt: skip
    """Return a picture in a buffer. ``start`` is the byte from which its layout counts.

    Raises
    ------
    InputError : if the picture exceeds the buffer.
    """
    format_, size, (low, end) = layout.format, layout.size, layout.span
    number = format_.bits // 8
    if start % number:
        raise InputError(f"{what}: begins at byte {start}, which is no multiple of {number}")
    first, last = start + low * number, start + end * number
    capacity = int(memory.size)
    if first < 0 or last > capacity:
        raise InputError(
            f"{what}: {size[0]}x{size[1]} pixels {format_.name} take bytes {first:,} to "
            f"{last:,}, and the buffer has {capacity:,}; give a larger one, or check offset and pitch"
        )
    moved = replace(layout, first=layout.first - low)
    return BufferPicture(
        format_, size, _retained(memory), context, is_stored, memory, moved, first, array_there
    )  # fmt: skip


def image_picture(context: Any, image: Any, format_: Format | None) -> ImagePicture:
    """Return a picture from a two-dimensional ``pyopencl.Image``."""
    import pyopencl as cl

    _check_memory(context, image, "the image")
    if image.type != cl.mem_object_type.IMAGE2D:
        raise InputError("an image must be two-dimensional to be a picture; copy one layer of it into another image")
    orders = {cl.channel_order.R: "r", cl.channel_order.RG: "rg", cl.channel_order.RGBA: "rgba",
              cl.channel_order.BGRA: "bgra"}  # fmt: skip
    types = {cl.channel_type.UNORM_INT8: "8", cl.channel_type.UNORM_INT16: "16", cl.channel_type.HALF_FLOAT: "16f",
             cl.channel_type.FLOAT: "32f"}  # fmt: skip
    image_format = image.format
    order, type_ = orders.get(image_format.channel_order), types.get(image_format.channel_data_type)
    if order is None or type_ is None:
        raise InputError(
            f"an image of {image_format} holds no format; give channels R, RG, RGBA or BGRA in UNORM_INT8, "
            "UNORM_INT16, HALF_FLOAT or FLOAT"
        )
    own = FORMATS[f"{'rgba'[: len(order)]}{type_}"]
    if format_ is not None and (format_.number, format_.channels) != (own.number, own.channels):
        raise InputError(f"the image holds the numbers of {own.name}; {format_.name} has other ones")
    size = int(image.width), int(image.height)
    channels = tuple(order.index(letter) for letter in "rgba"[: len(order)])
    layout = replace(ImageLayout.tight(format_ or own, size), places=channels)
    return ImagePicture(layout.format, size, _retained(image), context, format_ is None, image, layout)


def _retained(memory: Any) -> Any:
    """Return the same memory with a reference of its own."""
    import pyopencl as cl

    kind = cl.Image if isinstance(memory, cl.Image) else cl.Buffer
    return kind.from_int_ptr(memory.int_ptr, True)


def _check_memory(context: Any, memory: Any, what: str) -> None:
    import pyopencl as cl

    if not isinstance(memory, cl.MemoryObjectHolder):
        raise InputError(f"{what} must be in a pyopencl.Buffer, got {arguments.shown(memory)}")
    if memory.context != context:
        raise InputError(
            f"{what} is of another OpenCL context ({_devices(memory.context)}) than the host's queue "
            f"({_devices(context)}); make it in that context, or make a host of its own queue"
        )


def _devices(context: Any) -> str:
    return ", ".join(device.name.strip() for device in context.devices)


def _channels(order: str | None, format_: Format, what: str) -> tuple[int, ...]:
    letters = "rgba"[: format_.channels]
    order = letters if order is None else order
    arguments.one_of(order, f"{what}: order", _ORDERS, InputError)
    if not set(letters) <= set(order):
        raise InputError(f"{what}: order {order!r} lacks channels of {format_.name}, which are {letters!r}")
    return tuple(order.index(letter) for letter in letters)


def _bytes_to_numbers(bytes_: int | None, plain: int, number: int, what: str) -> int:
    """Convert bytes to numbers."""
    count = plain if bytes_ is None else arguments.whole_number(bytes_, f"{what} (bytes)", 0, sys.maxsize, InputError)
    if count % number:
        raise InputError(f"{what} is {count} bytes, which is no multiple of {number}, the bytes of a channel")
    return count // number
