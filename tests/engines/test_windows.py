"""Engines that bring a window: frames without an effect do not change by a bit, on a screen (Xvfb) and headless."""

from __future__ import annotations

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
SCREEN = ("xvfb-run", "-a")
#: Example → the distribution that it needs, and what it runs under.
ENGINES = {
    "pyglet": ("pyglet", SCREEN), "arcade": ("arcade", SCREEN), "moderngl_window": ("moderngl-window", ()),
    "pygame": ("pygame-ce", SCREEN), "qt": ("PySide6", SCREEN), "vispy": ("vispy", ()), "kivy": ("Kivy", SCREEN),
    "raylib": ("raylib", SCREEN),
}  # fmt: skip


@pytest.fixture(params=ENGINES)
def engine(request: pytest.FixtureRequest) -> str:
    name: str = request.param
    need(ENGINES[name][0])
    return name


@pytest.mark.parametrize("isolation", ["sibling", "guard"])
def test_other_frames_do_not_change(engine: str, isolation: str) -> None:
    check_harmless(engine, isolation, under=ENGINES[engine][1])


def test_the_effect_follows_the_size(engine: str) -> None:
    check_resized(engine, under=ENGINES[engine][1])


def test_an_effect_that_fails_leaves_the_frames(engine: str) -> None:
    check_failing_effect(engine, under=ENGINES[engine][1])


def test_a_state_that_is_left_behind_would_be_seen(engine: str) -> None:
    check_sensitive(engine, "outlines", under=ENGINES[engine][1])


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["moderngl_window", "pyglet"], indirect=True)
def test_nothing_grows_over_10_000_frames(engine: str) -> None:
    check_no_growth(engine, under=ENGINES[engine][1])
