"""What runs are given that changes from frame to frame: parameters, and how long a frame lasts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from passgraph.commands.options import flag_of
from passgraph.commands.ramps import TO, Ramp
from passgraph.effects.registry import Effect
from passgraph.errors import GraphError, InputError
from passgraph.frames.flow import Values
from passgraph.frames.frame import Source
from passgraph.frames.pictures import Pictures
from passgraph.graph.values import Value


@dataclass(frozen=True)
class Changing:
    """The parameters of an effect that runs are given: ramps, and the one that says how many seconds a frame lasts."""

    effect: Effect
    ramps: Mapping[str, Ramp]
    frame_time: str | None

    @staticmethod
    def of(effect: Effect, given: dict[str, Any]) -> Changing:
        """What of the given parameters changes, taken out of them; a frame's time that is given stays as it is."""
        time = None if effect.frame_time in given else effect.frame_time
        return Changing(effect, {n: given.pop(n) for n, value in list(given.items()) if isinstance(value, Ramp)}, time)

    def handles(self) -> dict[str, Value]:
        """What stands for them in a graph.

        A frame lasts as long as the effect says where a clip has no rate.
        """
        made = {name: Value(name) for name in self.ramps}
        if self.frame_time is not None:
            made[self.frame_time] = Value(self.frame_time, default=self.effect.parameter(self.frame_time).default)
        return made

    def graph(self, make: Callable[[Mapping[str, Any]], Any]) -> Any:
        """What ``make`` makes with values in the place of what changes."""
        try:
            return make(self.handles())
        except (GraphError, InputError) as error:
            if not self.ramps:
                raise
            flags = " ".join(flag_of(self.effect.parameter(name)) for name in self.ramps)
            raise InputError(
                f"{flags}: cannot change over frames, since {self.effect.name} makes its passes for one value; give one"
            ) from error

    def values(self, source: Source, rate: Fraction | None, others: Mapping[str, Any]) -> Values:
        """What the runs of a clip of so many frames a second are given."""
        known = dict(others)
        if self.frame_time is not None and rate is not None:
            known[self.frame_time] = float(1 / rate)
        if not self.ramps:
            return known
        first, last = self._ends(source)

        def at(number: int) -> dict[str, Any]:
            share = min((number - first) / (last - first), 1.0) if last > first else 0.0
            return known | {name: ramp.at(share) for name, ramp in self.ramps.items()}

        return at

    def _ends(self, source: Source) -> tuple[int, int]:
        """The numbers of a clip's first frame and its last."""
        if isinstance(source, Pictures):
            return min(source.paths), max(source.paths)
        if source.count is None:
            flag = flag_of(self.effect.parameter(next(iter(self.ramps))))
            raise InputError(
                f"{flag} FROM{TO}TO needs to know the last frame, and {source.name} does not say how many there are; "
                "give one value"
            )
        return 1, source.count
