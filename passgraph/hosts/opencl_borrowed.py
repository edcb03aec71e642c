"""The caller's pictures that a host uses in place, and the copies to write back when a run ends."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any
from weakref import ReferenceType, WeakKeyDictionary, finalize, ref

from passgraph.backends.base import Use
from passgraph.backends.opencl.caller_memory import BufferPicture, ImagePicture, OpenCLPicture, array_picture, parent_of
from passgraph.backends.opencl.storage import ImageLayout, Storage
from passgraph.errors import InputError
from passgraph.formats import Format

if TYPE_CHECKING:
    from passgraph.hosts.opencl import Host


#: The use of a destination that a result is copied to.
WRITTEN = Use(is_read=False, is_written=True)


@dataclass(frozen=True, slots=True)
class _Known:
    """A picture that was adopted before, with its allowed uses."""

    format: Format
    uses: list[Use]
    storage: Storage


class Borrowed:
    """The caller's pictures in a host. A buffer's picture is known as long as the caller keeps it, an image's for one
    run."""

    def __init__(self, host: Host) -> None:
        self.host = host
        self._known: WeakKeyDictionary[OpenCLPicture, _Known] = WeakKeyDictionary()
        #: The layouts of pyopencl arrays by their id, removed with the array.
        self._arrays: dict[int, tuple[Any, BufferPicture]] = {}
        #: Copies of images in this run, and True for those to write back.
        self._copies: list[tuple[ImagePicture, Storage, bool]] = []
        #: Arrays of other queues that this run writes to.
        self._written: list[Any] = []

    @property
    def counts(self) -> tuple[int, int, int, int]:
        """Return the counts of known pictures, arrays, copies of images and results for other queues."""
        return len(self._known), len(self._arrays), len(self._copies), len(self._written)

    def array(self, array: Any) -> BufferPicture:
        """Return an array as a picture, described once."""
        place = array.base_data, array.offset, array.shape, array.strides, array.dtype
        known = self._arrays.get(id(array))
        if known is not None and known[0] == place:
            return known[1]
        picture = array_picture(self.host.context, array, None)
        if id(array) not in self._arrays:
            finalize(array, _forget_array, ref(self), id(array)).atexit = False
        self._arrays[id(array)] = place, picture
        return picture

    def adopted(self, picture: OpenCLPicture, format_: Format, use: Use) -> Storage | None:
        """Return a picture for passes to use in place; None if it must be copied."""
        known = self._known.get(picture)
        if known is not None and known.format is format_ and use in known.uses:
            if picture.has_array:
                self._order(picture, use)
            return known.storage
        if use.is_written:
            check_room(picture, format_)
        if (use.is_read and not picture.is_readable) or not picture.holds(format_):
            return None
        if (format_.is_depth and use.is_drawn) or (use.is_overwritten and isinstance(picture, BufferPicture)):
            return None
        if known is not None and known.format is format_:
            known.uses.append(use)
            self._order(picture, use)
            return known.storage
        with self.host.reported("taking a picture of the caller's"):
            storage = self.storage(picture, format_, use)
        if isinstance(picture, BufferPicture):
            self._known[picture] = _Known(format_, [use], storage)
        return storage

    def storage(self, picture: OpenCLPicture, format_: Format, use: Use) -> Storage:
        """Return a picture's storage for passes: its buffer, or a copy of an image until the run ends."""
        if isinstance(picture, BufferPicture):
            self._order(picture, use)
            buffer, layout = self._region(picture)
            return Storage(replace(layout, format=format_), buffer, is_callers=True)
        assert isinstance(picture, ImagePicture)
        buffer = self.host.allocate(picture.layout.bytes, f"a copy of {picture}")
        copy = Storage(replace(picture.layout, format=format_), buffer, is_callers=True)
        self._copies.append((picture, copy, use.is_written))
        if use.is_read:
            self.host.cl.enqueue_copy(
                self.host.queue, copy.buffer, picture.memory, offset=0, origin=(0, 0), region=picture.size
            )
        return copy

    def _order(self, picture: OpenCLPicture, use: Use) -> None:
        """Wait for the events of a pyopencl array, and note it if the run's event must be added to them."""
        array = picture.array
        if array is None:
            return
        if array.events:
            self.wait_for(array.events)
        if use.is_written and array.queue not in (None, self.host.given, self.host.queue):
            self._written.append(array)

    def wait_for(self, events: Iterable[Any]) -> None:
        """Wait for commands of other queues, such as a pyopencl array's pending events."""
        foreign = [event for event in events if event.command_queue != self.host.queue]
        if foreign:
            self.host.cl.enqueue_barrier(self.host.queue, wait_for=foreign)

    def _region(self, picture: BufferPicture) -> tuple[Any, ImageLayout]:
        """Return a sub-buffer from a picture's start, aligned as OpenCL requires, so that kernels do not depend on the
        offset. OpenCL has no sub-buffers of sub-buffers, so one is created from the parent, if the driver knows it."""
        buffer, start, begin = picture.memory, picture.offset, 0
        is_part, parent = parent_of(buffer)
        if parent is not None:
            start += buffer.offset
        if parent is not None or not is_part:
            begin = start // self.host.alignment * self.host.alignment
        if parent is not None or begin:
            buffer = (parent or buffer).get_sub_region(begin, start + picture.layout.bytes - begin)
        before = (start - begin) * 8 // picture.format.bits
        return buffer, replace(picture.layout, first=picture.layout.first + before)

    @property
    def is_used(self) -> bool:
        """True if the end of the run has copies or events to handle."""
        return bool(self._copies or self._written)

    def copy_images(self) -> None:
        """Write results back to images."""
        copies, self._copies = self._copies, []
        for picture, storage, is_written in copies:
            storage.released = True
            if is_written:
                self.host.cl.enqueue_copy(
                    self.host.queue, picture.memory, storage.buffer, offset=0, origin=(0, 0), region=picture.size
                )
            self.host.free(storage.buffer)

    def tell_arrays(self, after: Any) -> None:
        """Add an event after the run to arrays of other queues; it is created if there is none."""
        written, self._written = self._written, []
        for array in written:
            after = after or self.host.cl.enqueue_marker(self.host.queue)
            array.add_event(after)

    def clear(self) -> None:
        """Drop all references."""
        self._known.clear()
        self._arrays.clear()


def _forget_array(borrowed: ReferenceType[Borrowed], array: int) -> None:
    there = borrowed()
    if there is not None:
        there._arrays.pop(array, None)


def check_source(picture: OpenCLPicture, format_: Format) -> None:
    """Raise InputError if a picture cannot be read as a format."""
    if not picture.is_readable:
        raise InputError(f"{picture} may not be read (WRITE_ONLY); make its memory READ_WRITE")
    if not picture.is_stored and picture.format.srgb != format_.srgb:
        raise InputError(f"{picture} cannot be read as {format_.name}: one is sRGB-encoded; declare the same format")


def check_room(picture: OpenCLPicture, format_: Format) -> None:
    """Raise InputError if a target of a format cannot be written to a picture."""
    if not picture.is_writable:
        raise InputError(f"into= gives a {picture}, which may not be written (READ_ONLY); make its memory READ_WRITE")
    picture.check_room(format_, "give both the same format", picture.is_stored)
    own = picture.format
    if own.number != format_.number and own.number != "f4":
        raise InputError(f"into= gives a {picture} for target format {format_.name}; give the same numbers, or float32")


def as_held(picture: OpenCLPicture, format_: Format) -> Format:
    """Return the format of a picture's numbers for transfers."""
    return format_ if picture.holds(format_) else picture.format
