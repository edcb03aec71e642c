"""Requests of the page, from any thread: settings, keys, and how many clients wait for a picture."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.viewer.display import Look
from passgraph.viewer.keyboard import Keyboard


@dataclass(frozen=True)
class Settings:
    """The settings of the page.

    Attributes
    ----------
    values : values of the controls that were moved, by name
    target : the name of the target to show; empty for the first output
    look : how the target is shown
    backend, other : names of the backends; ``other`` is compared with the first, `REFERENCE_FILE` for a picture, or
        empty
    compare : "", "other", "both", "difference" or "flip"
    gain : factor of differences
    playing : True while frames play
    frame : frame number from 0, of the input's frames or of the time
    steps, restarts : how often the page requested the next frame, and the first one
    orbit : radians to the right and up, and the factor of the distance
    """

    values: Mapping[str, Any] = field(default_factory=dict)
    target: str = ""
    look: Look = field(default_factory=Look)
    backend: str = ""
    other: str = ""
    compare: str = ""
    gain: float = 1.0
    playing: bool = False
    frame: int = 0
    steps: int = 0
    restarts: int = 0
    orbit: tuple[float, float, float] = (0.0, 0.0, 1.0)


class Requests:
    """The latest requests; each change wakes the thread that waits for one."""

    def __init__(self, settings: Settings) -> None:
        self._changed = threading.Condition()
        self.settings = settings
        self.keyboard = Keyboard()
        self.closed = False
        self._dirty = True
        self._waiting = 0  # clients that can take the next picture

    def ask(self, **changes: Any) -> None:
        """Change fields of `Settings`."""
        with self._changed:
            self.settings = replace(self.settings, **changes)
            self._dirty = True
            self._changed.notify()

    def ready(self) -> None:
        """Count a client that has shown the last picture and can take the next one."""
        with self._changed:
            self._waiting += 1
            self._changed.notify()

    def answered(self) -> None:
        """Note that every waiting client was answered: a picture was sent, or there is none."""
        with self._changed:
            self._waiting = 0

    def key(self, code: int, down: bool) -> None:
        """Press or release a key. Playing shaders read it in the next frame, others are run for it."""
        with self._changed:
            self.keyboard.change(code, down)
            self._dirty |= not self.settings.playing
            self._changed.notify()

    def close(self) -> None:
        with self._changed:
            self.closed = True
            self._changed.notify()

    def wait(self, seconds: float) -> tuple[Settings, bool, bool]:
        """Wait for a request: return the settings, True if they changed, and True if the next frame is due."""
        with self._changed:
            if not (self._dirty or self.closed or (self.settings.playing and self._waiting)):
                self._changed.wait(seconds)
            changed, self._dirty = self._dirty, False
            return self.settings, changed, self.settings.playing and self._waiting > 0

    def show_frame(self, frame: int) -> None:
        """Set the number of the frame that is shown, which is no request for another picture."""
        with self._changed:
            self.settings = replace(self.settings, frame=frame)

    def end_frame(self) -> NDArray[np.uint8]:
        """Return the keys of a frame, and forget which were pressed in it."""
        with self._changed:
            keys = self.keyboard.picture()
            self.keyboard.end_frame()
            return keys
