"""Parameters that change over frames: ``--progress 0..1`` on the command line, and their value at each frame."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any

import click

from passgraph.commands.input_values import written_value
from passgraph.commands.options import EffectOption, flag_of
from passgraph.effects.effect_table import Effect
from passgraph.errors import GraphError, InputError
from passgraph.files.flow import Values
from passgraph.files.frame import Source
from passgraph.files.sequences import Pictures
from passgraph.graph.run_values import Value
from passgraph.language.types import BOOL, element_of
from passgraph.records import dataclass

#: Separator of the first and the last value of a ramp.
TO = ".."


@dataclass(frozen=True)
class Ramp:
    """A parameter that changes linearly from a value at a clip's first frame to another at its last."""

    first: Any
    last: Any

    def at(self, share: float) -> Any:
        """Return the value at a share of the ramp; integers are rounded.

        >>> Ramp(0.0, 2.0).at(0.25), Ramp(1, 4).at(0.5), Ramp([0.0, 1.0], [1.0, 1.0]).at(0.75)
        (0.5, 2, [0.75, 1.0])
        """
        return _between(self.first, self.last, share)

    def __str__(self) -> str:
        return f"{written_value(self.first)}{TO}{written_value(self.last)}"


def _between(first: Any, last: Any, share: float) -> Any:
    if isinstance(first, (list, tuple)):
        return [_between(one, other, share) for one, other in zip(first, last, strict=True)]
    mixed = first * (1.0 - share) + last * share  # exact at both ends
    return round(mixed) if isinstance(first, int) else mixed


class FramesOption(EffectOption):
    """The option of an effect's parameter; numbers may be ramps."""

    def type_cast_value(self, ctx: click.Context, value: Any) -> Any:
        if not (isinstance(value, str) and TO in value and self.is_number):
            return super().type_cast_value(ctx, value)
        first, _, last = value.partition(TO)
        return Ramp(super().type_cast_value(ctx, first), super().type_cast_value(ctx, last))

    @property
    def is_number(self) -> bool:
        value_type = self.parameter.value_type
        return self.parameter.type in ("int", "float") or (value_type is not None and element_of(value_type) != BOOL)


def check_no_ramps(effect: Effect, parameters: Mapping[str, Any]) -> None:
    """Raise InputError for a ramp if only one picture is computed."""
    for name, value in parameters.items():
        if isinstance(value, Ramp):
            raise InputError(
                f"{flag_of(effect.parameter(name))} {value}: changes over frames, and one picture is made; give "
                "--frames NUMBER and a video or a numbered sequence: --frames 50 -o out.mp4"
            )


@dataclass(frozen=True)
class Changing:
    """The parameters of an effect that change over frames: ramps, and the duration of a frame in seconds."""

    effect: Effect
    ramps: Mapping[str, Ramp]
    frame_time: str | None

    @staticmethod
    def taken_from(effect: Effect, parameters: dict[str, Any]) -> Changing:
        """Remove the changing parameters from ``parameters`` and return them; a given frame time stays constant."""
        time = None if effect.frame_time in parameters else effect.frame_time
        return Changing(
            effect, {n: parameters.pop(n) for n, value in list(parameters.items()) if isinstance(value, Ramp)}, time
        )

    def handles(self) -> dict[str, Value]:
        """Return the run values of these parameters in a graph.

        If a clip has no rate, the frame time is the effect's default.
        """
        values = {name: Value(name) for name in self.ramps}
        if self.frame_time is not None:
            values[self.frame_time] = Value(self.frame_time, default=self.effect.parameter(self.frame_time).default)
        return values

    def graph(self, make: Callable[[Mapping[str, Any]], Any]) -> Any:
        """Build a graph with run values in place of the changing parameters."""
        try:
            return make(self.handles())
        except (GraphError, InputError) as error:
            if not self.ramps:
                raise
            flags = " ".join(flag_of(self.effect.parameter(name)) for name in self.ramps)
            mend = ", or annotate it with | pg.Value, and use it in kernels only" if ".py:" in self.effect.path else ""
            raise InputError(
                f"{flags}: cannot change over frames, since {self.effect.name} makes its passes for one value; "
                f"give one{mend}"
            ) from error

    def values(self, source: Source, rate: Fraction | None, constants: Mapping[str, Any]) -> Values:
        """Return the run values of a clip with a frame rate."""
        known = dict(constants)
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
        """Return the numbers of a clip's first and last frame."""
        if isinstance(source, Pictures):
            return source.first, max(source.paths)
        if source.count is None:
            flag = flag_of(self.effect.parameter(next(iter(self.ramps))))
            raise InputError(
                f"{flag} FROM{TO}TO needs to know the last frame, and {source.name} does not say how many there are; "
                "give one value"
            )
        return 1, source.count
