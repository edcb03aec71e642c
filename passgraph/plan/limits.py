"""Check the limits of device and memory on the plan, before anything is allocated."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import field
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from passgraph import arguments
from passgraph.errors import GraphError, InputError, UnsupportedError
from passgraph.language.native import Accuracy
from passgraph.plan.data import DrawStep, PixelStep, Plan, Resource, Step
from passgraph.records import dataclass

if TYPE_CHECKING:
    from passgraph.language.scalar import ScalarProgram

#: Stands for no limit.
NONE = 1 << 62


@dataclass(frozen=True)
class Limits:
    """Limits of one device; by default there are none.

    Attributes
    ----------
    device : its name in messages, such as ``"gl (llvmpipe)"``
    side : pixels along one side of a picture
    pixels : of one picture
    picture_bytes : of one picture
    images : that one pass reads; those of both kernels of a draw count together
    targets : that one pass writes, without depth
    bindings : images and targets of one pass together
    vertex_numbers, numbers : parameters of a vertex kernel, and of any other, in numbers of 4 bytes
    rounding : floats and ints are each padded to multiples of this many numbers
    filters : border rules under which its own filter may replace bilinear samples
    native : functions that ``math="native"`` lets it compute itself, with their accuracy
    contracts : True if it multiplies and adds in one instruction, which ``math="native"`` then uses
    varyings : numbers passed from a vertex kernel to the fragment kernel
    trips : loop iterations of one pixel, nested loops multiplied; a plan is rejected if every pixel makes more,
        whatever its data
    not_kept, not_written : channel types (`Format.number`) that the device cannot store in pictures, or cannot write in
        passes; with the feature that it lacks
    """

    device: str = "this device"
    side: int = NONE
    pixels: int = NONE
    picture_bytes: int = NONE
    images: int = NONE
    targets: int = NONE
    bindings: int = NONE
    vertex_numbers: int = NONE
    numbers: int = NONE
    rounding: int = 1
    varyings: int = NONE
    filters: tuple[str, ...] = ()
    native: Mapping[str, Accuracy] = field(default_factory=dict)
    contracts: bool = False
    trips: int = NONE
    not_kept: Mapping[str, str] = field(default_factory=dict)
    not_written: Mapping[str, str] = field(default_factory=dict)

    def numbers_taken(self, floats: int, ints: int) -> int:
        """Return the padded number of parameters."""
        return sum(-(-count // self.rounding) * self.rounding for count in (floats, ints))

    def fits(self, images: int, targets: int, floats: int, ints: int, trips: int = 0) -> bool:
        """Return True if a pixel pass with these needs is within the limits."""
        return (
            images <= self.images
            and images + targets <= self.bindings
            and self.numbers_taken(floats, ints) <= self.numbers
            and trips <= self.trips
        )


def check(plan: Plan, limits: Limits) -> None:
    """Raise UnsupportedError if the plan exceeds the limits of the device.

    Raises
    ------
    UnsupportedError
        With the pass, the limit and the device.
    """
    writers = {resource: step.name for step in plan.steps for resource in step.writes}
    for resource in plan.resources:
        _check_picture(resource, writers.get(resource.id), limits)
    for step in plan.steps:
        if isinstance(step, (PixelStep, DrawStep)):
            _check_bindings(step, limits)
        for program in step.programs:
            _check_numbers(step, program, limits)
            _check_trips(step, program, limits)
        if isinstance(step, DrawStep) and len(step.varyings) > limits.varyings:
            _refuse(
                step,
                f"hands over {len(step.varyings)} numbers from vertex to fragment kernel",
                limits,
                limits.varyings,
                "hand over fewer",
            )


def _check_picture(resource: Resource, writer: str | None, limits: Limits) -> None:
    format_ = resource.format
    what = f"input {resource.name!r}" if writer is None else f"pass {writer!r}: target {resource.name!r}"
    lacks = limits.not_kept.get(format_.number) or (writer is not None and limits.not_written.get(format_.number))
    if lacks and not format_.is_depth:
        raise UnsupportedError(
            f"{what} is {format_.name}; {limits.device} has no {'target' if writer else 'picture'} of that format, "
            f"which takes {lacks}; give it another one, such as rgba8, or use another backend"
        )
    width, height = resource.size
    size = width * height * resource.format.bytes_per_pixel
    for actual, limit, unit in (
        (max(width, height), limits.side, "pixels a side"),
        (width * height, limits.pixels, "pixels in a picture"),
        (size, limits.picture_bytes, "bytes in a picture"),
    ):
        if actual > limit:
            raise UnsupportedError(
                f"{what} is {width}x{height} {resource.format.name} ({size / 2**20:.0f} MiB); {limits.device} takes "
                f"{limit:,} {unit}; use a smaller size or format, or another backend"
            )


def _check_bindings(step: PixelStep | DrawStep, limits: Limits) -> None:
    images, targets = sum(len(program.images) for program in step.programs), len(step.outputs)
    if images > limits.images:
        _refuse(step, f"reads {images} images", limits, limits.images, "split the kernel")
    if targets > limits.targets:
        _refuse(step, f"writes {targets} targets", limits, limits.targets, "split the kernel")
    if images + targets > limits.bindings:
        _refuse(step, f"has {images + targets} images and targets", limits, limits.bindings, "split the kernel")


def _check_numbers(step: Step, program: ScalarProgram, limits: Limits) -> None:
    limit = limits.vertex_numbers if program.stage == "vertex" else limits.numbers
    needed = limits.numbers_taken(program.float_count, program.int_count)
    if needed > limit:
        mend = "make some of them Const, or put them into a picture"
        _refuse(step, f"has {needed} numbers as parameters of kernel {program.name}", limits, limit, mend)


def _check_trips(step: Step, program: ScalarProgram, limits: Limits) -> None:
    from passgraph.language.scalar import trips  # backends import this module before there is a program

    # Loops that may exit early usually make few of their possible iterations.
    trips_made = trips(program.body, certain=True) if limits.trips < NONE else 0
    if trips_made > limits.trips:
        mend = "make fewer in one pass, or use another backend"
        _refuse(
            step, f"makes {trips_made:,} trips of loops a pixel in kernel {program.name}", limits, limits.trips, mend
        )


def _refuse(step: Step, what: str, limits: Limits, limit: int, mend: str) -> None:
    raise UnsupportedError(f"pass {step.name!r} {what}; {limits.device} takes {limit:,} in one pass; {mend}")


_UNITS = {"": 1, "k": 10**3, "m": 10**6, "g": 10**9, "t": 10**12}
_BINARY = {"ki": 1 << 10, "mi": 1 << 20, "gi": 1 << 30, "ti": 1 << 40}
#: Larger memory limits are taken for typing errors.
MOST_BYTES = 1 << 52
#: Default memory limit of a plan as a fraction of the machine's memory.
SHARE = 0.5
#: Files with the memory limit of a container (control groups version 2, version 1).
_CGROUPS = ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes")
#: Most targets named in a message.
_NAMED = 3


def bytes_of(memory: object) -> int:
    """Parse a number of bytes, such as ``1_000_000``, ``"1 GB"`` or ``"512 MiB"``.

    >>> bytes_of("1 GB"), bytes_of("1.5 KiB")
    (1000000000, 1536)
    """
    if isinstance(memory, str):
        match = re.fullmatch(r"\s*(\d+(?:\.\d+)?)\s*([kmgt]?i?)b?\s*", memory.lower())
        unit = None if match is None else {**_UNITS, **_BINARY}.get(match[2])
        if match is None or unit is None:
            raise InputError(f"memory must be bytes, such as '1 GB' or '512 MiB', got {arguments.shown(memory)}")
        memory = int(float(match[1]) * unit)
    return arguments.whole_number(memory, "memory (bytes)", 1, MOST_BYTES, InputError)


def format_bytes(count: int) -> str:
    """Format a number of bytes for messages."""
    return f"{count / 1e9:.1f} GB" if count >= 10**9 else f"{-(-count // 10**6)} MB"


def enough(count: int) -> str:
    """Return a size of memory to ask for, rounded up, as options and ``memory=`` take it.

    >>> enough(1_230_000_001), enough(1)
    ('1.3GB', '1MB')
    """
    return f"{-(-count // 10**8) / 10:.1f}GB" if count >= 10**9 else f"{-(-count // 10**6)}MB"


@cache
def machine_memory() -> int:
    """Return the memory of the machine, of the container, or that the process may have (``ulimit -v``), in bytes."""
    limits = [_physical_memory(), *_process_limits()]
    for name in _CGROUPS:
        try:
            limits.append(int(Path(name).read_text()))
        except (OSError, ValueError):  # no such group, or "max"
            continue
    return min(limits)


def _process_limits() -> list[int]:
    if sys.platform == "win32":
        return []
    import resource

    limits = [resource.getrlimit(kind)[0] for kind in (resource.RLIMIT_AS, resource.RLIMIT_DATA)]
    return [limit for limit in limits if limit != resource.RLIM_INFINITY]


def _physical_memory() -> int:
    if sys.platform != "win32":
        with suppress(ValueError, OSError):  # the system does not tell
            return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    return MOST_BYTES


def check_memory(plan: Plan, allowed: int | None) -> None:
    """Raise GraphError if a plan allocates more than ``allowed`` bytes; None allows half of the machine's memory.

    Raises
    ------
    GraphError
        With the largest targets and their sizes.
    """
    limit = int(SHARE * machine_memory()) if allowed is None else allowed
    if plan.bytes <= limit:
        return
    largest = sorted(plan.resources, key=lambda resource: -plan.memories[resource.memory].bytes)[:_NAMED]
    named = ", ".join(
        f"{resource.name} {resource.size[0]}x{resource.size[1]} {resource.format.name} "
        f"({format_bytes(plan.memories[resource.memory].bytes)})"
        for resource in largest
    )
    why = "half of this machine's memory" if allowed is None else "the memory that is given"
    raise GraphError(
        f"the targets of this graph take {format_bytes(plan.bytes)}, and at most {format_bytes(limit)} are allowed, "
        f"{why}; the largest are {named}. Make them smaller, compute in tiles (pg.tiled), or allow more: pg.compile(…, "
        "memory='16 GB'), on the command line --memory 16GB"
    )
