"""Targets of effects that treat channels alike, which take and give pictures of one and two channels too."""

from __future__ import annotations

import passgraph as pg


def result_like(color: pg.Target, into: pg.TargetSpec | None, name: str) -> pg.TargetSpec:
    """Return the target of an effect's result: ``into``, else float32 with four channels, or the picture's one or two.

    >>> result_like(pg.Input("depth", "r16"), None, "soft"), result_like(pg.Input("frame"), None, "soft")
    (<target soft r32f>, <target soft rgba32f>)
    """
    if into is not None:
        return into
    declared = color.spec.format
    return pg.target(name, _floats(4 if declared is None else declared.channels))


def between(color: pg.Target, result: pg.TargetSpec) -> str:
    """Return the float format of an effect's own targets: of one or two channels if picture and result have no more.

    >>> between(pg.Input("depth", "r16"), pg.target("soft", "r32f")), between(pg.Input("frame"), pg.target("a", "r8"))
    ('r32f', 'rgba32f')
    """
    declared = color.spec.format
    return _floats(4 if declared is None else max(declared.channels, result.format.channels))


def _floats(channels: int) -> str:
    return f"{'rgba'[: channels if channels < 3 else 4]}32f"
