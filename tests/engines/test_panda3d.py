"""Panda3D with an effect: frames without it do not change by a bit."""

from __future__ import annotations

import pytest

from tests.engines.harmless import check_failing_effect, check_harmless, check_resized, check_sensitive, need

pytestmark = pytest.mark.engines


@pytest.fixture(autouse=True)
def _installed() -> None:
    need("panda3d")


@pytest.mark.parametrize("isolation", ["sibling", "guard"])
@pytest.mark.parametrize("samples", ["0", "4"])
def test_other_frames_do_not_change(isolation: str, samples: str) -> None:
    check_harmless("panda3d", isolation, "--samples", samples)


def test_the_effect_follows_the_buffer_s_size() -> None:
    check_resized("panda3d")


def test_an_effect_that_fails_leaves_the_frames() -> None:
    check_failing_effect("panda3d")


def test_a_state_that_is_left_behind_would_be_seen() -> None:
    check_sensitive("panda3d", "front face")
