"""The contract between a plan and a backend: make pictures, move them, compile passes, run them.

A backend is a class with the interface of :class:`Backend`, found under the entry point group
``passgraph.backends``.  It never sees the graph, only steps of a plan (:mod:`passgraph.plan.data`).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import Any, ClassVar, NoReturn, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.steps import FloatBlock as FloatBlock
from passgraph.backends.steps import numbers_of as numbers_of
from passgraph.backends.steps import quantised as quantised
from passgraph.backends.steps import values_of as values_of
from passgraph.backends.turn import Turn, turn_of
from passgraph.errors import BackendError
from passgraph.formats import Format
from passgraph.graph.draw_state import Geometry
from passgraph.plan.data import DrawStep, PixelStep
from passgraph.plan.limits import Limits
from passgraph.srgb import linear_to_srgb

_NOTHING = nullcontext()

IntBlock = NDArray[np.int32]


@dataclass(frozen=True)
class Block:
    """Parameters of one stage, packed by :func:`passgraph.language.uniform_layout.pack`."""

    floats: FloatBlock
    ints: IntBlock


@dataclass(frozen=True)
class DeviceInfo:
    """One device that a backend can use."""

    name: str
    driver: str
    version: str
    missing: str = ""  # why it cannot be used, with the command that mends it


@dataclass(frozen=True, eq=False)
class DevicePicture:
    """A picture on a device that is not ours: an engine's texture, a caller's buffer.  Its backend makes these.

    Attributes
    ----------
    format : what kernels read it as; what holds other numbers than formats do is read as float32
    size : (width, height), pixels
    """

    format: Format
    size: tuple[int, int]

    def overlaps(self, other: DevicePicture) -> bool:
        """Whether both may have a pixel in common."""
        return self is other

    def is_in(self, storage: Any) -> bool:
        """Whether what `Backend.adopt` made of it is the picture itself; else it is a copy on the device."""
        return True

    def __str__(self) -> str:
        return f"{self.format.name} picture of {self.size[0]}x{self.size[1]} pixels"


@dataclass(frozen=True)
class Use:
    """How a run uses an adopted picture: read, written or both.

    Attributes
    ----------
    is_read : passes read it
    is_written : passes write it
    is_drawn : triangles are drawn into it
    beside_others : a pass writes it together with other pictures
    is_overwritten : where it is, a result is written before passes have read all that they read of it
    """

    is_read: bool = True
    is_written: bool = False
    is_drawn: bool = False
    beside_others: bool = False
    is_overwritten: bool = False


READ, OVERWRITTEN = Use(), Use(is_overwritten=True)


class PixelRunner(Protocol):
    """A compiled pixel pass.  Sizes were fixed when it was compiled."""

    def __call__(self, outputs: Sequence[Any], images: Sequence[Any], block: Block) -> None:
        """Write ``outputs`` from ``images`` (storages, in the step's order)."""


class ChainRunner(Protocol):
    """Pixel passes compiled as one.  Sizes were fixed when they were compiled."""

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


class Backend(ABC):
    """One device, opened.  It owns everything that it made until :meth:`close`.

    Pictures on the host are (height, width, channels) float32 arrays with row 0 on top; depth pictures have one
    channel.  A *storage* is whatever a backend keeps a picture in.
    """

    name: ClassVar[str]
    #: Whether plans may fuse passes and leave static ones out: the reference runs everything as written.
    optimises: ClassVar[bool] = True
    #: Whether corners are rounded to the grid of docs/rasterisation.md before anything is computed from them.
    #: Where the grid is a driver's own, bounds allow for a step of it.
    snaps: ClassVar[bool] = True
    #: Whether it computes pictures; one that only plans makes none to look at.
    computes: ClassVar[bool] = True
    #: What the open device takes.  Fusion stops there, and a plan that still holds more is refused before it is made.
    limits: Limits = Limits()
    #: In whose context it runs, in words, where that is not its own.
    about: str = ""
    #: Held by whoever uses the backend; programs hold it over each call.
    turn: Turn

    def __new__(cls, *_: Any, **__: Any) -> Self:
        backend = super().__new__(cls)
        backend.turn = turn_of(backend, getattr(cls, "name", cls.__name__))
        return backend

    def __init__(self, device: str | None = None) -> None:
        """Open ``device`` (a number or a part of its name; None takes the first).

        Raises DeviceMissingError with the command that installs what is not there.
        """

    @classmethod
    @abstractmethod
    def devices(cls) -> list[DeviceInfo]:
        """List the devices, or return one entry that says what is missing. Must not raise."""

    @abstractmethod
    def make(self, format: Format, size: tuple[int, int]) -> Any:
        """A storage of (width, height) pixels, zeroed (depth 0, stencil 0)."""

    @abstractmethod
    def upload(self, storage: Any, picture: FloatBlock) -> None:
        """Host picture into a storage.  Values are stored as they are; formats quantize by rounding to nearest even."""

    @abstractmethod
    def download(self, storage: Any) -> FloatBlock:
        """A fresh host copy of a storage."""

    # Numbers as formats hold them (`Format.number`): these go through float32 where a backend knows no shorter way.

    def picture_of(self, candidate: object) -> DevicePicture | None:
        """Return the device picture that an object of the caller stands for; None for arrays and other objects.

        Raises
        ------
        InputError
            For what is on a device, but cannot be used there.
        """
        return None

    def adopt(self, external: Any, format: Format, use: Use = READ) -> Any | None:
        """A storage in memory that somebody else owns, read or written in place and never freed; None where its layout
        does not fit, and what it holds must be moved.

        ``external`` is an array (height, width, channels) of the format's number, or what :meth:`picture_of` gave.  It
        is adopted anew for each run, inside of :meth:`running`, and stays the caller's: what is written through the
        storage is there when that ends.  Nothing of it may be kept beyond: a backend that would know no end of its use
        gives None outside of a run.  One array may be adopted several times in a run, to be read.
        """
        return None

    def upload_stored(self, storage: Any, numbers: Any, format: Format) -> None:
        """An array (height, width, channels) of the format's numbers into a storage; of any strides and byte order.

        A backend that gives pictures of the device takes those too, of whatever format they have."""
        self.upload(storage, values_of(numbers, format))

    def download_into(self, storage: Any, into: Any, format: Format) -> None:
        """A storage into an array (height, width, channels) of any strides: values where that is float32, else numbers.

        Only the elements of the array are written, nothing between them.  A backend that gives pictures of the device
        takes those too.
        """
        values = self.download(storage)
        np.copyto(into, values if into.dtype == np.float32 else numbers_of(values, format))

    @abstractmethod
    def copy(self, source: Any, destination: Any) -> None:
        """One storage into another of the same format and size (stencil too)."""

    @abstractmethod
    def geometry(self, mesh: Geometry) -> Any:
        """A mesh on the device; made once per mesh and program."""

    @abstractmethod
    def pixel_pass(self, step: PixelStep) -> PixelRunner:
        """Compile a pixel pass."""

    def own_way(self, step: PixelStep) -> str | None:
        """Name this device's own implementation of a known step (`PixelStep.known`), in a few words for ``explain()``;
        None if it runs the step's program. The results must have the same bits."""
        return None

    def code(self, step: PixelStep | DrawStep, sizes: Mapping[int, tuple[int, int]]) -> str:
        """The code that this device makes of a step, for reading; empty where there is none to show.  ``sizes``
        (width, height) are those of the pictures, by resource."""
        return ""

    def pixel_chain(self, steps: Sequence[PixelStep]) -> ChainRunner | None:
        """Compile consecutive pixel passes as one, see :mod:`passgraph.plan.fuse`; what lies between them is read by
        them alone, and the results must be the same bits.  None where that brings nothing: they then run one by one."""
        return None

    @abstractmethod
    def draw_pass(self, step: DrawStep) -> DrawRunner:
        """Compile a draw."""

    def compiling(self) -> AbstractContextManager[None]:
        """Around the compilation of a plan's steps: what is compiled side by side meanwhile is ready when it ends."""
        return nullcontext()

    def running(self) -> AbstractContextManager[None]:
        """Around the transfers and passes of one run, between which nobody else uses the device: what they share is
        done once, and at the end what was adopted is the caller's again.  May be entered inside of itself."""
        return _NOTHING

    def finish(self) -> None:
        """Wait until everything that was asked for has happened."""

    @abstractmethod
    def release(self, storage: Any) -> None:
        """Give a storage back."""

    def release_geometry(self, geometry: Any) -> None:
        """Give a mesh back, where it is more than the arrays that it came from."""

    def after_fork(self) -> bool:
        """Make ready for use in a child process, right after a fork; False where that cannot be.

        Every use there is then refused with an error.  Threads other than the one that forked are gone.
        """
        return False

    @abstractmethod
    def close(self) -> None:
        """Give everything back; idempotent."""

    def __reduce__(self) -> NoReturn:
        raise BackendError(
            f"{self.name}: an open backend is a device of this process, and is neither copied nor pickled; give its "
            "name to the other process, and open it there"
        )

    def __enter__(self) -> Backend:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def device_number(device: str) -> int | None:
    """A device given by its number; None for a part of a name, and for digits that are none of ASCII's.

    >>> device_number("1"), device_number("²"), device_number("tesla")
    (1, None, None)
    """
    return int(device) if device.isascii() and device.isdigit() and len(device) <= 4 else None


def clear_colour(clear: tuple[float, ...], channels: int, srgb: bool) -> tuple[float, ...]:
    """Return the clear values of a target, one number a channel, before quantization.

    A clear color is linear as what kernels write is; sRGB targets hold it encoded (IEC 61966-2-1).

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
    """One attribute as (n, components) float32, filled with its default where the mesh has none."""
    from passgraph.language.signature import VERTEX_FIELDS

    array_name, components = ATTRIBUTES[name]
    array = getattr(mesh, array_name, None)
    count = len(mesh.positions)
    if array is None:
        return np.broadcast_to(np.array(VERTEX_FIELDS[name][1], np.float32), (count, components)).copy()
    return np.ascontiguousarray(array, np.float32).reshape(count, components)


def vertex_builtins(mesh: Geometry) -> dict[str, FloatBlock]:
    """Return the builtins of a vertex kernel for a mesh, by name: (n, components) arrays, or (n,) for one component."""
    attributes = {f"vertex.{name}": vertex_attribute(mesh, name) for name in ATTRIBUTES}
    return {name: values[:, 0] if values.shape[1] == 1 else values for name, values in attributes.items()}
