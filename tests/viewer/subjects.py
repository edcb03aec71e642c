"""What tests view: kernels in files, and a session whose states they wait for."""

from __future__ import annotations

import queue
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

import passgraph as pg
from passgraph.commands.view import EffectSubject
from passgraph.viewer.compiled import Compiled
from passgraph.viewer.session import Published, Session
from passgraph.viewer.subject import Subject
from tests.test_lines import Wrong

KERNEL = '''import passgraph as pg

@pg.kernel
def tint(color: pg.Image, gain: float = 1.0) -> pg.vec4:
    """Brighter.

    Parameters
    ----------
    gain : factor of all channels
    """
    return pg.vec4(color[0, 0].rgb * gain, 1.0)
'''


class SineForCosine(Wrong):
    """A backend with a mistake, by a name."""

    name = "mistaken"

    def __init__(self, device: str | None = None) -> None:
        super().__init__("cos", "sin")


def files(folder: Path, text: str = KERNEL) -> tuple[Path, Path]:
    """An effect and a picture of 8x4 texels in a folder."""
    effect, picture = folder / "mine.py", folder / "picture.png"
    effect.write_text(text)
    pixels = np.full((4, 8, 4), 51, np.uint8)
    pixels[..., 3] = 255
    pixels[1, 2] = (0, 102, 204, 255)
    pg.save(picture, pixels)
    return effect, picture


class Watched:
    """A session on files of a folder, and what it publishes."""

    def __init__(
        self, *words: str, size: tuple[int, int] = (8, 4), backend: str = "numpy", subject: Subject | None = None
    ) -> None:
        self.states: queue.Queue[Published] = queue.Queue()
        shown = subject or EffectSubject(words[0], words[1:], size, None)
        self.session = Session(shown, backend, self.states.put)
        self.session.start()

    def until(self, fits: Callable[[Published], Any]) -> Published:
        """The first state that fits."""
        while not fits(state := self.states.get(timeout=60.0)):
            pass
        return state

    def shows(self, x: int, y: int, color: tuple[int, ...]) -> Published:
        """The first state in which a pixel has a color."""
        return self.until(lambda state: state.pictures and tuple(self.session.picture("shown")[y, x, :3]) == color)

    def programs(self) -> Mapping[str, Compiled]:
        """The programs that are shown, by slot."""
        program_set = self.session.programs.current
        assert program_set is not None
        return program_set.programs

    def __enter__(self) -> Watched:
        return self

    def __exit__(self, *_: object) -> None:
        self.session.close()
