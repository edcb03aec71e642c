"""Engines that bring a window: frames without an effect do not change by a bit, on a screen (Xvfb) and headless."""

from __future__ import annotations

from importlib import import_module

import pytest

from tests.engines.harmless import (
    check_failing_effect,
    check_harmless,
    check_no_growth,
    check_resized,
    check_sensitive,
    need,
)

pytestmark = pytest.mark.engines
#: Example → the distribution that it needs.
ENGINES = {
    "pyglet": "pyglet", "arcade": "arcade", "moderngl_window": "moderngl-window", "pygame": "pygame-ce",
    "qt": "PySide6", "napari": "napari", "vispy": "vispy", "kivy": "Kivy", "raylib": "raylib",
}  # fmt: skip


@pytest.fixture(params=ENGINES)
def engine(request: pytest.FixtureRequest) -> str:
    name: str = request.param
    need(ENGINES[name])
    return name


@pytest.fixture
def under(engine: str, request: pytest.FixtureRequest) -> tuple[str, ...]:
    """What the engine is started by."""
    if not getattr(import_module(f"docs.engines.{engine}").Scene, "needs_display", False):
        return ()
    return ("env", f"DISPLAY={request.getfixturevalue('display')}")


@pytest.mark.sampled
@pytest.mark.parametrize("isolation", ["sibling", "guard"])
def test_other_frames_do_not_change(engine: str, under: tuple[str, ...], isolation: str) -> None:
    check_harmless(engine, isolation, under=under)


@pytest.mark.slow
def test_the_effect_follows_the_size(engine: str, under: tuple[str, ...]) -> None:
    check_resized(engine, under=under)


@pytest.mark.slow
def test_an_effect_that_fails_leaves_the_frames(engine: str, under: tuple[str, ...]) -> None:
    check_failing_effect(engine, under=under)


@pytest.mark.slow
def test_a_state_that_is_left_behind_would_be_seen(engine: str, under: tuple[str, ...]) -> None:
    check_sensitive(engine, "outlines", under=under)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["kivy"], indirect=True)
def test_blending_that_is_left_off_would_be_seen(engine: str, under: tuple[str, ...]) -> None:
    check_sensitive(engine, "blending off", under=under)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["moderngl_window", "pyglet"], indirect=True)
def test_nothing_grows_over_10_000_frames(engine: str, under: tuple[str, ...]) -> None:
    check_no_growth(engine, under=under)
