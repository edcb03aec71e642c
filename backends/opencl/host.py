"""OpenCL in a caller's context and queue: their buffers and images are read and written where they are."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from passgraph import arguments
from passgraph.backends.base import READ, DevicePicture, FloatBlock, Use
from passgraph.backends.opencl.backend import OpenCLBackend
from passgraph.backends.opencl.moves import move
from passgraph.backends.opencl.pictures import (
    BufferPicture,
    ImagePicture,
    OpenCLPicture,
    array_picture,
    buffer_picture,
    image_picture,
)
from passgraph.backends.opencl.storage import Placement, Storage, tight
from passgraph.errors import BackendError, InputError
from passgraph.formats import Format, format_named

if TYPE_CHECKING:
    from passgraph.backends.opencl.pictures import OpenCLPicture as Picture

#: The longest side of a picture, as the language counts pixels.
MOST_SIDE = 1 << 23


class Host(OpenCLBackend):
    """A backend on a caller's command queue, in its context, on its device.

    A run is put into the queue, behind what the caller has put there, and returns: nothing waits for the device, unless
    arrays of NumPy go in or come out, or triangles are drawn.  What the caller enqueues afterwards comes after it.  On
    an out-of-order queue passes run in an in-order queue of ours, and markers on both say the same.

    :meth:`close` gives back all that is ours in the context; buffers, images, queue and context stay the caller's.

    Parameters
    ----------
    queue
        A ``pyopencl.CommandQueue``; or a ``pyopencl.Context``, on whose first device a queue of ours is then made, and
        for which :meth:`wait_for` and :meth:`event` order runs among the caller's commands.

    Raises
    ------
    BackendError
        For anything else, and a device that compiles no kernels.

    Examples
    --------
    >>> import numpy as np, pyopencl, pyopencl.array
    >>> import passgraph as pg
    >>> context = pyopencl.create_some_context(interactive=False)
    >>> queue = pyopencl.CommandQueue(context)
    >>> invert = pg.kernel(source="def invert(color: Image) -> vec4: return vec4(1.0 - color[0, 0].rgb, 1.0)")
    >>> photo = pyopencl.array.to_device(queue, np.full((4, 6, 4), 51, np.uint8))
    >>> room = pyopencl.array.empty_like(photo)
    >>> output = invert(pg.Input("frame"), into=pg.target("negative", "rgba8"))
    >>> with pg.opencl.Host(queue) as host, pg.compile(output, backend=host) as program:
    ...     program.run(frame=photo, into={"negative": room})
    >>> room.get()[0, 0].tolist()
    [204, 204, 204, 255]
    """

    def __init__(self, queue: Any) -> None:
        cl = _pyopencl()
        if isinstance(queue, cl.Context):
            self.given: Any = None
            context, device = queue, queue.devices[0]
            used = cl.CommandQueue(context, device)
        elif isinstance(queue, cl.CommandQueue):
            self.given, context, device = queue, queue.context, queue.device
            unordered = queue.properties & cl.command_queue_properties.OUT_OF_ORDER_EXEC_MODE_ENABLE
            used = cl.CommandQueue(context, device) if unordered else queue
        else:
            raise BackendError(
                f"a host is made of a pyopencl.CommandQueue or a pyopencl.Context, got {arguments.shown(queue)}"
            )
        if not (device.available and device.compiler_available):
            raise BackendError(f"{device.name.strip()} is not available, or compiles no kernels; use another device")
        self._open(device, context, used)
        #: Pictures of the caller's that this run has adopted, and images whose results are still in a buffer.
        self._adopted: list[Storage] = []
        self._images: list[tuple[Storage, Any]] = []
        self._depth = 0
        how = "the caller's queue" if used is queue else "a queue of its own beside the caller's"
        self.about = f"the caller's OpenCL context, {how}, on {device.name.strip()}"

    # What the caller has

    def buffer(
        self,
        buffer: Any,
        size: tuple[int, int],
        format: str | Format,
        *,
        offset: int = 0,
        row_pitch: int | None = None,
        pixel_pitch: int | None = None,
        order: str | None = None,
        origin: Literal["top", "bottom"] = "top",
    ) -> BufferPicture:
        """A picture in a ``pyopencl.Buffer``, to be given for an input or in ``into=``.

        It holds the memory until it is dropped, and may be used for as many runs as you like.

        Parameters
        ----------
        size
            (width, height), pixels.
        format
            What a pixel holds, such as ``"rgba8"`` or ``"rgb8_srgb"``.
        offset
            Bytes before the first pixel in memory.
        row_pitch, pixel_pitch
            Bytes from one row, and from one pixel, to the next; left out, they lie side by side.
        order
            Channels as they lie in memory, such as ``"bgra"``; of three channels in four, ``"rgba"`` or ``"bgra"``
            leaves the fourth alone.
        origin
            Whether the first row in memory is the picture's highest or lowest.

        Raises
        ------
        InputError
            For a buffer of another context, what does not lie inside of it, and places that are no whole channels.
        """
        self.check_open()
        sides = arguments.several(size, 2, "host.buffer: size", "(width, height)", InputError)
        width, height = (arguments.whole(side, "host.buffer: each side", 1, MOST_SIDE, InputError) for side in sides)
        return buffer_picture(
            self.context, buffer, (width, height), format_named(format), offset=offset, row_pitch=row_pitch,
            pixel_pitch=pixel_pitch, order=order, origin=origin,
        )  # fmt: skip

    def picture(self, given: Any, format: str | Format | None = None) -> OpenCLPicture:
        """A picture of a ``pyopencl.array.Array`` or a two-dimensional ``pyopencl.Image``.

        Runs take these as they are too.  With a format, such as ``"rgba8_srgb"``, their numbers mean what that says.
        """
        made = self._described(given, None if format is None else format_named(format))
        if made is None:
            raise InputError(f"a picture is made of a pyopencl array or image, got {arguments.shown(given)}")
        return made

    def wait_for(self, events: Iterable[Any]) -> None:
        """Let the next run begin when these events of other queues have happened."""
        self.check_open()
        found = list(events)
        for event in found:
            arguments.instance(event, self.cl.Event, "wait_for: each event", "a pyopencl.Event", InputError)
        with self.turn, self.reported("waiting for the caller's events"):
            if found:
                self.cl.enqueue_barrier(self.queue, wait_for=found)

    def event(self) -> Any:
        """A ``pyopencl.Event`` that happens when all runs so far are done: for other queues, or to wait for."""
        self.check_open()
        with self.turn, self.reported("marking the end of the runs so far"):
            event = self.cl.enqueue_marker(self.queue)
            self.queue.flush()
            return event

    # The contract

    def picture_of(self, given: object) -> DevicePicture | None:
        return self._described(given, None)

    def _described(self, given: Any, format_: Format | None) -> OpenCLPicture | None:
        if isinstance(given, OpenCLPicture):
            if given.context != self.context:
                raise InputError(f"{given} is of another OpenCL context; make it with this program's host")
            return given
        if isinstance(given, np.ndarray) or not type(given).__module__.startswith("pyopencl"):
            return None
        self.check_open()
        if isinstance(given, self.cl.Image):
            return image_picture(self.context, given, format_)
        if hasattr(given, "base_data"):
            return array_picture(self.context, given, format_)
        raise InputError(
            f"{arguments.shown(given)} does not say of what size and format it is; give host.buffer(buffer, (width, "
            "height), 'rgba8')"
        )

    def adopt(self, external: Any, format: Format, use: Use = READ) -> Storage | None:
        if not isinstance(external, OpenCLPicture):
            return super().adopt(external, format, use)
        if use.is_written:
            check_room(external, format)
        misses = (use.is_read and not external.is_readable) or not external.holds(format)
        if misses or not self._depth or (format.is_depth and use.is_drawn):
            return None
        with self.reported("taking a picture of the caller's"):
            storage = self._storage(external, format)
            if isinstance(external, ImagePicture):
                if use.is_written:
                    self._images.append((storage, external))
                else:
                    self._from_image(external, storage.buffer)
        return storage

    def _storage(self, picture: OpenCLPicture, format_: Format) -> Storage:
        """A picture as passes take it, until the run ends."""
        if isinstance(picture, BufferPicture):
            self._wait_for_array(picture)
            buffer, placement = self._region(picture)
        else:
            assert isinstance(picture, ImagePicture)
            size = picture.size[0] * picture.size[1] * len(picture.channels) * picture.format.bits // 8
            buffer, placement = self.allocate(size, f"a copy of {picture}"), picture.placement
        plain = placement == tight(format_.channels, picture.size[0])
        made = Storage(format_, picture.size, buffer, None, None, None if plain else placement, picture)
        self._adopted.append(made)
        return made

    def _wait_for_array(self, picture: BufferPicture) -> None:
        """Commands of other queues that a pyopencl array is still waiting for."""
        foreign = [event for event in picture.events if event.command_queue != self.queue]
        if foreign:
            self.cl.enqueue_barrier(self.queue, wait_for=foreign)

    def _region(self, picture: BufferPicture) -> tuple[Any, Placement]:
        """The part of a buffer that holds a picture: nothing before it can be reached, but what alignment asks for."""
        memory, placement = picture.memory, picture.placement
        parent = memory.associated_memobject
        start = picture.offset + (0 if parent is None else memory.offset)
        begin = start // self.alignment * self.alignment
        if parent is None and begin == 0:
            buffer = memory
        else:
            buffer = (memory if parent is None else parent).get_sub_region(begin, start + picture.bytes - begin)
        before = (start - begin if buffer is not memory else picture.offset) // (picture.format.bits // 8)
        return buffer, Placement(placement.first + before, placement.row, placement.pixel, placement.channels)

    def _from_image(self, picture: ImagePicture, buffer: Any) -> None:
        self.cl.enqueue_copy(self.queue, buffer, picture.memory, offset=0, origin=(0, 0), region=picture.size)

    def _to_image(self, picture: ImagePicture, buffer: Any) -> None:
        self.cl.enqueue_copy(self.queue, picture.memory, buffer, offset=0, origin=(0, 0), region=picture.size)

    @contextmanager
    def running(self) -> Iterator[None]:
        """Behind what the caller has enqueued, and before what they enqueue next."""
        self.check_open()
        outermost = self._depth == 0
        if outermost:
            self._begin()
        self._depth += 1
        try:
            with super().running():
                yield
        finally:
            self._depth -= 1
            if outermost:
                self._end()

    @property
    def _is_apart(self) -> bool:
        """Whether passes run in a queue of ours beside one of the caller's."""
        return self.given is not None and self.given is not self.queue

    def _begin(self) -> None:
        if self._is_apart:
            with self.reported("waiting for the caller's queue"):
                before = self.cl.enqueue_marker(self.given)
                self.given.flush()
                self.cl.enqueue_barrier(self.queue, wait_for=[before])

    def _end(self) -> None:
        adopted, self._adopted = self._adopted, []
        images, self._images = self._images, []
        try:
            with self.reported("giving pictures back"):
                for storage, picture in images:
                    self._to_image(picture, storage.buffer)
                self._hand_over(adopted)
        finally:
            for storage in adopted:
                storage.released = True
                picture = storage.picture
                if isinstance(picture, ImagePicture):
                    self.free(storage.buffer)
                elif picture is not None and storage.buffer is not picture.memory:
                    storage.buffer.release()

    def _hand_over(self, adopted: list[Storage]) -> None:
        after = None
        if self._is_apart:
            after = self.cl.enqueue_marker(self.queue)
            self.queue.flush()
            self.cl.enqueue_barrier(self.given, wait_for=[after])
            self.given.flush()
        for storage in adopted:
            array = getattr(storage.picture, "array", None)
            if array is not None and array.queue is not None and array.queue != (self.given or self.queue):
                after = after or self.cl.enqueue_marker(self.queue)
                array.add_event(after)

    # Moved

    def upload_stored(self, storage: Storage, numbers: NDArray[Any] | Picture, format: Format) -> None:
        if not isinstance(numbers, OpenCLPicture):
            super().upload_stored(storage, numbers, format)
            return
        if not numbers.is_readable:
            raise InputError(f"{numbers} may not be read (WRITE_ONLY); make its memory READ_WRITE")
        if not numbers.is_stored and numbers.format.srgb != format.srgb:
            raise InputError(f"{numbers} cannot be read as {format.name}: one is sRGB-encoded; declare the same format")
        with self.running(), self.reported("copying a picture of the caller's"):
            source = self._storage(numbers, _as_held(numbers, format))
            if isinstance(numbers, ImagePicture):
                self._from_image(numbers, source.buffer)
            move(self, (source.buffer, source.layout), (storage.buffer, storage.layout))

    def download_into(self, storage: Storage, into: NDArray[Any] | Picture, format: Format) -> None:
        if not isinstance(into, OpenCLPicture):
            with self._plain(storage) as own:
                super().download_into(own, into, format)
            return
        check_room(into, format)
        with self.running(), self.reported("copying a result to the caller's picture"):
            destination = self._storage(into, _as_held(into, format))
            move(self, (storage.buffer, storage.layout), (destination.buffer, destination.layout))
            if isinstance(into, ImagePicture):
                self._images.append((destination, into))

    def download(self, storage: Storage) -> FloatBlock:
        values = np.empty(storage.shape, np.float32)
        self.download_into(storage, values, storage.format)
        return values

    @contextmanager
    def _plain(self, storage: Storage) -> Iterator[Storage]:
        """A storage without gaps, to be read by the host."""
        if storage.placement is None:
            yield storage
            return
        own = self.make(storage.format, storage.size)
        try:
            move(self, (storage.buffer, storage.layout), (own.buffer, own.layout))
            yield own
        finally:
            self.release(own)

    def copy(self, source: Storage, destination: Storage) -> None:
        if source.placement is None and destination.placement is None:
            super().copy(source, destination)
            return
        with self.reported("copying a picture"):
            move(self, (source.buffer, source.layout), (destination.buffer, destination.layout))


def check_room(picture: OpenCLPicture, format_: Format) -> None:
    """Whether a target of a format can be written there; InputError else."""
    if not picture.is_writable:
        raise InputError(f"into= gives a {picture}, which may not be written (READ_ONLY); make its memory READ_WRITE")
    if not picture.is_stored and picture.format.srgb != format_.srgb:
        raise InputError(f"into= gives a {picture} for target format {format_.name}: only one is sRGB-encoded")
    own = picture.format
    if own.channels != format_.channels and min(own.channels, format_.channels) < 3:
        raise InputError(
            f"into= gives a {picture} for target format {format_.name}, which has {format_.channels} channel(s); they "
            "must be as many"
        )
    if own.number != format_.number and own.number != "f4":
        raise InputError(f"into= gives a {picture} for target format {format_.name}; give the same numbers, or float32")


def _as_held(picture: OpenCLPicture, format_: Format) -> Format:
    """What a picture's numbers are, where they are to be moved."""
    return format_ if picture.holds(format_) else picture.format


def _pyopencl() -> Any:
    from passgraph.backends.opencl.devices import INSTALL_MODULE
    from passgraph.errors import DeviceMissingError

    try:
        import pyopencl
    except ImportError as error:
        raise DeviceMissingError(f"a host needs pyopencl ({error}); install it: {INSTALL_MODULE}") from None
    return pyopencl


