"""Mipmaps: passes that compute the smaller levels of pictures whose handles have ``mipmaps()``.

Level ``k`` has half the sides of the one before, rounded down, at least 1; the last one is a single texel.  A texel is
the mean over the area that it covers: 2 texels each way, or 3 where a side was odd.  Kernels read all levels from 1 on
in one picture, which stores them one below another (:func:`first_row`), so backends need no support for mipmaps.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from passgraph.formats import FORMATS, Format
from passgraph.graph.calls import PixelKernel, kernel
from passgraph.graph.targets import Absolute, Pass, Target, TargetSpec
from passgraph.language.ir import MIPS
from passgraph.plan.draft import Draft, Lowered, Sized
from passgraph.plan.sizes import level_sizes
from passgraph.plan.specialize import LongArrays, specialized

#: A side of even length is halved by means of two texels; a side of odd length 2m + 1 by m means of three, with weights
#: after Guthe and Heckbert, "Non-Power-of-Two Mipmapping" (NVIDIA, 2005).  A weight of 0 would turn an infinite
#: neighbor into NaN, so for even sides the second texel is read twice.
_HALVED = """
def weights(count: int, i: int) -> vec3:
    half = count // 2
    odd = vec3(float(half - i), float(half), float(i + 1)) / float(count)
    return odd if count % 2 == 1 and count > 1 else vec3(0.5, 0.25, 0.25)

def row(finer: Image, p: ivec2, last: int, across: vec3) -> vec4:
    near = finer.texel(p) * across.x + finer.texel(p + ivec2(1, 0)) * across.y
    return near + finer.texel(p + ivec2(last, 0)) * across.z

def halved(finer: Image) -> {result}:
    p, size = pixel(), finer.size
    across, down = weights(size.x, p.x), weights(size.y, p.y)
    last = ivec2(1) + size % ivec2(2)
    top, middle = row(finer, 2 * p, last.x, across), row(finer, 2 * p + ivec2(0, 1), last.x, across)
    bottom = row(finer, 2 * p + ivec2(0, last.y), last.x, across)
    return (top * down.x + middle * down.y + bottom * down.z){swizzle}
"""


def first_row(height: int, level: int) -> int:
    """Return the row at which a level begins in the picture of levels, from 1 on.

    >>> [first_row(5, level) for level in (1, 2, 3)]
    [0, 4, 6]
    """
    return height - (height >> (level - 1)) + level - 1


def add_levels(draft: Draft) -> Draft:
    """Return the draft with the passes of every picture whose smaller levels are read, before their first readers."""
    return _Levels(draft).added()


class _Levels:
    """The passes of a draft, and those of levels among them."""

    def __init__(self, draft: Draft) -> None:
        self.sizes = dict(draft.sizes)
        self.draft = replace(draft, sizes=self.sizes)
        self.passes: dict[Pass, Lowered] = {}
        self.notes = list(draft.notes)
        self.pictures: dict[Target, Target] = {}

    def added(self) -> Draft:
        for lowered in self.draft.passes.values():
            images = dict(lowered.images)
            of_levels = {name + MIPS for name in lowered.node.images}
            for name, target in lowered.images.items():
                # With a single level, dead code may still refer to others.
                if name in of_levels and target.has_levels and max(self.draft.size_of(target)) > 1:
                    if target.content not in self.pictures:
                        self.pictures[target.content] = self._levels(target)
                    images[name] = self.pictures[target.content].border(target.border_rule)
            self._add(replace(lowered, images=images))
        return replace(self.draft, passes=self.passes, notes=tuple(self.notes))

    def _add(self, lowered: Lowered) -> None:
        self.passes[lowered.node] = replace(lowered, index=len(self.passes))

    def _levels(self, target: Target) -> Target:
        """Return the picture of a content's levels, and add the passes that make it."""
        sizes, smaller = level_sizes(self.draft.size_of(target)), target.content
        format_ = self.draft.format_of(target)
        format_ = FORMATS["r32f"] if format_.is_depth else format_
        levels = []
        for number, size in enumerate(sizes[1:], 1):
            smaller = self._pass(_halving(format_.channels), [smaller], f"{target.name} level {number}", format_, size)
            levels.append(smaller)
        self.notes.append(f"{len(levels)} smaller levels of {target.name} are computed, down to 1x1")
        if len(levels) == 1:
            return smaller
        rows = [first_row(sizes[0][1], number) for number in range(1, len(sizes))]
        size = sizes[1][0], rows[-1] + sizes[-1][1]
        stacking = _stacking(len(levels), format_.channels)
        return self._pass(stacking, levels, f"{target.name} levels", format_, size, rows)

    def _pass(
        self, kernel: PixelKernel[Target], images: list[Target], name: str, format_: Format, size: tuple[int, int],
        *values: object,
    ) -> Target:  # fmt: skip
        spec = TargetSpec(name, format_, Absolute(*size))
        target = kernel(*images, *values, into=spec, name=name)
        self.sizes[spec] = size
        assert target.made_by is not None
        self._add(specialized(Sized(target.made_by, size, 0), self.draft, LongArrays(), self.notes))
        return target


@cache
def _halving(channels: int) -> PixelKernel[Target]:
    return kernel(source=_HALVED.format(result=_result(channels), swizzle=_swizzle(channels)), name="halved")


@cache
def _stacking(count: int, channels: int) -> PixelKernel[Target]:
    """Return a kernel that stores levels one below another; the rest of the picture is never read."""
    images = ", ".join(f"level{k}: Image" for k in range(count))
    reads = "".join(
        f"    if p.y < rows[{k + 1}]:\n        return level{k}.texel(p - ivec2(0, rows[{k}])){_swizzle(channels)}\n"
        for k in range(count - 1)
    )
    last = f"    return level{count - 1}.texel(p - ivec2(0, rows[{count - 1}])){_swizzle(channels)}\n"
    head = f"def stacked({images}, rows: Array[int, {count}]) -> {_result(channels)}:\n    p = pixel()\n"
    return kernel(source=head + reads + last)


def _result(channels: int) -> str:
    return "float" if channels == 1 else f"vec{channels}"


def _swizzle(channels: int) -> str:
    return "." + "rgba"[:channels]
