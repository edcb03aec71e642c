"""The interface of backends: create pictures, transfer them, compile passes, run them.

A backend is a subclass of :class:`Backend`, registered under the entry point group ``passgraph.backends``.  It never
sees the graph, only steps of a plan (:mod:`passgraph.plan.data`).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from typing import Any, ClassVar, NoReturn, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.turn import Turn, turn_of
from passgraph.errors import BackendError, InputError
from passgraph.formats import Format, as_many_channels, float_format
from passgraph.graph.draw_state import Geometry
from passgraph.language.builtin_name import BuiltinName
from passgraph.language.native import Accuracy
from passgraph.plan.data import CountStep, DrawStep, PixelStep
from passgraph.plan.limits import Limits
from passgraph.quantise import FloatBlock as FloatBlock
from passgraph.quantise import convert, transfer_format
from passgraph.quantise import numbers_of as numbers_of
from passgraph.quantise import quantised as quantised
from passgraph.quantise import values_of as values_of
from passgraph.records import dataclass
from passgraph.srgb import linear_to_srgb

_NOTHING = nullcontext()

IntBlock = NDArray[np.int32]


@dataclass(frozen=True)
class Block:
    """Parameters of one stage, at the places of its program's `UniformSlot`."""

    floats: FloatBlock
    ints: IntBlock


@dataclass(frozen=True)
class DeviceInfo:
    """A device that a backend can use."""

    name: str
    driver: str
    version: str
    missing: str = ""  # why it cannot be used, with the command that fixes it


@dataclass(frozen=True, eq=False)
class DevicePicture:
    """A picture on a device that passgraph does not own: an engine's texture or a caller's buffer.  Backends create
    these.

    Attributes
    ----------
    format : the format in which kernels read it; float32 if no format has its channel type
    size : (width, height), pixels
    """

    format: Format
    size: tuple[int, int]

    def overlaps(self, other: DevicePicture) -> bool:
        """Return True if both may share a pixel."""
        return self is other

    def is_in(self, storage: Any) -> bool:
        """Return True if `Backend.adopt` uses the picture itself, not a copy on the device."""
        return True

    def check_room(self, format_: Format, remedy: str, is_stored: bool = False) -> None:
        """Check that results of a format can be written to the picture.

        ``remedy`` ends the message if only one is sRGB-encoded; with ``is_stored`` that does not matter.

        Raises
        ------
        InputError
            For another encoding, and for fewer or more channels.
        """
        what = f"into= gives a {self} for target format {format_.name}"
        if not is_stored and self.format.srgb != format_.srgb:
            raise InputError(f"{what}: only one is sRGB-encoded; {remedy}")
        if not as_many_channels(format_, self.format):
            raise InputError(f"{what}, which has {format_.channels} channel(s); they must be as many")

    def __str__(self) -> str:
        return f"{self.format.name} picture of {self.size[0]}x{self.size[1]} pixels"


@dataclass(frozen=True)
class SentPass:
    """What a device gets for one run of a pixel pass or a draw, to repeat it without passgraph.

    Attributes
    ----------
    library : Python package whose calls repeat it, by the program of this name in `passgraph/assets/reproduction/`
    sources : file name → text, as it is compiled
    buffers : file name → bytes of parameters
    calls : what else the calls of the library take, as values of JSON
    images : NumPy's names of the types in which the device stores the images that are read
    program : "pass" or "draw", which the program repeats; a draw's calls also say of each output whether it is
        ``kept``, and whether the draw ``keeps_depth``: what is there before is part of the data
    """

    library: str
    sources: dict[str, str]
    buffers: dict[str, bytes]
    calls: dict[str, Any]
    images: tuple[str, ...]
    program: str = "pass"


@dataclass(frozen=True)
class Use:
    """The use of an adopted picture in a run.

    Attributes
    ----------
    is_read : passes read it
    is_written : passes write it
    is_drawn : triangles are drawn into it
    beside_others : a pass writes it together with other pictures
    is_overwritten : a result is written into it before passes have finished reading it
    """

    is_read: bool = True
    is_written: bool = False
    is_drawn: bool = False
    beside_others: bool = False
    is_overwritten: bool = False


READ, OVERWRITTEN = Use(), Use(is_overwritten=True)


class PixelRunner(Protocol):
    """A compiled pixel pass.  Sizes are fixed at compilation."""

    def __call__(self, outputs: Sequence[Any], images: Sequence[Any], block: Block) -> None:
        """Write ``outputs`` from ``images`` (storages, in the step's order)."""


class ChainRunner(Protocol):
    """Pixel passes compiled as one unit.  Sizes are fixed at compilation."""

    def __call__(self, outputs: Sequence[Any], images: Sequence[Sequence[Any]], blocks: Sequence[Block]) -> None:
        """Write the last step's ``outputs``; ``images`` and ``blocks`` are those of each step."""


class DrawRunner(Protocol):
    """A compiled draw."""

    def __call__(
        self,
        outputs: Sequence[Any],
        depth: Any,
        images: Sequence[Any],
        geometry: Any,
        vertex: Block,
        fragment: Block,
    ) -> None:
        """Clear what the step clears, then draw."""


@dataclass(frozen=True)
class Promises:
    """What the bounds of a device's results depend on.

    Attributes
    ----------
    corner_px : how far from its place on the screen a corner of a triangle may lie, in pixels, where the driver chooses
        its grid; 0 if corners are snapped to the grid of docs/rasterization.md before anything is computed from them
    native : functions that it computes itself under ``math="native"``, with their accuracy
    """

    corner_px: float = 0.0
    native: tuple[tuple[str, Accuracy], ...] = ()


#: Of most backends.
SNAPPED = Promises()
#: One step of the grid of docs/rasterization.md, and of those of most drivers, in pixels.
SNAP_PX = 1.0 / 256.0


class Backend(ABC):
    """An open device.  It owns everything that it created until :meth:`close`.

    Pictures on the host are (height, width, channels) float32 arrays with row 0 on top; depth pictures have one
    channel.  A *storage* is a backend's own representation of a picture.
    """

    name: ClassVar[str]
    #: True if plans may fuse passes and skip static ones; the reference runs everything as written.
    optimises: ClassVar[bool] = True
    #: See :class:`Promises`.
    corner_px: float = 0.0
    #: True if it computes pictures; a backend that only plans has none to show.
    computes: ClassVar[bool] = True
    #: The limits of the open device.  Fusion respects them, and a plan that exceeds them is rejected before allocation.
    limits: Limits = Limits()
    #: Description of the context that it runs in, if that is not its own.
    about: str = ""
    #: Lock of the backend's current user; programs hold it during each call.
    turn: Turn

    def __new__(cls, *_: Any, **__: Any) -> Self:
        backend = super().__new__(cls)
        backend.turn = turn_of(backend, getattr(cls, "name", cls.__name__))
        return backend

    @property
    def promises(self) -> Promises:
        """Return what the bounds of its results depend on."""
        return Promises(self.corner_px, tuple(self.limits.native.items()))

    def __init__(self, device: str | None = None) -> None:
        """Open ``device`` (a number or a part of its name; None for the first).

        Raises DeviceMissingError with the command that installs the missing driver.
        """

    @classmethod
    @abstractmethod
    def devices(cls) -> list[DeviceInfo]:
        """List the devices, or return one entry that names what is missing. Must not raise."""

    def device_info(self) -> DeviceInfo:
        """Describe the open device; by default the first that the class lists."""
        return self.devices()[0]

    @abstractmethod
    def make(self, format: Format, size: tuple[int, int]) -> Any:
        """Return a new storage of (width, height) pixels, zeroed (depth 0, stencil 0)."""

    @abstractmethod
    def upload(self, storage: Any, picture: FloatBlock) -> None:
        """Upload a host picture unconverted to a storage; formats quantize by rounding to nearest even."""

    @abstractmethod
    def download(self, storage: Any) -> FloatBlock:
        """Return a fresh host copy of a storage."""

    # Transfers in a format's own dtype (`Format.number`); by default they go through float32.

    def picture_of(self, candidate: object) -> DevicePicture | None:
        """Return the device picture that a caller's object represents; None for arrays and other objects.

        Raises
        ------
        InputError
            For an object on a device that cannot be used there.
        """
        return None

    def adopt(self, external: Any, format: Format, use: Use = READ) -> Any | None:
        """Return a storage in foreign memory that is read or written in place and never freed.

        Return None if its layout does not fit, so its content must be copied.

        ``external`` is an array (height, width, channels) of the format's dtype, or a result of :meth:`picture_of`.  It
        is adopted again for each run, inside :meth:`running`, and remains the caller's: when that context ends, writes
        through the storage are visible there.  No reference may be kept after the run; a backend that cannot tell when
        a run ends returns None outside of a run.  One array may be adopted several times in a run, for reading.
        """
        return None

    def upload_stored(self, storage: Any, numbers: Any, format: Format) -> None:
        """Upload an array (height, width, channels) of the format's dtype to a storage; strides and byte order may be
        any.

        A backend with device pictures accepts those too, in any format."""
        self.upload(storage, values_of(numbers, format))

    def download_into(self, storage: Any, into: Any, format: Format) -> None:
        """Download a storage into an array (height, width, channels) of any strides: as values for float32, else
        unconverted.

        Only the array's elements are written, no memory between them.  A backend with device pictures accepts those
        too.
        """
        convert(self.download(storage), float_format(format.channels), into, transfer_format(into, format))

    @abstractmethod
    def copy(self, source: Any, destination: Any) -> None:
        """Copy a storage into another of the same format and size (stencil too)."""

    @abstractmethod
    def geometry(self, mesh: Geometry) -> Any:
        """Upload a mesh; called once per mesh and program."""

    @abstractmethod
    def pixel_pass(self, step: PixelStep) -> PixelRunner:
        """Compile a pixel pass."""

    def count_pass(self, step: CountStep) -> PixelRunner:
        """Compile a count, by default its program; another implementation must be bit-identical."""
        return self.pixel_pass(step)

    def own_way(self, step: CountStep) -> str | None:
        """Describe this device's own implementation of a count in a few words for ``explain()``; None if it runs the
        step's program."""
        return None

    def code(self, step: PixelStep | DrawStep, sizes: Mapping[int, tuple[int, int]]) -> str:
        """Return the generated code of a step, for reading; empty if there is none.  ``sizes`` are the pictures'
        (width, height), by resource."""
        return ""

    def sent(self, step: PixelStep, outputs: Sequence[Any], images: Sequence[Any], block: Block) -> SentPass | None:
        """Return what the device gets for a pixel pass over these storages with these parameters; None if a backend
        cannot say, or if another program could not repeat it."""
        return None

    def sent_draw(
        self, step: DrawStep, outputs: Sequence[Any], depth: Any, images: Sequence[Any], geometry: Any, vertex: Block,
        fragment: Block,
    ) -> SentPass | None:  # fmt: skip
        """Return what the device gets for a draw, as :meth:`sent` does for a pixel pass."""
        return None

    def pixel_chain(self, steps: Sequence[PixelStep]) -> ChainRunner | None:
        """Compile consecutive pixel passes as one, see :mod:`passgraph.plan.chains`; results must be bit-identical.

        Only these passes read the pictures between them.  None if a chain has no advantage: the passes then run one by
        one.
        """
        return None

    @abstractmethod
    def draw_pass(self, step: DrawStep) -> DrawRunner:
        """Compile a draw."""

    def compiling(self) -> AbstractContextManager[None]:
        """Return a context for compiling a plan's steps: code compiled in parallel is ready when it ends."""
        return nullcontext()

    def running(self) -> AbstractContextManager[None]:
        """Return a reentrant context for the transfers and passes of one run, with exclusive use of the device.

        Shared setup is done once; at the end adopted pictures are the caller's again.
        """
        return _NOTHING

    def finish(self) -> None:
        """Wait until all submitted work has completed."""

    @abstractmethod
    def release(self, storage: Any) -> None:
        """Release a storage."""

    def release_geometry(self, geometry: Any) -> None:
        """Release a mesh, if it is more than the arrays that it came from."""

    def after_fork(self) -> bool:
        """Prepare for use in a child process, right after a fork; False if that is impossible.

        Every later use then raises an error.  After a fork only the forking thread exists.
        """
        return False

    @abstractmethod
    def close(self) -> None:
        """Release everything; idempotent."""

    def __reduce__(self) -> NoReturn:
        raise BackendError(
            f"{self.name}: an open backend is bound to this process and cannot be copied or pickled; give its "
            "name to the other process, and open it there"
        )

    def __enter__(self) -> Backend:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def device_number(device: str) -> int | None:
    """Parse a device number; None for a part of a name, and for digits other than ASCII.

    >>> device_number("1"), device_number("²"), device_number("tesla")
    (1, None, None)
    """
    return int(device) if device.isascii() and device.isdigit() and len(device) <= 4 else None


def clear_colour(clear: tuple[float, ...], channels: int, srgb: bool) -> tuple[float, ...]:
    """Return the clear values of a target, one number a channel, before quantization.

    Clear colors are linear, like the values that kernels write; sRGB targets store them encoded (IEC 61966-2-1).

    >>> clear_colour((1.0, 0.0, 0.0, 0.5), 4, srgb=True)[3]
    0.5
    """
    spread = clear * channels if len(clear) == 1 else clear
    if not srgb:
        return spread
    curve = linear_to_srgb(np.clip(np.array(spread[:3], np.float64), 0.0, 1.0))
    return *curve.tolist(), *spread[3:]


#: Mesh attribute → (array name, components), in the order of passgraph.language.signature.VERTEX_FIELDS.
ATTRIBUTES = {
    "position": ("positions", 3),
    "normal": ("normals", 3),
    "uv": ("uvs", 2),
    "color": ("colors", 4),
    "tangent": ("tangents", 4),
    "instance": ("instances", 1),
}


def vertex_attribute(mesh: Geometry, name: str) -> FloatBlock:
    """Return one attribute as (n, components) float32; its default if the mesh has none."""
    from passgraph.language.signature import VERTEX_FIELDS

    array_name, components = ATTRIBUTES[name]
    array = getattr(mesh, array_name, None)
    count = len(mesh.positions)
    if array is None:
        return np.broadcast_to(np.array(VERTEX_FIELDS[name][1], np.float32), (count, components)).copy()
    return np.ascontiguousarray(array, np.float32).reshape(count, components)


def vertex_builtins(mesh: Geometry) -> dict[BuiltinName, FloatBlock]:
    """Return the builtins of a vertex kernel for a mesh, by name: (n, components) arrays, or (n,) for one component."""
    attributes = {BuiltinName("vertex", name): vertex_attribute(mesh, name) for name in ATTRIBUTES}
    return {name: values[:, 0] if values.shape[1] == 1 else values for name, values in attributes.items()}
