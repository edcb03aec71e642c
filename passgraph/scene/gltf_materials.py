"""Materials of a glTF file: what the renderer has a place for, and a note for each thing that it has not.

Surfaces are matt, so of metallic-roughness and specular-glossiness the colour is taken and the gloss is not.
Source: Khronos, glTF 2.0 specification, section 3.9; KHR_texture_transform; KHR_materials_pbrSpecularGlossiness.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import cos, sin
from typing import Any, cast

import numpy as np

from passgraph.scene.gltf_data import GltfData
from passgraph.scene.load_materials import rgba, texture_of
from passgraph.scene.material import AlphaMode, ColorSpace, Material, Texture, Wrap
from passgraph.scene.matrices import Float64

GLOSSY = "KHR_materials_pbrSpecularGlossiness"
TRANSFORM = "KHR_texture_transform"
WEBP = "EXT_texture_webp"
#: Of a sampler (glTF 2.0, section 5.26): texels are not weighted.
_NEAREST = 9728
# of a sampler (OpenGL's numbers); what is none of them repeats
WRAPS: dict[Any, Wrap] = {33071: "clamp", 33648: "mirror", 10497: "repeat"}


@dataclass(frozen=True)
class Coordinates:
    """How the pictures of a material are laid onto a mesh: a set of coordinates and the (2, 3) matrix upon it."""

    number: int = 0
    matrix: tuple[tuple[float, float, float], tuple[float, float, float]] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))

    def applied(self, uvs: Float64) -> Float64:
        made: Float64 = uvs @ np.array(self.matrix)[:, :2].T + np.array(self.matrix)[:, 2]
        return made


@dataclass
class GltfMaterials:
    """Reads each material, and each picture, once."""

    data: GltfData
    _made: dict[int | None, tuple[Material, Coordinates]] = field(default_factory=dict)
    _textures: dict[tuple[Any, ColorSpace], Texture | None] = field(default_factory=dict)

    def read(self, index: int | None) -> tuple[Material, Coordinates]:
        """A material, and the coordinates of its pictures; without an index the white one of the specification."""
        if index not in self._made:
            self._made[index] = self._read({} if index is None else self.data.entry("materials", index), index)
        return self._made[index]

    def _read(self, source: dict[str, Any], index: int | None) -> tuple[Material, Coordinates]:
        name = str(source.get("name") or ("default" if index is None else f"material {index}"))
        where = f"material {name!r}"
        self._note_unshown(source, where)
        color, picture = self._base(source)
        bump = source.get("normalTexture")
        own = self._coordinates(picture if picture is not None else bump, where)
        if picture is not None and bump is not None and self._coordinates(bump, where) != own:
            self.data.notes.add("its normal map has other coordinates than its base colour; left out", where)
            bump = None
        mode = str(source.get("alphaMode", "OPAQUE")).lower()
        if mode not in ("opaque", "mask", "blend"):
            self.data.notes.add(f"unknown alpha mode {mode!r}, opaque is used", where)
            mode = "opaque"
        material = Material(
            name,
            rgba(color),
            self._texture(picture, "srgb", f"{name} base colour"),
            self._texture(bump, "linear", f"{name} normal map"),
            alpha_mode=cast(AlphaMode, mode),
            alpha_cutoff=min(max(float(source.get("alphaCutoff", 0.5)), 0.0), 1.0),
            double_sided=bool(source.get("doubleSided", False)),
        )
        return material, own

    def _base(self, source: dict[str, Any]) -> tuple[Any, dict[str, Any] | None]:
        """Colour and picture of the light that a surface throws back in all directions."""
        glossy = source.get("extensions", {}).get(GLOSSY)
        if glossy is not None:
            return glossy.get("diffuseFactor", (1, 1, 1, 1)), glossy.get("diffuseTexture")
        matt = source.get("pbrMetallicRoughness", {})
        return matt.get("baseColorFactor", (1, 1, 1, 1)), matt.get("baseColorTexture")

    def _note_unshown(self, source: dict[str, Any], where: str) -> None:
        add = self.data.notes.add
        if any(source.get("emissiveFactor", ())):
            add("its emissive light is not shown", where)
        matt = source.get("pbrMetallicRoughness", {})
        # Left out, the factor is 1, which most files do not mean.
        if matt.get("metallicFactor", 0.0) or "metallicRoughnessTexture" in matt:
            add("its metal is not shown; it looks diffuse", where)
        if "occlusionTexture" in source:
            add("its occlusion map is not used", where)
        if source.get("normalTexture", {}).get("scale", 1.0) != 1.0:
            add("the scale of its normal map is not applied", where)
        for extension in source.get("extensions", {}):
            if extension != GLOSSY:
                add(f"{extension} is not shown", where)

    def _coordinates(self, picture: dict[str, Any] | None, where: str) -> Coordinates:
        if picture is None:
            return Coordinates()
        change = picture.get("extensions", {}).get(TRANSFORM, {})
        for extension in picture.get("extensions", {}):
            if extension != TRANSFORM:
                self.data.notes.add(f"{extension} of a texture is not applied", where)
        (x, y), (sx, sy) = change.get("offset", (0.0, 0.0)), change.get("scale", (1.0, 1.0))
        c, s = cos(change.get("rotation", 0.0)), sin(change.get("rotation", 0.0))
        return Coordinates(
            change.get("texCoord", picture.get("texCoord", 0)), ((c * sx, s * sy, x), (-s * sx, c * sy, y))
        )

    def _texture(self, picture: dict[str, Any] | None, space: ColorSpace, what: str) -> Texture | None:
        if picture is None:
            return None
        key = (picture.get("index"), space)
        if key not in self._textures:
            self._textures[key] = self._decoded(self.data.entry("textures", picture.get("index")), space, what)
        return self._textures[key]

    def _decoded(self, texture: dict[str, Any], space: ColorSpace, what: str) -> Texture | None:
        extensions = texture.get("extensions", {})
        source = extensions.get(WEBP, {}).get("source", texture.get("source"))
        if source is None:
            named = ", ".join(extensions) or "no source"
            self.data.notes.add(f"its picture is not read ({named}); left out", what)
            return None
        data = self.data.picture(source, what)
        if data is None:
            return None
        return texture_of(data, space, what, self.data.notes, str(self.data.file), self._wrap(texture, what))

    def _wrap(self, texture: dict[str, Any], what: str) -> Wrap:
        if "sampler" not in texture:
            return "repeat"
        sampler = self.data.entry("samplers", texture["sampler"])
        across, down = (WRAPS.get(sampler.get(key, 10497), "repeat") for key in ("wrapS", "wrapT"))
        if _NEAREST in (sampler.get("magFilter"), sampler.get("minFilter")):
            self.data.notes.add("its sampler asks for the nearest texel (NEAREST); it is filtered linearly", what)
        if across != down:
            self.data.notes.add(f"it wraps by {across} across and {down} down; {across} is used for both", what)
        return across
