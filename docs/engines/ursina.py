"""Ambient occlusion in Ursina, which is Panda3D: the adapter for that takes Ursina's window.

    python docs/engines/ursina.py

writes docs/images/engines/ursina.png.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

if __name__ == "__main__":
    import demo  # noqa: F401 (puts the checkout on the path)

from docs.engines.demo import Picture, occluded, show
from docs.engines.panda3d import behind_all
from passgraph.engines import panda3d as adapter
from passgraph.engines.attachment import Attachment


class Scene:
    """Cubes and spheres on a floor."""

    engine = "ursina"
    hook = "Panda3D's `DisplayRegion.set_draw_callback`"

    def __init__(self, size: tuple[int, int]) -> None:
        from panda3d.core import load_prc_file_data

        # p3headlessgl renders through EGL, without a display; in a window nothing else changes.
        load_prc_file_data("", "load-display p3headlessgl\naudio-library-name null\nnotify-level-display error\n")
        import ursina

        self.app = ursina.Ursina(window_type="offscreen", size=size, development_mode=False)
        ursina.camera.position, ursina.camera.rotation_x = (0, 7, -14), 25
        ursina.Entity(model="plane", scale=16, color=ursina.color.light_gray)
        self.turned = [
            ursina.Entity(
                model=("cube", "sphere")[(x + z) % 2], position=(1.6 * x, 0.5, 1.6 * z), scale=1.4,
                color=ursina.hsv(25 * (x + 3) + 9 * z, 0.5, 0.9),
            )
            for x in range(-3, 4) for z in range(-2, 4)
        ]  # fmt: skip

    shown = partial(occluded, radius=1.2)

    def draw(self) -> None:
        for number, entity in enumerate(self.turned):
            entity.rotation_y += 3 + number % 4
        self.app.step()

    def picture(self) -> Picture:
        texture = self.app.win.get_screenshot()
        rows = np.frombuffer(texture.get_ram_image_as("RGB"), np.uint8)
        return rows.reshape(texture.get_y_size(), texture.get_x_size(), 3)[::-1].copy()

    def attach(self, effect: Callable[..., Any], **values: Any) -> Attachment:
        return adapter.attach(self.app.win, effect, **values)

    def hook_in(self, call: Callable[[], object]) -> Callable[[], object]:
        return behind_all(self.app.win, call)

    def resize(self, size: tuple[int, int]) -> None:
        self.app.win.set_size(*size)

    def close(self) -> None:
        self.app.destroy()


if __name__ == "__main__":
    show(Scene)
