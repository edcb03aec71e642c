"""Plans held against what a device takes, before anything is made there."""

from __future__ import annotations

from collections.abc import Iterable

from passgraph.errors import BackendError
from passgraph.language.scalar import ScalarProgram, trips
from passgraph.plan.data import DrawStep, PixelStep, Plan, Resource, Step
from passgraph.plan.limits import NONE, Limits


def check(plan: Plan, limits: Limits) -> None:
    """Refuse what the device does not take, before anything is made there.

    Raises
    ------
    BackendError
        With the pass, the limit and the device.
    """
    writers = {resource: step.name for step in plan.steps for resource in step.writes}
    for resource in plan.resources:
        _check_picture(resource, writers.get(resource.id), limits)
    for step in plan.steps:
        if isinstance(step, (PixelStep, DrawStep)):
            _check_bindings(step, limits)
            for program in _programs(step):
                _check_numbers(step, program, limits)
                _check_trips(step, program, limits)
        if isinstance(step, DrawStep) and len(step.varyings) > limits.varyings:
            _refuse(
                step, f"hands over {len(step.varyings)} numbers from vertex to fragment kernel", limits,
                limits.varyings, "hand over fewer",
            )  # fmt: skip


def _check_picture(resource: Resource, writer: str | None, limits: Limits) -> None:
    format_ = resource.format
    what = f"input {resource.name!r}" if writer is None else f"pass {writer!r}: target {resource.name!r}"
    lacks = limits.not_kept.get(format_.number) or (writer is not None and limits.not_written.get(format_.number))
    if lacks and not format_.is_depth:
        raise BackendError(
            f"{what} is {format_.name}; {limits.device} has no {'target' if writer else 'picture'} of that format, "
            f"which takes {lacks}; give it another one, such as rgba8, or use another backend"
        )
    width, height = resource.size
    size = width * height * resource.format.bytes_per_pixel
    for found, limit, unit in (
        (max(width, height), limits.side, "pixels a side"),
        (width * height, limits.pixels, "pixels in a picture"),
        (size, limits.picture_bytes, "bytes in a picture"),
    ):
        if found > limit:
            raise BackendError(
                f"{what} is {width}x{height} {resource.format.name} ({size / 2**20:.0f} MiB); {limits.device} takes "
                f"{limit:,} {unit}; use a smaller size or format, or another backend"
            )


def _programs(step: PixelStep | DrawStep) -> Iterable[ScalarProgram]:
    programs = (step.program,) if isinstance(step, PixelStep) else (step.vertex, step.fragment)
    return [program for program in programs if program is not None]


def _check_bindings(step: PixelStep | DrawStep, limits: Limits) -> None:
    images, targets = sum(len(program.images) for program in _programs(step)), len(step.outputs)
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
    # Loops that are left early mostly make few of the trips that they may make.
    made = trips(program.body, certain=True) if limits.trips < NONE else 0
    if made > limits.trips:
        mend = "make fewer in one pass, or use another backend"
        _refuse(step, f"makes {made:,} trips of loops a pixel in kernel {program.name}", limits, limits.trips, mend)


def _refuse(step: Step, what: str, limits: Limits, limit: int, mend: str) -> None:
    raise BackendError(f"pass {step.name!r} {what}; {limits.device} takes {limit:,} in one pass; {mend}")
