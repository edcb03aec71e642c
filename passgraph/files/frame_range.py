"""Frames of a sequence by number: ``1001-1100x2``."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from passgraph.arguments import shown
from passgraph.errors import InputError

_PART = re.compile(r"(-?[0-9]{1,18})(?:-(-?[0-9]{1,18})(?:x([0-9]{1,9}))?)?")


@dataclass(frozen=True)
class FrameRange:
    """Numbers of frames, as ranges with steps.

    >>> frames = FrameRange.parsed("1001-1100x2,1200")
    >>> 1003 in frames, 1004 in frames, 1200 in frames, frames.last
    (True, False, True, 1200)
    """

    parts: tuple[range, ...]

    @staticmethod
    def parsed(text: str) -> FrameRange:
        """Parse numbers and ranges with commas between them.

        Raises
        ------
        InputError
            For other text, a range that ends before it begins, or a step of 0.
        """
        parts = list[range]()
        for part in text.split(","):
            found = _PART.fullmatch(part.strip())
            first, last, step = (None, None, None) if found is None else found.groups()
            if first is None or int(last or first) < int(first) or (step is not None and int(step) < 1):
                raise InputError(
                    f"frames {shown(text)}: expected numbers or ranges, FIRST-LAST or FIRST-LASTxSTEP, such as "
                    "1001-1100x2"
                )
            parts.append(range(int(first), int(last or first) + 1, int(step or 1)))
        return FrameRange(tuple(parts))

    @staticmethod
    def of(numbers: Iterable[int]) -> FrameRange:
        """Return a range of some numbers."""
        return FrameRange(tuple(range(number, number + 1) for number in numbers))

    def __contains__(self, number: int) -> bool:
        return any(number in part for part in self.parts)

    @property
    def last(self) -> int:
        return max(part[-1] for part in self.parts)

    def missing_in(self, numbers: Iterable[int]) -> list[int]:
        """Return the first of its numbers that are not among others, at most ten.

        >>> FrameRange.parsed("1-5").missing_in([1, 2, 4])
        [3, 5]
        """
        known, missing = set(numbers), list[int]()
        for number in (number for part in self.parts for number in part):
            if number not in known:
                missing.append(number)
                if len(missing) == _MOST_MISSING:
                    break
        return missing


_MOST_MISSING = 10
