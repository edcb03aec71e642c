"""Ambient occlusion in pyglet, from a window's depth buffer and its own projection and view.

    xvfb-run -a python docs/engines/pyglet.py

writes docs/images/engines/pyglet.png.  Without a display it goes through EGL, headless.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

if __name__ == "__main__":
    import demo  # noqa: F401 (puts the checkout on the path)

from docs.engines.boxes import box
from docs.engines.demo import Picture, occluded, show
from passgraph.engines import pyglet as adapter
from passgraph.engines.attachment import Attachment
from passgraph.engines.hooks import hook

#: (middle, half the sides, colour)
_BOXES = (
    ((0.0, -0.5, 0.0), (6.0, 0.5, 6.0), (178, 172, 165)),
    ((2.6, 0.8, 0.5), (0.8, 0.8, 0.8), (205, 92, 80)),
    ((-2.4, 1.4, -1.0), (0.7, 1.4, 0.7), (95, 150, 205)),
    ((0.2, 0.5, 3.0), (0.9, 0.5, 0.5), (215, 190, 100)),
)


class Scene:
    """Boxes that stand on a floor, and one that turns, as pyglet's vertex lists."""

    engine = "pyglet"
    hook = "`flip`"
    needs_display = True
    shown = partial(occluded, radius=1.5)

    def __init__(self, size: tuple[int, int]) -> None:
        import pyglet

        pyglet.options.headless = "DISPLAY" not in os.environ
        from pyglet import gl

        self.pyglet, self.gl = pyglet, gl
        config = gl.Config(major_version=3, minor_version=3, double_buffer=True, depth_size=24,
                           red_size=8, green_size=8, blue_size=8, alpha_size=8)  # fmt: skip
        self.window = pyglet.window.Window(*size, config=config, resizable=True, vsync=False)
        self.batch = pyglet.graphics.Batch()
        for middle, half, colour in _BOXES:
            self._box(middle, half, colour)
        self.turning: Any = None
        self.angle_rad = 0.0
        # A frame is shown when the next one begins, so that what was drawn can be read.
        self.swap, self.window.flip = self.window.flip, lambda: None

    def _box(self, middle: Any, half: Any, colour: Any, angle_rad: float = 0.0) -> Any:
        corners = box()
        light = 0.45 + 0.55 * np.clip(corners[:, 3:] @ np.array([0.39, 0.78, 0.49]), 0, None)
        x, y, z = (corners[:, :3] * half).T
        cosine, sine = math.cos(angle_rad), math.sin(angle_rad)
        places = np.stack([cosine * x + sine * z, y, cosine * z - sine * x], axis=1) + middle
        shades = np.concatenate([light[:, None] * colour, np.full((36, 1), 255)], axis=1)
        return self.pyglet.graphics.get_default_shader().vertex_list(
            36, self.gl.GL_TRIANGLES, batch=self.batch, position=("f", places.ravel().tolist()),
            colors=("Bn", shades.astype(int).ravel().tolist()),
        )  # fmt: skip

    def draw(self) -> None:
        from pyglet.math import Mat4, Vec3

        gl, window = self.gl, self.window
        self.swap()
        window.switch_to()
        self.angle_rad += 0.1
        if self.turning is not None:
            self.turning.delete()
        self.turning = self._box((0.0, 0.9, 0.0), (0.9, 0.9, 0.9), (110, 180, 110), self.angle_rad)
        gl.glViewport(0, 0, *window.get_framebuffer_size())
        gl.glClearColor(0.55, 0.65, 0.80, 1.0)
        gl.glEnable(gl.GL_DEPTH_TEST)
        window.clear()
        window.projection = Mat4.perspective_projection(window.width / window.height, 1.0, 60.0, 40.0)
        window.view = Mat4.look_at(Vec3(6.5, 5.0, 8.0), Vec3(0.0, 0.6, 0.0), Vec3(0.0, 1.0, 0.0))
        self.batch.draw()
        window.flip()

    def picture(self) -> Picture:
        width, height = self.window.get_framebuffer_size()
        read = (self.gl.GLubyte * (width * height * 4))()
        self.gl.glReadPixels(0, 0, width, height, self.gl.GL_RGBA, self.gl.GL_UNSIGNED_BYTE, read)
        return np.frombuffer(read, np.uint8).reshape(height, width, 4)[::-1, :, :3].copy()

    def attach(self, effect: Callable[..., Any], **values: Any) -> Attachment:
        return adapter.attach(self.window, effect, **values)

    def hook_in(self, call: Callable[[], object]) -> Callable[[], object]:
        return hook(self.window, "flip", before=call)

    def resize(self, size: tuple[int, int]) -> None:
        self.swap()
        self.window.set_size(*size)
        for _ in range(5):  # X answers later
            time.sleep(0.02)
            self.window.dispatch_events()

    def close(self) -> None:
        self.window.close()


if __name__ == "__main__":
    show(Scene)
