"""Convert arrays and materials of model files to `Mesh`, `Material` and `Texture`."""

from __future__ import annotations

import dataclasses
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from passgraph.errors import InputError
from passgraph.formats import FORMATS
from passgraph.image_files import opened_image
from passgraph.quantise import numbers_of
from passgraph.scene.materials import AlphaMode, ColorSpace, Material, Node, Texture, Wrap, check_texels
from passgraph.scene.matrices import Float64, is_singular, translation
from passgraph.scene.meshes import Mesh, creased_normals, smooth_normals
from passgraph.scene.model_files import FolderReader, Notes, plain_name
from passgraph.scene.polygons import Polygons
from passgraph.scene.sides import with_outside
from passgraph.srgb import srgb_to_linear


@dataclass
class MtlReader:
    """Convert the materials of an MTL file, each once; PLY and other formats have at most a picture.

    Attributes
    ----------
    where : the model file, for messages
    folder : reader of material files and pictures
    notes : missing and unsupported parts
    """

    where: str
    folder: FolderReader
    notes: Notes
    _done: dict[str, Material] = field(default_factory=dict)

    def read(self, name: str | None) -> Material:
        """Return a material by its name, which may be empty; None is a surface without one."""
        if name is None:
            return Material(name="default")
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
        # MTL does not define the color space of Kd; it is taken as a linear reflectance
        color = np.array([*_floats(extra.get("kd"), (0.8, 0.8, 0.8)), 1.0])
        if texture is not None and not color[:3].any():
            # a common export: a black diffuse color with a texture that should be visible
            color[:3] = 1.0
        opacity = _floats(extra.get("d"), (1.0,))[-1]
        if "tr" in extra and "d" not in extra:
            opacity = 1.0 - _floats(extra.get("tr"), (0.0,))[-1]
            if opacity == 0.0:
                # exporters that confuse Tr with d write 1 for opaque surfaces; invisible surfaces are not exported
                opacity = 1.0
                self.notes.add("Tr 1 would make it invisible; taken as opaque", where)
        color[3] = opacity
        mode: AlphaMode = "blend" if opacity < 1.0 else "opaque"
        if "map_d" in extra:
            texture, has_opacity_map = self._with_opacity_map(texture, lines["map_d"], name)
            mode = "mask" if has_opacity_map else mode
        elif texture is not None and texture.has_alpha and mode == "opaque":
            mode = "mask"
        bump = next((lines[key] for key in ("map_bump", "bump", "norm", "map_kn") if key in extra), None)
        normal, height = self._bump(bump, name, "norm" in extra or "map_kn" in extra)
        return Material(name, rgba(color), texture, normal, height, 0.02, mode, 0.5, False)

    def _bump(self, line: str | None, name: str, is_normal: bool) -> tuple[Texture | None, Texture | None]:
        """Return a normal or a height map: MTL uses 'bump' for both, and a colored picture is a normal map."""
        if not line:
            return None, None
        texture = self._picture(line, "linear", f"{name} bump map")
        if texture is None:
            return None, None
        rgb = texture.pixels[:, :, :3].reshape(-1, 3).astype(np.float64).mean(axis=0)
        # the mean of a normal map is close to (128, 128, 255), that of a height map is gray
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
        """Return the picture that a line names after its options."""
        name = plain_name(line)
        data = self.folder.read(name)
        if data is None:
            return None
        wrap: Wrap = "clamp" if re.search(r"-clamp\s+on\b", line, re.I) else "repeat"
        return texture_of(data, space, what, self.notes, str(Path(self.where).parent / name), wrap)


def texture_of(
    data: bytes, space: ColorSpace, what: str, notes: Notes, where: str, wrap: Wrap | tuple[Wrap, Wrap]
) -> Texture | None:
    """Return a picture file as a texture; None with a note if it is missing, since surfaces can be drawn without it.

    Raises
    ------
    InputError : it has too many texels; ``where`` names it.
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
        pixels = numbers_of(pixels, FORMATS["rgba8"])
    return Texture.make(pixels, space, what, wrap)


def rgba(color: Any) -> tuple[float, float, float, float]:
    """Return a base color, clipped to [0, 1]."""
    r, g, b, a = np.clip(np.nan_to_num(np.asarray(color, dtype=np.float64)), 0.0, 1.0).tolist()
    return (r, g, b, a)


def _floats(value: Any, default: tuple[float, ...]) -> tuple[float, ...]:
    """Return the numbers of an MTL line (words, a number, or a list), or the default if they are invalid."""
    words = value if isinstance(value, (list, tuple)) else [value]
    try:
        numbers = tuple(float(w) for w in words if re.match(r"[-+.\d]", str(w)))
    except ValueError:
        return default
    if len(numbers) < len(default) or not np.isfinite(numbers).all():
        return default
    return tuple(min(max(n, 0.0), 1.0) for n in numbers[: len(default)])


# Beyond this ratio of distance to extent, float32 loses more than 6 of its 24 bits. Nearer meshes keep their
# coordinates, so that shared borders of two meshes stay equal in every bit.
FAR_OFFSET = 64.0
# Most nodes; instances of a mesh are small in a file, but expensive to draw.
MAX_NODES = 100_000


@dataclass(frozen=True, eq=False)
class Arrays:
    """The data of a mesh in a file, before it is checked.

    Attributes
    ----------
    positions : (n, 3)
    triangles : (m, 3)
    normals : (n, 3), or None if the file has none
    uvs : (n, 2), v = 0 at the top row of the texture, or None
    colors : (n, 3 | 4) linear, or None
    """

    positions: Float64
    triangles: NDArray[Any]
    normals: Float64 | None = None
    uvs: Float64 | None = None
    colors: Float64 | None = None

    def apart(self) -> Arrays:
        """Return the arrays with separate vertices for each triangle."""
        order = self.triangles.reshape(-1)
        rest = (None if table is None else table[order] for table in (self.normals, self.uvs, self.colors))
        return Arrays(self.positions[order], np.arange(len(order)).reshape(-1, 3), *rest)


def arrays_of(geometry: Any, name: str) -> Arrays:
    """Return the arrays of a trimesh geometry, whose colors are sRGB-encoded; ``name`` is for errors."""
    positions = np.asarray(geometry.vertices, dtype=np.float64)
    # trimesh has the file's normals in its cache; the property would compute smooth ones
    normals = geometry._cache.cache.get("vertex_normals")
    if normals is not None and np.shape(normals) != positions.shape:
        normals = None
    arrays = Arrays(positions, np.asarray(geometry.faces), normals, _uvs(geometry), _vertex_colors(geometry))
    face_colors = _face_colors(geometry)
    if face_colors is None:
        return arrays
    _check(arrays.positions, arrays.triangles, name)
    return dataclasses.replace(arrays.apart(), colors=np.repeat(face_colors, 3, axis=0))


def arrays_of_polygons(surface: Polygons, name: str) -> Arrays:
    """Return the triangles of a surface, whose colors are sRGB-encoded; ``name`` is for errors."""
    triangles = surface.triangles()
    colors = surface.vertex_colors
    arrays = Arrays(
        surface.positions,
        surface.corners[triangles],
        surface.normals,
        _v_down(surface.uvs),
        None if colors is None else _linear(colors),
    )
    by_polygon = surface.polygon_colors if colors is None else None
    if surface.corner_uvs is None and by_polygon is None:
        return arrays
    _check(arrays.positions, arrays.triangles, name)
    arrays = arrays.apart()
    if surface.corner_uvs is not None:
        arrays = dataclasses.replace(arrays, uvs=_v_down(surface.corner_uvs[triangles.reshape(-1)]))
    if by_polygon is not None:
        counts = 3 * np.maximum(surface.lengths - 2, 0)
        arrays = dataclasses.replace(arrays, colors=np.repeat(_linear(by_polygon), counts, axis=0))
    return arrays


def mesh_of(arrays: Arrays, name: str, flat: bool, warnings: list[str]) -> tuple[Mesh, Float64]:
    """Return a checked mesh, and the (4, 4) float64 matrix from its coordinates to the file's.

    Missing normals are smooth except at sharp edges, and continuous across texture seams. With ``flat`` they are those
    of the triangles, as in STL and required by the glTF specification (section 3.7.2.1).
    """
    _check(arrays.positions, arrays.triangles, name)
    if arrays.normals is None and flat:
        arrays = arrays.apart()
    positions, triangles, normals = arrays.positions, arrays.triangles, arrays.normals
    uvs, colors = arrays.uvs, arrays.colors
    low, high = positions.min(axis=0), positions.max(axis=0)
    centre = np.zeros(3)
    if np.abs(np.stack([low, high])).max() > FAR_OFFSET * max(float((high - low).max()), 1e-30):
        centre = 0.5 * (low + high)
    local = positions - centre
    if not _has_area(local, triangles):
        warnings.append(f"mesh {name!r}: none of its {len(triangles)} triangles has an area; nothing of it is seen")
    if normals is not None:
        smooth = smooth_normals(local, triangles, weld=True)
        shown: NDArray[Any] = _mended(np.asarray(normals, dtype=np.float64), smooth, name, warnings)
    elif flat:
        shown = smooth_normals(local, triangles)
    else:
        source_vertex, triangles, shown = creased_normals(local, triangles)
        local, uvs, colors = (
            local[source_vertex],
            *(None if table is None else table[source_vertex] for table in (uvs, colors)),
        )
    mesh = Mesh.make(local, triangles, shown, uvs, colors, name)
    return dataclasses.replace(mesh, has_normals=normals is not None), translation(centre)


class PlacedMeshes:
    """The meshes of a file, each read once, and the nodes that place them.

    Attributes
    ----------
    file : the path, for messages
    turn : (4, 4), the file's axes to the scene's
    flat : see `mesh_of`
    meshes : by any key, with the matrix of `mesh_of`
    both_sides : keys of meshes of which both sides are seen
    others : parts without triangles
    """

    def __init__(self, file: Path, turn: Float64, flat: bool) -> None:
        self.file, self.turn, self.flat = file, turn, flat
        self.meshes: dict[Any, tuple[Mesh, Float64]] = {}
        self.nodes: list[Node] = []
        self.warnings: list[str] = []
        self.both_sides: set[Any] = set()
        self.others = 0
        self._double_sided: dict[Material, Material] = {}

    def check_count(self, count: int) -> None:
        if count > MAX_NODES:
            raise InputError(f"{self.file}: {count} nodes are more than the limit of {MAX_NODES}; merge them")

    def make(self, key: Any, arrays: Arrays, name: str, *, find_outside: bool = False) -> None:
        """Add a mesh; ``find_outside`` is for formats without double-sided materials (`passgraph.scene.sides`)."""
        mesh, offset = mesh_of(arrays, name, self.flat, self.warnings)
        if find_outside:
            mesh, closed = with_outside(mesh)
            if not closed:
                self.both_sides.add(key)
        self.meshes[key] = mesh, offset

    def put(self, key: Any, matrix: Float64, material: Material, name: str) -> None:
        mesh, offset = self.meshes[key]
        transform = self.turn @ matrix @ offset
        if not np.isfinite(transform).all() or is_singular(transform):
            self.warnings.append(f"node {name!r}: its transform has a scale of zero or is not finite; skipped")
            return
        if key in self.both_sides:
            material = self._double_sided.setdefault(material, dataclasses.replace(material, double_sided=True))
        self.nodes.append(Node(mesh, material, transform, name))

    def done(self) -> tuple[list[Node], list[str]]:
        """Return the nodes and warnings; raise `InputError` if there is nothing to draw."""
        if self.others and self.nodes:
            self.warnings.append(f"{self.others} parts without triangles (points or lines) were skipped")
        if not self.nodes:
            what = "only points or lines" if self.others else "no mesh"
            raise InputError(f"{self.file}: holds {what}; expected at least one triangle in its scene")
        return self.nodes, self.warnings


def _check(positions: Float64, triangles: NDArray[Any], name: str) -> None:
    """Raise InputError for invalid arrays, with the messages of `Mesh.make`."""
    count = len(positions)
    bad = (triangles < 0) | (triangles >= count)
    if not np.isfinite(positions).all() or bad.any():
        Mesh.make(positions, triangles, np.ones((count, 3)), name=name)
        raise InputError(f"mesh {name!r}: positions or triangles are broken")


def _has_area(positions: Float64, triangles: NDArray[Any]) -> bool:
    """Return True if any triangle has an area, relative to the mesh's extent."""
    extent = max(float(np.ptp(positions, axis=0).max()), 1e-300)
    a, b, c = (positions[triangles[:, k]] / extent for k in range(3))
    return bool((np.abs(np.cross(b - a, c - a)) > 0.0).any())


def _mended(normals: Float64, smooth: NDArray[np.float32], name: str, warnings: list[str]) -> Float64:
    lengths = np.linalg.norm(normals, axis=1)
    bad = ~np.isfinite(lengths) | (lengths < 1e-12)
    if bad.any():
        warnings.append(f"mesh {name!r}: {int(bad.sum())} normals are zero or not finite; computed instead")
        normals = np.where(bad[:, None], smooth, normals)
    return normals


def _uvs(geometry: Any) -> Float64 | None:
    """Return texture coordinates; trimesh has v = 0 at the bottom for every format."""
    uvs = getattr(geometry.visual, "uv", None)
    if uvs is None or len(uvs) != len(geometry.vertices) or np.ndim(uvs) != 2:
        return None
    return _v_down(np.asarray(uvs, np.float64))


def _v_down(uvs: Float64 | None) -> Float64 | None:
    """Return texture coordinates with v = 0 at the top row, from those with v = 0 at the bottom."""
    if uvs is None:
        return None
    result = np.stack([uvs[:, 0], 1.0 - uvs[:, 1]], axis=1)
    return np.nan_to_num(result, nan=0.0, posinf=0.0, neginf=0.0)


def _linear(colors: Any) -> Float64:
    table = np.asarray(colors)
    scale = float(np.iinfo(table.dtype).max) if np.issubdtype(table.dtype, np.integer) else 1.0
    values = np.clip(np.nan_to_num(table.astype(np.float64) / scale), 0.0, 1.0)
    values[:, :3] = srgb_to_linear(values[:, :3]).astype(np.float32)
    return values


def _vertex_colors(geometry: Any) -> Float64 | None:
    visual = geometry.visual
    if visual.kind == "vertex":
        return _linear(visual.vertex_colors)
    table = getattr(visual, "vertex_attributes", {}).get("color")
    if table is not None and np.ndim(table) == 2 and len(table) == len(geometry.vertices):
        return _linear(table)
    return None


def _face_colors(geometry: Any) -> Float64 | None:
    return _linear(geometry.visual.face_colors) if geometry.visual.kind == "face" else None
