"""Ambient occlusion in a window of pygame, which moderngl draws into.

    xvfb-run -a python docs/engines/pygame.py

writes docs/images/engines/pygame-ce.png.  Without a display, SDL_VIDEODRIVER=offscreen goes through EGL.
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
from passgraph.engines import pygame as adapter
from passgraph.engines.attachment import Attachment
from passgraph.engines.hooks import hook


class Scene:
    """Boxes in pygame's window; a process has one."""

    engine = "pygame-ce"
    hook = "`pygame.display.flip`"
    needs_display = True
    shown = partial(occluded, radius=1.5)

    def __init__(self, size: tuple[int, int]) -> None:
        import moderngl
        import pygame

        self.display = display = pygame.display
        display.init()
        for name, value in (("MAJOR_VERSION", 3), ("MINOR_VERSION", 3), ("PROFILE_MASK", 1)):
            display.gl_set_attribute(getattr(pygame, f"GL_CONTEXT_{name}"), value)
        self.flags = pygame.OPENGL | pygame.DOUBLEBUF | pygame.RESIZABLE
        display.set_mode(size, self.flags)
        self.context = moderngl.create_context()
        self.boxes = Boxes(self.context)
        # A frame is shown when the next one begins, so that what was drawn can be read.
        self.swap, display.flip = display.flip, lambda: None

    def draw(self) -> None:
        self.swap()
        self.context.screen.use()
        self.boxes.draw(self.display.get_window_size())
        self.display.flip()

    def picture(self) -> Picture:
        width, height = self.display.get_window_size()
        rows = np.frombuffer(self.context.screen.read((0, 0, width, height), components=3), np.uint8)
        return rows.reshape(height, width, 3)[::-1].copy()

    def attach(self, effect: Callable[..., Any], **values: Any) -> Attachment:
        return adapter.attach(self.display, effect, camera=self.boxes.camera, **values)

    def hook_in(self, call: Callable[[], object]) -> Callable[[], object]:
        return hook(self.display, "flip", before=call)

    def resize(self, size: tuple[int, int]) -> None:
        import pygame

        self.swap()
        self.display.set_mode(size, self.flags)
        pygame.event.get()

    def close(self) -> None:
        self.boxes.release()
        self.display.flip = self.swap
        self.display.quit()


if __name__ == "__main__":
    show(Scene)
