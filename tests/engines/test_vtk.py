"""VTK with an effect: frames without it do not change by a bit."""

from __future__ import annotations

import pytest

from tests.engines.harmless import check_failing_effect, check_harmless, check_resized, check_sensitive, need, said

pytestmark = pytest.mark.engines


@pytest.fixture(autouse=True)
def _installed() -> None:
    need("vtk")


@pytest.mark.sampled
@pytest.mark.parametrize("isolation", ["sibling", "guard"])
@pytest.mark.parametrize("samples", ["0", "4"])
def test_other_frames_do_not_change(isolation: str, samples: str) -> None:
    check_harmless("vtk", isolation, "--samples", samples)


def test_the_effect_follows_the_window_s_size() -> None:
    check_resized("vtk")


def test_an_effect_that_fails_leaves_the_frames() -> None:
    check_failing_effect("vtk")


@pytest.mark.parametrize("left", ["depth test off", "front face", "colour mask"])
def test_a_state_that_is_left_behind_would_be_seen(left: str) -> None:
    check_sensitive("vtk", left)


def test_each_of_two_renderers_has_its_part_of_a_window() -> None:
    """PyVista's plotter, with two views side by side, of which the right one has the effect."""
    need("pyvista")
    assert said("""
        import numpy as np
        import pyvista
        from docs.engines.demo import inverse, inverse_of
        from passgraph.engines.vtk import attach

        plotter = pyvista.Plotter(shape=(1, 2), off_screen=True, window_size=(80, 30), border=False)
        plotter.render_window.SetMultiSamples(0)  # it takes the mean of samples by a curve of its own
        for column in range(2):
            plotter.subplot(0, column)
            plotter.add_mesh(pyvista.Sphere(theta_resolution=12, phi_resolution=9), color="orange")
        plotter.show(auto_close=False)
        plain = plotter.screenshot()
        plotter.subplot(0, 1)
        with attach(plotter, inverse) as attached:
            plotter.render()
            changed = plotter.screenshot()
        plotter.render()
        print(attached.error, (changed[:, :40] == plain[:, :40]).all())
        print((changed[:, 40:] == inverse_of(plain[:, 40:])).all(), (plotter.screenshot() == plain).all())
    """).split("\n") == ["None True", "True True", ""]


def test_an_effect_that_changes_nothing_changes_no_edge() -> None:
    """VTK takes the mean of samples in linear light, which the mean as they are stored is not."""
    assert said("""
        import passgraph as pg
        from docs.engines.vtk import Scene

        same = pg.kernel(source="def same(c: Image) -> vec4: return c[0, 0]")
        for isolation in ("sibling", "guard"):
            plain, changed = Scene((96, 64), 4), Scene((96, 64), 4)
            with changed.attach(lambda frame: same(frame, into=pg.target("same", "rgba8")), isolation=isolation) as one:
                for scene in (plain, changed):
                    scene.draw()
                print(one.error, (plain.picture() == changed.picture()).all())
    """).split("\n") == ["None True", "None True", ""]


def test_depth_of_several_samples_is_that_of_the_pixel_s_middle() -> None:
    """Distances in 24 bits, without samples and with four; most pixels see one facet of a solid."""
    assert said("""
        import numpy as np
        import passgraph as pg
        from docs.engines.vtk import Scene

        coded = pg.kernel(source='''
        def coded(c: Image, d: Image) -> vec4:
            n = int(clamp(d[0, 0].r / 16.0, 0.0, 1.0) * 16777215.0)
            return vec4(float(n >> 16), float((n >> 8) & 255), float(n & 255), 255.0) / 255.0
        ''')

        def distances(samples, isolation):
            scene = Scene((96, 64), samples)
            coding = lambda frame, depth: coded(frame, depth, into=pg.target("coded", "rgba8"))
            with scene.attach(coding, isolation=isolation) as one:
                scene.draw()
                assert one.error is None, one.error
            return scene.picture() @ np.array([65536, 256, 1]) * (16 / 16777215)

        expected = distances(0, "auto")
        for isolation in ("sibling", "guard"):
            off = np.abs(distances(4, isolation) - expected)[expected > 0]
            print(len(off) > 3000, np.median(off) < 1e-4, np.quantile(off, 0.6) < 2e-3)
    """).split("\n") == ["True True True", "True True True", ""]


def test_a_screenshot_in_tiles_gets_the_effect_and_so_do_frames_after_it() -> None:
    """The right one of two views has the effect; of 3 x 3 tiles it is in all, in a part, or in none."""
    need("pyvista")
    assert said("""
        import pyvista, passgraph as pg
        from passgraph.engines.vtk import attach

        one = pg.kernel(source="def one(c: Image) -> vec4: return vec4(1.0 - c[0, 0].rgb, c[0, 0].a)")
        plotter = pyvista.Plotter(shape=(1, 2), off_screen=True, window_size=(80, 30), border=False)
        plotter.render_window.SetMultiSamples(0)
        for column in range(2):
            plotter.subplot(0, column)
            plotter.add_mesh(pyvista.Sphere(theta_resolution=12, phi_resolution=9), color="orange")
        plotter.show(auto_close=False)
        scales = (2, 3, 1)
        plain = [plotter.screenshot(scale=scale) for scale in scales]
        plotter.subplot(0, 1)
        with attach(plotter, lambda frame: one(frame, into=pg.target("one", "rgba8"))) as attached:
            plotter.render()
            for scale, before in zip(scales, plain):
                after, half = plotter.screenshot(scale=scale), before.shape[1] // 2
                print(attached.error, after.shape, (after[:, :half] == before[:, :half]).all(),
                      (after[:, half:] == 255 - before[:, half:]).all())
    """).split("\n") == [
        "None (60, 160, 3) True True", "None (90, 240, 3) True True", "None (30, 80, 3) True True", "",
    ]  # fmt: skip


def test_picking_sees_actors_through_the_effect() -> None:
    assert said("""
        import vtk
        from docs.engines.demo import inverse
        from docs.engines.vtk import Scene

        scene = Scene((64, 40))
        scene.draw()

        def picked():
            selector = vtk.vtkHardwareSelector()
            selector.SetRenderer(scene.renderer)
            selector.SetArea(0, 0, 63, 39)
            found = selector.Select()
            nodes = [found.GetNode(i) for i in range(found.GetNumberOfNodes())]
            return sorted(node.GetSelectionList().GetNumberOfTuples() for node in nodes)

        plain = picked()
        with scene.attach(inverse) as attached:
            scene.window.Render()
            print(attached.error, len(plain) > 5, picked() == plain)
    """).split("\n") == ["None True True", ""]
