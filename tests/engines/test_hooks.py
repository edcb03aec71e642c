"""Hooks into methods, and what adapters refuse."""

from __future__ import annotations

from importlib import import_module
from types import SimpleNamespace
from typing import Any

import pytest

import passgraph as pg
from passgraph.effects import black_and_white
from passgraph.engines.hooks import hook


class Window:
    """Like an engine's: a method of the class."""

    def __init__(self) -> None:
        self.seen: list[str] = []

    def flip(self, count: int = 1) -> int:
        self.seen.append("flip")
        return 2 * count


def test_calls_come_in_order_and_arguments_and_results_pass() -> None:
    window = Window()
    hook(window, "flip", before=lambda: window.seen.append("first"))
    hook(window, "flip", before=lambda: window.seen.append("second"), after=lambda: window.seen.append("after"))
    assert window.flip(count=3) == 6
    assert window.seen == ["first", "second", "flip", "after"]


def test_the_last_end_leaves_the_object_as_it_was() -> None:
    window = Window()
    ends = [hook(window, "flip", before=lambda: window.seen.append("ours")) for _ in range(2)]
    ends[0]()
    ends[0]()  # a second time does nothing
    window.flip()
    assert window.seen == ["ours", "flip"]
    ends[1]()
    assert vars(window).keys() == {"seen"}


def test_what_an_object_had_of_its_own_comes_back() -> None:
    def own() -> None: ...

    window = SimpleNamespace(flip=own)
    hook(window, "flip", before=lambda: None)()
    assert window.flip is own


def test_a_wrapper_of_someone_else_s_around_ours_stays() -> None:
    window: Any = Window()
    end = hook(window, "flip", before=lambda: window.seen.append("ours"))
    ours = window.flip
    window.flip = theirs = lambda: ours()
    end()
    window.flip()
    assert window.flip is theirs
    assert window.seen == ["flip"]


def test_a_hook_may_end_itself() -> None:
    window = Window()
    end = hook(window, "flip", before=lambda: end())
    window.flip()
    window.flip()
    assert window.seen == ["flip", "flip"]
    assert vars(window).keys() == {"seen"}


@pytest.mark.parametrize(
    ("engine", "says"),
    [
        ("pyglet", "pyglet: attach takes a pyglet.window.Window or an arcade.Window, got 'no window', which has"),
        ("moderngl_window", "moderngl-window: attach takes a window of moderngl_window's, got 'no window'"),
        ("pygame", "pygame: attach takes the module pygame.display, got 'no window', which has no flip .*get_surface"),
        ("qt", "qt: attach takes a QOpenGLWidget or QOpenGLWindow, got 'no window', which has no paintGL"),
        ("vispy", "vispy: attach takes a vispy.scene.SceneCanvas, got 'no window'"),
        ("kivy", "kivy: attach takes kivy.core.window.Window, got 'no window'"),
    ],
)
def test_what_is_no_window_is_refused(engine: str, says: str) -> None:
    with pytest.raises(pg.InputError, match=f"^{says}"):
        import_module(f"passgraph.engines.{engine}").attach("no window", black_and_white)


def test_an_effect_that_cannot_be_made_hooks_nothing() -> None:
    window: Any = SimpleNamespace(swap_buffers=print, fbo=None, destroy=print)
    with pytest.raises(pg.InputError, match="no value 'strength'"):
        import_module("passgraph.engines.moderngl_window").attach(window, black_and_white, strength=1.0)
    assert window.swap_buffers is print
    assert window.destroy is print


@pytest.mark.parametrize(
    ("flags", "size"),
    [(0x10, (64, 48)), (0x01000002, (64, 48)), (0x2, (1280, 960))],
    ids=["no OpenGL", "surfaces, sent by SDL through OpenGL", "scaled surfaces, likewise"],
)
def test_a_display_of_surfaces_has_no_frame_for_effects(flags: int, size: tuple[int, int]) -> None:
    surface = SimpleNamespace(get_flags=lambda: flags, get_size=lambda: (64, 48))
    display = SimpleNamespace(
        flip=lambda: None, quit=lambda: None, set_mode=lambda: None, get_surface=lambda: surface,
        get_window_size=lambda: size,
    )  # fmt: skip
    attach = import_module("passgraph.engines.pygame").attach
    with pytest.raises(pg.InputError, match=r"pygame: the display has no OpenGL; call .*pygame\.OPENGL"):
        attach(display, black_and_white)
    surface.get_flags, display.get_window_size = lambda: 0x2, lambda: (64, 48)
    attach(display, black_and_white).close()
    display.get_surface = lambda: None  # before set_mode
    attach(display, black_and_white).close()


def test_a_window_of_pygame_has_opengl_and_a_flip_of_its_own() -> None:
    class Slotted:
        __slots__ = ()
        opengl = True

        def flip(self) -> None: ...
        def destroy(self) -> None: ...

    attach = import_module("passgraph.engines.pygame").attach
    with pytest.raises(pg.InputError, match=r"of a Slotted cannot be hooked; derive a class"):
        attach(Slotted(), black_and_white)
    calls: list[str] = []
    window = SimpleNamespace(opengl=False, flip=lambda: calls.append("flip"), destroy=lambda: calls.append("destroy"))
    with pytest.raises(pg.InputError, match="the window has no OpenGL; make it with opengl=True"):
        attach(window, black_and_white)
    window.opengl = True
    attached = attach(window, black_and_white)
    window.destroy()
    assert calls == ["destroy"]
    assert not attached.enabled
