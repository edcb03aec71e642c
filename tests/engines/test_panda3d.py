"""Panda3D with an effect: frames without it do not change by a bit."""

from __future__ import annotations

import pytest

from tests.engines.harmless import check_failing_effect, check_harmless, check_resized, check_sensitive, need, said

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


def test_a_window_s_overlay_can_stay_above_the_effect() -> None:
    """ShowBase's own buffer, with a white card in its 2D overlay, which is drawn after regions of sort 5."""
    assert said("""
        from direct.showbase.ShowBase import ShowBase
        from panda3d.core import CardMaker, load_prc_file_data
        import numpy as np
        from docs.engines.demo import inverse
        from passgraph.engines.panda3d import attach

        load_prc_file_data("", "load-display p3headlessgl\\nwindow-type offscreen\\nwin-size 40 20\\n")
        base = ShowBase()
        base.set_background_color(0.2, 0.4, 0.6)
        maker = CardMaker("card")
        maker.set_frame(-1, 0, -1, 0)
        card = base.render2d.attach_new_node(maker.generate())

        def corners():
            base.graphics_engine.render_frame()
            shot = base.win.get_screenshot()
            rows = np.frombuffer(shot.get_ram_image_as("RGB"), np.uint8).reshape(20, 40, 3)
            return rows[0, 0].tolist(), rows[-1, -1].tolist()

        corners()  # the first frame comes without the overlay
        print(corners())
        with attach(base.win, inverse, sort=5) as above:
            print(corners())
            assert above.error is None, above.error
        with attach(base.win, inverse):
            print(corners())
        print(corners())
    """).split("\n")[-5:] == [
        "([255, 255, 255], [51, 102, 153])",
        "([255, 255, 255], [204, 153, 102])",
        "([0, 0, 0], [204, 153, 102])",
        "([255, 255, 255], [51, 102, 153])",
        "",
    ]


@pytest.mark.parametrize("isolation", ["sibling", "guard"])
def test_frames_of_ursina_do_not_change(isolation: str) -> None:
    need("ursina")
    check_harmless("ursina", isolation)
