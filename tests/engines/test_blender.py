"""Blender with an effect on views drawn off screen: frames without it do not change by a bit."""

from __future__ import annotations

import pytest

from tests.engines.harmless import check_failing_effect, check_harmless, check_resized, check_sensitive, need

pytestmark = pytest.mark.engines


@pytest.fixture(autouse=True)
def _installed() -> None:
    need("bpy")


@pytest.mark.sampled
@pytest.mark.parametrize("isolation", ["sibling", "guard"])
def test_other_frames_do_not_change(isolation: str) -> None:
    check_harmless("blender", isolation)


def test_the_effect_follows_the_buffer_s_size() -> None:
    check_resized("blender")


def test_an_effect_that_fails_leaves_the_frames() -> None:
    check_failing_effect("blender")


def test_a_state_that_is_left_behind_would_be_seen() -> None:
    check_sensitive("blender", "front face")
