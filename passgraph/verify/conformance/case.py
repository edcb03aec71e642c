"""A case of the conformance suite: a graph, its inputs, and the share of its pixels that must be decided."""

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
    group, name : together the identifier of the case
    graph : makes the outputs by name; called when the case runs, so that listing cases is cheap
    size : (width, height) of the output, pixels
    frames : inputs and values of each run, one run after another
    most_ambiguous : largest share of a target's pixels that may be ambiguous; beyond it the case is vacuous
    least_told : smallest share of a target's values with narrow bounds; below it the case is vacuous
    told_less : smaller such shares of single targets, by name: those with differences of nearly equal numbers
    exact : exact outputs after the last frame, compiled with every optimization; a function is called when the case
        runs
    quick : False for cases that a short run leaves out because others are similar
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
    """Return a picture of random values below, in and above [0, 1], some of them exact halves of 8-bit steps."""
    random = np.random.default_rng(seed)
    picture = random.uniform(-0.2, 1.2, (size[1], size[0], channels)).astype(np.float32)
    picture.reshape(-1)[3::7] = (random.integers(0, 255, picture.size)[3::7] + 0.5) / 255
    return picture


def whole_numbers(size: tuple[int, int], seed: int) -> Picture:
    """Return a picture of whole numbers from 0 to 7."""
    return np.random.default_rng(seed).integers(0, 8, (size[1], size[0], 4)).astype(np.float32)


def graph_of(text: str, size: tuple[int, int] | None = None, **values: Any) -> Mapping[str, pg.Target]:
    """Return the pass of a kernel's text, ``run``: its images are inputs of their names, its results ``result0`` …"""
    kernel = pg.kernel(source=text)
    into = tuple(pg.target(f"result{k}", "rgba32f", size=size) for k in range(len(kernel.program.results)))
    inputs = [pg.Input(name) for name in kernel.program.images]
    targets = kernel(*inputs, into=into if len(into) > 1 else into[0], **values)
    return {target.name: target for target in (targets if isinstance(targets, tuple) else (targets,))}
