"""What windows go through while an effect is attached: test_window_lives.py runs each function in a process."""

from __future__ import annotations

import gc
import sys
from importlib import import_module
from typing import Any

import numpy as np

from docs.engines.demo import Scene, inverse, inverse_of
from passgraph.engines.attachment import Attachment

SIZE = (67, 45)


def _same(one: Any, other: Any) -> None:
    np.testing.assert_array_equal(one, other)


def _whole(*attached: Attachment) -> None:
    for each in attached:
        assert each.error is None, each.error


def _check(scene: Any, attached: Attachment, turned: Any) -> None:
    """A frame with the effect is that of the same frame without; ``turned`` has the angle that moves."""
    pictures = []
    _whole(attached)
    for attached.enabled in (False, True):
        turned.angle_rad = 1.0
        scene.draw()
        pictures.append(scene.picture())
    _whole(attached)
    _same(pictures[1], inverse_of(pictures[0]))


def _opened(name: str) -> Scene:
    scene: Scene = import_module(f"docs.engines.{name}").Scene(SIZE)
    scene.draw()
    return scene


def two_effects_run_in_the_order_in_which_they_came() -> None:
    """On one window; the first can go while the other stays."""
    import passgraph as pg
    from passgraph.engines import moderngl_window

    left = pg.kernel(source="def left(c: Image) -> vec4: return vec4(1.0, c[0, 0].gb, 1.0)")
    double = pg.kernel(source="def double(c: Image) -> vec4: return vec4(c[0, 0].r * 0.4, c[0, 0].gb, 1.0)")
    scene: Any = _opened("moderngl_window")
    plain = scene.picture()
    first = moderngl_window.attach(scene.window, lambda frame: left(frame, into=pg.target("left", "rgba8")))
    second = moderngl_window.attach(scene.window, lambda frame: double(frame, into=pg.target("double", "rgba8")))
    scene.draw()
    assert set(scene.picture()[..., 0].flat) == {102}, "the second effect reads what the first wrote"
    first.close()
    scene.draw()
    assert plain[0, 0, 0] * 0.4 == scene.picture()[0, 0, 0]
    assert vars(scene.window)["swap_buffers"]
    second.close()
    assert "swap_buffers" not in vars(scene.window), "the window has its own method again"
    _whole(first, second)


def two_windows_of_one_process() -> None:
    """Their contexts share objects, and are two hosts."""
    from pyglet import gl

    from passgraph.engines import pyglet as adapter

    one: Any = _opened("pyglet")
    other: Any = type(one)((50, 31))
    both = [adapter.attach(scene.window, inverse) for scene in (one, other)]
    for _ in range(3):
        for scene, attached in ((one, both[0]), (other, both[1])):
            _check(scene, attached, scene)
    one.window.switch_to()
    other.window.flip()  # with another window's context current
    _whole(*both)
    assert gl.current_context is other.window.context
    other.window.close()
    assert not both[1].enabled, "closing the window has closed what was attached"
    one.draw()
    _whole(*both)


def a_context_is_made_anew() -> None:
    """pygame makes another one where the window was one without OpenGL meanwhile; the effect goes on in that."""
    import moderngl

    from docs.engines.boxes import Boxes

    scene: Any = _opened("pygame")
    with scene.attach(inverse) as attached:
        scene.draw()
        scene.display.set_mode(SIZE, 0)
        scene.display.set_mode(SIZE, scene.flags)
        scene.context = moderngl.create_context()
        scene.boxes = Boxes(scene.context)
        _check(scene, attached, scene.boxes)


def the_display_is_closed_first() -> None:
    """With pygame's display goes all that was made in it: programs and hosts close after it, and without them."""
    import pygame

    import passgraph as pg

    kernel = pg.kernel(source="def same(c: Image) -> vec4: return c[0, 0]")
    for closes in (True, False, True):
        scene: Any = _opened("pygame")
        host = pg.gl.Host.current("sibling")
        program = pg.compile(kernel(pg.Input("frame"), into=pg.target("made", "rgba8")), backend=host)
        frame = host.framebuffer(srgb=False)
        program.run(frame=frame, into={"made": frame})
        pygame.display.flip = scene.swap
        pygame.display.quit()
        if closes:
            host.close()
        del program, host, frame
        gc.collect()


def a_window_beside_the_display() -> None:
    """pygame-ce's other kind of window, with OpenGL, through a change of its size and to its end."""
    import moderngl
    import pygame

    from docs.engines.boxes import Boxes
    from passgraph.engines import pygame as adapter

    class Window(pygame.Window):
        """Has attributes, which pygame's own class has not."""

    pygame.display.init()
    for name, value in (("MAJOR_VERSION", 3), ("MINOR_VERSION", 3), ("PROFILE_MASK", 1)):
        pygame.display.gl_set_attribute(getattr(pygame, f"GL_CONTEXT_{name}"), value)
    window = Window("boxes", SIZE, opengl=True)
    context = moderngl.create_context()
    boxes = Boxes(context)
    swap, window.flip = window.flip, lambda: None  # what was drawn can be read until the next frame

    def drawn() -> Any:
        swap()
        boxes.angle_rad = 1.0
        context.screen.use()
        boxes.draw(window.size)
        window.flip()
        rows = np.frombuffer(context.screen.read((0, 0, *window.size), components=3), np.uint8)
        return rows.reshape(*window.size[::-1], 3)[::-1].copy()

    attached = adapter.attach(window, inverse)
    for size in (SIZE, (90, 60)):
        swap()
        window.size = size
        pygame.event.get()
        attached.enabled = False
        plain = drawn()
        attached.enabled = True
        _same(drawn(), inverse_of(plain))
        _whole(attached)
        assert plain.shape[:2] == size[::-1]
    window.destroy()
    assert not attached.enabled, "destroying the window has closed what was attached"


def a_widget_moves_to_another_window() -> None:
    """Qt makes a new context for it; the effect goes on in that."""
    from PySide6.QtWidgets import QVBoxLayout, QWidget

    scene: Any = _opened("qt")
    attached = scene.attach(inverse)
    scene.draw()
    before = scene.widget.context()
    parent = QWidget()
    QVBoxLayout(parent).addWidget(scene.widget)
    parent.resize(120, 90)
    parent.show()
    scene.application.processEvents()
    assert scene.widget.context() is not before
    _check(scene, attached, scene.widget.boxes)
    attached.close()


def picking_goes_without() -> None:
    """vispy finds what is under a pixel by colours that it draws: no effect changes these."""
    scene: Any = _opened("vispy")
    middle = tuple(side // 2 for side in scene.canvas.size)
    scene.draw()
    plain = scene.canvas.visual_at(middle)
    calls: list[int] = []
    with scene.attach(lambda frame: (calls.append(1), inverse(frame))[1]) as attached:
        assert scene.canvas.visual_at(middle) is plain
        _whole(attached)
    assert plain is not None


def several_samples_a_pixel() -> None:
    """A frame with four is read as their mean, and written in all of them."""
    from moderngl_window.context.headless import Window

    from docs.engines.boxes import Boxes
    from passgraph.engines import moderngl_window

    window = Window(size=SIZE, gl_version=(3, 3), backend="egl", samples=4)
    boxes = Boxes(window.ctx)
    shown = window.ctx.simple_framebuffer(SIZE, 4)

    def drawn() -> Any:
        boxes.angle_rad = 1.0
        window.use()
        boxes.draw(SIZE)
        window.swap_buffers()
        window.ctx.copy_framebuffer(shown, window.fbo)
        return np.frombuffer(shown.read(components=3), np.uint8).reshape(*SIZE[::-1], 3)[::-1].copy()

    plain = drawn()
    with moderngl_window.attach(window, inverse) as attached:
        _same(drawn(), inverse_of(plain))
        _whole(attached)
    _same(drawn(), plain)


if __name__ == "__main__":
    globals()[sys.argv[1]]()
