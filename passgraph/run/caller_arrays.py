"""The caller's arrays: inputs read in place, and arrays that results are written into."""

from __future__ import annotations

import weakref
from collections import defaultdict, deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from math import prod
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from passgraph import arguments
from passgraph.backends.base import OVERWRITTEN, READ, DevicePicture, Use
from passgraph.cached import cached_property
from passgraph.errors import InputError
from passgraph.formats import Format, as_many_channels, colour_format, curved, float_format
from passgraph.graph.targets import InputSpec, Pass, Target
from passgraph.plan.data import DrawStep, Plan
from passgraph.quantise import opaque
from passgraph.records import dataclass
from passgraph.run.finite_checks import NonFinite, admitted, readers_of
from passgraph.run.result import Results

if TYPE_CHECKING:
    from passgraph.backends.base import Backend


#: Results of at least this many bytes are pooled; the allocator itself keeps smaller blocks.
MIN_POOLED_BYTES = 1 << 17
#: Bytes of a cache line: storing vectors that straddle two takes twice the time.
LINE = 64


class BufferPool:
    """A pool of result buffers, reused once they have been garbage-collected.

    The caller owns a result, so its buffer is reused only when no array refers to it any more.  Without the pool, each
    run would allocate new memory, which the system fills with zeros.
    """

    def __init__(self, most: int = 2) -> None:
        #: By size in bytes.  Results may be dropped in any thread: adding and taking are atomic.
        self._free: defaultdict[int, deque[NDArray[np.uint8]]] = defaultdict(lambda: deque(maxlen=most))

    def array(self, shape: tuple[int, ...], dtype: np.dtype[Any]) -> NDArray[Any]:
        """Return an uninitialized array."""
        needed = prod(shape) * dtype.itemsize
        if needed < MIN_POOLED_BYTES:
            return np.empty(shape, dtype)
        free = self._free[needed]
        try:
            memory = free.pop()
        except IndexError:
            padded = np.empty(needed + LINE, np.uint8)
            first = -padded.ctypes.data % LINE
            memory = padded[first : first + needed]
        owner = _PooledBuffer(memory)
        weakref.finalize(owner, free.append, memory).atexit = False
        return np.asarray(owner).view(dtype).reshape(shape)


class _PooledBuffer:
    """The owner of a pooled buffer, kept alive by the arrays that use it."""

    def __init__(self, memory: NDArray[np.uint8]) -> None:
        self.__array_interface__ = memory.__array_interface__


def room_of(plan: Plan, results: Results, names: Iterable[str] | None = None) -> dict[str, NDArray[Any]]:
    """Return new arrays by output name, with the shapes and dtypes of a plan's results, to pass as ``into=``.

    ``results`` is the program's setting; ``names`` selects outputs (default: all).

    >>> import passgraph as pg
    >>> dim = pg.kernel(source="def dim(color: Image) -> vec4: return color[0, 0] * 0.5")
    >>> dimmed = dim(pg.Input("frame", "rgba8", (4, 2)), into=pg.target("dimmed", "rgba8"))
    >>> with pg.compile(dimmed, results="stored") as program:
    ...     room = room_of(program.plan, "stored")
    ...     made = program(frame=np.full((2, 4, 4), 100, np.uint8), into=room)
    >>> made["dimmed"] is room["dimmed"], room["dimmed"][0, 0].tolist()
    (True, [50, 50, 50, 50])
    """
    made = {}
    for name in plan.outputs if names is None else names:
        one = plan.resources[plan.outputs[name]]
        dtype = one.format.number if results == "stored" else np.float32
        made[name] = np.empty((*one.size[::-1], one.format.channels), dtype)
    return made


#: A picture given to a run, or returned for a result that was written into it.
Picture: TypeAlias = "NDArray[Any] | DevicePicture"
#: A picture (h, w) without a channel axis is gray; for an input of undeclared format it fills this many channels.
GREY_CHANNELS = 3
#: Most steps in a search for shared memory: enough for pictures side by side in one array.
OVERLAP_WORK: Any = 10_000  # NumPy 2.4 declares 0 and -1 only
_FLOAT32 = np.dtype(np.float32)


def format_of(dtype: np.dtype[Any], channels: int, srgb: bool = False) -> Format:
    """Return the format for pictures of a dtype and channel count; float32 if no format stores that dtype.

    ``srgb``: the sRGB-encoded format, if there is one.

    >>> format_of(np.dtype(np.uint8), 4).name
    'rgba8'
    """
    own = (colour_format(dtype.str[1:], channels) if dtype.isnative else None) or float_format(channels)
    return (curved(own, True) if srgb else None) or own


def admitted_device_picture(picture: DevicePicture, spec: InputSpec) -> DevicePicture:
    """Return a picture on the device if it fits the input's declaration; its pixels are not checked.

    Raises
    ------
    InputError
        For another size, or fewer or more channels than the declared format has.
    """
    if spec.size is not None and picture.size != spec.size:
        (width, height), (across, down) = spec.size, picture.size
        raise InputError(f"input {spec.name!r} is declared {width}x{height} pixels, got {across}x{down}: {picture}")
    if spec.format is not None and not as_many_channels(spec.format, picture.format):
        raise InputError(
            f"input {spec.name!r} is {spec.format.name} with {spec.format.channels} channel(s), got "
            f"{picture.format.channels}: {picture}"
        )
    return picture


def admitted_picture(
    picture_: Any, spec: InputSpec, non_finite: NonFinite = "keep", readers: Iterable[Pass] = ()
) -> NDArray[Any]:
    """Return an input as (height, width, channels): unchanged if a format stores its dtype, else as float32.
    Values that may be NaN or infinite are checked, see :func:`passgraph.run.finite_checks.admitted`.

    In a float32 input, uint8, uint16 and bool are scaled to 0 to 1; floats of 64 and more bits are rounded.  Byte order
    and strides may be any.  A picture (height, width) is gray: red, green and blue are its value.  For an input
    declared with one channel it is that channel.  (height, width, 1) is always one channel.

    Raises
    ------
    InputError
        If it is not a picture of numbers, does not fit the declared size or channels, or is not finite.
    """
    array = _picture(picture_, spec)
    format_ = spec.format or format_of(array.dtype, array.shape[2])
    picture = array if array.dtype == np.dtype(format_.number) else _as_values(array)
    if array.dtype.kind != "f":
        return picture
    return admitted(picture, spec.name, spec.format, non_finite, readers)


def bound_to(picture: Picture, spec: InputSpec) -> tuple[Format, tuple[int, int]]:
    """Return the format and size (width, height) of an input for a given picture."""
    if isinstance(picture, DevicePicture):
        return spec.format or picture.format, picture.size
    height, width, channels = picture.shape
    return spec.format or format_of(picture.dtype, channels, spec.srgb), (width, height)


class Admission:
    """The input pictures of a program's runs; a static picture that is given again is not checked again."""

    def __init__(self, specs: Mapping[str, InputSpec], outputs: Iterable[Target], non_finite: NonFinite) -> None:
        self._specs, self._outputs, self._non_finite = specs, tuple(outputs), non_finite
        #: The last picture given for each static input, and the checked result.
        self._static: dict[str, tuple[Any, Any]] = {}

    def known(self) -> dict[str, tuple[Format, tuple[int, int]]]:
        """Return the known formats and sizes before a run: as declared, or those of the inputs' defaults."""
        formats_and_sizes: dict[str, tuple[Format, tuple[int, int]]] = {}
        for name, spec in self._specs.items():
            if spec.format is not None and spec.size is not None:
                formats_and_sizes[name] = spec.format, spec.size
            elif spec.default is not None:
                formats_and_sizes[name] = bound_to(_picture(spec.default, spec), spec)
        return formats_and_sizes

    def pictures(
        self, inputs: Mapping[str, Any], on_device: Callable[[object], DevicePicture | None]
    ) -> dict[str, Any]:
        """Return the checked pictures of one run; InputError for one that is missing or does not fit."""
        pictures: dict[str, Any] = {}
        for name, spec in self._specs.items():
            picture = inputs.get(name, spec.default)
            if picture is None:
                raise InputError(f"input {name!r} is missing; run the program as program({name}=picture)")
            seen, checked = self._static.get(name, (None, None))
            there = on_device(picture)
            if there is not None:
                pictures[name] = admitted_device_picture(there, spec)
                continue
            if not spec.static or seen is not picture:
                checked = admitted_picture(picture, spec, self._non_finite, readers_of(name, self._outputs))
            if spec.static:
                # The same object counts as unchanged: steps that depend on it do not run again.
                self._static[name] = picture, checked
            pictures[name] = checked
        return pictures


def _picture(value: Any, spec: InputSpec) -> NDArray[Any]:
    what, expected = f"input {spec.name!r}", "be an array (height, width, channels) of numbers"
    if (isinstance(value, int) and not isinstance(value, bool)) or hasattr(value, "glo"):
        raise InputError(
            f"{what} must {expected}, got {arguments.shown(value)}. For a texture of OpenGL give host.texture(...) of "
            "the pg.gl.Host that the program runs on"
        )
    array = arguments.numbers(value, what, expected)
    if array.ndim not in (2, 3):
        raise InputError(f"{what} must {expected}, got {arguments.shown(value)}")
    if array.ndim == 2:
        array = _grey(array, GREY_CHANNELS if spec.format is None else spec.format.channels)
    height, width, channels = array.shape
    if not (height and width and 1 <= channels <= 4):
        raise InputError(f"{what} must have 1 to 4 channels and at least one pixel, got shape {array.shape}")
    if spec.format is not None and channels != spec.format.channels:
        raise InputError(f"{what} is {spec.format.name} with {spec.format.channels} channel(s), got {channels}")
    if spec.size is not None and (width, height) != spec.size:
        raise InputError(f"{what} is declared {spec.size[0]}x{spec.size[1]} pixels, got {width}x{height}")
    if array.dtype.kind in "ui" and (array.dtype.kind == "i" or array.dtype.itemsize > 2):
        raise InputError(f"{what} has dtype {array.dtype}; give float32 (0 to 1 for colours), uint8 or uint16")
    return array


def _grey(array: NDArray[Any], channels: int) -> NDArray[Any]:
    """Expand a picture (h, w) to the given number of channels: its value in each color, and alpha 1."""
    if channels < GREY_CHANNELS:
        return array[:, :, None]
    color = np.empty((*array.shape, channels), array.dtype)
    color[..., :GREY_CHANNELS] = array[..., None]
    if channels > GREY_CHANNELS:
        color[..., GREY_CHANNELS] = opaque(array.dtype)
    return color


def _as_values(array: NDArray[Any]) -> NDArray[np.float32]:
    if array.dtype.kind == "u":  # of any byte order
        return np.ascontiguousarray(array / np.float32(np.iinfo(array.dtype).max), np.float32)
    with np.errstate(over="ignore"):  # float64 beyond float32 becomes infinite, which non_finite then handles
        return np.ascontiguousarray(array, np.float32)


def given_room(
    into: object, plan: Plan, pictures: Mapping[str, Picture], on_device: Callable[[object], DevicePicture | None]
) -> dict[int, Picture]:
    """Return the arrays and device pictures that results are written into, by resource.

    Raises
    ------
    InputError
        For an array that does not fit its target, is read-only, or shares memory with another picture.
    """
    if type(into) is not dict and not isinstance(into, Mapping):  # the isinstance check runs Python code
        raise InputError(f"into= takes arrays by output name, {{'name': array}}, got {arguments.shown(into)}")
    result_arrays: dict[int, Picture] = {}
    arrays = {}
    for name, array in into.items():
        if not arguments.among(name, plan.outputs):
            raise InputError(f"into= names {arguments.shown(name)}; the outputs are {', '.join(plan.outputs)}")
        resource = plan.resources[plan.outputs[name]]
        picture = on_device(array)
        if picture is not None:
            _check_device_room(name, picture, resource.size)
            result_arrays[plan.outputs[name]] = picture
        else:
            arrays[name] = array
            result_arrays[plan.outputs[name]] = _room(array, resource.format, resource.size, f"into={{{name!r}: …}}")
    if arrays:
        input_arrays = {name: picture for name, picture in pictures.items() if not isinstance(picture, DevicePicture)}
        for (one, array), (other, another) in _pairs(arrays, input_arrays):
            if _overlap(array, another):
                raise InputError(f"the array given for output {one!r} shares memory with {other}; give each its own")
    if len(arrays) < len(result_arrays):
        for one_picture, other_picture in combinations(
            [p for p in result_arrays.values() if isinstance(p, DevicePicture)], 2
        ):
            if one_picture.overlaps(other_picture):
                raise InputError(f"into= gives {one_picture} for two outputs; give each its own")
    return result_arrays


def _check_device_room(name: str, picture: DevicePicture, size: tuple[int, int]) -> None:
    if picture.size != size:
        raise InputError(
            f"into={{{name!r}: …}} takes a picture of {size[0]}x{size[1]} pixels, got {picture.size[0]}x"
            f"{picture.size[1]}: {picture}"
        )


def _room(array: Any, format_: Format, size: tuple[int, int], what: str) -> NDArray[Any]:
    if not isinstance(array, np.ndarray):
        expected = _expected_room(format_, size)
        destination, array = array, arguments.numbers(array, what, f"be {expected}")
        if array.flags.owndata:  # converted from a list: writing to the array would not change the list
            raise InputError(
                f"{what} takes {expected}, got {arguments.shown(destination)}, which cannot be written into"
            )
    shaped = array[:, :, None] if array.ndim == 2 else array
    fits = array.dtype == _FLOAT32 or array.dtype == np.dtype(format_.number)
    if shaped.shape != (size[1], size[0], format_.channels) or not fits:
        raise InputError(f"{what} takes {_expected_room(format_, size)}, got {array.shape} of {array.dtype}")
    if not array.flags.writeable:
        raise InputError(f"{what} is read-only; give an array that may be written, such as a copy of it")
    if not array.flags.c_contiguous and _overlaps_itself(shaped):
        raise InputError(f"{what} has pixels that share memory (strides {array.strides}); give a contiguous array")
    view: NDArray[Any] = shaped
    return view


def _expected_room(format_: Format, size: tuple[int, int]) -> str:
    number, (width, height) = np.dtype(format_.number), size
    types = "float32" if number == _FLOAT32 else f"{number} or float32"
    return f"an array ({height}, {width}, {format_.channels}) of {types}, as target format {format_.name} requires"


def _overlaps_itself(array: NDArray[Any]) -> bool:
    """Return True if two elements share memory, as in a result of np.broadcast_to."""
    reach = array.itemsize
    for stride, count in sorted((abs(s), n) for s, n in zip(array.strides, array.shape, strict=True) if n > 1):
        if stride < reach:
            return True
        reach = stride * (count - 1) + reach
    return False


_Named = tuple[str, NDArray[Any]]


def _pairs(into: Mapping[str, Any], pictures: Mapping[str, NDArray[Any]]) -> Iterator[tuple[_Named, _Named]]:
    for (one, array), (other, another) in combinations(into.items(), 2):
        yield (one, array), (f"that of output {other!r}", another)
    for one, array in into.items():
        for name, picture in pictures.items():
            yield (one, array), (f"input {name!r}", picture)


def _overlap(one: NDArray[Any], other: NDArray[Any]) -> bool:
    try:
        return np.shares_memory(one, other, max_work=OVERLAP_WORK)
    except np.exceptions.TooHardError:
        return True  # the search gave up; their memory ranges overlap


#: Smaller results are copied; binding them costs more than the copy.
MIN_ZERO_COPY_BYTES = 1 << 13


class CallerArrays:
    """Bind the caller's arrays to plan allocations, from run to run (zero-copy).

    Attributes
    ----------
    storages : storages that the backend made from the caller's arrays, by allocation
    result_arrays : arrays of the caller for results of the last run, by resource
    new_results : new arrays for other results, laid out as the caller gets them
    """

    def __init__(self, plan: Plan, backend: Backend) -> None:
        self.plan, self.backend = plan, backend
        self.storages: dict[int, Any] = {}
        self.result_arrays: dict[int, Picture] = {}
        self.new_results: dict[int, NDArray[Any]] = {}
        self._handed_out: set[int] = set()
        self._names = {resource: name for name, resource in plan.outputs.items()}
        self.buffer_pool = BufferPool()
        #: How each array of the last run was transferred: a description, and the array's layout.
        self._transfers: dict[str, tuple[str, tuple[object, ...]]] = {}

    @property
    def transfers(self) -> dict[str, str]:
        """Describe how each array of the last run was transferred."""
        return {what: f"{how} {_layout_text(layout)}" for what, (how, layout) in self._transfers.items()}

    def begin(self, result_arrays: Mapping[int, Picture], results: Results | None = None) -> None:
        """Begin a run: release the arrays of the last one.

        ``results``: how results outside ``result_arrays`` are returned; None if the run returns none.
        """
        self.storages.clear()
        self._transfers.clear()
        self.new_results.clear()
        self._handed_out.clear()
        self.result_arrays = dict(result_arrays)
        for resource in self._large_results if results else ():
            number = self.plan.resources[resource].format.number
            if resource not in result_arrays and (results == "stored" or number == "f4"):
                self.new_results[resource] = self.array(resource, np.dtype(number))

    def array(self, resource: int, dtype: np.dtype[Any]) -> NDArray[Any]:
        """Return a new array for a result; the caller will own it."""
        info = self.plan.resources[resource]
        return self.buffer_pool.array((*info.size[::-1], info.format.channels), dtype)

    def result(self, resource: int) -> Picture | None:
        """Return a result that is already in its destination; None if it must be downloaded."""
        array = self.new_results.get(resource)
        if array is None:
            return self.result_arrays.get(resource)
        if resource in self._handed_out:
            return array.copy()
        self._handed_out.add(resource)
        return array

    def takes(self, name: str, resource: int, place: int, picture: Picture) -> bool:
        """Return True if the picture of an input is used in place, or as a copy on the device."""
        format_ = self.plan.resources[resource].format
        is_overwritten = isinstance(picture, DevicePicture) and self._is_overwritten(resource, picture)
        use = OVERWRITTEN if is_overwritten else READ
        storage = self.backend.adopt(picture, format_, use) if resource in self._read_only else None
        how = "read in place"
        if storage is None:
            how = f"moved to {format_.name}"
        elif isinstance(picture, DevicePicture) and not picture.is_in(storage):
            how = f"copied on the device{', since a result is written there,' if use.is_overwritten else ''}"
        self._transfers[f"input {name!r}"] = f"{how} from", _layout(picture)
        if storage is not None:
            self.storages[place] = storage
        return storage is not None

    def _is_overwritten(self, resource: int, picture: DevicePicture) -> bool:
        """Return True if a step reads an input's memory at or after a step that overwrites it with a result."""
        over = [
            self._uses[self.plan.resources[result].memory].first_written
            for result, destination in self.result_arrays.items()
            if isinstance(destination, DevicePicture) and destination.overlaps(picture)
        ]
        return any(resource in step.reads for first in over for step in self.plan.steps[first:])

    def bind_results(self, places: Sequence[int]) -> None:
        """Let the backend write results straight into the caller's arrays where it can."""
        for resource in (self.result_arrays.keys() & self._plain_results) | self.new_results.keys():
            target = self.plan.resources[resource]
            array = self.result_arrays[resource] if resource in self.result_arrays else self.new_results[resource]
            storage = self.backend.adopt(array, target.format, self._uses[target.memory].use)
            if storage is not None:
                self.storages[places[resource]] = storage
            else:
                self.new_results.pop(resource, None)

    def end(self, places: Sequence[int], memories: Sequence[Any]) -> None:
        """Download the other results into their destinations, and release the inputs.

        Results stay bound until the next run, so that they can be read.
        """
        for resource, array in self.result_arrays.items():
            moved = places[resource] not in self.storages
            if moved:
                self.backend.download_into(memories[places[resource]], array, self.plan.resources[resource].format)
            how = "moved into" if moved else "written in place in"
            self._transfers[f"output {self._names[resource]!r}"] = how, _layout(array)
        for resource in self._read_only:
            self.storages.pop(places[resource], None)

    @cached_property
    def _read_only(self) -> set[int]:
        """Return the inputs that are not needed after a run and that no step draws over."""
        plan = self.plan
        caller_visible = {*plan.outputs.values(), *(r for name, r in plan.inputs.items() if name in plan.static_inputs)}
        written = {plan.resources[r].memory for step in plan.steps for r in step.writes}
        return {r for r in plan.inputs.values() if r not in caller_visible and plan.resources[r].memory not in written}

    @cached_property
    def _uses(self) -> list[_PlaceUse]:
        """Return how steps use each allocation; results may share one with pictures that are no longer needed."""
        plan = self.plan
        uses = [Use(is_read=False, is_written=True) for _ in plan.memories]
        first = [len(plan.steps)] * len(plan.memories)
        for number, step in enumerate(plan.steps):
            for resource in step.reads:
                place = plan.resources[resource].memory
                uses[place] = replace(uses[place], is_read=True)
            for resource in step.writes:
                place = plan.resources[resource].memory
                first[place] = min(first[place], number)
                drawn, has_more_outputs = isinstance(step, DrawStep), len(step.writes) > 1
                uses[place] = replace(
                    uses[place],
                    is_drawn=uses[place].is_drawn or drawn,
                    beside_others=uses[place].beside_others or has_more_outputs,
                )
        return [_PlaceUse(*both) for both in zip(uses, first, strict=True)]

    @cached_property
    def _plain_results(self) -> set[int]:
        """Return the results that every run rewrites and that the next run does not read."""
        plan = self.plan
        static = {r for step in plan.steps if step.static for r in step.writes}
        plain = (plan.resources[r] for r in plan.outputs.values() if r not in static)
        return {info.id for info in plain if info.kind == "target" and info.history is None}

    @cached_property
    def _large_results(self) -> list[int]:
        """Return the plain results that are large enough to be written in place."""
        memories = ((r, self.plan.memories[self.plan.resources[r].memory]) for r in self._plain_results)
        return [resource for resource, memory in memories if memory.bytes >= MIN_ZERO_COPY_BYTES]


@dataclass(frozen=True)
class _PlaceUse:
    """Use of an allocation in one run, and the first step that writes it."""

    use: Use
    first_written: int


def _layout(array: Picture) -> tuple[object, ...]:
    """Return the layout that `_layout_text` describes; keeps no reference to the array."""
    return (str(array),) if isinstance(array, DevicePicture) else (array.dtype, array.shape, array.strides)


def _layout_text(layout: tuple[object, ...]) -> str:
    if len(layout) == 1:
        return str(layout[0])
    dtype, shape, strides = layout
    return f"{dtype} {shape}, strides {strides}"
