"""A kernel over many lanes: its parameters, the pictures that it reads, and quantization of its results."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import Block, quantised
from passgraph.backends.reference.interpreter import Interpreter, Lanes, NumberDomain, Numbers, Surroundings, shaped
from passgraph.formats import Format
from passgraph.language import ir
from passgraph.language.borders import BORDERS, border_place
from passgraph.language.builtin_name import OTHER_PIXELS, WHOLE_PIXEL, WHOLE_SIZE, BuiltinName
from passgraph.language.facts import Facts, ImageFacts
from passgraph.language.long_arrays import numbers_in
from passgraph.language.scalar import ScalarProgram, UniformSlot
from passgraph.language.scope import host_numbers
from passgraph.language.types import Array, component_count, shape_of
from passgraph.plan.data import PixelStep
from passgraph.srgb import linear_to_srgb, srgb_to_linear

Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]


@dataclass(eq=False)
class Storage:
    """A picture as stored: (height, width, channels) float32 with row 0 on top.

    ``stencil`` is (height, width) bytes, for formats that have one.
    """

    format: Format
    size: tuple[int, int]
    pixels: Float32
    stencil: NDArray[np.uint8] | None = None

    @classmethod
    def make(cls, format_: Format, size: tuple[int, int]) -> Storage:
        width, height = size
        stencil = np.zeros((height, width), np.uint8) if format_.stencil else None
        return cls(format_, size, np.zeros((height, width, format_.channels), np.float32), stencil)

    @property
    def flat(self) -> Float32:
        """Return the pixels row by row, (pixels, channels): a view."""
        return self.pixels.reshape(-1, self.format.channels)


def encode_srgb(linear: NDArray[Any]) -> Float64:
    """Encode linear values of [0, 1] in float64; others are clamped."""
    return linear_to_srgb(np.clip(np.asarray(linear, np.float64), 0.0, 1.0))


def decode_srgb(encoded: NDArray[Any]) -> Float64:
    """Decode sRGB values in float64."""
    return srgb_to_linear(np.asarray(encoded, np.float64))


def stored(format_: Format, values: NDArray[Any]) -> Float32:
    """Quantize a kernel's result (…, channels) to a target's format; sRGB formats hold encoded color."""
    if format_.srgb:
        values = np.concatenate([encode_srgb(values[..., :3]), values[..., 3:]], axis=-1)
    return quantised(values, format_)


Ints = NDArray[np.int64]

#: Values of channels that a picture lacks.
MISSING = (0.0, 0.0, 0.0, 1.0)


class SampledImage:
    """A stored picture (height, width, channels) as one pass reads it."""

    def __init__(self, pixels: Float32, facts: ImageFacts) -> None:
        self.height, self.width, self.channels = pixels.shape
        self.border = facts.border
        self.texels: NDArray[Any] = pixels.reshape(-1, self.channels)
        if facts.decode is not None:
            # Decoded once for all reads; 0 decodes to 0, so the order with the border rule does not matter.
            colour = decode_srgb(self.texels[:, :3])
            self.texels = np.concatenate([colour, self.texels[:, 3:]], axis=1)

    def fetch(self, x: Ints, y: Ints) -> NDArray[np.float64]:
        """Return texels at integer positions, (lanes, 4) float64."""
        place = border_place(self.border, y, self.height) * self.width + border_place(self.border, x, self.width)
        result = np.empty((len(place), 4), np.float64)
        result[:, : self.channels] = self.texels[place]
        result[:, self.channels :] = MISSING[self.channels :]
        if BORDERS[self.border].blank:
            outside = (x < 0) | (x >= self.width) | (y < 0) | (y >= self.height)
            result[np.broadcast_to(outside, place.shape), : self.channels] = 0.0
        return result

    def everything(self) -> NDArray[np.float64]:
        """Return all possible results of a read, one per row."""
        inside = self.fetch(*np.divmod(np.arange(self.width * self.height), self.width)[::-1])
        outside = self.fetch(np.array([-1]), np.array([-1]))
        return np.concatenate([inside, outside])


def blank_image() -> SampledImage:
    """Return a substitute for an image that only dead code reads."""
    return SampledImage(np.zeros((1, 1, 4), np.float32), ImageFacts())


#: Lanes computed at once, so that temporaries of a wide kernel stay in the tens of megabytes.
LANES = 1 << 16

#: Stage value → function that computes it for all lanes, called only if the kernel reads it.
Builtins = Mapping[BuiltinName, Callable[[], Numbers]]


Made = TypeVar("Made")


def constant(value: NDArray[Any]) -> Callable[[], Numbers]:
    """Return a stage value that is already known."""
    return lambda: value


def on_quads(
    builtins_of: Callable[[str], Mapping[BuiltinName, Callable[[], Made]]],
) -> dict[BuiltinName, Callable[[], Made]]:
    """Return the builtins of a draw at every pixel of a quad; ``builtins_of`` returns those at one pixel, by axes.

    It is called for another pixel only if a kernel reads there.
    """
    at = cache(builtins_of)

    def value_at(axes: str, name: BuiltinName) -> Made:
        return at(axes)[name]()

    own = at("")
    at_neighbors = {name.at(axes): partial(value_at, axes, name) for axes in OTHER_PIXELS for name in own}
    return {**own, **at_neighbors}


class Stage:
    """A kernel, its facts from the graph, and the layout of its parameters."""

    def __init__(self, program: ir.TypedKernel, scalar: ScalarProgram, facts: Facts) -> None:
        self.program, self.facts = program, facts
        self.domain = NumberDomain()
        self.slots: dict[str, UniformSlot] = {str(slot.name): slot for slot in scalar.uniforms}
        #: Long array parameters, which are stored in pictures.
        self.long = {name for name, _, _ in scalar.buffers}

    def bind(self, block: Block, names: Sequence[str] = (), storages: Sequence[Storage] = ()) -> BoundStage:
        """Bind the parameters and pictures of one run."""
        pictures = dict(zip(names, storages, strict=True))
        images = {
            name: SampledImage(storage.pixels, self.facts.images.get(name, ImageFacts()))
            for name, storage in pictures.items()
            if name in self.program.pictures
        }
        arrays = {name: storage for name, storage in pictures.items() if name in self.long}
        return BoundStage(self, block, images, arrays)


class BoundStage:
    """A stage ready to run over lanes; uniform values are read once."""

    def __init__(
        self, stage: Stage, block: Block, images: dict[str, SampledImage], arrays: Mapping[str, Storage]
    ) -> None:
        self.arrays = arrays
        self.program, self.images, self.domain = stage.program, images, stage.domain
        self.facts, self.slots, self.block = stage.facts, stage.slots, block
        self._uniforms: dict[str, Numbers] = {}

    @property
    def read(self) -> dict[str, Numbers]:
        """Return the parameters that were read, by name."""
        return dict(self._uniforms)

    def image(self, name: str) -> SampledImage:
        if name not in self.images:
            self.images[name] = blank_image()
        return self.images[name]

    def size(self, name: str) -> Numbers:
        """Return the size of an image.  One that is not bound has a known size, or only dead code reads it."""
        picture = self.image(name)
        known = self.facts.images.get(name, ImageFacts()).size
        return np.array([known or (picture.width, picture.height)], np.int64)

    def uniform(self, expression: ir.Uniform) -> Numbers:
        if expression.name not in self._uniforms:
            read = self._constant if expression.const else self._parameter
            self._uniforms[expression.name] = read(expression)
        return self._uniforms[expression.name]

    def _constant(self, expression: ir.Uniform) -> Numbers:
        parameter = next(p for p in self.program.parameters if p.name == expression.name)
        value = self.facts.constants.get(expression.name, parameter.default)
        where = f"{self.program.name}({expression.name})"
        return shaped(host_numbers(value, expression.type, where, parameter.span), expression.type)

    def _parameter(self, expression: ir.Uniform) -> Numbers:
        if expression.name in self.arrays:
            array = cast(Array, expression.type)
            return shaped(numbers_in(self.arrays[expression.name].pixels, array), array)
        slot = self.slots.get(expression.name)
        if slot is None:
            # Only dead code reads it, so any value will do.
            return shaped(np.zeros(component_count(expression.type)), expression.type)
        block: NDArray[Any] = self.block.floats if slot.block == "float" else self.block.ints
        return shaped(block[slot.offset : slot.offset + slot.count], expression.type)

    def run(
        self, count: int, builtins: Builtins, make: Callable[..., Interpreter[Numbers, Lanes]] = Interpreter
    ) -> tuple[list[Numbers], NDArray[np.bool_] | None]:
        """Return results as (count, …) arrays, and the mask of kept lanes (None: all).  ``make`` creates the
        interpreter."""
        with np.errstate(all="ignore"):
            interpreter = make(self.program, self.domain, _Lanes(self, builtins))
            values, keep = interpreter.run()
        results = []
        for result in self.program.results:
            shape = (count, *shape_of(result.type))
            results.append(np.broadcast_to(values[result.name], shape))
        return results, None if keep is None else np.broadcast_to(keep, (count,))


class _Lanes(Surroundings[Numbers]):
    """The inputs of one batch of lanes."""

    def __init__(self, bound: BoundStage, builtins: Builtins) -> None:
        self.bound, self.builtins = bound, builtins
        self._made: dict[BuiltinName, Numbers] = {}

    def uniform(self, expression: ir.Uniform) -> Numbers:
        return self.bound.uniform(expression)

    def builtin(self, expression: ir.Builtin) -> Numbers:
        return self._builtin(expression.key)

    def _builtin(self, name: BuiltinName) -> Numbers:
        if name not in self._made:
            self._made[name] = self.builtins[name]()
        return self._made[name]

    def texel(self, image: str, x: Numbers, y: Numbers, relative: bool) -> Numbers:
        if relative:
            pixel = self._builtin(WHOLE_PIXEL)
            x, y = x + pixel[:, 0], y + pixel[:, 1]
        return self.bound.image(image).fetch(x, y)

    def property(self, image: str, name: str) -> ir.Number:
        return self.bound.facts.images.get(image, ImageFacts()).property(name)

    def size(self, image: str) -> Numbers:
        return self.bound.size(image)


class ReferencePixelPass:
    """A pixel pass, interpreted."""

    def __init__(self, step: PixelStep) -> None:
        self.step = step
        self.stage = Stage(step.source.kernel.program, step.program, step.facts)

    def __call__(self, outputs: Sequence[Storage], images: Sequence[Storage], block: Block) -> None:
        width, height = self.step.size
        bound = self.stage.bind(block, [name for name, _ in self.step.images], images)
        for first in range(0, width * height, LANES):
            lanes = np.arange(first, min(first + LANES, width * height))
            pixel = np.stack([lanes % width, lanes // width], axis=1)
            size = np.array([[width, height]], np.int64)
            results, _ = bound.run(len(lanes), {WHOLE_PIXEL: constant(pixel), WHOLE_SIZE: constant(size)})
            for output, values in zip(outputs, results, strict=True):
                output.flat[lanes] = stored(output.format, values.reshape(len(lanes), -1))
