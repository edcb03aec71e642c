"""Passes that differ in one number, each with a program of its own."""

from __future__ import annotations

import passgraph as pg


def times(factor: int) -> pg.Target:
    """A picture ``color`` times a number, as rgba32f."""
    text = f"def times(color: Image) -> vec4: return {factor}.0 * color[0, 0]"
    return pg.kernel(source=text)(pg.Input("color"), into=pg.target("times", "rgba32f"))
