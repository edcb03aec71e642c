"""Reductions of pictures larger than memory: partial results of blocks of 64x64 pixels, merged in one order.

The blocks begin at the picture's corner, and levels of eights join them as `passgraph.reduce` does on devices.  So the
result has the same bits, whatever the tiles.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from passgraph.graph.calls import kernel
from passgraph.graph.reductions import (
    BOTH,
    MAX,
    MIN,
    SIDE,
    SUM,
    count_of_bin,
    mean,
    mean_one,
    mean_two,
    reduce_level,
    reduced,
    reduced_one,
    reduced_two,
)
from passgraph.graph.targets import Blocks, CountPass, InputSpec, Pass, PixelPass, Target
from passgraph.plan.dependencies import passes_behind
from passgraph.plan.replaced import with_inputs
from passgraph.tiles.grid import Convert, Numbers, Part, pieces
from passgraph.tiles.sinks import Sink

#: Side of the blocks of partial results: two levels.
BLOCK = SIDE * SIDE
#: Operator → function of two arrays, and its neutral element; NaN is never the least nor the largest.
_OPERATORS = {SUM: (np.add, 0.0), MIN: (np.fmin, np.inf), MAX: (np.fmax, -np.inf)}
_MEANS, _LAST = (mean_one, mean_two, mean), (reduced_one, reduced_two, reduced)


@dataclass(frozen=True)
class Merging:
    """The arithmetic of a reduction, which workers of a cluster get.

    Attributes
    ----------
    how : SUM, MIN or MAX; None for a histogram of numbers of bins
    channels : of the result
    is_mean : the sum is divided by the number of texels
    bins : of a histogram
    """

    how: int | None
    channels: int
    is_mean: bool = False
    bins: int = 0

    def partial(self, values: Numbers) -> Numbers:
        """Return the partial results of a part that begins at a block's corner: (rows, columns, channels) of blocks."""
        if self.how is None:
            counts = np.bincount(values.reshape(-1).astype(np.int64), minlength=self.bins + 1)
            return counts[None, None, 1:]
        # Missing channels read as 0, 0, 1.
        missing = np.array([0.0, 0.0, 0.0, 1.0], np.float32)[values.shape[2] : self.channels]
        full = np.broadcast_to(missing, (*values.shape[:2], len(missing)))
        values = np.concatenate([values, full], axis=2) if len(missing) else values[..., : self.channels]
        return _level(_level(values.astype(np.float32, copy=False), self.how), self.how)

    def merged(self, partials: Numbers, size: tuple[int, int]) -> Numbers:
        """Return the result's picture from all blocks of a picture of (width, height)."""
        if self.how is None:
            counts: Numbers = partials.sum(axis=(0, 1))[None, :, None].astype(np.float32)
            return counts
        while max(partials.shape[:2]) > 1:
            partials = _level(partials, self.how)
        count = np.float32(size[0]) * np.float32(size[1])
        result: Numbers = partials / count if self.is_mean else partials
        return result


@dataclass(frozen=True)
class Reduction:
    """A reduction of a whole picture, in a graph.

    Attributes
    ----------
    source : the picture that tiles compute: that which is reduced, or the number of each texel's bin
    result : the target of the reduction: 1x1 pixels, or one pixel a bin
    """

    source: Target
    result: Target
    merging: Merging

    def input(self) -> InputSpec:
        """Return the input that replaces the result."""
        size = (self.merging.bins or 1, 1)
        return InputSpec(f"{self.result.name} of all tiles", self.result.spec.format, size, static=True)


def _level(values: Numbers, how: int) -> Numbers:
    """Reduce blocks of 8x8: eights of a row pairwise, then the rows in sequence."""
    join, neutral = _OPERATORS[how]
    height, width, channels = values.shape
    padding = (0, -height % SIDE), (0, -width % SIDE), (0, 0)
    line = np.pad(values, padding, constant_values=neutral).reshape(
        -(-height // SIDE), SIDE, -(-width // SIDE), SIDE, channels
    )
    while line.shape[3] > 1:
        line = join(line[:, :, :, ::2], line[:, :, :, 1::2])
    total = np.full_like(line[:, 0, :, 0], neutral)
    for row in range(SIDE):
        total = join(total, line[:, row, :, 0])
    return total


class PartialSink(Sink):
    """A sink of tiles that keeps the partial results of reductions of one picture."""

    block = (BLOCK, BLOCK)
    dtype = np.dtype(np.float32)

    def __init__(self, reductions: list[Reduction], size: tuple[int, int]) -> None:
        self.size = size
        across, down = -(-size[0] // BLOCK), -(-size[1] // BLOCK)
        self._partials = {
            one: np.zeros((1, 1, one.merging.bins), np.int64) if one.merging.how is None
            else np.zeros((down, across, one.merging.channels), np.float32)
            for one in reductions
        }  # fmt: skip

    def write(self, part: Part, picture: Convert) -> None:
        for piece in pieces(part, self.block):
            values = picture(piece)
            for reduction, partials in self._partials.items():
                found = reduction.merging.partial(values)
                if reduction.merging.how is None:
                    partials += found
                else:
                    y, x = piece[0] // BLOCK, piece[2] // BLOCK
                    partials[y : y + len(found), x : x + found.shape[1]] = found

    def results(self) -> Iterator[tuple[Reduction, Numbers]]:
        """Yield each reduction with its result, after the last tile."""
        for reduction, partials in self._partials.items():
            yield reduction, reduction.merging.merged(partials, self.size)


def reductions_of(outputs: Mapping[str, Target]) -> list[Reduction]:
    """Return the reductions of whole pictures that depend on no other one."""
    found: list[Reduction] = []
    dependent: set[Pass] = set()
    for node in passes_behind(list(outputs.values())):
        makers = {target.made_by for target in node.reads}
        if makers & dependent:
            dependent.add(node)
        elif (reduction := _reduction_by(node)) is not None:
            found.append(reduction)
            dependent.add(node)
    return found


def _is(target: Target | Pass | None, *kernels: object) -> bool:
    """Return True for a pass, or the target of one, that runs one of some kernels, also of a graph that was sent."""
    node = target.made_by if isinstance(target, Target) else target
    bodies = [(one.program.body, one.program.results) for one in kernels]  # type: ignore[attr-defined]
    return isinstance(node, PixelPass) and (node.kernel.program.body, node.kernel.program.results) in bodies


def _reduction_by(node: Pass) -> Reduction | None:
    """Return the reduction whose last pass this is."""
    if not isinstance(node, PixelPass) or not _is(node, *_LAST, *_MEANS):
        return None
    top, result, channels = node.images["top"], Target(node.into[0], node), node.into[0].format.channels
    if _is(top, count_of_bin):
        assert isinstance(top.made_by, PixelPass)
        counts = _bottom(top.made_by.images["counts"])
        size = top.made_by.into[0].size
        if counts is None or not isinstance(counts.made_by, CountPass) or not isinstance(size, Blocks):
            return None
        return Reduction(counts.made_by.images["numbers"], result, Merging(None, 1, bins=size.each))
    source = _bottom(top)
    if source is None:
        return None
    constants = top.made_by.constants  # type: ignore[union-attr]
    if constants["over"] != BOTH or constants["how"] not in _OPERATORS:
        return None
    return Reduction(source, result, Merging(int(constants["how"]), channels, _is(node, *_MEANS)))


def _bottom(top: Target) -> Target | None:
    """Return the picture that levels reduce; None if it is made by none."""
    if not _is(top, reduce_level):
        return None
    while _is(top, reduce_level):
        assert isinstance(top.made_by, PixelPass)
        top = top.made_by.images["image"]
    return top


#: Yields the results of reductions: those of some targets, all by name; given the results of earlier ones.
Compute = Callable[[dict[str, Target], dict[str, list[Reduction]], dict[str, Any]], Iterator[tuple[Reduction, Any]]]


def resolved(outputs: Mapping[str, Target], compute: Compute) -> tuple[dict[str, Target], dict[str, Any]]:
    """Compute a graph's reductions first; return its outputs with inputs in their place, and these inputs' pictures.

    Reductions that depend on others follow in a further call of ``compute``.
    """
    pictures: dict[str, Any] = {}
    found = dict(outputs)
    while reductions := reductions_of(found):
        by_source: dict[Target, list[Reduction]] = {}
        for reduction in reductions:
            by_source.setdefault(reduction.source.content, []).append(reduction)
        named = {f"reduced {number}": source for number, source in enumerate(by_source)}
        sources = {name: _passed(source, name) for name, source in named.items()}
        inputs, computed = {}, {}
        of_source = {name: by_source[source] for name, source in named.items()}
        for reduction, picture in compute(sources, of_source, pictures):
            inputs[reduction.result.content] = spec = reduction.input()
            computed[spec.name] = picture
        pictures |= computed
        found = with_inputs(found, inputs)
    return found, pictures


def _passed(source: Target, name: str) -> Target:
    """Return a target that a pass makes; an input gets a pass that copies it."""
    if source.made_by is not None:
        return source
    copied: Target = kernel(source="def unchanged(color: Image) -> vec4: return color[0, 0]")(source, name=name)
    return copied
