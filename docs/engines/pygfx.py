"""Ambient occlusion on solids in pygfx, from its depth texture and camera.

    python docs/engines/pygfx.py

writes docs/images/engines/pygfx.png.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

if __name__ == "__main__":
    import demo  # noqa: F401 (puts the checkout on the path)

from docs.engines.demo import Picture, occluded, show
from passgraph.engines import pygfx as adapter
from passgraph.engines.attachment import Attachment


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


if __name__ == "__main__":
    show(Scene)
