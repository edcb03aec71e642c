"""Distances from an engine's depth buffer, for effects on a linear depth."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Any

import passgraph as pg
from passgraph.effects.checked import checked
from passgraph.language import Image, clamp, vec2


@pg.struct
class DepthFrame:
    """`passgraph.HardwareDepth` in kernels."""

    ends: vec2  # 1 / distance (the distance in parallel views), which is linear in the stored number, at 0 and at 1
    perspective: bool
    reversed_z: bool


@pg.function
def distance_held(stored: float, frame: DepthFrame) -> float:
    """Return the distance along the view axis of a stored depth; that of the far plane where nothing is drawn."""
    d = clamp(stored, 0.0, 1.0)
    # both terms are positive: depths near the far plane keep all digits of the buffer
    linear = (1.0 - d) * frame.ends.x + d * frame.ends.y
    return 1.0 / max(linear, 1e-37) if frame.perspective else linear


@pg.function
def distance_from(stored: float, frame: DepthFrame) -> float:
    """Return `distance_held`, but 0 where nothing is drawn, and for NaN."""
    drawn = stored > 0.0 if frame.reversed_z else stored < 1.0
    return distance_held(stored, frame) if drawn else 0.0


@pg.kernel
def to_distance(depth: Image, frame: DepthFrame) -> float:
    """Convert each pixel of a depth buffer to a distance."""
    return distance_from(depth[0, 0].r, frame)


def depth_frame(holds: pg.HardwareDepth) -> DepthFrame:
    """Return a depth buffer's convention as kernel values."""
    make: Any = DepthFrame  # its fields are tuples on the host, vectors in kernels
    frame = make(holds.ends, not holds.orthographic, holds.reversed_z)
    assert isinstance(frame, DepthFrame)
    return frame


@checked
def distances(
    depth: pg.Target,
    holds: pg.HardwareDepth | pg.Value,
    into: pg.TargetSpec | None = None,
    name: str = "distance",
) -> pg.Target:
    """Convert an engine's depth buffer to distances along the view axis, for effects.

    Parameters
    ----------
    depth : numbers from 0 to 1 in red, of any format ("r16" for D16, "r32f", "depth32f")
    holds : convention of the numbers; a run value if near and far change
    into : destination target; default: "r32f" of the buffer's size named ``name``
    name : name of the pass and target

    Returns
    -------
    Scene units; 0 where nothing is drawn, i.e. where the depth is that of the far plane.

    Examples
    --------
    >>> import numpy as np
    >>> holds = pg.HardwareDepth(0.5, np.inf, reversed_z=True)
    >>> with pg.compile(distances(pg.Input("depth"), holds), backend="numpy") as program:
    ...     program(depth=np.float32([[1.0, 0.05, 0.0]]))["distance"][..., 0].tolist()
    [[0.5, 10.0, 0.0]]
    """
    spec = into or pg.target(name, "r32f", like=depth)
    frame = depth_frame(holds) if isinstance(holds, pg.HardwareDepth) else holds.map(depth_frame)
    target: pg.Target = to_distance(depth, frame, into=spec, name=name)
    return target
