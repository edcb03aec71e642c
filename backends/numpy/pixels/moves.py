"""Copy pictures in memory and convert between formats, with compiled code on all threads.

A copy is a pixel pass that computes nothing: loads decode, stores round.  Channels may be reversed, as in BGR pictures,
and some channels of each pixel may be skipped, as in ``rgba[..., :3]``.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import Block
from passgraph.backends.numpy.machine.workers import Workers, rest_of_page
from passgraph.backends.numpy.pixels.chains import Stage
from passgraph.backends.numpy.pixels.runner import PixelRun
from passgraph.backends.numpy.storage import adopted
from passgraph.formats import Format
from passgraph.language import scalar as s
from passgraph.plan.window import Halo
from passgraph.quantise import convert
from passgraph.records import dataclass

#: NumPy moves smaller pictures faster than compiled code is looked up.
LEAST = 1 << 14
#: Most numbers of a pixel.
MOST_CHANNELS = 4
_NOTHING = Block(np.zeros(1, np.float32), np.zeros(1, np.int32))


@dataclass(frozen=True)
class Move:
    """A step that copies a picture, see :class:`passgraph.plan.data.PixelStep`."""

    program: s.ScalarProgram
    size: tuple[int, int]
    image_formats: tuple[Format]
    output_formats: tuple[Format]
    images: tuple[tuple[str, int]] = (("picture", 0),)
    outputs: tuple[int] = (1,)


@lru_cache(maxsize=8)
def _program(channels: int, channels_held: int, is_reversed: bool) -> s.ScalarProgram:
    """Return ``picture[0, 0]`` with its first ``channels``, in order or reversed."""
    values = tuple(s.Val("float", channel) for channel in range(channels))
    zero, results = s.Lit("int", 0), values[::-1] if is_reversed else values
    load = s.LoadTexel(values, "picture", zero, zero, relative=True, border="clamp")
    use = s.ImageUse("picture", channels_held, relative=True)
    return s.ScalarProgram(
        "move", "pixel", (load,), (s.Output("moved", results, results),), None, (), (), (), (use,), ()
    )


class Moves:
    """Format conversions of one backend; compiled when first needed, by size and formats."""

    def __init__(self, workers: Workers) -> None:
        self.workers = workers
        self._run = lru_cache(maxsize=32)(self._compile)

    def _compile(self, size: tuple[int, int], source: Format, target: Format, is_reversed: bool) -> PixelRun:
        step = Move(_program(target.channels, source.channels, is_reversed), size, (source,), (target,))
        run = PixelRun.compile((Stage(step, Halo(), ()),), self.workers)
        assert run is not None  # a single pass always compiles
        return run

    def __call__(self, source: NDArray[Any], from_format: Format, target: NDArray[Any], to_format: Format) -> None:
        """Convert numbers of one format to another; arrays are (height, width, channels), with any strides."""
        if source.size >= LEAST:
            (one, other), is_reversed = _in_memory_order(source, target)
            pixels = _with_gaps(one)
            source_format = from_format if pixels is one else replace(from_format, channels=pixels.shape[2])
            read, written = adopted(pixels, source_format), adopted(other, to_format)
            if read is not None and written is not None:
                self._run(read.size, source_format, to_format, is_reversed)((written,), ((read,),), (_NOTHING,))
                return
        convert(source, from_format, target, to_format)


def _with_gaps(array: NDArray[Any]) -> NDArray[Any]:
    """Return the array, or for pixels with gaps between them one that includes the gaps as channels."""
    (_, width, channels), item = array.shape, array.itemsize
    together, rest = divmod(array.strides[1], item)
    side_by_side = channels == 1 or array.strides[2] == item
    if width == 1 or rest or not side_by_side or not channels < together <= MOST_CHANNELS:
        return array
    # Memory behind the last pixel must not be used; within its page it may be read.
    end = np.lib.array_utils.byte_bounds(array)[1]
    if rest_of_page(end) < (together - channels) * item:
        return array
    strides = (array.strides[0], array.strides[1], item)
    return np.lib.stride_tricks.as_strided(array, (*array.shape[:2], together), strides, writeable=False)


def _in_memory_order(source: NDArray[Any], target: NDArray[Any]) -> tuple[tuple[NDArray[Any], NDArray[Any]], bool]:
    """Return both with their channels in memory order, and True if one is then the other's reverse."""
    turned = [array.shape[2] > 1 and array.strides[2] < 0 for array in (source, target)]
    one, other = (array[:, :, ::-1] if turn else array for array, turn in zip((source, target), turned, strict=True))
    return (one, other), turned[0] != turned[1]
