"""``--frames``, ``--proxy`` and ``--contact-sheet``: some of the frames, smaller frames, frames in one picture."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import click

from passgraph.commands.clips import Clip
from passgraph.commands.parameter_options import Ramp
from passgraph.effects.effect_table import Effect
from passgraph.effects.parameters import Parameter
from passgraph.errors import InputError
from passgraph.files.film import Film
from passgraph.files.frame import Source
from passgraph.files.frame_range import FrameRange
from passgraph.files.run import MOST_PROXY
from passgraph.files.sequences import Pictures
from passgraph.ranges import Range

#: Most frames to generate: more than an hour at 25 frames a second.
MOST_FRAMES = 100_000
#: Most frames in a row or a column of a contact sheet.
_MOST_CELLS = 64


class FramesToMake(click.ParamType):  # type: ignore[type-arg]  # generic in newer clicks only
    """NUMBER of frames to make, or a `FrameRange` of frames to read."""

    name = "frames"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int | FrameRange:
        if isinstance(value, (int, FrameRange)):
            return value
        if re.fullmatch("[0-9]{1,18}", value):
            if not 1 <= int(value) <= MOST_FRAMES:
                self.fail(f"{value} is not in the range 1<=x<={MOST_FRAMES}.", param, ctx)
            return int(value)
        try:
            return FrameRange.parsed(value)
        except InputError as error:
            self.fail(f"{error}", param, ctx)


class Fraction(click.ParamType):  # type: ignore[type-arg]
    """1/N of the size."""

    name = "fraction"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        if isinstance(value, int):
            return value
        found = re.fullmatch(r"1/([0-9]{1,2})", str(value))
        if found is None or not 2 <= int(found[1]) <= MOST_PROXY:
            self.fail(f"{value!r}: expected 1/2 to 1/{MOST_PROXY}", param, ctx)
        return int(found[1])


class Cells(click.ParamType):  # type: ignore[type-arg]
    """COLUMNSxROWS."""

    name = "cells"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, int]:
        if isinstance(value, tuple):
            return value
        found = re.fullmatch(r"([0-9]{1,3})x([0-9]{1,3})", str(value))
        cells = (0, 0) if found is None else (int(found[1]), int(found[2]))
        if not (min(cells) >= 1 and max(cells) <= _MOST_CELLS):
            self.fail(f"{value!r}: expected COLUMNSxROWS of 1 to {_MOST_CELLS}, such as 4x3", param, ctx)
        return cells


def preview_options() -> list[click.Parameter]:
    return [
        click.Option(
            ["--proxy"], type=Fraction(), metavar="1/N",
            help="Read pictures at 1/N of their size; lengths in pixels, such as radii, are scaled with them.",
        ),
        click.Option(
            ["--contact-sheet", "sheet"], type=Cells(), metavar="COLUMNSxROWS",
            help="Write frames in even steps side by side in one picture, with their numbers.",
        ),
    ]  # fmt: skip


def scaled_parameters(effect: Effect, given: dict[str, Any], proxy: int) -> dict[str, Any]:
    """Return the parameters of an effect for a proxy: lengths in pixels, given or default, divided by ``proxy``."""
    scaled = dict(given)
    for parameter in effect.parameters:
        value = given.get(parameter.name, parameter.default)
        if proxy > 1 and parameter.range.unit == "px" and value is not None:
            scaled[parameter.name] = _divided(value, parameter, proxy)
    return scaled


def _divided(value: Any, parameter: Parameter, proxy: int) -> Any:
    if isinstance(value, Ramp):
        return Ramp(_divided(value.first, parameter, proxy), _divided(value.last, parameter, proxy))
    limits: Range = parameter.range
    divided = value / proxy
    if parameter.type == "int":
        # A length that is there does not vanish.
        divided = 2 * round((divided - 1) / 2) + 1 if limits.odd else max(round(divided), 1 if value else 0)
    least = limits.low if limits.low is not None and not limits.above else None
    return divided if least is None else type(divided)(max(divided, least))


def check_frames(clip: Clip, frames: FrameRange | None) -> None:
    """Raise InputError if a sequence has none of some frames, or a video would be cut; warn about missing ones."""
    source = clip.source
    if frames is not None and isinstance(clip.sink, Film) and not isinstance(source, Pictures):
        raise InputError(
            f"{clip.sink.path}: --frames does not cut videos, whose frames have times and sound; write pictures "
            "(-o out.%04d.png), or cut the video first"
        )
    if frames is None or not isinstance(source, Pictures):
        return
    numbers = source.paths
    if not any(number in frames for number in numbers):
        raise InputError(
            f"--frames: {source.name} has the frames {min(numbers)} to {max(numbers)}, and none of those; give some of "
            "them"
        )
    if missing := frames.missing_in(numbers):
        listed = ", ".join(map(str, missing[:-1] if len(missing) == 10 else missing))
        more = " ..." if len(missing) == 10 else ""
        click.echo(f"passgraph: warning: {source.name}: frames {listed}{more} are not there", err=True)


def evenly(source: Source, frames: FrameRange | None, count: int) -> FrameRange:
    """Return frames of a source in even steps, the first and the last among them.

    >>> from passgraph.files.sequences import Numbers
    >>> [number for number in range(1, 12) if number in evenly(Numbers(11), None, 3)]
    [1, 6, 11]
    """
    if source.count is None:
        raise InputError(f"--contact-sheet: {source.name} does not say how many frames it has; give --frames 1-100x10")
    known: Sequence[int] = list(source.paths) if isinstance(source, Pictures) else range(1, source.count + 1)
    numbers = [number for number in known if frames is None or number in frames]
    if not numbers:
        raise InputError(f"--contact-sheet: {source.name} has none of the frames; give some of its {source.count}")
    last = min(count, len(numbers)) - 1
    return FrameRange.of(numbers[round(i * (len(numbers) - 1) / max(last, 1))] for i in range(last + 1))
