"""Materials of an MTL file as `Material`, and pictures of any file as `Texture`."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from passgraph.errors import InputError
from passgraph.image_files import opened_image
from passgraph.scene.files import FolderReader, plain_name
from passgraph.scene.material import AlphaMode, ColorSpace, Material, Texture, Wrap, check_texels
from passgraph.scene.notes import Notes


@dataclass
class MtlReader:
    """Turns the materials of an MTL file into ours, each once; PLY and the others have a picture at most.

    Attributes
    ----------
    where : the model file, for messages
    folder : reads material files and pictures
    notes : what could not be had
    """

    where: str
    folder: FolderReader
    notes: Notes
    _done: dict[str, Material] = field(default_factory=dict)

    def read(self, source: Any) -> Material:
        """One material; ``source`` is trimesh's SimpleMaterial, which has a name, or None."""
        if source is None:
            return Material(name="default")
        name = str(source.name or "")
        if name not in self._done:
            self._done[name] = self._from_mtl(name, self.folder.materials.get(name, {}))
        return self._done[name]

    def _from_mtl(self, name: str, lines: dict[str, str]) -> Material:
        name = name or "material"
        where = f"material {name!r}"
        extra = {key: line.split() for key, line in lines.items()}
        picture = lines.get("map_kd") or (None if self.folder.materials else self.folder.picture)
        texture = None if picture is None else self._picture(picture, "srgb", f"{name} map_Kd")
        if any(_floats(extra.get("ke"), (0.0, 0.0, 0.0))) or "map_ke" in extra:
            self.notes.add("its emissive light (Ke, map_Ke) is not shown", where)
        # MTL does not say in which space Kd is; it is taken as a reflectance, which is linear
        color = np.array([*_floats(extra.get("kd"), (0.8, 0.8, 0.8)), 1.0])
        if texture is not None and not color[:3].any():
            # a common export: black diffuse colour beside a texture that is meant to be seen
            color[:3] = 1.0
        opacity = _floats(extra.get("d"), (1.0,))[-1]
        if "tr" in extra and "d" not in extra:
            opacity = 1.0 - _floats(extra.get("tr"), (0.0,))[-1]
            if opacity == 0.0:
                # exporters that take Tr for d write 1 for every opaque surface; nobody draws one that cannot be seen
                opacity = 1.0
                self.notes.add("Tr 1 would make it invisible; taken as opaque", where)
        color[3] = opacity
        mode: AlphaMode = "blend" if opacity < 1.0 else "opaque"
        if "map_d" in extra:
            texture, found = self._with_opacity_map(texture, lines["map_d"], name)
            mode = "mask" if found else mode
        elif texture is not None and texture.has_alpha and mode == "opaque":
            mode = "mask"
        bump = next((lines[key] for key in ("map_bump", "bump", "norm", "map_kn") if key in extra), None)
        normal, height = self._bump(bump, name, "norm" in extra or "map_kn" in extra)
        return Material(name, rgba(color), texture, normal, height, 0.02, mode, 0.5, False)

    def _bump(self, line: str | None, name: str, is_normal: bool) -> tuple[Texture | None, Texture | None]:
        """A normal or a height map: MTL says 'bump' for both, a coloured picture is a normal map."""
        if not line:
            return None, None
        texture = self._picture(line, "linear", f"{name} bump map")
        if texture is None:
            return None, None
        rgb = texture.pixels[:, :, :3].reshape(-1, 3).astype(np.float64).mean(axis=0)
        # the mean of a normal map is close to (128, 128, 255), that of a height map is grey
        if is_normal or rgb[2] > 1.2 * max(rgb[0], rgb[1]):
            return texture, None
        return None, texture

    def _with_opacity_map(self, texture: Texture | None, line: str, name: str) -> tuple[Texture | None, bool]:
        alpha = self._picture(line, "linear", f"{name} opacity map")
        if alpha is None:
            return texture, False
        pixels = np.full_like(alpha.pixels, 255) if texture is None else texture.pixels.copy()
        if pixels.shape != alpha.pixels.shape:
            self.notes.add("its opacity map has another size than its colours; left out", f"material {name!r}")
            return texture, False
        pixels[:, :, 3] = alpha.pixels[:, :, 3] if alpha.has_alpha else alpha.pixels[:, :, 0]
        return Texture.make(pixels, "srgb", f"{name} base colour"), True

    def _picture(self, line: str, space: ColorSpace, what: str) -> Texture | None:
        """The picture that a line names after its options."""
        name = plain_name(line)
        data = self.folder.read(name)
        if data is None:
            return None
        wrap: Wrap = "clamp" if re.search(r"-clamp\s+on\b", line, re.I) else "repeat"
        return texture_of(data, space, what, self.notes, str(Path(self.where).parent / name), wrap)


def texture_of(data: bytes, space: ColorSpace, what: str, notes: Notes, where: str, wrap: Wrap) -> Texture | None:
    """A picture file as a texture, or None with a note: a surface can be drawn without one.

    Raises
    ------
    InputError : it has more texels than are allowed; ``where`` names it.
    """
    too_large: InputError | None = None
    try:
        with opened_image(Path(what), data) as picture:
            try:
                check_texels(picture.width, picture.height, where)
            except InputError as error:
                too_large = error
                raise
            pixels = picture.read()
    except InputError:
        if too_large is not None:
            raise
        notes.add("it is not a picture that can be read; left out", what)
        return None
    if pixels.dtype == np.uint16:
        pixels = (pixels >> 8).astype(np.uint8)
    elif pixels.dtype != np.uint8:
        pixels = np.rint(np.clip(np.nan_to_num(pixels), 0, 1) * np.float32(255)).astype(np.uint8)
    return Texture.make(pixels, space, what, wrap)


def rgba(color: Any) -> tuple[float, float, float, float]:
    """A base colour of a file, brought into [0, 1]."""
    r, g, b, a = np.clip(np.nan_to_num(np.asarray(color, dtype=np.float64)), 0.0, 1.0).tolist()
    return (r, g, b, a)


def _floats(value: Any, default: tuple[float, ...]) -> tuple[float, ...]:
    """Numbers of an MTL line (words, a number, or a list), or the default where they make no sense."""
    words = value if isinstance(value, (list, tuple)) else [value]
    try:
        numbers = tuple(float(w) for w in words if re.match(r"[-+.\d]", str(w)))
    except ValueError:
        return default
    if len(numbers) < len(default) or not np.isfinite(numbers).all():
        return default
    return tuple(min(max(n, 0.0), 1.0) for n in numbers[: len(default)])
