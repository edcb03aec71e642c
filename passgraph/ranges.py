"""Ranges of numbers, declared in a signature: ``threshold: Annotated[float, pg.Range(0)] = 1.0``."""

from __future__ import annotations

from passgraph.arguments import flag, is_number, real, shown, string
from passgraph.errors import GraphError
from passgraph.records import dataclass


@dataclass(frozen=True, slots=True)
class Range:
    """The allowed values of a number; if it annotates a color, of each channel.

    Parameters
    ----------
    low, high : inclusive bounds; None for no bound
    unit : such as "px", "stops" or "scene units"; empty for pure numbers
    above : True if ``low`` itself is excluded
    odd : True if only odd numbers are allowed

    Raises
    ------
    GraphError
        If a limit is not a number, or the range is empty.

    Examples
    --------
    >>> 0 in Range(0, 1), 0 in Range(0, 1, above=True), float("nan") in Range()
    (True, False, False)
    >>> [str(Range(*limits)) for limits in ((0, 1), (0,), (None, 1), ())]
    ['0 to 1', '0 or more', '1 or less', 'any number']
    >>> str(Range(0, above=True)), str(Range(0, 1, above=True)), str(Range(1, 15, odd=True))
    ('above 0', 'above 0 and at most 1', 'odd, 1 to 15')
    """

    low: float | None = None
    high: float | None = None
    unit: str = ""
    above: bool = False
    odd: bool = False

    def __post_init__(self) -> None:
        for name in ("low", "high"):
            if getattr(self, name) is not None:
                real(getattr(self, name), f"Range: {name}")
        string(self.unit, "Range: unit", GraphError)
        flag(self.above, "Range: above")
        flag(self.odd, "Range: odd")
        if self.low is not None and self.high is not None and not self.low < self.high:
            raise GraphError(f"Range: low must be below high, got {shown(self.low)} and {shown(self.high)}")

    def __contains__(self, number: object) -> bool:
        if not is_number(number):
            return False
        assert isinstance(number, (int, float)) or hasattr(number, "__float__")
        low, high = self.low, self.high
        if low is not None and not (number > low if self.above else number >= low):  # type: ignore[operator]
            return False
        if high is not None and not number <= high:  # type: ignore[operator]
            return False
        return number == number and not (self.odd and number % 2 != 1)  # type: ignore[operator]

    def __str__(self) -> str:
        """Describe the range without its unit, as in errors: "0 or more"."""
        low, high = _short(self.low), _short(self.high)
        words = "odd, " if self.odd else ""
        if self.low is None:
            return words + ("any number" if self.high is None else f"{high} or less")
        if self.high is None:
            return words + (f"above {low}" if self.above else f"{low} or more")
        return words + (f"above {low} and at most {high}" if self.above else f"{low} to {high}")


def _short(limit: float | None) -> str:
    return f"{limit:g}" if isinstance(limit, float) else str(limit)
