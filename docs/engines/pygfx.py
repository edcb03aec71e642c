"""Ambient occlusion on solids in pygfx, from its depth texture and camera.

    python docs/engines/pygfx.py [--times]

writes docs/images/engines/pygfx.png; with --times it measures what docs/engines/table.py measures in other engines, and
prints it.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from functools import partial
from statistics import median
from typing import Any

if __name__ == "__main__":
    import demo  # noqa: F401 (puts the checkout on the path)

from docs.engines.demo import Picture, gray_and_soft, occluded, show
from passgraph.effects.filters.blur import gaussian_weights
from passgraph.engines import pygfx as adapter
from passgraph.engines.attachment import Attachment

_GRAY = "return vec4f(vec3f(dot(texel(p).rgb, vec3f(.2126, .7152, .0722))), texel(p).a);"


class Scene:
    """Boxes and balls that stand close on a floor, seen by a camera that goes round them."""

    engine = "pygfx"
    hook = "`renderer.effect_passes`"
    shown = partial(occluded, radius=0.6)

    def __init__(self, size: tuple[int, int]) -> None:
        import pygfx as gfx
        from rendercanvas.offscreen import RenderCanvas

        self.canvas = RenderCanvas(size=size, pixel_ratio=1)
        self.renderer = gfx.WgpuRenderer(self.canvas, pixel_scale=1, ppaa="none")
        self.scene, self.angle = gfx.Scene(), 0.9
        self.camera = gfx.PerspectiveCamera(40, size[0] / size[1], depth_range=(0.5, 30))
        sun = gfx.DirectionalLight(intensity=2)
        sun.local.position = (2, -3, 6)
        self.scene.add(gfx.Background.from_color("#d0d8e8"), gfx.AmbientLight(intensity=1.5), sun)
        for x in range(4):
            for y in range(4):
                solid = gfx.box_geometry(0.8, 0.8, 0.8) if (x + y) % 2 else gfx.sphere_geometry(0.5, 32, 32)
                self._add(solid, (1.05 * x - 1.6, 1.05 * y - 1.6, 0.4), (0.75, 0.45 + 0.1 * x, 0.35 + 0.1 * y))
        self._add(gfx.plane_geometry(6, 6), (0, 0, 0), (0.85, 0.83, 0.8))
        self.canvas.request_draw(lambda: self.renderer.render(self.scene, self.camera))

    def _add(self, geometry: Any, at: tuple[float, float, float], color: tuple[float, float, float]) -> None:
        import pygfx as gfx

        mesh = gfx.Mesh(geometry, gfx.MeshPhongMaterial(color=color, specular="#222"))
        mesh.local.position = at
        self.scene.add(mesh)

    def draw(self) -> None:
        from math import cos, sin

        self.angle += 0.05
        self.camera.local.position = (7.5 * cos(self.angle), -7.5 * sin(self.angle), 5.0)
        self.camera.show_pos((0, 0, 0.2), up=(0, 0, 1))
        self.frame = self.canvas.draw()

    def picture(self) -> Picture:
        import numpy as np

        return np.asarray(self.frame)[..., :3].copy()

    def attach(self, effect: Callable[..., Any], **values: Any) -> Attachment:
        return adapter.attach(self.renderer, effect, **values)

    def resize(self, size: tuple[int, int]) -> None:
        self.canvas.set_logical_size(*size)

    def close(self) -> None:
        self.canvas.close()


def by_hand() -> list[Any]:
    """Return the measured effect as three passes of pygfx's own, with WGSL by hand."""
    from pygfx.renderers.wgpu import EffectPass

    weights = [f"{gaussian_weights(3.0, 7)[abs(i)]:.9g}" for i in range(-7, 8)]
    read = "fn texel(p: vec2i) -> vec4f { return textureLoad(colorTex, p, 0); }"

    def blur(step: str) -> str:
        return (
            f"var w = array<f32, 15>({', '.join(weights)}); let last = vec2i(textureDimensions(colorTex)) - 1;"
            "var c = vec4f(); for (var i = -7; i <= 7; i++) "
            f"{{ c += w[i + 7] * texel(clamp(p + {step}, vec2i(), last)); }} return c;"
        )

    def made(body: str) -> Any:
        head = (
            "@fragment fn fs_main(varyings: Varyings) -> @location(0) vec4<f32> { let p = vec2i(varyings.position.xy);"
        )
        return type("ByHand", (EffectPass,), {"wgsl": f"{read}\n{head} {body} }}"})()

    return [made(body) for body in (_GRAY, blur("vec2i(i, 0)"), blur("vec2i(0, i)"))]


def times() -> None:
    """Print the medians of frames that alternate, in milliseconds of CPU time, and how many bits the effect leaves."""
    import numpy as np

    from docs.engines.table import FRAMES, ROUNDS, SIZE

    scene = Scene(SIZE)
    scene.draw()
    plain = tuple(scene.renderer.effect_passes)
    attached = scene.attach(gray_and_soft)
    scene.draw()
    ours = tuple(scene.renderer.effect_passes)
    variants = {"without": plain, "passgraph": ours, "by hand": (*plain, *by_hand())}
    spent: dict[str, list[float]] = {name: [] for name in variants}
    for number in range(ROUNDS):
        for name, passes in variants.items():
            scene.renderer.effect_passes = passes
            for frame in range(FRAMES + 1):
                start = time.process_time()
                scene.draw()  # reads the picture back, so the device has finished
                if number and frame:
                    spent[name].append(1000.0 * (time.process_time() - start))
    ms = {name: median(each) for name, each in spent.items()}
    own, hand = ms["passgraph"] - ms["without"], ms["by hand"] - ms["without"]
    angle, pictures = scene.angle, []
    for passes in (plain, ours, plain):
        scene.renderer.effect_passes, scene.angle = passes, angle
        scene.draw()
        pictures.append(scene.picture())
    attached.close()
    figures = " ".join(f"{name} {value:.1f}" for name, value in ms.items())
    changed = int(np.bitwise_count(pictures[0] ^ pictures[2]).sum())
    print(f"{figures}, {ms['passgraph'] / ms['by hand']:.2f} x, alone {own / hand:.2f} x, bits changed {changed}")


if __name__ == "__main__":
    times() if "--times" in sys.argv[1:] else show(Scene)
