"""pygfx with an effect, on its own WebGPU device: frames without it do not change by a bit."""

from __future__ import annotations

import pytest

from tests.engines.harmless import need, said

pytestmark = pytest.mark.engines

_HEAD = """
        import numpy as np
        import passgraph as pg
        from docs.engines.demo import inverse, inverse_of
        from docs.engines.pygfx import Scene

        def run(frames, size=(96, 64), resize=None, at=(), effect=None, **values):
            scene, made = Scene(size), []
            for n in range(frames):
                if n == resize:
                    scene.resize((80, 50))
                attached = scene.attach(effect, **values) if n in at else None
                scene.draw()
                if attached is not None:
                    made.append((attached.error, scene.picture()))
                    attached.close()
                else:
                    made.append((None, scene.picture()))
            assert scene.renderer.effect_passes == ()
            assert "render" not in vars(scene.renderer)
            return made
"""


@pytest.fixture(autouse=True)
def _installed() -> None:
    need("pygfx")


def test_other_frames_do_not_change_and_the_effect_follows_the_size() -> None:
    assert said(f"""{_HEAD}
        plain = run(7, resize=3)
        changed = run(7, resize=3, at=(2, 3), effect=inverse)
        for n in range(7):
            expected = inverse_of(plain[n][1]) if n in (2, 3) else plain[n][1]
            print(changed[n][0], (changed[n][1] == expected).all(), expected.shape)
    """).split("\n") == [f"None True ({h}, {w}, 3)" for h, w in 3 * [(64, 96)] + 4 * [(50, 80)]] + [""]


def test_an_effect_that_changes_nothing_changes_no_bit() -> None:
    """Every number of 8 bits goes through sRGB, linear and sRGB, and comes out as it was."""
    assert said("""
        import numpy as np
        import pygfx as gfx
        import passgraph as pg
        from passgraph.effects import black_and_white
        from passgraph.engines.pygfx import attach
        from rendercanvas.offscreen import RenderCanvas

        same = pg.kernel(source="def same(c: Image) -> vec4: return c[0, 0]")
        numbers = np.arange(256, dtype=np.uint8).repeat(4).reshape(16, 64, 1)
        photo = np.concatenate([numbers, numbers[::-1], numbers[:, ::-1], np.full_like(numbers, 255)], axis=2)
        renderer = gfx.WgpuRenderer(RenderCanvas(size=(64, 16), pixel_ratio=1), pixel_scale=1, ppaa="none")
        scene = gfx.Background(None, gfx.BackgroundImageMaterial(gfx.Texture(photo, dim=2, colorspace="srgb")))

        def frame():
            renderer.render(scene, gfx.NDCCamera())
            return renderer.snapshot().copy()

        plain = frame()
        print(len(np.unique(plain)) > 250)
        for format in ("rgba8", "rgba16f", "rgba32f"):
            with attach(renderer, lambda image: same(image, into=pg.target("same", format))) as attached:
                print((frame() == plain).all(), attached.error)
        with attach(renderer, black_and_white) as attached:
            gray = frame()
        program = pg.compile({"picture": black_and_white(pg.Input("frame", "rgba8"))}, backend="numpy")
        expected = program(frame=plain)["picture"]
        print(attached.error, np.abs(gray / 255.0 - expected).max() <= 0.501 / 255, (gray != plain).any())
        print((frame() == plain).all())
    """).split("\n") == ["True", "True None", "True None", "True None", "None True True", "True", ""]


@pytest.mark.parametrize("camera", ["PerspectiveCamera(50, 1.5, depth_range=(0.5, 40))",
                                    "OrthographicCamera(6, 4, depth_range=(0.5, 40))"])  # fmt: skip
def test_depths_are_distances_along_the_view(camera: str) -> None:
    assert (
        said(f"""
        import numpy as np
        import pygfx as gfx
        import passgraph as pg
        from passgraph.engines.pygfx import attach
        from rendercanvas.offscreen import RenderCanvas

        coded = pg.kernel(source='''
        def coded(c: Image, d: Image) -> vec4:
            n = int(clamp(d[0, 0].r / 16.0, 0.0, 1.0) * 65535.0 + 0.5)
            return vec4(float(n >> 8), float(n & 255), 0.0, 255.0) / 255.0
        ''')
        renderer = gfx.WgpuRenderer(RenderCanvas(size=(96, 64), pixel_ratio=1), pixel_scale=1, ppaa="none")
        camera = gfx.{camera}
        camera.local.position = (0, 0, 5)
        scene = gfx.Scene()
        for x, z in ((-1.2, 2.0), (0.0, -3.0), (1.2, 0.5)):
            mesh = gfx.Mesh(gfx.plane_geometry(0.8, 0.8), gfx.MeshBasicMaterial(color="white"))
            mesh.local.position = (x, 0, z)
            scene.add(mesh)
        with attach(renderer, lambda frame, depth: coded(frame, depth, into=pg.target("coded", "rgba8"))) as attached:
            renderer.render(scene, camera)
            found = renderer.snapshot()[..., :2].astype(int) @ [256, 1] * (16 / 65535)
        print(attached.error, sorted(set(found[found > 0].round(3).tolist())), (found == 0).mean() > 0.5)
    """)
        == "None [3.0, 4.5, 8.0] True\n"
    )


def test_values_are_set_and_errors_leave_the_frame() -> None:
    assert said(f"""{_HEAD}
        kernel = pg.kernel(source="def lit(c: Image, gain: float) -> vec4: return vec4(c[0, 0].rgb * gain, 1.0)")
        plain, scene = run(5), Scene((96, 64))
        scene.draw()
        lit = lambda frame: kernel(frame, pg.Value("gain", float), into=pg.target("lit", "rgba8"))
        with scene.attach(lit) as attached:
            print(attached.warm_up() if attached.set(gain=0.5) is None else None)
            scene.draw()
            half = scene.picture()
            attached.set(gain=0.0)
            scene.draw()
            print(attached.error, half.max() < 140, scene.picture().max(), attached.isolation)
        with scene.attach(lit) as attached:
            scene.draw()
            print("gain" in str(attached.error), attached.enabled, (scene.picture() == plain[3][1]).all())
            scene.draw()
            print((scene.picture() == plain[4][1]).all())
        try:
            scene.attach(lambda frame: 1)
        except pg.GraphError as error:
            print("must return" in str(error), scene.renderer.effect_passes)
    """).split("\n")[:-1] == [
        "True", "None True 0 encoder", "True False True", "True", "True ()",
    ]  # fmt: skip
