"""Pictures drawn over pictures with fixed-function blending."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

import passgraph as pg
from passgraph import Image, vec4
from passgraph.effects.light2d.shapes import Shape, Spot, in_window, quads
from passgraph.effects.light2d.world import Window

#: Clip space itself: the whole picture.
WHOLE = Window(-1.0, -1.0, 1.0, 1.0)


@pg.fragment
def black(spot: Spot) -> vec4:
    """Shadow: no light at all."""
    return vec4(0.0, 0.0, 0.0, 0.0)


@pg.fragment
def copied(spot: Spot, picture: Image, factor: float = 1.0) -> vec4:
    """A picture stretched over the quad, times a factor."""
    return picture.sample(spot.uv) * factor


def whole() -> Shape:
    """A quad over the whole picture."""
    return quads([WHOLE.corners])


def drawn(
    picture: pg.Target,
    into: pg.Target | pg.TargetSpec,
    name: str,
    factor: float = 1.0,
    blend: str | pg.Blend | None = None,
) -> pg.Target:
    """A picture stretched over a target."""
    values = {"clip": WHOLE.clip, "picture": picture, "factor": factor}
    made: pg.Target = pg.draw(
        whole(), vertex=in_window, fragment=copied, into=into, name=name, values=values, blend=blend
    )
    return made
