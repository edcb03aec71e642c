"""VTK with an effect: frames without it do not change by a bit."""

from __future__ import annotations

import re

import pytest

from tests.engines.harmless import check_failing_effect, check_harmless, check_resized, check_sensitive, need, said
from tests.xvfb import screen

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


@pytest.mark.parametrize("shown", ["off screen", "on a screen smaller than the picture"])
def test_a_screenshot_of_the_attachment_is_that_of_a_larger_window(shown: str) -> None:
    """Ambient occlusion reads the depth around each pixel, which tiles do not have."""
    code = """
        from functools import partial
        import numpy as np
        import passgraph as pg
        from docs.engines.vtk import Scene
        from passgraph.effects import occluded

        ON_SCREEN = False
        scene = Scene((60, 40))
        scene.window.SetOffScreenRendering(not ON_SCREEN)
        with scene.attach(partial(occluded, radius=0.6)) as one:
            scene.window.Render()
            before = scene.picture()
            for scale in (2, 4):
                large = Scene((60 * scale, 40 * scale))
                large.window.Render()
                plain = large.picture()
                with large.attach(partial(occluded, radius=0.6)):
                    large.window.Render()
                    expected = large.picture()
                taken = one.screenshot(scale)
                print(taken.dtype, (taken == expected).all(), (expected != plain).mean() > 0.1)
            print(one.error, (scene.picture() == before).all(), scene.window.GetSize())
            scene.window.SetSize(3000, 20)
            try:
                one.screenshot(16)
            except pg.InputError as error:
                print(error)
    """
    if shown == "off screen":
        printed = said(code)
    else:
        with screen() as display:
            printed = said(code.replace("ON_SCREEN = False", "ON_SCREEN = True"), DISPLAY=display)
    *lines, error, _ = printed.split("\n")
    assert lines == ["uint8 True True", "uint8 True True", "None True (60, 40)"]
    assert re.fullmatch(r"vtk: this device draws at most \d+ pixels a side, got 48000x320; take a smaller scale", error)


def test_tiles_of_a_screenshot_stay_without_an_effect_that_reads_around_and_it_is_said() -> None:
    assert said("""
        import logging
        import sys
        import vtk
        from vtk.util.numpy_support import vtk_to_numpy
        from docs.engines.vtk import Scene
        from passgraph.effects import occluded, vignette

        logging.basicConfig(stream=sys.stdout, format="%(message)s")
        scene = Scene((60, 40))

        def tiled():
            filter = vtk.vtkWindowToImageFilter()
            filter.SetInput(scene.window)
            filter.SetScale(2)
            filter.Update()
            return vtk_to_numpy(filter.GetOutput().GetPointData().GetScalars()).copy()

        scene.window.Render()
        plain = tiled()
        for effect in (occluded, vignette):
            with scene.attach(effect) as one:
                print((tiled() == plain).all(), one.error)
    """).split("\n") == 2 * [
        "vtk: a frame stays without the effect: this screenshot is drawn in tiles, and the effect reads beyond its "
        "pixel, which would leave seams; take it with .screenshot(scale=2) of what attach returned",
        "True None",
    ] + [""]


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
