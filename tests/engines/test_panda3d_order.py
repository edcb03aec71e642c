"""Where Panda3D's adapter puts an effect among display regions; no engine is needed for it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from passgraph.engines.panda3d import SORT, _last


def output(*regions: tuple[int, bool]) -> Any:
    made = [SimpleNamespace(sort=sort, get_clear_depth_active=lambda clears=clears: clears) for sort, clears in regions]
    return SimpleNamespace(get_active_display_regions=lambda: made)


def test_an_effect_is_behind_all_regions() -> None:
    assert _last(output((0, False), (10, True), (20, False)), takes_depth=False) == SORT
    assert _last(output(), takes_depth=True) == SORT


def test_one_that_takes_depth_is_before_the_first_that_clears_it() -> None:
    """As the 2D overlays of ShowBase and Ursina do: behind them nothing is left of the scene's depth."""
    assert _last(output((0, True), (10, True), (20, True)), takes_depth=True) == 9
    assert _last(output((0, True), (10, False)), takes_depth=True) == SORT
