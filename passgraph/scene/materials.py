"""Materials, textures, and nodes: meshes placed in the world with a material."""

from __future__ import annotations

from dataclasses import field
from math import inf
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from passgraph import arguments
from passgraph.cached import cached_property
from passgraph.errors import InputError
from passgraph.records import dataclass
from passgraph.scene.matrices import Float64, floats, matrix4, number, transform_points
from passgraph.scene.meshes import Mesh
from passgraph.srgb import srgb_to_linear

AlphaMode = Literal["opaque", "mask", "blend"]
ColorSpace = Literal["srgb", "linear"]
Wrap = Literal["repeat", "clamp", "mirror"]
Magnify = Literal["linear", "nearest"]
Minify = Literal["linear mipmap linear", "nearest", "nearest mipmap nearest", "nearest mipmap linear"]

# Most texels of a picture, checked before it is decoded: 64 Mi texels are 256 MiB as RGBA bytes.
MAX_TEXELS = 1 << 26


@dataclass(frozen=True, eq=False)
class Texture:
    """A picture on a surface; row 0 is at v = 0.

    Attributes
    ----------
    pixels : (h, w, 4) uint8
    color_space : "srgb" for colors (alpha is always linear), "linear" for normals and heights
    name : used in messages
    wrap : the wrap mode: repeat, mirrored repeat, or clamp to the edge; a pair has one across and one down
    magnify : the magnification filter: linear (four texels) or nearest
    minify : the minification filter, as OpenGL's GL_TEXTURE_MIN_FILTER; "nearest" aliases
    """

    pixels: NDArray[np.uint8]
    color_space: ColorSpace = "srgb"
    name: str = "texture"
    wrap: Wrap | tuple[Wrap, Wrap] = "repeat"
    magnify: Magnify = "linear"
    minify: Minify = "linear mipmap linear"

    def __post_init__(self) -> None:
        where = f"texture {arguments.string(self.name, 'the name of a texture')!r}"
        array: object = self.pixels
        if not isinstance(array, np.ndarray) or array.ndim != 3 or array.shape[2] != 4 or array.dtype != np.uint8:
            got = arguments.shown(array)
            raise InputError(
                f"{where}: expected (h, w, 4) uint8 pixels (pg.Texture.make checks and converts), got {got}"
            )
        pair = isinstance(self.wrap, tuple) and len(self.wrap) == 2
        choices = (
            ("color_space", self.color_space, ColorSpace),
            *(("wrap", wrap, Wrap) for wrap in (self.wrap if pair else (self.wrap,))),
            ("magnify", self.magnify, Magnify),
            ("minify", self.minify, Minify),
        )
        for field_name, value, choice in choices:
            *first, last = map(repr, get_args(choice))
            if not arguments.among(value, get_args(choice)):
                got = arguments.shown(value)
                raise InputError(f"{where}: {field_name}: expected {', '.join(first)} or {last}, got {got}")

    @classmethod
    def make(
        cls, pixels: ArrayLike, color_space: ColorSpace = "srgb", name: str = "texture",
        wrap: Wrap | tuple[Wrap, Wrap] = "repeat", magnify: Magnify = "linear", minify: Minify = "linear mipmap linear",
    ) -> Texture:  # fmt: skip
        """Create a texture from an array of bytes, converted to four channels.

        Parameters
        ----------
        pixels : uint8: gray (h, w) or (h, w, 1), gray and alpha (h, w, 2), RGB (h, w, 3) or RGBA (h, w, 4)
        color_space, name, wrap, magnify, minify : see the class

        Raises
        ------
        InputError
            Wrong shape, type, color space, wrap or filter, or more than `MAX_TEXELS`.

        >>> Texture.make(np.full((2, 2), 255, np.uint8)).decode()[0, 0].tolist()
        [1.0, 1.0, 1.0, 1.0]
        """
        where = f"texture {arguments.string(name, 'the name of a texture')!r}"
        array = arguments.numbers(pixels, where, "be uint8 pixels (h, w, 1 to 4)")
        if array.ndim == 2:
            array = array[:, :, None]
        if array.ndim != 3 or array.shape[2] not in (1, 2, 3, 4) or 0 in array.shape:
            raise InputError(f"texture {name!r}: expected shape (h, w, 1 to 4), got {np.shape(pixels)}")
        if array.dtype != np.uint8:
            raise InputError(f"texture {name!r}: expected uint8, got {array.dtype}; scale to 0..255 first")
        height, width, channels = array.shape
        check_texels(width, height, f"texture {name!r}")
        full = np.full((height, width, 4), 255, np.uint8)
        if channels < 3:
            full[:, :, :3] = array[:, :, :1]
            full[:, :, 4 - (channels - 1) :] = array[:, :, 1:]
        else:
            full[:, :, :channels] = array
        full.setflags(write=False)
        return cls(full, color_space, name, wrap, magnify, minify)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in texels."""
        return self.pixels.shape[1], self.pixels.shape[0]

    @property
    def wraps(self) -> tuple[Wrap, Wrap]:
        """The wrap modes across and down."""
        return self.wrap if isinstance(self.wrap, tuple) else (self.wrap, self.wrap)

    @cached_property
    def has_alpha(self) -> bool:
        """True if any texel is not fully opaque."""
        return bool((self.pixels[:, :, 3] < 255).any())

    def decode(self) -> NDArray[np.float32]:
        """Return the picture as (h, w, 4) float32 linear RGBA in [0, 1] (sRGB: IEC 61966-2-1)."""
        result = self.pixels.astype(np.float32) / np.float32(255.0)
        if self.color_space == "srgb":
            result[:, :, :3] = srgb_to_linear(np.arange(256) / 255.0)[self.pixels[:, :, :3]]
        return result


@dataclass(frozen=True, eq=False)
class Material:
    """Attributes of a surface.

    Attributes
    ----------
    name : used in messages
    base_color : linear RGBA in [0, 1]; multiplies the texture and the vertex colors
    base_color_texture : sRGB-encoded colors with linear alpha
    normal_texture : linear; RGB in 0..255 stands for x, y, z in -1..1, y up in the picture (OpenGL, glTF)
    height_texture : linear; red 255 is the surface itself, 0 is ``height_scale`` below it
    height_scale : depth of the height map in texture units: 1 is as deep as the texture is wide
    alpha_mode : "opaque" ignores alpha, "mask" drops texels below ``alpha_cutoff``, "blend" mixes
    alpha_cutoff : used by "mask"; above 1, everything is dropped
    double_sided : back faces are drawn, with the normal flipped
    unlit : it has its own color, whatever light and shadow reach it

    >>> Material(base_color=(1, 0.5, 0, 1)).alpha_mode
    'opaque'
    """

    name: str = "material"
    base_color: tuple[float, float, float, float] = (0.8, 0.8, 0.8, 1.0)
    base_color_texture: Texture | None = None
    normal_texture: Texture | None = None
    height_texture: Texture | None = None
    height_scale: float = 0.05
    alpha_mode: AlphaMode = "opaque"
    alpha_cutoff: float = 0.5
    double_sided: bool = False
    unlit: bool = False

    def __post_init__(self) -> None:
        where = f"material {arguments.string(self.name, 'the name of a material')!r}"
        color = floats(self.base_color, f"{where}: base_color", "four numbers in [0, 1]")
        if color.shape != (4,) or not np.isfinite(color).all() or color.min() < 0.0 or color.max() > 1.0:
            got = arguments.shown(self.base_color)
            raise InputError(f"{where}: base_color: expected four numbers in [0, 1], got {got}")
        object.__setattr__(self, "base_color", tuple(float(c) for c in color))
        object.__setattr__(self, "height_scale", number(self.height_scale, f"{where}: height_scale", 0.0, 1.0))
        object.__setattr__(self, "alpha_cutoff", number(self.alpha_cutoff, f"{where}: alpha_cutoff", 0.0, inf))
        if not arguments.among(self.alpha_mode, ("opaque", "mask", "blend")):
            got = arguments.shown(self.alpha_mode)
            raise InputError(f"{where}: alpha_mode: expected 'opaque', 'mask' or 'blend', got {got}")
        for name in ("base_color_texture", "normal_texture", "height_texture"):
            if getattr(self, name) is not None:
                arguments.instance(getattr(self, name), Texture, f"{where}: {name}", "a pg.Texture", InputError)
        if self.height_texture is not None and len(set(self.height_texture.wraps)) > 1:
            got = arguments.shown(self.height_texture.wrap)
            raise InputError(f"{where}: height_texture: expected one wrap mode for both axes, got {got}")
        for switch in ("double_sided", "unlit"):
            arguments.flag(getattr(self, switch), f"{where}: {switch}", InputError)

    @property
    def needs_tangents(self) -> bool:
        """True if shading needs the mesh's tangents, for a normal map or a height map."""
        return self.normal_texture is not None or self.height_texture is not None


def check_texels(width: int, height: int, where: str) -> None:
    """Raise InputError for a picture of more than `MAX_TEXELS`; ``where`` names it in the error."""
    if width * height > MAX_TEXELS:
        raise InputError(
            f"{where}: {width} x {height} texels are more than the limit of {MAX_TEXELS}; scale the picture down"
        )


@dataclass(frozen=True, eq=False)
class Node:
    """A mesh placed in the world, with a material.

    Attributes
    ----------
    mesh : may be shared between nodes; tangents are added here if the material needs them
    material : the material of its surface
    transform : (4, 4) float64, mesh frame to world
    name : used in messages
    casts, receives : True if it casts, and if it receives, shadows

    >>> triangle = Mesh.make([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> Node(triangle).bounds.tolist()
    [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0]]
    """

    mesh: Mesh
    material: Material = field(default_factory=Material)
    transform: Float64 = field(default_factory=lambda: np.eye(4))
    name: str = "node"
    casts: bool = True
    receives: bool = True

    def __post_init__(self) -> None:
        where = f"node {arguments.string(self.name, 'the name of a node')!r}"
        arguments.instance(self.mesh, Mesh, f"{where}: mesh", "a pg.Mesh, made by pg.Mesh.make(...)", InputError)
        arguments.instance(self.material, Material, f"{where}: material", "a pg.Material", InputError)
        for switch in ("casts", "receives"):
            arguments.flag(getattr(self, switch), f"{where}: {switch}", InputError)
        transform = matrix4(self.transform, f"{where}: transform")
        transform.setflags(write=False)
        object.__setattr__(self, "transform", transform)
        if self.material.needs_tangents and self.mesh.has_uvs:
            object.__setattr__(self, "mesh", self.mesh.with_tangents())

    @cached_property
    def bounds(self) -> Float64:
        """The box around all vertices in the world, (2, 3) float64."""
        points = transform_points(self.transform, self.mesh.positions)
        return np.stack([points.min(axis=0), points.max(axis=0)])

    @property
    def flips_winding(self) -> bool:
        """True if the transform mirrors, so that front faces become clockwise."""
        return bool(np.linalg.det(self.transform[:3, :3]) < 0.0)
