"""Materials of a loaded file as `Material`: from glTF (metallic-roughness) and from MTL."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any, cast

import numpy as np

from passgraph.errors import InputError
from passgraph.scene.files import FolderReader, check_picture, plain_name
from passgraph.scene.material import AlphaMode, ColorSpace, Material, Texture, check_texels


@dataclass
class MaterialReader:
    """Turns trimesh's materials into ours, each once.

    Attributes
    ----------
    where : the model file, for messages
    folder : reads pictures that trimesh does not
    factors : exact base colours of a glTF file by material name, because trimesh rounds them to bytes
    warnings : what could not be had
    """

    where: str
    folder: FolderReader
    factors: dict[str, list[float]] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    _done: dict[int, tuple[Any, Material]] = field(default_factory=dict)

    def read(self, source: Any) -> Material:
        """One material; ``source`` is trimesh's PBRMaterial, SimpleMaterial or None."""
        if source is None:
            return Material(name="default")
        if id(source) not in self._done:
            is_pbr = hasattr(source, "baseColorFactor")
            made = self._from_gltf(source) if is_pbr else self._from_mtl(source)
            # the source is kept too, so that its id is not given to another
            self._done[id(source)] = (source, made)
        return self._done[id(source)][1]

    def _from_gltf(self, source: Any) -> Material:
        name = str(source.name or "material")
        color = np.ones(4)
        if source.baseColorFactor is not None:
            color = np.asarray(source.baseColorFactor, dtype=np.float64) / 255.0
        if name in self.factors:
            color = np.asarray(self.factors[name], dtype=np.float64)
        mode = str(source.alphaMode or "OPAQUE").lower()
        if mode not in ("opaque", "mask", "blend"):
            self.warnings.append(f"material {name!r}: unknown alpha mode {mode!r}, opaque is used")
            mode = "opaque"
        cutoff = 0.5 if source.alphaCutoff is None else float(source.alphaCutoff)
        return Material(
            name,
            _rgba(color),
            self._texture(source.baseColorTexture, "srgb", f"{name} base colour"),
            self._texture(source.normalTexture, "linear", f"{name} normal map"),
            alpha_mode=cast(AlphaMode, mode),
            alpha_cutoff=min(max(cutoff, 0.0), 1.0),
            double_sided=bool(source.doubleSided),
        )

    def _from_mtl(self, source: Any) -> Material:
        name = str(source.name or "material")
        extra = {key.lower(): value for key, value in (getattr(source, "kwargs", None) or {}).items()}
        texture = self._texture(getattr(source, "image", None), "srgb", f"{name} map_Kd")
        # MTL does not say in which space Kd is; it is taken as a reflectance, which is linear
        color = np.array([*_floats(extra.get("kd"), (0.8, 0.8, 0.8)), 1.0])
        if texture is not None and not color[:3].any():
            # a common export: black diffuse colour beside a texture that is meant to be seen
            color[:3] = 1.0
        opacity = _floats(extra.get("d"), (1.0,))[-1]
        if "tr" in extra and "d" not in extra:
            opacity = 1.0 - _floats(extra.get("tr"), (0.0,))[-1]
        color[3] = opacity
        mode: AlphaMode = "blend" if opacity < 1.0 else "opaque"
        if "map_d" in extra:
            texture, found = self._with_opacity_map(texture, " ".join(extra["map_d"]), name)
            mode = "mask" if found else mode
        elif texture is not None and texture.has_alpha and mode == "opaque":
            mode = "mask"
        bump = next((extra[key] for key in ("map_bump", "bump", "norm", "map_kn") if key in extra), None)
        normal, height = self._bump(bump, name, "norm" in extra or "map_kn" in extra)
        return Material(name, _rgba(color), texture, normal, height, 0.02, mode, 0.5, False)

    def _bump(self, words: list[str] | None, name: str, is_normal: bool) -> tuple[Texture | None, Texture | None]:
        """A normal or a height map: MTL says 'bump' for both, a coloured picture is a normal map."""
        if not words:
            return None, None
        texture = self._picture(" ".join(words), f"{name} bump map")
        if texture is None:
            return None, None
        rgb = texture.pixels[:, :, :3].reshape(-1, 3).astype(np.float64).mean(axis=0)
        # the mean of a normal map is close to (128, 128, 255), that of a height map is grey
        if is_normal or rgb[2] > 1.2 * max(rgb[0], rgb[1]):
            return texture, None
        return None, texture

    def _with_opacity_map(self, texture: Texture | None, line: str, name: str) -> tuple[Texture | None, bool]:
        alpha = self._picture(line, f"{name} opacity map")
        if alpha is None:
            return texture, False
        pixels = np.full_like(alpha.pixels, 255) if texture is None else texture.pixels.copy()
        if pixels.shape != alpha.pixels.shape:
            self.warnings.append(f"material {name!r}: its opacity map has another size than its colours; left out")
            return texture, False
        pixels[:, :, 3] = alpha.pixels[:, :, 3] if alpha.has_alpha else alpha.pixels[:, :, 0]
        return Texture.make(pixels, "srgb", f"{name} base colour"), True

    def _picture(self, line: str, what: str) -> Texture | None:
        """A picture that trimesh does not load, by the text of its MTL line."""
        from PIL import Image

        path = self.folder.find(plain_name(line))
        if path is None:
            return None
        data = path.read_bytes()
        check_picture(data, str(path))
        try:
            return self._texture(Image.open(path), "linear", what)
        except (OSError, ValueError, SyntaxError):
            self.warnings.append(f"{what}: {path.name} is not a picture that can be read; left out")
            return None

    def _texture(self, picture: Any, space: ColorSpace, what: str) -> Texture | None:
        if picture is None:
            return None
        check_texels(picture.width, picture.height, f"{self.where}: {what}")
        try:
            if picture.mode.startswith("I;16") or picture.mode == "I":
                # pillow would clip 16 bits to 255; keep the upper byte
                grey = np.asarray(picture).astype(np.int64) >> 8
                return Texture.make(np.clip(grey, 0, 255).astype(np.uint8), space, what)
            return Texture.make(np.asarray(picture.convert("RGBA")), space, what)
        except InputError:
            raise
        except Exception as error:  # pillow's decoders raise nearly anything on broken data
            self.warnings.append(f"{what}: the picture cannot be decoded ({str(error)[:80]}); left out")
            return None


def _rgba(color: Any) -> tuple[float, float, float, float]:
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
