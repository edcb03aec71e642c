"""An effect of another package: one file, and one line in its pyproject.toml."""

# mypy: disable-error-code="no-any-return"
from __future__ import annotations

from typing import Annotated

import passgraph as pg
from passgraph import Image, vec4
from passgraph.effects import effect


@pg.kernel
def scale(color: Image, share: float) -> vec4:
    """A share of the light; alpha stays."""
    c = color[0, 0]
    return vec4(c.rgb * share, c.a)


@effect("halved")
def halved(
    frame: pg.Target, share: Annotated[float, pg.Range(0, 1, above=True)] = 0.5, into: pg.TargetSpec | None = None
) -> pg.Target:
    """A picture with less light.

    Parameters
    ----------
    frame : any picture, linear light
    share : of the light that is left
    into : where it goes; left out, a float32 target "halved"
    """
    made: pg.Target = scale(frame, share, into=into or pg.target("halved", "rgba32f"), name="halved")
    return made
