"""Bloom over a picture in napari, whose canvas is a widget of Qt's.

    xvfb-run -a python docs/engines/napari.py

writes docs/images/engines/napari.png.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

if __name__ == "__main__":
    import demo  # noqa: F401 (puts the checkout on the path)

from docs.engines.demo import Picture, show
from passgraph.effects import bloom
from passgraph.engines import qt as adapter
from passgraph.engines.attachment import Attachment
from passgraph.engines.hooks import hook


def cells(side: int = 256) -> np.ndarray:
    """Bright spots of several sizes on a dim ground, (side, side) float32: what microscopes see."""
    rng = np.random.default_rng(4)
    y, x = np.mgrid[:side, :side]
    picture = 0.05 + 0.03 * np.sin(x / 19.0) * np.cos(y / 23.0)
    for column, row, size in rng.uniform((0, 0, 3), (side, side, 12), (40, 3)):
        picture += np.exp(-0.5 * ((x - column) ** 2 + (y - row) ** 2) / size**2)
    return picture.astype(np.float32)


class Scene:
    """A picture that moves under the camera."""

    engine = "napari"
    hook = "behind `paintGL`"
    needs_display = True
    shown = partial(bloom, intensity=0.6, threshold=0.2)

    def __init__(self, size: tuple[int, int]) -> None:
        import napari

        self.viewer = napari.Viewer(show=False)
        self.viewer.add_image(cells(), colormap="magma")
        self.camera = getattr(self.viewer, "scene", self.viewer).camera  # of the scene from napari 0.9 on
        # napari calls the window's parts its own; Qt knows the canvas as a widget like any other.
        self.widget = self.viewer.window._qt_viewer.canvas.native
        self.widget.setParent(None)
        self.resize(size)
        self.widget.show()
        self.image: Any = None
        self.draw()

    def draw(self) -> None:
        from qtpy.QtWidgets import QApplication

        row, column = self.camera.center[-2:]
        self.camera.center = (row, column + 3.0)
        QApplication.processEvents()
        self.image = self.widget.grabFramebuffer()

    def picture(self) -> Picture:
        image = self.image.convertToFormat(self.image.Format.Format_RGBA8888)
        width, height, row = image.width(), image.height(), image.bytesPerLine()
        bits = image.constBits()
        if hasattr(bits, "setsize"):  # PyQt's, which does not know how many there are
            bits.setsize(row * height)
        return np.frombuffer(bits, np.uint8).reshape(height, row // 4, 4)[:, :width, :3].copy()

    def attach(self, effect: Callable[..., Any], **values: Any) -> Attachment:
        return adapter.attach(self.widget, effect, **values)

    def hook_in(self, call: Callable[[], object]) -> Callable[[], object]:
        return hook(self.widget, "paintGL", after=call)

    def resize(self, size: tuple[int, int]) -> None:
        self.widget.resize(*size)

    def close(self) -> None:
        self.viewer.close()


if __name__ == "__main__":
    show(Scene)
