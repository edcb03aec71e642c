"""OpenCL in a caller's context and queue: their buffers and images are read and written where they are."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from passgraph import arguments
from passgraph.backends.base import READ, DevicePicture, Use
from passgraph.backends.opencl import transfers
from passgraph.backends.opencl.backend import OpenCLBackend
from passgraph.backends.opencl.pictures import (
    BufferPicture,
    OpenCLPicture,
    array_picture,
    buffer_picture,
    image_picture,
)
from passgraph.backends.opencl.storage import Storage
from passgraph.backends.opencl.transfers import move
from passgraph.errors import BackendError, InputError
from passgraph.formats import Format, format_named
from passgraph.hosts.opencl_borrowed import WRITTEN, Borrowed, as_held, check_room, check_source

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
        device: Any
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
        self.borrowed = Borrowed(self)
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
        return buffer_picture(
            self.context, buffer, _checked_size(size), format_named(format), offset=offset, row_pitch=row_pitch,
            pixel_pitch=pixel_pitch, order=order, origin=origin,
        )  # fmt: skip

    def picture(self, source: Any, format: str | Format | None = None) -> OpenCLPicture:
        """A picture of a ``pyopencl.array.Array`` or a two-dimensional ``pyopencl.Image``.

        Runs take these as they are too.  With a format, such as ``"rgba8_srgb"``, their numbers mean what that says.
        """
        with self.turn:
            described = self._described(source, None if format is None else format_named(format))
        if described is None:
            raise InputError(f"a picture is made of a pyopencl array or image, got {arguments.shown(source)}")
        return described

    def wait_for(self, events: Iterable[Any]) -> None:
        """Let the next run begin when these events of other queues have happened."""
        self.check_open()
        checked_events = list(arguments.iterable(events, "wait_for: events", "a list of pyopencl.Event", InputError))
        for event in checked_events:
            arguments.instance(event, self.cl.Event, "wait_for: each event", "a pyopencl.Event", InputError)
        with self.turn, self.reported("waiting for the caller's events"):
            self.borrowed.wait_for(checked_events)

    def event(self) -> Any:
        """A ``pyopencl.Event`` that happens when all runs so far are done: for other queues, or to wait for."""
        self.check_open()
        with self.turn, self.reported("marking the end of the runs so far"):
            event = self.cl.enqueue_marker(self.queue)
            self.queue.flush()
            return event

    # The contract

    def picture_of(self, candidate: object) -> DevicePicture | None:
        return self._described(candidate, None)

    def _described(self, candidate: Any, format_: Format | None) -> OpenCLPicture | None:
        if isinstance(candidate, OpenCLPicture):
            self.check_open()
            if candidate.context != self.context:
                raise InputError(f"{candidate} is of another OpenCL context; make it with this program's host")
            return candidate
        if isinstance(candidate, np.ndarray) or not type(candidate).__module__.startswith("pyopencl"):
            return None
        self.check_open()
        if isinstance(candidate, self.cl.Image):
            return image_picture(self.context, candidate, format_)
        if hasattr(candidate, "base_data"):
            return (
                array_picture(self.context, candidate, format_)
                if format_ is not None
                else self.borrowed.array(candidate)
            )
        raise InputError(
            f"{arguments.shown(candidate)} does not say its size and format; give host.buffer(buffer, (width, height), "
            "'rgba8')"
        )

    def adopt(self, external: Any, format: Format, use: Use = READ) -> Storage | None:
        if not isinstance(external, OpenCLPicture):
            return super().adopt(external, format, use)
        if not self._depth:
            return None
        return self.borrowed.adopted(external, format, use)

    def running(self) -> AbstractContextManager[None]:
        """Behind what the caller has enqueued, and before what they enqueue next."""
        return _Run(self)

    @property
    def _is_apart(self) -> bool:
        """Return True if passes run in a queue of our own, beside the caller's."""
        return self.given is not None and self.given is not self.queue

    def begin(self) -> None:
        """A run begins."""
        self.check_open()
        if self._depth == 0 and self._is_apart:
            with self.reported("waiting for the caller's queue"):
                before = self.cl.enqueue_marker(self.given)
                self.given.flush()
                self.cl.enqueue_barrier(self.queue, wait_for=[before])
        self._depth += 1

    def end(self) -> None:
        """End the run, after its last pass or after an error."""
        self._depth -= 1
        if self._depth == 0 and (self.borrowed.is_used or self._is_apart):
            with self.reported("giving pictures back"):
                self._give_back()

    def _give_back(self) -> None:
        self.borrowed.copy_images()
        after = None
        if self._is_apart:
            after = self.cl.enqueue_marker(self.queue)
            self.queue.flush()
            self.cl.enqueue_barrier(self.given, wait_for=[after])
            self.given.flush()
        self.borrowed.tell_arrays(after)

    def _close(self) -> None:
        super()._close()
        self.borrowed.clear()
        self.given = None

    # Moved

    def upload_stored(self, storage: Storage, numbers: NDArray[Any] | Picture, format: Format) -> None:
        if not isinstance(numbers, OpenCLPicture):
            super().upload_stored(storage, numbers, format)
            return
        check_source(numbers, format)
        with self.running(), self.reported("copying a picture of the caller's"):
            source = self.borrowed.storage(numbers, as_held(numbers, format), READ)
            move(self, (source.buffer, source.layout), (storage.buffer, storage.layout))

    def download_into(self, storage: Storage, into: NDArray[Any] | Picture, format: Format) -> None:
        if not isinstance(into, OpenCLPicture):
            with self._plain(storage) as own:
                super().download_into(own, into, format)
            return
        check_room(into, format)
        with self.running(), self.reported("copying a result to the caller's picture"):
            destination = self.borrowed.storage(into, as_held(into, format), WRITTEN)
            move(self, (storage.buffer, storage.layout), (destination.buffer, destination.layout))

    @contextmanager
    def _plain(self, storage: Storage) -> Iterator[Storage]:
        """A storage without gaps, to be read by the host."""
        if storage.placement is None:
            yield storage
            return
        own = super().make(storage.format, storage.size)
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


def _checked_size(size: object) -> tuple[int, int]:
    if not isinstance(size, (tuple, list)) or len(size) != 2:
        raise InputError(f"host.buffer: size must be (width, height) in pixels, got {arguments.shown(size)}")
    width, height = (arguments.whole_number(side, "host.buffer: each side", 1, MOST_SIDE, InputError) for side in size)
    return width, height


class _Run(transfers.Running):
    """A run on a caller's queue."""

    __slots__ = ()
    backend: Host

    def __enter__(self) -> None:
        self.backend.begin()
        transfers.Running.__enter__(self)

    def __exit__(self, *error: object) -> None:
        try:
            if self.backend.lent:
                transfers.Running.__exit__(self, *error)
            else:
                self.backend.lent = self.outer
        finally:
            self.backend.end()


def _pyopencl() -> Any:
    from passgraph.backends.opencl.backend import INSTALL_MODULE
    from passgraph.errors import DeviceMissingError

    try:
        import pyopencl
    except ImportError as error:
        raise DeviceMissingError(f"a host needs pyopencl ({error}); install it: {INSTALL_MODULE}") from None
    return pyopencl
