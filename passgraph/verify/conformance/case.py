"""One case of the conformance suite: a graph, what it runs on, and how much of it has to be decided."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.verify.compare import MOST_AMBIGUOUS

Picture = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Case:
    """A graph that every conforming backend computes within the oracle's bounds.

    Attributes
    ----------
    group, name : together what the case is known by
    graph : makes the outputs by name; called when the case runs, so that listing cases is cheap
    size : (width, height) of the output, pixels
    frames : inputs and values of each run, one run after another
    most_ambiguous : share of a target's pixels in which rounding may turn a decision; beyond it the case is vacuous
    least_told : share of a target's values of which the bounds must say something; below it the case is vacuous
    told_less : such shares of targets by name, where they are smaller: of differences of numbers that are nearly equal
    exact : what outputs hold behind the last frame, to the bit, compiled with every optimization; a function is called
        when the case runs
    quick : false for cases that a short run may leave out, since others come near
    """

    group: str
    name: str
    graph: Callable[[], Mapping[str, pg.Target]]
    size: tuple[int, int]
    frames: tuple[Mapping[str, Any], ...] = ({},)
    most_ambiguous: float = MOST_AMBIGUOUS
    least_told: float = 0.9
    told_less: Mapping[str, float] = field(default_factory=dict)
    exact: Mapping[str, NDArray[Any] | float | Callable[[], NDArray[Any]]] = field(default_factory=dict)
    quick: bool = True

    @property
    def id(self) -> str:
        """``group/name``."""
        return f"{self.group}/{self.name}"


def values(size: tuple[int, int], channels: int = 4, seed: int = 0) -> Picture:
    """A picture of random values below, in and above [0, 1], with exact halves of 8-bit steps among them."""
    random = np.random.default_rng(seed)
    picture = random.uniform(-0.2, 1.2, (size[1], size[0], channels)).astype(np.float32)
    picture.reshape(-1)[3::7] = (random.integers(0, 255, picture.size)[3::7] + 0.5) / 255
    return picture
