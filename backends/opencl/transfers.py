"""Transfer pictures between the caller's memory and buffers: in place on CPUs, else directly, or through mapped memory
if rows are not contiguous.  Kernels convert between numbers and float32."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import FloatBlock
from passgraph.backends.driver import shaped
from passgraph.backends.opencl.opencl_c import element, join, load_expression, package_text
from passgraph.backends.opencl.storage import INT_LIMIT, ImageLayout, Storage
from passgraph.formats import Format, float_format
from passgraph.quantise import convert, numbers_of, transfer_format

if TYPE_CHECKING:
    from passgraph.backends.opencl.backend import OpenCLBackend


_MOVE_SOURCE = """
__kernel void pg_move(__global const {source}* restrict from, __global {destination}* restrict to, int width)
{{
    int y = (int)get_global_id(1), start = (int)get_global_id(0) * {run}, end = start + min({run}, width - start);
    for (int x = start; x < end; ++x)
    {{
        {source_type} f = {source_place};
        {destination_type} t = {destination_place};
        {body}
    }}
}}
"""
#: Numbers of a row that one work-item moves: on CPUs enough for several vectors, elsewhere one.
RUN, RUN_GPU = 1 << 12, 1


def nearest_number(format_: Format, value: str) -> str:
    """Return the expression of the number nearest to a value; as in passgraph.quantise, NaN becomes 0."""
    if not format_.steps:
        return f"pg_store_half({value})" if format_.number == "f2" else value
    # Comparisons and a plain conversion vectorize.
    clamped = f"(0.0f < {value} ? (1.0f < {value} ? 1.0f : {value}) : 0.0f)"
    return f"({element(format_)})(int)rint({clamped} * {format_.steps}.0f)"


def move_source(source: ImageLayout, destination: ImageLayout, run: int) -> str:
    """Return ``pg_move``: ``run`` pixels of a row per work-item.  As on the host, alpha that the source lacks is 1."""
    rows = []
    for channel in range(destination.channels):
        if channel >= source.channels:
            number = nearest_number(destination.format, "1.0f")
        elif source.format.number == destination.format.number:
            number = f"from[f + {source.places[channel]}]"
        else:
            rows.append(
                f"float v{channel} = {load_expression(source.format, 'from', f'f + {source.places[channel]}')};"
            )
            number = nearest_number(destination.format, f"v{channel}")
        rows.append(f"to[t + {destination.places[channel]}] = {number};")
    return _MOVE_SOURCE.format(
        source=element(source.format), destination=element(destination.format), run=run,
        source_type=source.index_type, source_place=source.place("x", "y"),
        destination_type=destination.index_type, destination_place=destination.place("x", "y"),
        body="\n        ".join(rows),
    )  # fmt: skip


def move(backend: OpenCLBackend, source: Storage, destination: Storage, size: tuple[int, int] | None = None) -> None:
    """Copy a picture into another one of the same size, or as much of it as ``size`` says."""
    layouts = source.layout, destination.layout
    width, height = size or source.size
    run = RUN if backend.is_cpu else RUN_GPU
    kernel = backend.moves.get(layouts)
    if kernel is None:
        text = join(package_text("helpers.cl"), move_source(*layouts, run))
        kernel = backend.cl.Kernel(backend.programs.build(text, "a copy of a picture"), "pg_move")
        backend.moves[layouts] = kernel
    kernel.set_args(source.buffer, destination.buffer, np.int32(width))
    group = (1, 1) if backend.is_cpu else None
    backend.cl.enqueue_nd_range_kernel(backend.queue, kernel, (-(-width // run), height), group)


#: The host converts up to this many numbers faster than a kernel starts.
SMALL = 1 << 14


# In place


def adopted(backend: OpenCLBackend, array: Any, format_: Format) -> Storage | None:
    """Return memory of the caller as a storage until the run ends; None outside of a run, or if it does not fit."""
    if not backend.is_cpu or backend.borrowed_arrays is None or not isinstance(array, np.ndarray):
        return None
    plain = array.dtype == np.dtype(format_.number) and array.flags.c_contiguous and array.flags.aligned
    if not plain or format_.stencil or array.nbytes > backend.max_bytes:
        return None
    place, size = (array.ctypes.data, array.nbytes), (array.shape[1], array.shape[0])
    earlier = backend.borrowed_arrays.get(place)
    if earlier is not None and (earlier.format, earlier.size) == (format_, size):
        return earlier
    # OpenCL guarantees nothing about two buffers over one memory.
    if any(start < sum(place) and place[0] < start + length for start, length in backend.borrowed_arrays):
        return None
    buffer = _buffer_over(backend, array)
    if buffer is None:
        return None
    storage = Storage(ImageLayout.tight(format_, size), buffer, borrowed=array)
    backend.borrowed_arrays[place] = storage
    return storage


def _buffer_over(backend: OpenCLBackend, array: NDArray[Any]) -> Any | None:
    """Return a buffer over an array's own memory; None if the driver fails."""
    cl = backend.cl
    access = cl.mem_flags.READ_WRITE if array.flags.writeable else cl.mem_flags.READ_ONLY
    try:
        buffer = cl.Buffer(backend.context, access | cl.mem_flags.USE_HOST_PTR, hostbuf=array)
    except cl.Error:
        return None
    backend.alive[buffer.int_ptr] = buffer
    return buffer


def _give_back(backend: OpenCLBackend, buffer: Any, array: NDArray[Any]) -> None:
    """Make results in a mapped buffer visible in the array, and release the array."""
    cl, queue = backend.cl, backend.queue
    if array.flags.writeable:
        mapped, _ = cl.enqueue_map_buffer(queue, buffer, cl.map_flags.READ, 0, array.shape, array.dtype)
        mapped.base.release(queue)
    queue.finish()
    backend.free(buffer)


class Running:
    """A context manager that releases adopted arrays at its end. A class, since every run enters it."""

    __slots__ = ("backend", "outer")

    def __init__(self, backend: OpenCLBackend) -> None:
        self.backend = backend

    def __enter__(self) -> None:
        self.outer, self.backend.borrowed_arrays = self.backend.borrowed_arrays, {}

    def __exit__(self, *_: object) -> None:
        backend = self.backend
        adopted_storages, backend.borrowed_arrays = backend.borrowed_arrays, self.outer
        for storage in (adopted_storages or {}).values():
            storage.released = True
            with backend.reported("giving a picture back"):
                assert storage.borrowed is not None
                _give_back(backend, storage.buffer, storage.borrowed)


# Copied


def send_values(backend: OpenCLBackend, storage: Storage, picture: FloatBlock) -> None:
    """Upload values to a storage, rounded to its format."""
    values, format_ = shaped(np.asarray(picture, np.float32), storage), storage.format
    if format_.number == "f4":
        send(backend, storage, values)
    elif not _is_converted_here(backend, values):
        send(backend, storage, numbers_of(values, format_))
    else:
        values = np.ascontiguousarray(values)
        with _buffer_of(backend, values) as buffer:
            _convert(backend, (buffer, float_format(1)), (storage.buffer, format_), values.size)


def send(backend: OpenCLBackend, storage: Storage, numbers: NDArray[Any]) -> None:
    """Upload numbers in a storage's format."""
    array = shaped(numbers, storage)
    if array.flags.c_contiguous and array.dtype == np.dtype(storage.format.number):
        backend.cl.enqueue_copy(backend.queue, storage.buffer, array, is_blocking=True)
        return
    with _mapped(backend, storage.buffer, array.shape, storage.format.number, writing=True) as mapped:
        np.copyto(mapped, array)


def receive(backend: OpenCLBackend, storage: Storage, into: NDArray[Any]) -> None:
    """Download a storage into an array: as values for float32, else unconverted."""
    format_, destination = storage.format, shaped(into, storage)
    wanted = transfer_format(into, format_)
    if storage.borrowed is not None and storage.released:
        # The run is over: its results are already in the caller's array.
        convert(storage.borrowed, format_, destination, wanted)
    elif wanted.number == format_.number:
        _fetch(backend, storage.buffer, destination, format_.number)
    elif _is_converted_here(backend, destination) and _exact(backend, format_):
        with _buffer_of(backend, destination, is_result=True) as buffer:
            _convert(backend, (storage.buffer, format_), (buffer, float_format(1)), destination.size)
    else:
        numbers = np.empty(destination.shape, format_.number)
        _fetch(backend, storage.buffer, numbers, format_.number)
        convert(numbers, format_, destination, wanted)


def _fetch(backend: OpenCLBackend, buffer: Any, destination: NDArray[Any], number: str) -> None:
    if destination.flags.c_contiguous and destination.dtype == np.dtype(number):
        backend.read(buffer, destination)
        return
    with _mapped(backend, buffer, destination.shape, number) as mapped:
        np.copyto(destination, mapped)


@contextmanager
def _mapped(
    backend: OpenCLBackend, buffer: Any, shape: tuple[int, ...], number: str, *, writing: bool = False
) -> Iterator[NDArray[Any]]:
    """Map a buffer's memory for the host, to read it or to overwrite it."""
    cl, queue = backend.cl, backend.queue
    flags = cl.map_flags.WRITE_INVALIDATE_REGION if writing else cl.map_flags.READ
    mapped, _ = cl.enqueue_map_buffer(queue, buffer, flags, 0, shape, np.dtype(number))
    try:
        yield mapped
    finally:
        mapped.base.release(queue)


@contextmanager
def _buffer_of(backend: OpenCLBackend, values: NDArray[Any], *, is_result: bool = False) -> Iterator[Any]:
    """Yield a buffer with an array's values, or for results that are written into it: its own memory on CPUs."""
    fits = backend.is_cpu and values.flags.c_contiguous and values.flags.aligned
    own = _buffer_over(backend, values) if fits else None
    if own is not None:
        try:
            yield own
        finally:
            _give_back(backend, own, values)
        return
    buffer = backend.scratch_buffer("converted values", values.nbytes)
    if not is_result:
        backend.cl.enqueue_copy(backend.queue, buffer, values, is_blocking=True)
    yield buffer
    if is_result:
        _fetch(backend, buffer, values, "f4")


# Converted


def _exact(backend: OpenCLBackend, format_: Format) -> bool:
    """Return True if kernels convert numbers exactly as the host: quotients rounded once, and halves below 2**-14 not
    flushed as denormals."""
    if format_.steps:
        return backend.programs.rounds_quotients
    return bool(backend.device.single_fp_config & backend.cl.device_fp_config.DENORM)


def _is_converted_here(backend: OpenCLBackend, values: NDArray[Any]) -> bool:
    """Return True if values are converted on the device: not few, nor more than it takes at once."""
    return SMALL < values.size < INT_LIMIT and values.nbytes <= backend.max_bytes


def _convert(backend: OpenCLBackend, source: tuple[Any, Format], destination: tuple[Any, Format], count: int) -> None:
    """Convert numbers of a buffer into those of another format: one kernel for all sizes."""
    one, other = (
        Storage(ImageLayout.tight(replace(format_, channels=1), (1, 1)), buffer)
        for buffer, format_ in (source, destination)
    )
    move(backend, one, other, (count, 1))
