"""Ambient occlusion in moderngl-window, from its depth buffer and the camera of whoever draws.

    python docs/engines/moderngl_window.py

writes docs/images/engines/moderngl-window.png; headless, through EGL.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

if __name__ == "__main__":
    import demo  # noqa: F401 (puts the checkout on the path)

from docs.engines.boxes import Boxes
from docs.engines.demo import Picture, occluded, show
from passgraph.engines import moderngl_window as adapter
from passgraph.engines.attachment import Attachment
from passgraph.engines.hooks import hook


class Scene:
    """Boxes in a window without a screen; a window of pyglet, glfw or SDL2 differs in its class alone."""

    engine = "moderngl-window"
    hook = "`swap_buffers`"
    shown = partial(occluded, radius=1.5)

    def __init__(self, size: tuple[int, int]) -> None:
        from moderngl_window.context.headless import Window

        self.window = Window(size=size, gl_version=(3, 3), backend="egl", samples=0)
        self.boxes = Boxes(self.window.ctx)

    def draw(self) -> None:
        self.window.use()
        self.boxes.draw(self.window.size)
        self.window.swap_buffers()

    def picture(self) -> Picture:
        width, height = self.window.size
        rows = np.frombuffer(self.window.fbo.read(components=3), np.uint8)
        return rows.reshape(height, width, 3)[::-1].copy()

    def attach(self, effect: Callable[..., Any], **values: Any) -> Attachment:
        return adapter.attach(self.window, effect, camera=self.boxes.camera, **values)

    def hook_in(self, call: Callable[[], object]) -> Callable[[], object]:
        return hook(self.window, "swap_buffers", before=call)

    def resize(self, size: tuple[int, int]) -> None:
        self.window.size = size

    def close(self) -> None:
        self.boxes.release()
        self.window.destroy()


if __name__ == "__main__":
    show(Scene)
