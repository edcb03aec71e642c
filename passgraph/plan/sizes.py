"""Find the sizes of targets: declared, or taken from an input, another target or the output."""

from __future__ import annotations

import math
from collections.abc import Container, Mapping

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
from passgraph.plan.draft import Bound, Sized

#: Largest picture in bytes: a typing error in a size should not make the machine swap.
MAX_PICTURE_BYTES = 16 << 30


class Sizes:
    """Finds the sizes of targets; those found so far are in ``found``.

    Parameters
    ----------
    requested : the output's size, if it is given
    in_windows : pictures are never allocated whole, so any size is allowed
    """

    def __init__(
        self, outputs: Mapping[str, Target], inputs: Bound, requested: tuple[int, int] | None, in_windows: bool
    ) -> None:
        self.outputs, self.inputs, self.requested, self.in_windows = outputs, inputs, requested, in_windows
        self.found: dict[TargetSpec, tuple[int, int]] = {}
        self._output = requested or self._first_size()
        #: For each target why its size does not depend on the output's; empty if it does.
        self._not_asked: dict[TargetSpec, str] = {}
        #: The first writer of each target: a size may be taken from a target that is not read.
        self._makers: dict[TargetSpec, Pass] = {}

    def of_passes(self, passes: list[Pass]) -> tuple[Sized, ...]:
        """Return every pass, in writing order, with the size of its targets; default: the output's size."""
        for node in passes:
            for spec in node.writes:
                self._makers.setdefault(spec, node)
        sized = tuple(Sized(node, self._pass_size(node), index) for index, node in enumerate(passes))
        if self.requested is not None:
            self._check_asked(self.requested, passes)
        return sized

    def of_output(self) -> tuple[int, int]:
        """Return the output's size: the requested one, that of the first input, or that of the first output."""
        size = self._output or self._known_size(next(iter(self.outputs.values())))
        assert size is not None
        return size

    def _first_size(self) -> tuple[int, int] | None:
        """Return the output's size if none was requested."""
        for target in self.outputs.values():
            if isinstance(target.spec, TargetSpec) and isinstance(target.spec.size, Absolute):
                return target.spec.size.width, target.spec.size.height
        for spec, (_, input_size) in self.inputs.items():
            if spec.default is None:  # textures do not set the output's size
                return input_size
        return None

    def _pass_size(self, node: Pass) -> tuple[int, int]:
        specs = node.writes
        for spec in specs:
            self._find(spec)
        sizes = {self.found[spec] for spec in specs}
        if len(sizes) > 1:
            listed = ", ".join(f"{s.name} {self.found[s][0]}x{self.found[s][1]}" for s in specs)
            raise GraphError(f"pass {node.name!r} writes targets of different sizes ({listed}); give them one size")
        return sizes.pop()

    def _find(self, spec: TargetSpec) -> None:
        """Find the size of a target, and first the sizes that it depends on."""
        pending = {spec: None}
        while pending:
            last = next(reversed(pending))
            source = self._source(last)
            size = self._known_size(source) if isinstance(source, Target) else source
            if last in self.found:
                pending.popitem()
            elif size is not None:
                self.found[last] = self._checked(_taken(size, last), last)
                self._not_asked[last] = self._why_not_output_size(last, source)
            else:
                assert isinstance(source, Target) and isinstance(source.spec, TargetSpec)
                self._check_lender(source.spec, last, pending)
                pending[source.spec] = None

    def _source(self, spec: TargetSpec) -> Target | tuple[int, int]:
        """Return what a target takes its size from."""
        if isinstance(spec.size, Absolute):
            return spec.size.width, spec.size.height
        if isinstance(spec.size, Like | Blocks):
            return spec.size.other
        if spec.size is None:
            node = self._makers[spec]
            for image in node.images.values() if isinstance(node, PixelPass) else ():
                if not image.is_previous:
                    return image
        if self._output is None:
            raise GraphError("the output's size is not known: give pg.compile(..., size=(width, height))")
        if isinstance(spec.size, Computed):
            where, output = f"target {spec.name!r}", self._output
            return computed_side(spec.size.width, output, where), computed_side(spec.size.height, output, where)
        return self._output

    def _why_not_output_size(self, spec: TargetSpec, source: Target | tuple[int, int]) -> str:
        """Explain why a target's size does not depend on the output's; empty if it does."""
        if isinstance(spec.size, Absolute):
            return f"as target {spec.name!r} is declared"
        if not isinstance(source, Target):
            return ""
        if isinstance(source.spec, InputSpec):
            if self.inputs[source.spec][1] == self._output:
                return ""
            how = "reduced from" if isinstance(spec.size, Blocks) else "the size of"
            return f"{how} input {source.name!r}"
        return self._not_asked.get(source.spec, f"the size of target {source.name!r}")

    def _check_asked(self, size: tuple[int, int], passes: list[Pass]) -> None:
        """Raise an error if no target uses the requested size, or outputs have another one because of an input."""
        specs = {name: target.spec for name, target in self.outputs.items() if isinstance(target.spec, TargetSpec)}
        if any(self.found[spec] == size or not self._not_asked[spec] for spec in specs.values()):
            return
        is_used = any(not reason for reason in self._not_asked.values()) or any(
            value is OUTPUT_SIZE for node in passes for value in sources_of(node.values)
        )
        for name, spec in specs.items():
            reason, (width, height) = self._not_asked[spec], self.found[spec]
            if not is_used or reason.startswith("the size of input"):
                raise GraphError(
                    f"size=({size[0]}, {size[1]}) was requested, but output {name!r} is {width}x{height}, {reason}; "
                    "leave size out, or declare the target with scale=1.0, which takes the requested size"
                )

    def _known_size(self, target: Target) -> tuple[int, int] | None:
        if isinstance(target.spec, InputSpec):
            return self.inputs[target.spec][1]
        if target.spec not in self.found and isinstance(target.spec.size, Absolute):
            return target.spec.size.width, target.spec.size.height
        return self.found.get(target.spec)

    def _check_lender(self, lender: TargetSpec, spec: TargetSpec, pending: Container[TargetSpec]) -> None:
        where = f"pass {self._makers[spec].name!r} takes its size from {lender.name!r}, which"
        if lender not in self._makers:
            raise GraphError(f"{where} no pass before it makes; give that one a size")
        if lender in pending:
            raise GraphError(f"{where} takes its own from {spec.name!r}; give one of the two a size")

    def _checked(self, size: tuple[int, int], spec: TargetSpec) -> tuple[int, int]:
        width, height = size
        total = width * height * spec.format.bytes_per_pixel
        if self.in_windows:
            return size
        if width > MAX_SIDE or height > MAX_SIDE or total > MAX_PICTURE_BYTES:
            raise GraphError(
                f"target {spec.name!r} would be {width}x{height} {spec.format.name} ({total / 2**30:.1f} GiB); "
                f"the limits are {MAX_SIDE} a side and {MAX_PICTURE_BYTES >> 30} GiB"
            )
        return size


def _taken(size: tuple[int, int], spec: TargetSpec) -> tuple[int, int]:
    """Return the size of a target that takes it from a picture of this size."""
    declared = spec.size
    if isinstance(declared, Blocks):
        return declared.each * -(-size[0] // declared.width), -(-size[1] // declared.height)
    across, down = declared.scale if isinstance(declared, Like | Relative) else (1.0, 1.0)
    return max(1, math.ceil(size[0] * across)), max(1, math.ceil(size[1] * down))


def level_sizes(size: tuple[int, int]) -> list[tuple[int, int]]:
    """Return the width and height of every level, starting with the picture itself.

    >>> level_sizes((5, 3))
    [(5, 3), (2, 1), (1, 1)]
    """
    return [(max(1, size[0] >> k), max(1, size[1] >> k)) for k in range(max(size).bit_length())]
