"""Textures of materials as inputs that bring their own picture."""

from __future__ import annotations

import numpy as np

import passgraph as pg
from passgraph.effects.surfaces.mip_maps import Mips, Use, mips_of, wrap_number
from passgraph.scene import Texture


class TextureInputs:
    """One input for each texture, however many materials share it; names stay unique."""

    def __init__(self) -> None:
        self._made: dict[tuple[int, str], pg.Target] = {}
        self._mips: dict[tuple[int, str], tuple[pg.Target, Mips]] = {}

    def of(self, texture: Texture, use: Use) -> pg.Target:
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

    def levels(self, texture: Texture, use: Use) -> dict[str, object]:
        """What `mip_maps.mipped` takes beside a texture: the input of its levels, their size, count and wrap."""
        key = (id(texture), use)
        if key not in self._mips:
            mips = mips_of(texture.decode(), use, texture.wrap)
            kind = "rgba16f" if use == "base color" else "rgba8"
            size = (mips.picture.shape[1], mips.picture.shape[0])
            name = f"{texture.name} ({use} levels {len(self._mips)})"
            made = (
                pg.Input(name, kind, size, static=True, default=mips.picture) if mips.count else self.of(texture, use)
            )
            self._mips[key] = made, mips
        levels, mips = self._mips[key]
        return {
            "levels": levels, "size": tuple(map(float, mips.size)), "count": mips.count,
            "wrap": wrap_number(texture.wrap),
        }  # fmt: skip
