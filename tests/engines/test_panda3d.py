"""Panda3D with an effect: frames without it do not change by a bit."""

from __future__ import annotations

import pytest

from tests.engines.harmless import check_failing_effect, check_harmless, check_resized, check_sensitive, need, said

pytestmark = pytest.mark.engines


@pytest.fixture(autouse=True)
def _installed() -> None:
    need("panda3d")


@pytest.mark.sampled
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


#: A white card 10 away from the first camera and 20 from the second, in ShowBase's own buffer.
CARD = """
    from direct.showbase.ShowBase import ShowBase
    from panda3d.core import CardMaker, NodePath, PerspectiveLens, load_prc_file_data
    import numpy as np
    import passgraph as pg
    from passgraph.engines.panda3d import attach

    load_prc_file_data("", "load-display p3headlessgl\\nwindow-type offscreen\\nwin-size 40 20\\n")
    load_prc_file_data("", "audio-library-name null")
    base = ShowBase()
    maker = CardMaker("card")
    maker.set_frame(-50, 50, -50, 50)
    card = base.render.attach_new_node(maker.generate())
    card.set_pos(0, 10, 0)
    fog = pg.kernel(source="def fog(c: Image, d: Image) -> vec4: return vec4(vec3(d[0, 0].r / 25.5), 1.0)")

    def by_distance(frame, depth):
        return fog(frame, depth, into=pg.target("fog", frame.spec.format or "rgba8"))

    def row(output):
        # distances times ten, each with the pixels that have it
        shot = output.get_texture() or output.get_screenshot()
        base.graphics_engine.extract_texture_data(shot, output.gsg)
        kind = {1: np.uint8, 2: np.float16, 4: np.float32}[shot.get_component_width()]
        rows = np.frombuffer(shot.get_ram_image_as("RGB"), kind)
        rows = rows if kind == np.uint8 else np.round(255 * rows)
        rows = rows.reshape(shot.get_y_size(), shot.get_x_size(), 3)[:20, :40, 0]
        numbers, counts = np.unique(rows, return_counts=True)
        return [(int(n), int(c)) for n, c in zip(numbers, counts)]
"""


def test_each_view_of_a_split_screen_has_its_own_distances() -> None:
    """The right one by the second lens of its camera, whose near plane is another."""
    assert said(f"""{CARD}
    left = base.win.get_display_region(1)
    assert left.camera == base.cam
    left.set_dimensions(0, 0.5, 0, 1)
    camera = base.make_camera(base.win, displayRegion=(0.5, 1, 0, 1), lens=PerspectiveLens())
    camera.set_pos(0, -10, 0)
    second = PerspectiveLens()
    second.set_near_far(3, 300)
    camera.node().set_lens(1, second)
    right = camera.node().get_display_region(0)
    right.set_lens_index(1)
    base.task_mgr.step()
    for given in ([left, right], [right], [base.win]):
        attached = [attach(each, by_distance) for each in given]
        base.task_mgr.step()
        print(row(base.win), *[each.error and "display regions" in str(each.error) for each in attached])
        for each in attached:
            each.close()
    """).split("\n")[-4:] == [
        "[(100, 400), (200, 400)] None None", "[(200, 400), (255, 400)] None", "[(255, 800)] True", "",
    ]  # fmt: skip


@pytest.mark.parametrize("filters", ["CommonFilters", "simplepbr"])
def test_the_scene_behind_filters_is_found(filters: str) -> None:
    """Filters show the scene on a card without depth; what was attached before them says that it has none."""
    if filters == "simplepbr":
        need("panda3d-simplepbr")
    assert said(f"""{CARD}
    early = attach(base.win, by_distance)
    if "{filters}" == "simplepbr":
        import simplepbr
        manager = simplepbr.init(msaa_samples=0)._filtermgr
    else:
        from direct.filter.CommonFilters import CommonFilters
        filters = CommonFilters(base.win, base.cam)
        filters.set_bloom()
        manager = filters.manager
    base.task_mgr.step()
    print("behind the filters" in str(early.error))
    early.close()
    scene = manager.buffers[0]
    shown = []
    for given in (base.win, scene):
        with attach(given, by_distance) as attached:
            base.task_mgr.step()
            assert attached.error is None, attached.error
            shown.append(row(scene))
    print(shown[0] == shown[1], shown[0])
    """).split("\n")[-3:] == ["True", "True [(100, 800)]", ""]


def test_other_threads_may_close_while_a_frame_is_drawn() -> None:
    """Panda3D must not lose a display region that it draws."""
    assert said("""
        import random, threading, time
        from direct.showbase.ShowBase import ShowBase
        from panda3d.core import load_prc_file_data
        from docs.engines.demo import inverse
        from passgraph.engines.panda3d import attach

        load_prc_file_data("", "load-display p3headlessgl\\nwindow-type offscreen\\nwin-size 40 30\\n")
        base = ShowBase()
        base.task_mgr.step()
        count = base.win.get_num_display_regions()

        def close(some):
            for attached in some:
                time.sleep(random.random() * 0.001)
                attached.close()

        for _ in range(10):
            made = [attach(base.win, inverse, sort=random.choice([5, None])) for _ in range(40)]
            for attached in made:
                attached.enabled = False  # what is drawn then is Panda3D's
            threads = [threading.Thread(target=close, args=(made[k::4],)) for k in range(4)]
            for thread in threads:
                thread.start()
            while any(thread.is_alive() for thread in threads):
                base.graphics_engine.render_frame()
        base.task_mgr.step()
        print(base.win.get_num_display_regions() == count)
    """).split("\n")[-2:] == ["True", ""]


@pytest.mark.parametrize("isolation", ["sibling", "guard"])
def test_frames_of_ursina_do_not_change(isolation: str) -> None:
    need("ursina")
    check_harmless("ursina", isolation)
