"""Find the sizes of targets: declared, or taken from an input, another target or the output."""

from __future__ import annotations

import math
from collections.abc import Container

from passgraph.errors import GraphError
from passgraph.graph.run_values import OUTPUT_SIZE, computed_side, sources_of
from passgraph.graph.targets import (
    MAX_SIDE,
    Absolute,
    Blocks,
    Computed,
    InputSpec,
    Like,
    Pass,
    PixelPass,
    Relative,
    Target,
    TargetSpec,
)
from passgraph.plan.work import Sized, Work

#: Largest picture in bytes: a typing error in a size should not make the machine swap.
MAX_PICTURE_BYTES = 16 << 30


def find_sizes(passes: list[Pass], work: Work) -> None:
    """Add every pass to ``work``, in writing order, with the size of its targets; default: the output's size."""
    requested = work.size
    work.size = requested or _output_size(work)
    for node in passes:
        for spec in node.writes:
            work.makers.setdefault(spec, node)
    for index, node in enumerate(passes):
        work.sized.append(Sized(node, _pass_size(node, work), index))
    if requested is not None:
        _check_asked(requested, work)
    work.size = work.size or work.size_of(next(iter(work.outputs.values())))


def _output_size(work: Work) -> tuple[int, int] | None:
    """Return the output's size if none was requested."""
    for target in work.outputs.values():
        if isinstance(target.spec, TargetSpec) and isinstance(target.spec.size, Absolute):
            return target.spec.size.width, target.spec.size.height
    for spec, (_, input_size) in work.inputs.items():
        if spec.default is None:  # textures do not set the output's size
            return input_size
    return None


def _pass_size(node: Pass, work: Work) -> tuple[int, int]:
    specs = node.writes
    for spec in specs:
        _find_size(spec, work)
    sizes = {work.sizes[spec] for spec in specs}
    if len(sizes) > 1:
        listed = ", ".join(f"{s.name} {work.sizes[s][0]}x{work.sizes[s][1]}" for s in specs)
        raise GraphError(f"pass {node.name!r} writes targets of different sizes ({listed}); give them one size")
    return sizes.pop()


def _find_size(spec: TargetSpec, work: Work) -> None:
    """Add the size of a target to ``work.sizes``, and first the sizes that it depends on."""
    pending = {spec: None}
    while pending:
        last = next(reversed(pending))
        source = _size_source(last, work)
        size = _known_size(source, work) if isinstance(source, Target) else source
        if last in work.sizes:
            pending.popitem()
        elif size is not None:
            work.sizes[last] = _checked(_taken(size, last), last, work)
            work.not_asked[last] = _why_not_output_size(last, source, work)
        else:
            assert isinstance(source, Target) and isinstance(source.spec, TargetSpec)
            _check_lender(source.spec, last, pending, work)
            pending[source.spec] = None


def _size_source(spec: TargetSpec, work: Work) -> Target | tuple[int, int]:
    """Return what a target takes its size from."""
    if isinstance(spec.size, Absolute):
        return spec.size.width, spec.size.height
    if isinstance(spec.size, Like | Blocks):
        return spec.size.other
    if spec.size is None:
        node = work.makers[spec]
        for image in node.images.values() if isinstance(node, PixelPass) else ():
            if not image.is_previous:
                return image
    if work.size is None:
        raise GraphError("the output's size is not known: give pg.compile(..., size=(width, height))")
    if isinstance(spec.size, Computed):
        sides = (computed_side(one, work.size, f"target {spec.name!r}") for one in (spec.size.width, spec.size.height))
        return next(sides), next(sides)
    return work.size


def _why_not_output_size(spec: TargetSpec, source: Target | tuple[int, int], work: Work) -> str:
    """Explain why a target's size does not depend on the output's; empty if it does."""
    if isinstance(spec.size, Absolute):
        return f"as target {spec.name!r} is declared"
    if not isinstance(source, Target):
        return ""
    if isinstance(source.spec, InputSpec):
        if work.size_of(source) == work.size:
            return ""
        how = "reduced from" if isinstance(spec.size, Blocks) else "the size of"
        return f"{how} input {source.name!r}"
    return work.not_asked.get(source.spec, f"the size of target {source.name!r}")


def _check_asked(size: tuple[int, int], work: Work) -> None:
    """Raise an error if no target uses the requested size, or outputs have another one because of an input."""
    specs = {name: target.spec for name, target in work.outputs.items() if isinstance(target.spec, TargetSpec)}
    if any(work.sizes[spec] == size or not work.not_asked[spec] for spec in specs.values()):
        return
    is_used = any(not reason for reason in work.not_asked.values()) or any(
        value is OUTPUT_SIZE for one in work.sized for value in sources_of(one.node.values)
    )
    for name, spec in specs.items():
        reason, (width, height) = work.not_asked[spec], work.sizes[spec]
        if not is_used or reason.startswith("the size of input"):
            raise GraphError(
                f"size=({size[0]}, {size[1]}) was requested, but output {name!r} is {width}x{height}, {reason}; "
                "leave size out, or declare the target with scale=1.0, which takes the requested size"
            )


def _known_size(target: Target, work: Work) -> tuple[int, int] | None:
    if isinstance(target.spec, InputSpec):
        return work.inputs[target.spec][1]
    if target.spec not in work.sizes and isinstance(target.spec.size, Absolute):
        return target.spec.size.width, target.spec.size.height
    return work.sizes.get(target.spec)


def _check_lender(lender: TargetSpec, spec: TargetSpec, pending: Container[TargetSpec], work: Work) -> None:
    where = f"pass {work.makers[spec].name!r} takes its size from {lender.name!r}, which"
    if lender not in work.makers:
        raise GraphError(f"{where} no pass before it makes; give that one a size")
    if lender in pending:
        raise GraphError(f"{where} takes its own from {spec.name!r}; give one of the two a size")


def _taken(size: tuple[int, int], spec: TargetSpec) -> tuple[int, int]:
    """Return the size of a target that takes it from a picture of this size."""
    declared = spec.size
    if isinstance(declared, Blocks):
        return declared.each * -(-size[0] // declared.width), -(-size[1] // declared.height)
    across, down = declared.scale if isinstance(declared, Like | Relative) else (1.0, 1.0)
    return max(1, math.ceil(size[0] * across)), max(1, math.ceil(size[1] * down))


def _checked(size: tuple[int, int], spec: TargetSpec, work: Work) -> tuple[int, int]:
    width, height = size
    total = width * height * spec.format.bytes_per_pixel
    if work.in_windows:
        return size
    if width > MAX_SIDE or height > MAX_SIDE or total > MAX_PICTURE_BYTES:
        raise GraphError(
            f"target {spec.name!r} would be {width}x{height} {spec.format.name} ({total / 2**30:.1f} GiB); "
            f"the limits are {MAX_SIDE} a side and {MAX_PICTURE_BYTES >> 30} GiB"
        )
    return size


def level_sizes(size: tuple[int, int]) -> list[tuple[int, int]]:
    """Return the width and height of every level, starting with the picture itself.

    >>> level_sizes((5, 3))
    [(5, 3), (2, 1), (1, 1)]
    """
    return [(max(1, size[0] >> k), max(1, size[1] >> k)) for k in range(max(size).bit_length())]
