"""NaN and infinity: rejected or replaced in inputs, and traced to the pass that makes them.

One such value blackens everything within a blur's radius, and stays forever in a target with history.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Literal, TypeAlias, cast, get_args

import numpy as np
from numpy.typing import NDArray

from passgraph.arguments import one_of
from passgraph.errors import GraphError, InputError
from passgraph.formats import Format
from passgraph.graph.targets import Pass, PixelPass, Target
from passgraph.plan.data import Plan, Step
from passgraph.records import dataclass

Picture: TypeAlias = NDArray[np.float32]
NonFinite: TypeAlias = Literal["error", "replace", "keep"]
CHOICES: tuple[NonFinite, ...] = get_args(NonFinite)
#: The kernel that treats infinite, NaN and negative depth as sky (effects/checked.py).
SURFACE_DEPTH = "surface_depth"
#: float16 rounds larger numbers to infinity (halfway between its largest number and 2¹⁶), smaller ones to
#: `LARGEST_HALF`.
HALF_OVERFLOW = 65520.0
LARGEST_HALF = 65504.0
#: The bits of an infinite half float; those of NaN are larger.
HALF_INFINITY = 0x7C00
#: Numbers checked at a time in pictures whose rows are not contiguous.
NUMBERS_AT_ONCE = 1 << 16
LARGEST_FLOAT = float(np.finfo(np.float32).max)
#: Most readers of an input named in a message.
NAMED = 4


@dataclass(frozen=True, slots=True)
class Found:
    """The values of a picture that are not finite, or become infinite when stored.

    Attributes
    ----------
    count, total : number of such values, and of all values
    column, row, channel : of the first, row by row from the top
    value : the first such value
    """

    count: int
    total: int
    column: int
    row: int
    channel: int
    value: float

    def __str__(self) -> str:
        return (
            f"{self.count} of {self.total} values {'is' if self.count == 1 else 'are'} not finite, the first at "
            f"column {self.column}, row {self.row}, channel {'rgba'[self.channel]}: {self.value:g}"
        )


def _is_half(format: Format | None) -> bool:
    return format is not None and format.number == "f2"


def find(picture: Picture, format: Format | None = None) -> Found | None:
    """Return the values of a picture that are not finite, or become infinite in a format; None if there are none.

    >>> find(np.array([[[1.0, 2.0], [np.inf, np.nan]]], np.float32))
    Found(count=2, total=4, column=1, row=0, channel=0, value=inf)
    """
    half = _is_half(format)
    if picture.dtype == np.float16:
        if _are_finite_halves(picture):
            return None
    # The sum of squares is at least the largest square, so one pass over memory clears nearly every picture.
    elif _squares(picture) < (HALF_OVERFLOW**2 if half else np.inf):
        return None
    # converting this number to half overflows to infinity, which NumPy would warn of
    becomes_half = half and picture.dtype != np.float16
    bad = ~(np.abs(picture) < HALF_OVERFLOW) if becomes_half else ~np.isfinite(picture)
    if not bad.any():
        return None
    row, column, channel = (int(i) for i in np.unravel_index(np.argmax(bad), bad.shape))
    return Found(int(bad.sum()), bad.size, column, row, channel, float(picture[row, column, channel]))


def _squares(picture: NDArray[np.floating]) -> float:
    """Return the sum of squares; pictures that are not contiguous are copied a few rows at a time."""
    together = picture.flags.c_contiguous and picture.dtype == np.float32
    rows = len(picture) if together else max(1, NUMBERS_AT_ONCE // max(1, picture[:1].size))
    total = 0.0
    with np.errstate(over="ignore", invalid="ignore"):
        for first in range(0, len(picture), rows):
            part = picture[first : first + rows]
            values = np.ascontiguousarray(part if together else part.astype(np.float32)).reshape(-1)
            total += float(np.dot(values, values))
    return total


def _are_finite_halves(picture: NDArray[Any]) -> bool:
    """Test half floats through their bit patterns: positive ones order like ints, negative ones like uints."""
    largest, lowest = picture.view(np.int16).max(), picture.view(np.uint16).max()
    return bool(largest < HALF_INFINITY and lowest < HALF_INFINITY + 0x8000)


def admitted(picture: Picture, name: str, format: Format | None, choice: NonFinite, readers: Iterable[Pass]) -> Picture:
    """Return an input as passes may read it.

    Parameters
    ----------
    picture : (height, width, channels) float32
    name : of the input
    format : the format it is stored in; None for float32
    choice : "error" raises for values that are not finite; "replace" makes NaN 0 and infinity the largest number of the
        format; "keep" accepts them
    readers : the passes that read it; a picture that only `SURFACE_DEPTH` reads is not checked

    Raises
    ------
    InputError
        With the number of such values, the first one, and the passes that read it.
    """
    # normalized formats store NaN as their lower end and infinity as 1
    if choice == "keep" or (format is not None and format.steps):
        return picture
    where = find(picture, format)
    if where is None:
        return picture
    passes = list(readers)
    if passes and all(isinstance(one, PixelPass) and one.kernel.name == SURFACE_DEPTH for one in passes):
        return picture
    stored = f" in {format.name}" if format is not None and np.isfinite(where.value) else ""
    if choice == "error":
        raise InputError(
            f"input {name!r}: {where}{stored}; {_passes([one.name for one in passes])}. Mend the picture, or compile "
            "with non_finite='replace' (NaN becomes 0, infinity the largest number) or 'keep'; "
            "on the command line --non-finite replace"
        )
    largest = LARGEST_HALF if _is_half(format) else LARGEST_FLOAT
    replaced: Picture = np.clip(np.nan_to_num(picture.astype(np.float32), nan=0.0), -largest, largest, dtype=np.float32)
    return replaced


def _passes(names: list[str]) -> str:
    shown = ", ".join(repr(name) for name in names[:NAMED])
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return f"pass {shown} reads it" if len(names) == 1 else f"passes {shown}{more} read it"


def checked_choice(choice: object) -> NonFinite:
    """Return one of `CHOICES`; GraphError for anything else."""
    return cast("NonFinite", one_of(choice, "non_finite", CHOICES))


class PassCheck:
    """Checks what every pass wrote, and raises at the first pass that made a value that is not finite.

    A pass that only propagates such values is not reported.
    """

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self._bad: set[int] = set()  # resources that hold such a value

    def begin(self) -> None:
        """Forget the results of the last run."""
        before = set(self._bad)
        for resource in self.plan.resources:
            if resource.history is not None:
                self._mark(resource.history, resource.id in before)

    def admit(self, resource: int, picture: Picture) -> None:
        """Check an input, as the passes read it."""
        format = self.plan.resources[resource].format
        self._mark(resource, not format.steps and find(picture, format) is not None)

    def look(self, step: Step, written: Mapping[int, Picture]) -> None:
        """Check what a step wrote; ``written`` by resource.

        Raises
        ------
        GraphError
            With the pass, the target and the first pixel, if everything that the pass read was finite.
        """
        spreads = any(resource in self._bad for resource in step.reads)
        for resource, picture in written.items():
            where = find(picture)
            self._mark(resource, where is not None)
            if where is not None and not spreads:
                target = self.plan.resources[resource]
                raise GraphError(
                    f"pass {step.name!r} makes values that are not finite in target {target.name!r} "
                    f"({target.format.name}) from finite ones: {where}"
                )

    def _mark(self, resource: int, bad: bool) -> None:
        (self._bad.add if bad else self._bad.discard)(resource)


def readers_of(name: str, outputs: Iterable[Target]) -> Iterator[Pass]:
    """Yield the passes behind some targets that read an input."""
    from passgraph.graph.calls import graph

    network = graph(*outputs)
    for node, data in network.nodes(data=True):
        if data["kind"] == "input" and data["name"] == name:
            yield from network.successors(node)
