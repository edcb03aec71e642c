"""Runs one stage of a step: a kernel with its parameters and pictures, over many lanes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import Block
from passgraph.backends.reference.domain import Surroundings
from passgraph.backends.reference.images import SampledImage, blank_image
from passgraph.backends.reference.interpreter import Interpreter
from passgraph.backends.reference.number_domain import Lanes, NumberDomain, Numbers, shaped
from passgraph.backends.reference.storage import Storage
from passgraph.language import ir
from passgraph.language.buffers import numbers_in
from passgraph.language.lower import Facts, ImageFacts
from passgraph.language.scalar import ScalarProgram, UniformSlot
from passgraph.language.scope import host_numbers
from passgraph.language.types import Array, component_count, shape_of

#: Lanes computed at once: temporaries of a wide kernel then stay in the tens of megabytes.
LANES = 1 << 16

#: Stage value → how to compute it for all lanes, asked only where the kernel reads it.
Builtins = Mapping[str, Callable[[], Numbers]]


Made = TypeVar("Made")


def given(value: NDArray[Any]) -> Callable[[], Numbers]:
    """A stage value that is known already."""
    return lambda: value


def on_quads(of: Callable[[str], Mapping[str, Callable[[], Made]]]) -> dict[str, Callable[[], Made]]:
    """What a draw's triangles hand in at every pixel of a quad; ``of`` says what they do at one, named by its axes.

    It is asked for another pixel only where a kernel reads there.
    """
    at = cache(of)

    def asked(axes: str, name: str) -> Made:
        return at(axes)[name]()

    own = at("")
    beside = {ir.other_pixel(name, axes): partial(asked, axes, name) for axes in ir.OTHER_PIXELS for name in own}
    return {**own, **beside}


class Stage:
    """A kernel, what the graph knows about it, and where its parameters lie."""

    def __init__(self, program: ir.TypedKernel, scalar: ScalarProgram, facts: Facts) -> None:
        self.program, self.facts = program, facts
        self.domain = NumberDomain()
        self.slots: dict[str, UniformSlot] = {slot.name: slot for slot in scalar.uniforms}
        #: Parameters that are long arrays and lie in pictures.
        self.long = {name for name, _ in scalar.buffers}

    def bind(self, block: Block, names: Sequence[str] = (), storages: Sequence[Storage] = ()) -> BoundStage:
        """With the parameters and pictures of one run."""
        given = dict(zip(names, storages, strict=True))
        images = {
            name: SampledImage(storage.pixels, self.facts.images.get(name, ImageFacts()))
            for name, storage in given.items()
            if name in self.program.pictures
        }
        arrays = {name: storage for name, storage in given.items() if name in self.long}
        return BoundStage(self, block, images, arrays)


class BoundStage:
    """A stage ready to run over lanes; values that all lanes share are read once."""

    def __init__(
        self, stage: Stage, block: Block, images: dict[str, SampledImage], arrays: Mapping[str, Storage]
    ) -> None:
        self.arrays = arrays
        self.program, self.images, self.domain = stage.program, images, stage.domain
        self.facts, self.slots, self.block = stage.facts, stage.slots, block
        self._uniforms: dict[str, Numbers] = {}

    @property
    def read(self) -> dict[str, Numbers]:
        """Parameters that were read, by name."""
        return dict(self._uniforms)

    def image(self, name: str) -> SampledImage:
        if name not in self.images:
            self.images[name] = blank_image()
        return self.images[name]

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
            # Lowering met it in no code that can run, so any value will do.
            return shaped(np.zeros(component_count(expression.type)), expression.type)
        block: NDArray[Any] = self.block.floats if slot.block == "float" else self.block.ints
        return shaped(block[slot.offset : slot.offset + slot.count], expression.type)

    def run(
        self, count: int, builtins: Builtins, make: Callable[..., Interpreter[Numbers, Lanes]] = Interpreter
    ) -> tuple[list[Numbers], NDArray[np.bool_] | None]:
        """Results as (count, …) arrays, and which lanes are kept (None: all).  ``make`` is what interprets."""
        with np.errstate(all="ignore"):
            interpreter = make(self.program, self.domain, _Lanes(self, builtins))
            values, keep = interpreter.run()
        results = []
        for result in self.program.results:
            shape = (count, *shape_of(result.type))
            results.append(np.broadcast_to(values[result.name], shape))
        return results, None if keep is None else np.broadcast_to(keep, (count,))


class _Lanes(Surroundings[Numbers]):
    """What one batch of lanes sees."""

    def __init__(self, bound: BoundStage, builtins: Builtins) -> None:
        self.bound, self.builtins = bound, builtins
        self._made: dict[str, Numbers] = {}

    def uniform(self, expression: ir.Uniform) -> Numbers:
        return self.bound.uniform(expression)

    def builtin(self, expression: ir.Builtin) -> Numbers:
        return self._builtin(expression.name)

    def _builtin(self, name: str) -> Numbers:
        if name not in self._made:
            self._made[name] = self.builtins[name]()
        return self._made[name]

    def texel(self, image: str, x: Numbers, y: Numbers, relative: bool) -> Numbers:
        if relative:
            pixel = self._builtin("pixel")
            x, y = x + pixel[:, 0], y + pixel[:, 1]
        return self.bound.image(image).fetch(x, y)

    def property(self, image: str, name: str) -> ir.Number:
        return self.bound.facts.images.get(image, ImageFacts()).property(name)

    def size(self, image: str) -> Numbers:
        picture = self.bound.image(image)
        return np.array([[picture.width, picture.height]], np.int64)
