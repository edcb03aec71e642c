"""Textures that hosts of original shaders have in common."""

from __future__ import annotations

import moderngl
import numpy as np


def smooth(texture: moderngl.Texture) -> moderngl.Texture:
    """The same texture, read linearly and clamped at its edges."""
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
    texture.repeat_x = texture.repeat_y = False
    return texture


def places(context: moderngl.Context, size: tuple[int, int]) -> moderngl.Texture:
    """Where the centre of each pixel lies, from (0, 0) at the first one of the first row to (1, 1), in float32."""
    x, y = ((np.arange(side, dtype=np.float32) + np.float32(0.5)) / np.float32(side) for side in size)
    whole = np.stack(np.broadcast_arrays(x[None, :], y[:, None]), -1)
    return context.texture(size, 2, np.ascontiguousarray(whole).tobytes(), dtype="f4")
