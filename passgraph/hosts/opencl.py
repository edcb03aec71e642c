"""OpenCL in a caller's context and queue: the caller's buffers and images are read and written in place."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from passgraph import arguments
from passgraph.backends.base import READ, DevicePicture, Use
from passgraph.backends.opencl import transfers
from passgraph.backends.opencl.backend import INSTALL_MODULE, OpenCLBackend
from passgraph.backends.opencl.caller_memory import (
    BufferPicture,
    OpenCLPicture,
    array_picture,
    buffer_picture,
    image_picture,
)
from passgraph.backends.opencl.storage import Storage
from passgraph.backends.opencl.transfers import move
from passgraph.errors import BackendError, DeviceMissingError, InputError
from passgraph.formats import Format, format_named
from passgraph.hosts.opencl_borrowed import WRITTEN, Borrowed, as_held, check_room, check_source

if TYPE_CHECKING:
    from passgraph.backends.opencl.caller_memory import OpenCLPicture as Picture


#: Longest side of a picture in the kernel language.
MOST_SIDE = 1 << 23


class Host(OpenCLBackend):
    """A backend on a caller's command queue, in its context, on its device.

    A run is asynchronous: it is enqueued behind the caller's commands, and before those that follow. It waits for the
    device only to transfer NumPy arrays, or to draw triangles. For an out-of-order queue, passes run in an in-order
    queue of ours, and markers on both queues give the same order.

    :meth:`close` releases our objects in the context; buffers, images, queue and context belong to the caller.

    Parameters
    ----------
    queue
        A ``pyopencl.CommandQueue``; or a ``pyopencl.Context``, on whose first device a queue of ours is created. Then
        :meth:`wait_for` and :meth:`event` order runs relative to the caller's commands.

    Raises
    ------
    BackendError
        For other objects, and for a device without a compiler.

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
        """Describe a picture in a ``pyopencl.Buffer``, for an input or for ``into=``.

        It keeps the buffer alive, and may be used for any number of runs.

        Parameters
        ----------
        size
            (width, height) in pixels.
        format
            The pixel format, such as ``"rgba8"`` or ``"rgb8_srgb"``.
        offset
            Offset of the first pixel in bytes.
        row_pitch, pixel_pitch
            Stride of rows, and of pixels, in bytes; by default they are contiguous.
        order
            Order of the channels in memory, such as ``"bgra"``; for formats of three channels, ``"rgba"`` or ``"bgra"``
            skips the fourth.
        origin
            The row that is first in memory: the picture's top or bottom row.

        Raises
        ------
        InputError
            For a buffer of another context, a picture beyond its end, and offsets that are not aligned to channels.
        """
        self.check_open()
        checked = arguments.size_in_pixels(size, "host.buffer: size", MOST_SIDE)
        return buffer_picture(
            self.context, buffer, checked, format_named(format), offset=offset, row_pitch=row_pitch,
            pixel_pitch=pixel_pitch, order=order, origin=origin,
        )  # fmt: skip

    def picture(self, source: Any, format: str | Format | None = None) -> OpenCLPicture:
        """Describe a picture in a ``pyopencl.array.Array`` or a two-dimensional ``pyopencl.Image``.

        Runs accept these objects directly too; this gives their numbers another format, such as ``"rgba8_srgb"``.
        """
        with self.turn:
            described = self._described(source, None if format is None else format_named(format))
        if described is None:
            raise InputError(f"a picture is made of a pyopencl array or image, got {arguments.shown(source)}")
        return described

    def wait_for(self, events: Iterable[Any]) -> None:
        """Let the next run wait for events of other queues."""
        self.check_open()
        checked_events = list(arguments.iterable(events, "wait_for: events", "a list of pyopencl.Event", InputError))
        for event in checked_events:
            arguments.instance(event, self.cl.Event, "wait_for: each event", "a pyopencl.Event", InputError)
        with self.turn, self.reported("waiting for the caller's events"):
            self.borrowed.wait_for(checked_events)

    def event(self) -> Any:
        """Return a ``pyopencl.Event`` that completes when all runs so far are done."""
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
        """Order a run after the caller's earlier commands and before later ones."""
        return _Run(self)

    @property
    def _is_apart(self) -> bool:
        """True if passes run in a queue of ours, not in the caller's."""
        return self.given is not None and self.given is not self.queue

    def begin(self) -> None:
        """Begin a run."""
        self.check_open()
        if self._depth == 0 and self._is_apart:
            with self.reported("waiting for the caller's queue"):
                before = self.cl.enqueue_marker(self.given)
                self.given.flush()
                self.cl.enqueue_barrier(self.queue, wait_for=[before])
        self._depth += 1

    def end(self) -> None:
        """End a run, also after an error."""
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

    # Transfers

    def upload_stored(self, storage: Storage, numbers: NDArray[Any] | Picture, format: Format) -> None:
        if not isinstance(numbers, OpenCLPicture):
            super().upload_stored(storage, numbers, format)
            return
        check_source(numbers, format)
        with self.running(), self.reported("copying a picture of the caller's"):
            source = self.borrowed.storage(numbers, as_held(numbers, format), READ)
            move(self, source, storage)

    def download_into(self, storage: Storage, into: NDArray[Any] | Picture, format: Format) -> None:
        if not isinstance(into, OpenCLPicture):
            with self._plain(storage) as own:
                super().download_into(own, into, format)
            return
        check_room(into, format)
        with self.running(), self.reported("copying a result to the caller's picture"):
            destination = self.borrowed.storage(into, as_held(into, format), WRITTEN)
            move(self, storage, destination)

    @contextmanager
    def _plain(self, storage: Storage) -> Iterator[Storage]:
        """Yield a contiguous copy of a storage for reading by the host, or the storage if it is contiguous."""
        if storage.layout.is_tight:
            yield storage
            return
        own = super().make(storage.format, storage.size)
        try:
            move(self, storage, own)
            yield own
        finally:
            self.release(own)

    def copy(self, source: Storage, destination: Storage) -> None:
        if source.layout.is_tight and destination.layout.is_tight:
            super().copy(source, destination)
            return
        with self.reported("copying a picture"):
            move(self, source, destination)


class _Run(transfers.Running):
    """A run on a caller's queue."""

    __slots__ = ()
    backend: Host

    def __enter__(self) -> None:
        self.backend.begin()
        transfers.Running.__enter__(self)

    def __exit__(self, *error: object) -> None:
        try:
            if self.backend.borrowed_arrays:
                transfers.Running.__exit__(self, *error)
            else:
                self.backend.borrowed_arrays = self.outer
        finally:
            self.backend.end()


def _pyopencl() -> Any:
    try:
        import pyopencl
    except ImportError as error:
        raise DeviceMissingError(f"a host needs pyopencl ({error}); install it: {INSTALL_MODULE}") from None
    return pyopencl
