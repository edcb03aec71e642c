"""MuJoCo with an effect: frames without it do not change by a bit."""

from __future__ import annotations

import pytest

from tests.engines.harmless import check_failing_effect, check_harmless, check_resized, check_sensitive, need, said

pytestmark = pytest.mark.engines


@pytest.fixture(autouse=True)
def _installed() -> None:
    need("mujoco")


@pytest.mark.sampled
@pytest.mark.parametrize("isolation", ["sibling", "guard"])
@pytest.mark.parametrize("samples", ["0", "4"])
def test_other_frames_do_not_change(isolation: str, samples: str) -> None:
    check_harmless("mujoco", isolation, "--samples", samples)


def test_the_effect_follows_the_viewport_s_size() -> None:
    check_resized("mujoco")


def test_an_effect_that_fails_leaves_the_frames() -> None:
    check_failing_effect("mujoco")


@pytest.mark.parametrize("left", ["sampler", "colour mask"])
def test_a_state_that_is_left_behind_would_be_seen(left: str) -> None:
    check_sensitive("mujoco", left)


def test_a_renderer_s_colours_change_and_its_depths_and_segments_do_not() -> None:
    assert said("""
        import os
        os.environ["MUJOCO_GL"] = "egl"
        import mujoco, numpy as np
        from docs.engines.demo import inverse, inverse_of
        from docs.engines.mujoco import MODEL
        from passgraph.engines.mujoco import attach

        model = mujoco.MjModel.from_xml_string(MODEL.format(samples=4))
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        call = mujoco.mjr_render
        with mujoco.Renderer(model, 48, 64) as renderer, mujoco.Renderer(model, 48, 64) as other:
            def pictures():
                made = []
                for each in (renderer, other):
                    each.update_scene(data)
                    made.append(each.render())
                for name in ("depth", "segmentation"):
                    getattr(renderer, f"enable_{name}_rendering")()
                    made.append(renderer.render())
                    getattr(renderer, f"disable_{name}_rendering")()
                return made

            plain = pictures()
            with attach(renderer, inverse) as attached:
                changed = pictures()
            print(attached.error, (changed[0] == inverse_of(plain[0])).all())
            print([bool((a == b).all()) for a, b in zip(plain[1:], changed[1:])])
            print(all((a == b).all() for a, b in zip(plain, pictures())), mujoco.mjr_render is call)
    """).split("\n") == ["None True", "[True, True, True]", "True True", ""]


def test_the_passive_viewer_is_refused_and_other_scenes_beside_it_are_not(display: str) -> None:
    assert said(f"""
        import os
        os.environ["DISPLAY"], os.environ["MUJOCO_GL"] = "{display}", "glfw"
        import mujoco, mujoco.viewer
        import passgraph as pg
        from docs.engines.demo import inverse
        from docs.engines.mujoco import MODEL
        from passgraph.engines.mujoco import attach

        model = mujoco.MjModel.from_xml_string(MODEL.format(samples=0))
        with mujoco.viewer.launch_passive(model, mujoco.MjData(model)) as viewer:
            for given in (viewer, viewer.user_scn):
                try:
                    attach(given, inverse)
                except pg.InputError as error:
                    print("passive viewer" in str(error) and "mjr_render" in str(error), flush=True)
            attach(mujoco.MjvScene(model, 200), inverse).close()
            os._exit(0)  # its thread and GLFW's end do not agree, without passgraph too
    """).split("\n") == ["True", "True", ""]
