"""A kernel over intervals, with its parameters and pictures, on every path of every lane."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from passgraph.backends.base import Block
from passgraph.backends.reference.interpreter import Interpreter, Numbers, Surroundings
from passgraph.backends.reference.stage import BoundStage, SampledImage, Stage, Storage
from passgraph.language import ir
from passgraph.language.builtin_name import WHOLE_PIXEL, BuiltinName
from passgraph.language.lower import ImageFacts
from passgraph.language.types import component_count
from passgraph.verify.oracle import interval as iv
from passgraph.verify.oracle.decisions import Bounds, Ints, Lanes, Track, explore
from passgraph.verify.oracle.domain import IntervalDomain
from passgraph.verify.oracle.interval import Bounded, Interval
from passgraph.verify.oracle.stored_bounds import loaded
from passgraph.verify.oracle.time_limit import TimeLimit
from passgraph.verify.oracle.watch import Watch, WatchedInterpreter

#: Stage value → a function for its value in all lanes, (lanes or 1, …), called only if the kernel reads it.
Builtins = Mapping[BuiltinName, Callable[[], Bounded]]


class StageOracle:
    """A kernel with the parameters and pictures of one run."""

    def __init__(
        self,
        stage: Stage,
        block: Block,
        names: Sequence[str] = (),
        storages: Sequence[Storage] = (),
        carried: Mapping[int, Interval] | None = None,
        watch: Watch | None = None,
        limit: TimeLimit | None = None,
    ) -> None:
        self.watch, self.limit = watch, limit
        self.bound: BoundStage = stage.bind(block, names, storages)
        self.formats = {name: storage.format for name, storage in zip(names, storages, strict=True)}
        self._whole: dict[str, Interval] = {}
        self._uniforms: dict[str, Bounded] = {}
        #: Images known only by bounds: smallest and largest pixels.
        self.uncertain: dict[str, tuple[SampledImage, SampledImage]] = {}
        for name, storage in zip(names, storages, strict=True):
            if carried and id(storage) in carried and name in stage.program.pictures:
                interval = carried[id(storage)]
                facts = stage.facts.images.get(name, ImageFacts())
                low, high = (x.reshape(storage.pixels.shape).astype(np.float32) for x in (interval.lo, interval.hi))
                self.uncertain[name] = SampledImage(low, facts), SampledImage(high, facts)

    def all_texels(self, image: str) -> Interval:
        """Return the bounds of all texels together, (1, 4)."""
        if image not in self._whole:
            ends = []
            for picture in self.uncertain.get(image, (self.bound.image(image),) * 2):
                ends.append(loaded(picture.everything(), self.formats.get(image), picture.channels))
            low, high = ends[0].lo, ends[1].hi
            nan = np.asarray(ends[0].nan.any(axis=0, keepdims=True))
            self._whole[image] = Interval(np.fmin.reduce(low, keepdims=True), np.fmax.reduce(high, keepdims=True), nan)
        return self._whole[image]

    def uniform(self, expression: ir.Uniform) -> Bounded:
        """Return a parameter, floats as intervals; cached."""
        if expression.name not in self._uniforms:
            value = self.bound.uniform(expression)
            exact = Interval.as_read(value.astype(np.float32)) if value.dtype.kind == "f" else value
            self._uniforms[expression.name] = exact
        return self._uniforms[expression.name]

    def bounds(self, count: int, builtins: Builtins, pixels: Ints | None = None, first_only: bool = False) -> Bounds:
        """Return the bounds of every result in every lane; the watch gets the pixel of each lane.

        ``first_only``: bounds of the first path only, as a watch needs.
        """
        pixels = np.arange(count) if pixels is None else pixels
        known_builtins: dict[BuiltinName, Bounded] = {}

        def builtin(name: BuiltinName) -> Bounded:
            if name not in known_builtins:
                known_builtins[name] = builtins[name]()
            return known_builtins[name]

        program = self.bound.program
        sizes = [component_count(result.type) for result in program.results]

        def run(track: Track) -> tuple[list[Interval], Lanes | None]:
            domain = IntervalDomain(track, self.bound.facts.native)
            around = _Around(self, builtin, domain)
            interpreter: Interpreter[Bounded, Lanes] = Interpreter(program, domain, around)
            if self.watch is not None and track.forced.shape[1] == 0:  # the first path of each lane
                interpreter = WatchedInterpreter(program, domain, around, self.watch, pixels)
            values, keep = interpreter.run()
            results = []
            for result, size in zip(program.results, sizes, strict=True):
                value = values[result.name]
                value = value if isinstance(value, Interval) else Interval.point(value)
                results.append(_in_lanes(value, len(track.lanes), size))
            # A condition shared by all lanes depends on none of them.
            always = keep is None or (len(keep) == 1 and bool(np.asarray(keep)[0]))
            return results, None if always else np.broadcast_to(np.asarray(keep), (len(track.lanes),))

        with np.errstate(all="ignore"):
            return explore(run, count, sizes, self.limit, first_only)


def _in_lanes(value: Interval, count: int, components: int) -> Interval:
    return value.map(lambda x: np.broadcast_to(x.reshape(len(x), -1), (count, components)))


class _Around(Surroundings[Bounded]):
    """The inputs of some of the lanes."""

    def __init__(self, oracle: StageOracle, builtin: Callable[[BuiltinName], Bounded], domain: IntervalDomain) -> None:
        self.oracle, self.builtin_of_all, self.domain = oracle, builtin, domain

    def uniform(self, expression: ir.Uniform) -> Bounded:
        return self.oracle.uniform(expression)

    def builtin(self, expression: ir.Builtin) -> Bounded:
        return self._builtin(expression.key)

    def _builtin(self, name: BuiltinName) -> Bounded:
        value = self.builtin_of_all(name)
        if len(value) == 1:
            return value
        lanes = self.domain.track.lanes
        return value.take(lanes) if isinstance(value, Interval) else value[lanes]

    def texel(self, image: str, x: Bounded, y: Bounded, relative: bool) -> Bounded:
        assert not isinstance(x, Interval)
        assert not isinstance(y, Interval)
        if relative:
            pixel = self._builtin(WHOLE_PIXEL)
            assert not isinstance(pixel, Interval)
            x, y = x + pixel[:, 0], y + pixel[:, 1]
        read = self._read(image, x, y)
        vague = self.domain.track.vague
        return iv.where(vague[:, None], self.oracle.all_texels(image), read) if vague.any() else read

    def _read(self, image: str, x: Numbers, y: Numbers) -> Interval:
        if image in self.oracle.uncertain:
            low, high = (picture.fetch(x, y) for picture in self.oracle.uncertain[image])
            return Interval(low, high, np.zeros(low.shape, np.bool_))
        picture = self.oracle.bound.image(image)
        return loaded(picture.fetch(x, y), self.oracle.formats.get(image), picture.channels)

    def property(self, image: str, name: str) -> ir.Number:
        return self.oracle.bound.facts.images.get(image, ImageFacts()).property(name)

    def size(self, image: str) -> Bounded:
        return self.oracle.bound.size(image)
