"""Compare versions of a user's graph: the time of each, and the difference of its picture from an exact one."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from math import inf, nan, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.backends.base import Backend
from passgraph.bench.metrics import flip_map, ssim_map
from passgraph.bench.timing import FrameTime, times_in_turn
from passgraph.errors import InputError
from passgraph.graph.targets import Target
from passgraph.plan.data import Options
from passgraph.run.compile import compile
from passgraph.run.program import Program

Picture = NDArray[np.float32]


@dataclass(frozen=True)
class Difference:
    """The difference of two pictures of one size.

    Attributes
    ----------
    rmse, largest : over all channels' values; NaN and infinite if a value is not finite in one picture only
    ssim : structural similarity, mean over pixels and channels, 1 is equal; NaN for pictures under 11 pixels
    flip : mean of FLIP, 0 is equal, of the pictures as an 8-bit file shows them; NaN without the ``flip`` extra
    """

    rmse: float
    largest: float
    ssim: float
    flip: float


@dataclass(frozen=True, eq=False)
class Version:
    """A version on one backend.

    Attributes
    ----------
    name : name of the graph's output
    call : time from the inputs' arrays to the picture's, with every pass run again
    difference : difference from the exact version on the same backend
    picture : (h, w, channels)
    """

    backend: str
    name: str
    call: FrameTime
    difference: Difference
    picture: Picture


def measure_versions(
    graphs: Mapping[str, Target],
    exact: str,
    backends: Sequence[Backend],
    size: tuple[int, int],
    inputs: Mapping[str, Any],
    frames: int,
    say: Callable[[str], object] = lambda _: None,
) -> list[Version]:
    """Time every graph, with calls in turn, and compare its picture.

    Parameters
    ----------
    graphs : one target for each version, by name
    exact : name of the reference version; it is measured too
    given : input pictures by name; a graph uses those that it has
    frames : number of timed calls of each

    >>> import passgraph as pg
    >>> from passgraph.backends.registry import open_backend
    >>> times = pg.kernel(source="def times(c: Image, by: float) -> float: return c[0, 0].r * by")
    >>> frame = pg.Input("frame", "r32f", (16, 16))
    >>> graphs = {name: times(frame, by, into=pg.target("made", "r32f")) for name, by in (("half", 0.5), ("less", 0.4))}
    >>> with open_backend("numpy") as backend:
    ...     made = measure_versions(graphs, "half", [backend], (16, 16), {"frame": np.ones((16, 16, 1), np.float32)}, 1)
    >>> [(version.name, round(version.difference.rmse, 6)) for version in made]
    [('half', 0.0), ('less', 0.1)]
    """
    if exact not in graphs:
        raise InputError(f"there is no version {exact!r} to hold the others against; there are {', '.join(graphs)}")
    return [version for backend in backends for version in _on(backend, graphs, exact, size, inputs, frames, say)]


def _on(
    backend: Backend,
    graphs: Mapping[str, Target],
    exact: str,
    size: tuple[int, int],
    inputs: Mapping[str, Any],
    frames: int,
    say: Callable[[str], object],
) -> list[Version]:
    with ExitStack() as stack:
        calls: dict[str, Callable[[int], Picture]] = {}
        for name in [exact, *(other for other in graphs if other != exact)]:
            say(f"{backend.name}: compiling {name}")
            # Static passes would be skipped and timed as nothing, since inputs do not change between calls.
            options = Options(static=False)
            program = stack.enter_context(compile(graphs[name], backend=backend, size=size, options=options))
            calls[name] = _call(program, {key: picture for key, picture in inputs.items() if key in program.inputs})
        say(f"{backend.name}: {frames} frames each")
        pictures = {name: call(0) for name, call in calls.items()}
        for name, picture in pictures.items():
            if picture.shape != pictures[exact].shape:
                raise InputError(
                    f"version {name!r} is {_shape(picture)}, and {exact!r}, which it is held against, "
                    f"{_shape(pictures[exact])}; give both targets one size and as many channels"
                )
        times = times_in_turn(calls, frames)
    return [
        Version(backend.name, name, times[name], difference(pictures[name], pictures[exact]), pictures[name])
        for name in graphs
    ]


def _call(program: Program, inputs: Mapping[str, Any]) -> Callable[[int], Picture]:
    def call(frame: int) -> Picture:
        result = program(**inputs)
        return result[next(iter(result))]

    return call


def difference(got: Picture, true: Picture) -> Difference:
    """Measure the difference of two pictures.

    >>> black, grey = np.zeros((4, 4, 3), np.float32), np.full((4, 4, 3), 0.25, np.float32)
    >>> difference(grey, black).rmse, difference(grey, black).largest
    (0.25, 0.25)
    """
    alike = (got == true) | (np.isnan(got) & np.isnan(true))
    off = np.where(alike, 0.0, got.astype(np.float64) - true)
    finite = bool(np.isfinite(off).all())
    colours = [picture[:, :, :3] for picture in (got, true)]
    known = all(np.isfinite(picture).all() for picture in colours)
    span = float(np.ptp(colours[1])) if known else 1.0
    similar = ssim_map(colours[0], colours[1], span or 1.0) if known else None
    seen = flip_map(_shown(got), _shown(true))
    return Difference(
        rmse=sqrt(float(np.mean(off**2))) if finite else nan,
        largest=float(np.abs(off).max()) if finite else inf,
        ssim=nan if similar is None else float(similar.mean()),
        flip=nan if seen is None else float(seen.mean()),
    )


def _shown(picture: Picture) -> Picture:
    """Return the color as three channels from 0 to 1; one channel is gray, and two have a third of 0."""
    color = np.clip(np.nan_to_num(picture[:, :, :3]), 0.0, 1.0)
    if color.shape[2] == 1:
        color = np.repeat(color, 3, axis=2)
    lacking = np.zeros((*color.shape[:2], 3 - color.shape[2]), np.float32)
    return np.ascontiguousarray(np.concatenate([color, lacking], axis=2), np.float32)


def _shape(picture: Picture) -> str:
    height, width, channels = picture.shape
    return f"{width}x{height} with {channels} channel{'s' if channels > 1 else ''}"
