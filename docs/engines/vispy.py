"""Ambient occlusion in vispy, from the depth buffer and the camera of a view.

    python docs/engines/vispy.py

writes docs/images/engines/vispy.png; headless, through EGL.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

if __name__ == "__main__":
    import demo  # noqa: F401 (puts the checkout on the path)

from docs.engines.demo import Picture, occluded, show
from passgraph.engines import vispy as adapter
from passgraph.engines.attachment import Attachment
from passgraph.engines.hooks import hook


class Scene:
    """A surface with spheres on it, turned by a turntable camera."""

    engine = "vispy"
    hook = "behind the scene's drawing"
    shown = partial(occluded, radius=0.8)

    def __init__(self, size: tuple[int, int]) -> None:
        # vispy asks EGL for its default display, which is none where there is no screen.
        os.environ.setdefault("EGL_PLATFORM", "surfaceless")
        import vispy

        vispy.use("egl")
        from vispy import scene
        from vispy.visuals.filters import ShadingFilter

        self.canvas = scene.SceneCanvas(size=size, show=True, bgcolor=(0.55, 0.65, 0.80, 1.0))
        self.view = self.canvas.central_widget.add_view()
        self.view.camera = scene.TurntableCamera(fov=40, distance=4.6, elevation=38, azimuth=30)
        self.view.camera.depth_value = 100.0
        y, x = np.mgrid[-2:2:60j, -2:2:60j]
        z = 0.35 * np.sin(2.0 * x) * np.cos(2.5 * y)
        parent = self.view.scene
        surface = scene.visuals.SurfacePlot(x=x[0], y=y[:, 0], z=z.T, color=(0.75, 0.72, 0.66, 1), parent=parent)
        surface.shading_filter.ambient_light = (1, 1, 1, 0.6)
        for place, radius, colour in (
            ((0.2, 0.1, 0.55), 0.5, (0.80, 0.35, 0.30, 1)),
            ((-0.9, 0.8, 0.45), 0.4, (0.35, 0.60, 0.80, 1)),
            ((0.9, -0.7, 0.35), 0.35, (0.85, 0.75, 0.40, 1)),
        ):
            ball = scene.visuals.Sphere(radius=radius, method="ico", subdivisions=4, color=colour, parent=parent)
            ball.transform = scene.transforms.STTransform(translate=place)
            ball.mesh.attach(ShadingFilter("smooth", light_dir=(-0.4, 0.5, -1.0)))
        self.shown_picture: Any = None

    def draw(self) -> None:
        self.view.camera.azimuth += 3.0
        self.shown_picture = self.canvas.render(alpha=False)

    def picture(self) -> Picture:
        return np.array(self.shown_picture, np.uint8)

    def attach(self, effect: Callable[..., Any], **values: Any) -> Attachment:
        return adapter.attach(self.canvas, effect, view=self.view, **values)

    def hook_in(self, call: Callable[[], object]) -> Callable[[], object]:
        return hook(self.canvas, "_draw_scene", after=lambda: (self.canvas.context.flush_commands(), call()))

    def resize(self, size: tuple[int, int]) -> None:
        self.canvas.size = size

    def close(self) -> None:
        self.canvas.close()


if __name__ == "__main__":
    show(Scene)
