"""What the table of docs/engines.md compares is the same work, and long runs keep nothing."""

from __future__ import annotations

import pytest

from tests.engines.harmless import check_by_hand_is_alike, check_no_growth, need

pytestmark = pytest.mark.engines


@pytest.mark.parametrize("engine", ["panda3d", "vtk", "mujoco"])
def test_by_hand_is_the_same_picture(engine: str) -> None:
    need(engine)
    check_by_hand_is_alike(engine)


@pytest.mark.slow
@pytest.mark.parametrize("isolation", ["sibling", "guard"])
def test_ten_thousand_frames_keep_nothing(isolation: str) -> None:
    need("moderngl-window")
    check_no_growth("moderngl_window", "--isolation", isolation)
