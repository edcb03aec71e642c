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
    ambiguous : (height, width), pixels where a decision may go either way and the outcomes differ, or where the
        arguments of an operation are outside its documented domain
    unpromised : (height, width), those of them only for the second reason
    names : the operations with an uncertain decision, and in how many pixels
    untried : number of pixels (of a draw: fragments) without bounds because the time limit was reached
    """

    values: Interval
    ambiguous: Lanes
    unpromised: Lanes
    names: Counter[str]
    untried: int = 0

    @classmethod
    def exactly(cls, picture: FloatBlock) -> Allowed:
        """Allow exactly these values; for bits that are only copied."""
        nowhere = np.zeros(picture.shape[:2], np.bool_)
        return cls(Interval.point(picture), nowhere, nowhere, Counter())
