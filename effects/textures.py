"""Textures of materials as inputs that bring their own picture."""

from __future__ import annotations

import numpy as np

import passgraph as pg
from passgraph.scene import Texture


class TextureInputs:
    """One input for each texture, however many materials share it; names stay unique."""

    def __init__(self) -> None:
        self._made: dict[tuple[int, str], pg.Target] = {}

    def of(self, texture: Texture, use: str) -> pg.Target:
        """The input of a texture: ``use`` is "base color" (linear RGBA), "normals" or "height" (one)."""
        key = (id(texture), use)
        if key not in self._made:
            pixels = texture.decode()
            if use == "height":
                pixels, kind = pixels[:, :, :1], "r8"
            else:
                # decoded here, once, so that a lookup costs four fetches and no transfer function
                kind = "rgba16f" if use == "base color" else "rgba8"
            name = f"{texture.name} ({use} {len(self._made)})"
            picture = np.ascontiguousarray(pixels)
            self._made[key] = pg.Input(name, kind, texture.size, static=True, border=texture.wrap, default=picture)
        return self._made[key]
