"""A backend that computes each pass in float32 as badly as the standards allow, at random.

Every operation is rounded in a direction of its own, numbers too small to be normal are flushed or not, a
product goes into the sum behind it unrounded or not, quotients and roots are off by what OpenGL and OpenCL
leave them.  Every other lane sees zeros where it compares such numbers, and hands on the numbers themselves, so
that a minimum may be the larger of two.  What the oracle allows must contain all of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from evaluate import COMPUTE, Evaluator
from numpy.typing import NDArray

from passgraph.backends.base import Block, quantised
from passgraph.backends.reference import ReferenceBackend
from passgraph.backends.reference.stage import ReferencePixelPass, SampledImage, Storage
from passgraph.language import scalar as s
from passgraph.language.builtin_name import PIXEL
from passgraph.language.lower import ImageFacts
from passgraph.plan.data import PixelStep

Numbers = NDArray[Any]
SMALLEST_NORMAL = 2.0**-126
#: ULP of float32 that an operation may be off where its standard does not round it correctly.
LOOSE = {"div": 2.5, "sqrt": 3.0}
COMPARED = {"less", "less_equal", "greater", "greater_equal", "equal", "not_equal"}
EXACT: dict[str, Any] = {"add": np.add, "sub": np.subtract, "mul": np.multiply, "div": np.divide, "sqrt": np.sqrt}


def spacing(x: Numbers) -> Numbers:
    """One ULP of float32 at each number of float64."""
    size = np.clip(np.abs(np.nan_to_num(x, nan=0.0)), SMALLEST_NORMAL, 3e38).astype(np.float32)
    return np.spacing(size).astype(np.float64)


class Perturbed(Evaluator):
    """One run of a scalar program, each lane rounded in a way of its own.

    Parameters
    ----------
    directed
        Whether sums and products may round up or down instead of to the nearest (OpenGL names no mode).
    """

    def __init__(self, seed: int, directed: bool, program: s.ScalarProgram, lanes: int, *args: Any, **blocks: Numbers):
        self.random, self.directed = np.random.default_rng(seed), directed
        self.products: dict[int, Numbers] = {}
        super().__init__(program, lanes, *args, **blocks)

    def run(self, i: s.Instruction, active: Numbers) -> None:
        if isinstance(i, s.Op) and i.on == "float" and i.operation in EXACT:
            self.put(i.to, self._computed(i))
        elif isinstance(i, s.Op) and i.on == "float" and i.operation in COMPARED:
            self.put(i.to, COMPUTE[i.operation](*(self._seen(self.get(a)) for a in i.arguments)))
        elif isinstance(i, s.Op) and i.on == "float" and i.operation in ("min", "max"):
            a, b = (self.get(argument) for argument in i.arguments)
            low, high = (a, b) if i.operation == "max" else (b, a)
            self.put(i.to, np.where(self._seen(low) < self._seen(high), b, a))
        else:
            super().run(i, active)

    def _seen(self, x: Numbers) -> Numbers:
        """What a comparison sees, in one way throughout a lane: a device compares in one mode."""
        return np.where((np.abs(x) < SMALLEST_NORMAL) & (np.arange(self.lanes) % 2 == 1), np.float32(0), x)

    def _computed(self, i: s.Op) -> Numbers:
        arguments = [self._read(a, i.operation) for a in i.arguments]
        exact = EXACT[i.operation](*arguments)
        if i.operation == "mul":
            self.products[i.to.id] = exact
        if i.operation in LOOSE:
            off = LOOSE[i.operation] * spacing(exact) * self.random.uniform(-1, 1, self.lanes)
            exact = np.where(np.isfinite(exact) & (exact != 0), exact + off, exact)
        return self._flushed(self._rounded(exact))

    def _read(self, operand: s.Operand, operation: str) -> Numbers:
        value = self._flushed(self.get(operand)).astype(np.float64)
        product = self.products.get(getattr(operand, "id", -1))
        if operation in ("add", "sub") and product is not None:
            return np.where(self.random.random(self.lanes) < 0.5, product, value)
        return value

    def _rounded(self, exact: Numbers) -> Numbers:
        nearest = exact.astype(np.float32)
        if not self.directed:
            return nearest
        way = self.random.integers(-1, 2, self.lanes)
        up = np.where(nearest < exact, np.nextafter(nearest, np.float32(np.inf)), nearest)
        down = np.where(nearest > exact, np.nextafter(nearest, np.float32(-np.inf)), nearest)
        return np.where(way == 0, nearest, np.where(way > 0, up, down))

    def _flushed(self, x: Numbers) -> Numbers:
        tiny = (np.abs(x) < SMALLEST_NORMAL) & (self.random.random(self.lanes) < 0.5)
        return np.where(tiny, np.copysign(np.float32(0), x), x)


class Conforming(ReferenceBackend):
    """Pixel passes are :class:`Perturbed`; draws and copies are the reference's."""

    name = "conforming"

    def __init__(self, seed: int = 0, directed: bool = True) -> None:
        super().__init__()
        self.seed, self.directed = seed, directed

    def pixel_pass(self, step: PixelStep) -> ReferencePixelPass:
        return _PixelPass(step, self)


class _PixelPass(ReferencePixelPass):
    def __init__(self, step: PixelStep, backend: Conforming) -> None:
        super().__init__(step)
        self.backend = backend

    def __call__(self, outputs: Sequence[Storage], images: Sequence[Storage], block: Block) -> None:
        width, height = self.step.size
        y, x = np.divmod(np.arange(width * height), width)
        sampled = {}
        sizes = {}
        for (name, _), storage in zip(self.step.images, images, strict=True):
            facts = replace(self.step.facts.images.get(name, ImageFacts()), decode=None)
            sampled[name] = SampledImage(storage.pixels, facts)
            for axis in (0, 1):
                sizes[f"size.{name}.{axis}"] = np.full(len(x), storage.size[axis])

        def fetch(image: str, dx: Numbers, dy: Numbers) -> Numbers:
            return sampled[image].fetch(dx.astype(np.int64), dy.astype(np.int64)).astype(np.float32)

        program = _absolute(self.step.program)
        run = Perturbed(
            self.backend.seed, self.backend.directed, program, len(x), fetch,
            float=block.floats, int=block.ints, **sizes,
            **{"pixel.0": x, "pixel.1": y, "output_size.0": np.full(len(x), width),
               "output_size.1": np.full(len(x), height)},
        )  # fmt: skip
        for output, values in zip(outputs, run.outputs(), strict=True):
            # What a kernel hands to a unorm target is kept as the nearest step.
            output.flat[...] = quantised(np.stack(values, axis=1), output.format)


def _absolute(program: s.ScalarProgram) -> s.ScalarProgram:
    """Reads relative to the pixel as reads of a place: the evaluator knows no pixel of its own."""
    used = max([v.id for i in s.walk(program.body) for v in s.results_of(i)], default=0)
    used = max([used, *(i.index.id for i in s.walk(program.body) if isinstance(i, s.For))])
    pixel = [s.Val("int", used + 1), s.Val("int", used + 2)]
    count = [used + 2]

    def fresh() -> s.Val:
        count[0] += 1
        return s.Val("int", count[0])

    def body(instructions: tuple[s.Instruction, ...]) -> tuple[s.Instruction, ...]:
        made: list[s.Instruction] = []
        for i in instructions:
            if isinstance(i, s.LoadTexel) and i.relative:
                place = [fresh(), fresh()]
                made += [s.Op(place[k], "add", "int", (pixel[k], (i.x, i.y)[k])) for k in (0, 1)]
                made.append(replace(i, x=place[0], y=place[1], relative=False))
            elif isinstance(i, s.If):
                made.append(replace(i, then=body(i.then), orelse=body(i.orelse)))
            elif isinstance(i, s.For):
                made.append(replace(i, body=body(i.body)))
            else:
                made.append(i)
        return tuple(made)

    loads = tuple(s.LoadBuiltin(pixel[k], PIXEL[k]) for k in (0, 1))
    return replace(program, body=(*loads, *body(program.body)))
