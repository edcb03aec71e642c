"""Ambient occlusion in a QOpenGLWidget, which moderngl draws into.

    xvfb-run -a python docs/engines/qt.py

writes docs/images/engines/PySide6.png.
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
from passgraph.engines import qt as adapter
from passgraph.engines.attachment import Attachment
from passgraph.engines.hooks import hook


class Scene:
    """Boxes in a widget; a process has one QApplication."""

    engine = "PySide6"
    hook = "behind `paintGL`"
    needs_display = True
    shown = partial(occluded, radius=1.5)

    def __init__(self, size: tuple[int, int]) -> None:
        from PySide6.QtGui import QSurfaceFormat
        from PySide6.QtOpenGLWidgets import QOpenGLWidget
        from PySide6.QtWidgets import QApplication

        kind = QSurfaceFormat()
        kind.setVersion(3, 3)
        kind.setProfile(QSurfaceFormat.OpenGLContextProfile.CoreProfile)
        kind.setDepthBufferSize(24)
        QSurfaceFormat.setDefaultFormat(kind)
        self.application = QApplication.instance() or QApplication([])

        class Widget(QOpenGLWidget):
            def initializeGL(self) -> None:
                import moderngl

                self.moderngl = moderngl.create_context()
                self.boxes = Boxes(self.moderngl)

            def paintGL(self) -> None:
                self.moderngl.detect_framebuffer(self.defaultFramebufferObject()).use()
                self.boxes.draw((self.width(), self.height()))

        self.widget = Widget()
        self.resize(size)
        self.widget.show()
        self.application.processEvents()
        self.image: Any = None

    def draw(self) -> None:
        self.image = self.widget.grabFramebuffer()

    def picture(self) -> Picture:
        image = self.image.convertToFormat(self.image.Format.Format_RGBA8888)
        width, height = image.width(), image.height()
        rows = np.frombuffer(image.constBits(), np.uint8).reshape(height, image.bytesPerLine() // 4, 4)
        return rows[:, :width, :3].copy()

    def attach(self, effect: Callable[..., Any], **values: Any) -> Attachment:
        return adapter.attach(self.widget, effect, camera=Boxes.camera, **values)

    def hook_in(self, call: Callable[[], object]) -> Callable[[], object]:
        return hook(self.widget, "paintGL", after=call)

    def resize(self, size: tuple[int, int]) -> None:
        self.widget.resize(*size)

    def close(self) -> None:
        self.widget.makeCurrent()
        self.widget.boxes.release()
        self.widget.doneCurrent()
        self.widget.close()


if __name__ == "__main__":
    show(Scene)
