"""A window of Kivy's, out of focus: the blur is one call beside the widgets.

    xvfb-run -a python docs/engines/kivy.py

writes docs/images/engines/Kivy.png.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

if __name__ == "__main__":
    import demo  # noqa: F401 (puts the checkout on the path)

from docs.engines.demo import Picture, show
from passgraph.effects import gaussian_blur
from passgraph.engines import kivy as adapter
from passgraph.engines.attachment import Attachment


class Scene:
    """Widgets and blended shapes; a process has one window."""

    engine = "Kivy"
    hook = "event `on_flip`"
    needs_display = True
    shown = partial(gaussian_blur, sigma_px=4.0, radius_px=12)

    def __init__(self, size: tuple[int, int]) -> None:
        os.environ.update(KIVY_NO_ARGS="1", KIVY_NO_CONFIG="1", KIVY_NO_FILELOG="1", KIVY_LOG_MODE="MIXED")
        from kivy.config import Config

        for name, value in (("width", size[0]), ("height", size[1]), ("multisamples", 0), ("maxfps", 0)):
            Config.set("graphics", name, str(value))
        from kivy.base import EventLoop, runTouchApp
        from kivy.core.window import Window
        from kivy.graphics import Color, Ellipse, Rectangle
        from kivy.uix.boxlayout import BoxLayout
        from kivy.uix.button import Button
        from kivy.uix.label import Label
        from kivy.uix.slider import Slider

        self.loop, self.window = EventLoop, Window
        root = BoxLayout(orientation="vertical", padding=size[0] // 16, spacing=size[0] // 32)
        with root.canvas.before:
            Color(0.12, 0.25, 0.38, 1)
            Rectangle(size=(2000, 2000))
            for k in range(5):
                Color(0.9, 0.3 + 0.1 * k, 0.2, 0.5)
                Ellipse(pos=(size[0] * k / 6, size[1] * (0.15 + 0.1 * (k % 3))), size=(size[0] / 3, size[0] / 3))
        root.add_widget(Label(text="passgraph", font_size=size[1] / 8))
        self.slider = Slider(min=0, max=20, value=3)
        root.add_widget(self.slider)
        root.add_widget(Button(text="blur", font_size=size[1] / 12))
        runTouchApp(root, embedded=True)
        # A frame is shown when the next one begins, so that what was drawn can be read.
        self.swap, self.window.flip = self.window.flip, lambda: None

    def draw(self) -> None:
        self.swap()
        self.slider.value += 1.0
        self.window.canvas.ask_update()
        self.loop.idle()

    def picture(self) -> Picture:
        from kivy.graphics.opengl import GL_RGBA, GL_UNSIGNED_BYTE, glReadPixels

        width, height = self.window.system_size
        read = glReadPixels(0, 0, int(width), int(height), GL_RGBA, GL_UNSIGNED_BYTE)
        return np.frombuffer(read, np.uint8).reshape(int(height), int(width), 4)[::-1, :, :3].copy()

    def attach(self, effect: Callable[..., Any], **values: Any) -> Attachment:
        return adapter.attach(self.window, effect, **values)

    def hook_in(self, call: Callable[[], object]) -> Callable[[], object]:
        def handler(*_: object) -> None:
            call()

        # The one bound last is called first; the effect comes before this.
        attached = list(self.window.get_property_observers("on_flip", args=True))
        for made in attached:
            self.window.funbind("on_flip", made[0])
        self.window.fbind("on_flip", handler)
        for made in attached:
            self.window.fbind("on_flip", made[0])
        return lambda: self.window.funbind("on_flip", handler)

    def resize(self, size: tuple[int, int]) -> None:
        self.window.system_size = size
        self.loop.idle()

    def close(self) -> None:
        self.window.close()


if __name__ == "__main__":
    show(Scene)
