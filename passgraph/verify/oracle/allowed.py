"""Allowed results of one target after a step."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from passgraph.backends.base import FloatBlock
from passgraph.verify.oracle.interval import Interval, Lanes


@dataclass(frozen=True, eq=False)
class Allowed:
    """Allowed results of one target after a step.

    Attributes
    ----------
    values : (height, width, channels), intervals of stored values
    ambiguous : (height, width), pixels where a decision may fall either way and the outcomes lie apart, or where
        an operation promises nothing for what it is given
    unpromised : (height, width), those of them that are so for the second reason only
    names : the operations that straddled, and in how many pixels
    untried : of how many pixels (of a draw: fragments) nothing is said because time was up
    """

    values: Interval
    ambiguous: Lanes
    unpromised: Lanes
    names: Counter[str]
    untried: int = 0

    @classmethod
    def exactly(cls, picture: FloatBlock) -> Allowed:
        """This and nothing else: of bits that are only moved."""
        nowhere = np.zeros(picture.shape[:2], np.bool_)
        return cls(Interval.point(picture), nowhere, nowhere, Counter())
