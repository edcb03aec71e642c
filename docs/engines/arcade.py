"""Bloom on sprites and shapes of arcade.

    xvfb-run -a python docs/engines/arcade.py

writes docs/images/engines/arcade.png.  Without a display, ARCADE_HEADLESS=1 goes through EGL.
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

from docs.engines.demo import Picture, show
from passgraph.effects import bloom
from passgraph.engines import pyglet as adapter
from passgraph.engines.attachment import Attachment
from passgraph.engines.hooks import hook


class Scene:
    """Crates on the ground, a player among glowing discs, and a moon: sprites that arcade brings."""

    engine = "arcade"
    hook = "`flip`"
    needs_display = True
    shown = partial(bloom, threshold=0.65, intensity=1.5, levels=5)

    def __init__(self, size: tuple[int, int]) -> None:
        if "DISPLAY" not in os.environ:
            os.environ["ARCADE_HEADLESS"] = "1"
        import arcade

        self.arcade = arcade
        self.window = arcade.Window(*size, "scene", resizable=True, vsync=False, antialiasing=False)
        self.sprites = arcade.SpriteList()
        self.unit = size[0] / 640
        for k in range(12):
            self._sprite("tiles/grassMid.png", 0.5, 32 + 64 * k, 32)
        for x, y in ((180, 96), (244, 96), (212, 160), (460, 96)):
            self._sprite("tiles/boxCrate_double.png", 0.5, x, y)
        folder = "animated_characters/female_adventurer"
        self.player = self._sprite(f"{folder}/femaleAdventurer_idle.png", 0.75, 340, 112)
        self.angle_rad = 0.0
        # A frame is shown when the next one begins, so that what was drawn can be read.
        self.swap, self.window.flip = self.window.flip, lambda: None

    def _sprite(self, name: str, scale: float, x: float, y: float) -> Any:
        unit = self.unit
        made = self.arcade.Sprite(f":resources:images/{name}", scale * unit, x * unit, y * unit)
        self.sprites.append(made)
        return made

    def draw(self) -> None:
        arcade, unit = self.arcade, self.unit
        self.swap()
        self.window.switch_to()
        self.angle_rad += 0.1
        self.player.center_x = (340 + 40 * math.sin(self.angle_rad)) * unit
        self.window.clear(color=(24, 26, 48))
        arcade.draw_circle_filled(540 * unit, 320 * unit, 36 * unit, (250, 245, 220))
        for k in range(6):
            turn = self.angle_rad + math.tau * k / 6
            x, y = 340 + 110 * math.cos(turn), 200 + 70 * math.sin(turn)
            arcade.draw_circle_filled(x * unit, y * unit, 9 * unit, (255, 170, 60))
        self.sprites.draw()
        self.window.flip()

    def picture(self) -> Picture:
        return np.array(self.arcade.get_image().convert("RGB"), np.uint8)

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
