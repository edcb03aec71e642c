"""Ogre, through what adapters share: frames without an effect do not change by a bit, with rows from the top down."""

from __future__ import annotations

import pytest

from tests.engines.harmless import check_harmless, check_resized, check_sensitive, need

pytestmark = pytest.mark.engines
SCREEN = ("xvfb-run", "-a")


@pytest.fixture(autouse=True)
def _installed() -> None:
    need("ogre-python")


@pytest.mark.sampled
@pytest.mark.parametrize("isolation", ["sibling", "guard"])
def test_other_frames_do_not_change(isolation: str) -> None:
    check_harmless("ogre", isolation, under=SCREEN)


def test_the_effect_follows_the_texture_s_size() -> None:
    check_resized("ogre", under=SCREEN)


def test_a_state_that_is_left_behind_would_be_seen() -> None:
    check_sensitive("ogre", "colour mask", under=SCREEN)
