"""Arrays of the caller: pictures that a run reads in place, and memory that it writes results into."""

from __future__ import annotations

import weakref
from collections import defaultdict, deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
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
from passgraph.run.finite_checks import NonFinite, admitted, readers_of
from passgraph.run.result import Results

if TYPE_CHECKING:
    from passgraph.backends.base import Backend
    from passgraph.run.program import Program


#: Shape and type of an array.
Kind: TypeAlias = "tuple[tuple[int, int, int], np.dtype[Any]]"
#: Bytes of a result from which on its memory is kept: less than that the allocator keeps itself.
LEAST = 1 << 17
#: Bytes of a cache line: vectors that straddle two are stored in twice the time.
LINE = 64


class Spare:
    """Memory of results, handed out again once nobody has it any more.

    A result belongs to whom it is handed to, so that its memory cannot simply be written again; but once the last array
    that looks at it is gone, it is.  New memory would be asked of the system, and zeroed by it, with each run.
    """

    def __init__(self, most: int = 2) -> None:
        #: By size in bytes.  Whoever drops a result may do so in any thread: adding and taking are one step each.
        self._free: defaultdict[int, deque[NDArray[np.uint8]]] = defaultdict(lambda: deque(maxlen=most))

    def array(self, shape: tuple[int, ...], dtype: np.dtype[Any]) -> NDArray[Any]:
        """An array that holds anything."""
        needed = prod(shape) * dtype.itemsize
        if needed < LEAST:
            return np.empty(shape, dtype)
        free = self._free[needed]
        try:
            memory = free.pop()
        except IndexError:
            padded = np.empty(needed + LINE, np.uint8)
            first = -padded.ctypes.data % LINE
            memory = padded[first : first + needed]
        owner = _Lent(memory)
        weakref.finalize(owner, free.append, memory).atexit = False
        return np.asarray(owner).view(dtype).reshape(shape)


class _Lent:
    """The owner of an allocation, kept alive by the arrays in it."""

    def __init__(self, memory: NDArray[np.uint8]) -> None:
        self.__array_interface__ = memory.__array_interface__


def room_of(program: Program, names: Iterable[str] | None = None) -> dict[str, NDArray[Any]]:
    """New arrays by output name, of the sizes and in the types of the program's results: what ``into=`` takes.

    Of ``names``, else of all.  Runs that are given the same ones again allocate nothing of a picture's size.

    >>> import passgraph as pg
    >>> dim = pg.kernel(source="def dim(color: Image) -> vec4: return color[0, 0] * 0.5")
    >>> dimmed = dim(pg.Input("frame", "rgba8", (4, 2)), into=pg.target("dimmed", "rgba8"))
    >>> with pg.compile(dimmed, results="stored") as program:
    ...     room = room_of(program)
    ...     made = program(frame=np.full((2, 4, 4), 100, np.uint8), into=room)
    >>> made["dimmed"] is room["dimmed"], room["dimmed"][0, 0].tolist()
    (True, [50, 50, 50, 50])
    """
    kinds = _kinds(program)
    return {name: np.empty(*kinds[name]) for name in (kinds if names is None else names)}


def _kinds(program: Program) -> dict[str, Kind]:
    """Shape and type of each result."""
    plan, stored = program.plan, program.settings()["results"] == "stored"
    results = {name: plan.resources[resource] for name, resource in plan.outputs.items()}
    return {
        name: ((*one.size[::-1], one.format.channels), np.dtype(one.format.number if stored else np.float32))
        for name, one in results.items()
    }


#: What a run is given, and gives back in the place of a result that was written there.
Picture: TypeAlias = "NDArray[Any] | DevicePicture"
#: A picture without channels, (h, w), is gray where no format is declared: as many channels have its value.
GREY_CHANNELS = 3
#: Steps that finding shared memory may take: enough for pictures side by side in one array.
OVERLAP_WORK = 10_000
_FLOAT32 = np.dtype(np.float32)


def format_of(dtype: np.dtype[Any], channels: int, srgb: bool = False) -> Format:
    """The format that pictures of such numbers are bound to: their own, or float32 where no format holds them.

    ``srgb``: the one that is decoded from sRGB, where there is such a one.

    >>> format_of(np.dtype(np.uint8), 4).name
    'rgba8'
    """
    own = (colour_format(dtype.str[1:], channels) if dtype.isnative else None) or float_format(channels)
    return (curved(own, True) if srgb else None) or own


def admitted_device_picture(picture: DevicePicture, spec: InputSpec) -> DevicePicture:
    """A picture on the device, where it fits what the input declares; nobody looks at its pixels.

    Raises
    ------
    InputError
        For another size, or fewer channels or more than the declared format has.
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
    """An input as (height, width, channels): as it is where the input's format holds such numbers, else in float32.
    What could hold NaN or infinity is looked through, see :func:`passgraph.run.finite_checks.admitted`.

    As float32, uint8, uint16 and bool count from 0 to 1; floats of 64 and more bits are rounded.  Byte order and
    strides may be any.  Without channels, (height, width), it is gray: red, green and blue are its value.  For an input
    that is declared with one channel it is that one, and (height, width, 1) is one channel of data anywhere.

    Raises
    ------
    InputError
        For what is not a picture, holds no numbers, does not fit the declared size or channels, or is not finite.
    """
    array = _picture(picture_, spec)
    format_ = spec.format or format_of(array.dtype, array.shape[2])
    picture = array if array.dtype == np.dtype(format_.number) else _as_values(array)
    if array.dtype.kind != "f":
        return picture
    return admitted(picture, spec.name, spec.format, non_finite, readers)


def bound_to(picture: Picture, spec: InputSpec) -> tuple[Format, tuple[int, int]]:
    """Format and size (width, height) of an input that such a picture is given for."""
    if isinstance(picture, DevicePicture):
        return spec.format or picture.format, picture.size
    height, width, channels = picture.shape
    return spec.format or format_of(picture.dtype, channels, spec.srgb), (width, height)


class Admission:
    """The pictures of a program's runs, by input; a static one that is given again is not looked through again."""

    def __init__(self, specs: Mapping[str, InputSpec], outputs: Iterable[Target], non_finite: NonFinite) -> None:
        self._specs, self._outputs, self._non_finite = specs, tuple(outputs), non_finite
        #: Of static inputs what was given last, and what that became.
        self._static: dict[str, tuple[Any, Any]] = {}

    def known(self) -> dict[str, tuple[Format, tuple[int, int]]]:
        """Formats and sizes before a run: as declared, or those of what stands in where a run brings none."""
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
        """Return the checked pictures of one run; InputError for one that is missing or unfit."""
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
                # The same object again is the same picture: what depends on it does not run again.
                self._static[name] = picture, checked
            pictures[name] = checked
        return pictures


def _picture(value: Any, spec: InputSpec) -> NDArray[Any]:
    what, expected = f"input {spec.name!r}", "be an array (height, width, channels) of numbers"
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
    """A picture without channels with as many as are read: its value in each color, and alpha 1."""
    if channels < GREY_CHANNELS:
        return array[:, :, None]
    color = np.empty((*array.shape, channels), array.dtype)
    color[..., :GREY_CHANNELS] = array[..., None]
    if channels > GREY_CHANNELS:
        color[..., GREY_CHANNELS] = np.iinfo(array.dtype).max if array.dtype.kind in "ui" else 1
    return color


def _as_values(array: NDArray[Any]) -> NDArray[np.float32]:
    if array.dtype.kind == "u":  # of any byte order
        return np.ascontiguousarray(array / np.float32(np.iinfo(array.dtype).max), np.float32)
    with np.errstate(over="ignore"):  # float64 beyond float32 becomes infinite, and non_finite says what of that
        return np.ascontiguousarray(array, np.float32)


def given_room(
    into: object, plan: Plan, pictures: Mapping[str, Picture], on_device: Callable[[object], DevicePicture | None]
) -> dict[int, Picture]:
    """Arrays, and pictures on the device, that results are written into, by resource.

    Raises
    ------
    InputError
        For an array that does not fit its target, cannot be written, or lies where another picture lies.
    """
    if type(into) is not dict and not isinstance(into, Mapping):  # the second asks Python code
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
        if array.flags.owndata:  # a list: what is written into the array would not be in it
            raise InputError(
                f"{what} takes {expected}, got {arguments.shown(destination)}, which is no memory to write into"
            )
    shaped = array[:, :, None] if array.ndim == 2 else array
    fits = array.dtype == _FLOAT32 or array.dtype == np.dtype(format_.number)
    if shaped.shape != (size[1], size[0], format_.channels) or not fits:
        raise InputError(f"{what} takes {_expected_room(format_, size)}, got {array.shape} of {array.dtype}")
    if not array.flags.writeable:
        raise InputError(f"{what} is read-only; give an array that may be written, such as a copy of it")
    if not array.flags.c_contiguous and _overlaps_itself(shaped):
        raise InputError(f"{what} has pixels that share memory (strides {array.strides}); give a plain array")
    view: NDArray[Any] = shaped
    return view


def _expected_room(format_: Format, size: tuple[int, int]) -> str:
    number, (width, height) = np.dtype(format_.number), size
    types = "float32" if number == _FLOAT32 else f"{number} or float32"
    return f"an array ({height}, {width}, {format_.channels}) of {types}, as target format {format_.name} says"


def _overlaps_itself(array: NDArray[Any]) -> bool:
    """Whether two elements lie in one place, as in what np.broadcast_to makes."""
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
        return np.shares_memory(one, other, max_work=OVERLAP_WORK)  # type: ignore[arg-type]
    except np.exceptions.TooHardError:
        return True  # their bounds overlap


#: Bytes of a result from which on passes write it where its caller will have it.
WORTH_MAKING = 1 << 13


class Lending:
    """Bind the caller's arrays to plan allocations, from run to run (zero-copy).

    Attributes
    ----------
    storages : those that the backend made of such arrays, by the place of the memory that they stand for
    room : where the caller wants results of the last run, by resource
    made : memory for others of them, which will be the caller's, written as the caller wants them
    """

    def __init__(self, plan: Plan, backend: Backend) -> None:
        self.plan, self.backend = plan, backend
        self.storages: dict[int, Any] = {}
        self.room: dict[int, Picture] = {}
        self.made: dict[int, NDArray[Any]] = {}
        self._handed_out: set[int] = set()
        self._names = {resource: name for name, resource in plan.outputs.items()}
        self.spare = Spare()
        #: How each array of the last run came in or went out: in words, and what tells of its layout.
        self._transfers: dict[str, tuple[str, tuple[object, ...]]] = {}

    @property
    def transfers(self) -> dict[str, str]:
        """Describe how each array of the last run was transferred."""
        return {what: f"{how} {_in_words(layout)}" for what, (how, layout) in self._transfers.items()}

    def begin(self, result_arrays: Mapping[int, Picture], results: Results | None = None) -> None:
        """Another run begins: what the one before was lent is the caller's alone.

        ``results``: as what its caller wants those that are not in ``room``; None for one that reads none.
        """
        self.storages.clear()
        self._transfers.clear()
        self.made.clear()
        self._handed_out.clear()
        self.room = dict(result_arrays)
        for resource in self._worth_making if results else ():
            number = self.plan.resources[resource].format.number
            if resource not in result_arrays and (results == "stored" or number == "f4"):
                self.made[resource] = self.array(resource, np.dtype(number))

    def array(self, resource: int, dtype: np.dtype[Any]) -> NDArray[Any]:
        """An array of a result's size, which is the caller's from then on."""
        info = self.plan.resources[resource]
        return self.spare.array((*info.size[::-1], info.format.channels), dtype)

    def result(self, resource: int) -> Picture | None:
        """A result that is where its caller wants it; None for one that must be moved."""
        array = self.made.get(resource)
        if array is None:
            return self.room.get(resource)
        if resource in self._handed_out:
            return array.copy()
        self._handed_out.add(resource)
        return array

    def takes(self, name: str, resource: int, place: int, picture: Picture) -> bool:
        """Whether an input's picture is read where it lies, or a copy of it on the device."""
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
        """Whether a step reads an input's picture where, or after, a result is written over it."""
        over = [
            self._uses[self.plan.resources[result].memory].first_written
            for result, destination in self.room.items()
            if isinstance(destination, DevicePicture) and destination.overlaps(picture)
        ]
        return any(resource in step.reads for first in over for step in self.plan.steps[first:])

    def take_room(self, places: Sequence[int]) -> None:
        """Results that the backend can write where the caller wants them are written there."""
        for resource in (self.room.keys() & self._plain_results) | self.made.keys():
            target = self.plan.resources[resource]
            array = self.room[resource] if resource in self.room else self.made[resource]
            storage = self.backend.adopt(array, target.format, self._uses[target.memory].use)
            if storage is not None:
                self.storages[places[resource]] = storage
            else:
                self.made.pop(resource, None)

    def end(self, places: Sequence[int], memories: Sequence[Any]) -> None:
        """Move the other results to where they are wanted, and give the inputs back.

        Results stay lent until the next run, so that they can be read.
        """
        for resource, array in self.room.items():
            moved = places[resource] not in self.storages
            if moved:
                self.backend.download_into(memories[places[resource]], array, self.plan.resources[resource].format)
            how = "moved into" if moved else "written in place in"
            self._transfers[f"output {self._names[resource]!r}"] = how, _layout(array)
        for resource in self._read_only:
            self.storages.pop(places[resource], None)

    @cached_property
    def _read_only(self) -> set[int]:
        """Inputs of which nothing is needed after a run, and that no step draws over."""
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
        """Results that every run writes anew, and that the next one does not need."""
        plan = self.plan
        static = {r for step in plan.steps if step.static for r in step.writes}
        plain = (plan.resources[r] for r in plan.outputs.values() if r not in static)
        return {info.id for info in plain if info.kind == "target" and info.history is None}

    @cached_property
    def _worth_making(self) -> list[int]:
        """Plain results that take longer to be moved than to be lent memory."""
        memories = ((r, self.plan.memories[self.plan.resources[r].memory]) for r in self._plain_results)
        return [resource for resource, memory in memories if memory.bytes >= WORTH_MAKING]


@dataclass(frozen=True)
class _PlaceUse:
    """How one run uses an allocation, and the first step that writes it."""

    use: Use
    first_written: int


def _layout(array: Picture) -> tuple[object, ...]:
    """Return the layout that `_in_words` describes; keeps no reference to the array."""
    return (str(array),) if isinstance(array, DevicePicture) else (array.dtype, array.shape, array.strides)


def _in_words(layout: tuple[object, ...]) -> str:
    if len(layout) == 1:
        return str(layout[0])
    dtype, shape, strides = layout
    return f"{dtype} {shape}, strides {strides}"
