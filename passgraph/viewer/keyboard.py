"""The keys of the page as the picture that Shadertoy gives to shaders."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import InputError
from passgraph.shaders.containers.signals import SIGNALS

#: Rows of the picture, from its top. Shaders count them from the bottom: down, pressed, toggled.
_TOGGLED, _PRESSED, _DOWN = range(3)


class Keyboard:
    """The state of each key, by JavaScript's ``keyCode``."""

    def __init__(self) -> None:
        width, height = SIGNALS["keyboard"]
        self._picture = np.zeros((height, width, 1), np.uint8)

    def change(self, code: int, down: bool) -> None:
        """Press or release a key; a key that is down already is not pressed again."""
        if not 0 <= code < self._picture.shape[1]:
            raise InputError(f"a key has a code from 0 to {self._picture.shape[1] - 1}, got {code}")
        is_down = bool(self._picture[_DOWN, code])
        self._picture[_DOWN, code] = 255 * down
        if down and not is_down:
            self._picture[_PRESSED, code] = 255
            self._picture[_TOGGLED, code] ^= 255

    def picture(self) -> NDArray[np.uint8]:
        """Return a copy of the picture, (3, 256, 1)."""
        return self._picture.copy()

    def end_frame(self) -> None:
        """Forget which keys were pressed in the frame."""
        self._picture[_PRESSED] = 0
