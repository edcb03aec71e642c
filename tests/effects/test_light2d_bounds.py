"""Flat worlds that are too large are refused before the work that they would take."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import pytest

import passgraph as pg
from passgraph.effects.light2d import light_tiles, world
from passgraph.effects.light2d.light_map import light_map
from passgraph.effects.light2d.world import Light2D, Wall, Window

WINDOW = Window(0, 0, 100, 100)


def _world(walls: int, lights: int, radius: float) -> tuple[list[Wall], list[Light2D]]:
    places = np.random.default_rng(1).random((walls + lights, 2)) * 99
    boxes = [Wall.box(x, y, x + 0.5, y + 0.5) for x, y in places[:walls].tolist()]
    return boxes, [Light2D((x, y), radius=radius, size=0.1) for x, y in places[walls:].tolist()]


@pytest.fixture
def compared(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Pairs of a tile and an edge that were compared, a call each."""
    counts: list[int] = []
    between = light_tiles._between

    def counted(middles: Any, around: float, light: Light2D, edges: Any) -> Any:
        counts.append(len(middles) * len(edges))
        return between(middles, around, light, edges)

    monkeypatch.setattr(light_tiles, "_between", counted)
    return counts


def test_many_walls_and_lights_are_refused_before_they_are_compared(
    monkeypatch: pytest.MonkeyPatch, compared: list[int]
) -> None:
    monkeypatch.setattr(light_tiles, "MAX_COMPARED", 100_000)
    walls, lights = _world(400, 100, 200.0)
    with pytest.raises(
        pg.GraphError, match=r"the first 1 lights and 1600 edges make \d+ pairs .*, and at most 100000 are allowed"
    ):
        light_map(WINDOW, lights, walls, (320, 320))
    assert compared == []


def test_too_many_edges_before_one_light_end_the_work_at_it(compared: list[int]) -> None:
    walls, lights = _world(1000, 8, 200.0)
    with pytest.raises(pg.GraphError, match="edges are between one light and a tile"):
        light_map(WINDOW, lights, walls, (64, 64))
    assert sum(compared) <= 4000 * 16


def test_too_long_lists_end_the_work_when_they_are(monkeypatch: pytest.MonkeyPatch, compared: list[int]) -> None:
    monkeypatch.setattr(light_tiles, "MAX_TABLE_ROWS", 1)
    walls, lights = _world(20, 50, 200.0)
    with pytest.raises(
        pg.GraphError, match=r"lists of its tiles take \d+ texels or more, and at most 1024 are allowed; take larger"
    ):
        light_map(WINDOW, lights, walls, (320, 320))
    assert len(compared) < 10


def test_tiles_are_compared_some_at_a_time_with_the_same_result(
    monkeypatch: pytest.MonkeyPatch, compared: list[int]
) -> None:
    walls, lights = _world(40, 3, 30.0)
    whole = light_tiles.tile_tables(WINDOW, lights, walls, (320, 320), 16)
    calls = len(compared)
    monkeypatch.setattr(light_tiles, "COMPARED_AT_ONCE", 1000)
    parts = light_tiles.tile_tables(WINDOW, lights, walls, (320, 320), 16)
    assert len(compared) > 3 * calls
    assert max(compared[calls:]) <= 1000
    assert np.array_equal(whole.table, parts.table)
    assert all(np.array_equal(a, b) for a, b in zip(whole.tiles, parts.tiles, strict=True))


def test_walls_are_gone_through_once_for_all_lights(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[int] = []
    edges = world.all_edges
    # the package has a function of the module's name
    module = sys.modules["passgraph.effects.light2d.light_map"]

    def counted(walls: Any) -> Any:
        calls.append(1)
        return edges(walls)

    monkeypatch.setattr(module, "all_edges", counted)
    walls, lights = _world(5, 6, 10.0)
    light_map(WINDOW, lights, walls, (32, 32), penumbra="move")
    assert len(calls) == 1
