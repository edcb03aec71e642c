"""Parameters that change over frames, as the command line writes them: ``--progress 0..1``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import click

from passgraph.commands.given_values import written_value
from passgraph.commands.options import EffectOption, flag_of
from passgraph.effects.registry import Effect
from passgraph.errors import InputError
from passgraph.language.types import BOOL, element_of

#: Between the first and the last value of a ramp.
TO = ".."


@dataclass(frozen=True)
class Ramp:
    """A parameter that goes evenly from one value at a clip's first frame to another at its last."""

    first: Any
    last: Any

    def at(self, share: float) -> Any:
        """The value after a share of the way; whole numbers are rounded.

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
    """An effect's parameter, which may change over frames where it is a number or several."""

    def type_cast_value(self, ctx: click.Context, value: Any) -> Any:
        if not (isinstance(value, str) and TO in value and self.is_number):
            return super().type_cast_value(ctx, value)
        first, _, last = value.partition(TO)
        return Ramp(super().type_cast_value(ctx, first), super().type_cast_value(ctx, last))

    @property
    def is_number(self) -> bool:
        of = self.parameter.of
        return self.parameter.type in ("int", "float") or (of is not None and element_of(of) != BOOL)


def check_no_ramps(effect: Effect, given: Mapping[str, Any]) -> None:
    """Refuse what changes over frames where one picture is made."""
    for name, value in given.items():
        if isinstance(value, Ramp):
            raise InputError(
                f"{flag_of(effect.parameter(name))} {value}: changes over frames, and one picture is made; give "
                "--frames NUMBER and a video or a numbered sequence: --frames 50 -o out.mp4"
            )
