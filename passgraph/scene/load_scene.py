"""Load a model file as a `Scene`: OBJ and STL through trimesh, the others directly, since it reads parts of them."""

from __future__ import annotations

from io import BytesIO
from os import PathLike
from pathlib import Path
from typing import Any, Literal

import numpy as np

from passgraph.arguments import among, flag, shown
from passgraph.errors import InputError
from passgraph.scene import gltf
from passgraph.scene.camera import Camera
from passgraph.scene.gltf import GltfData
from passgraph.scene.gltf_parts import nodes_of
from passgraph.scene.ground import (
    bounds_of_nodes,
    floors_of,
    lacks_ground,
    seeing_floors,
    standing_points,
    with_ground,
)
from passgraph.scene.lights import Light
from passgraph.scene.materials import Node
from passgraph.scene.matrices import LEAST_RADIUS, MOST_RADIUS, Float64, sphere_of
from passgraph.scene.model_data import Arrays, MtlReader, PlacedMeshes, arrays_of, arrays_of_polygons
from passgraph.scene.model_files import MAX_FILE_BYTES, FolderReader, Notes, as_utf8, checked_path, read_model
from passgraph.scene.off import read_off
from passgraph.scene.ply import read_ply
from passgraph.scene.polygons import split_obj_polygons
from passgraph.scene.scene_parts import SceneParts

# Formats that hold one surface of polygons.
POLYGON_READERS = {".off": read_off, ".ply": read_ply}
# Rotates a file with z up, so that z becomes y.
_Z_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])


def load_scene(
    path: str | PathLike[str],
    *,
    ground: bool | None = None,
    up: Literal["y", "z"] | None = None,
    max_bytes: int = MAX_FILE_BYTES,
) -> SceneParts:
    """Read a .glb, .gltf, .obj, .off, .ply or .stl file.

    Parameters
    ----------
    path : the file; textures and material files are read only from its folder and below
    ground : True adds a floor below the model, False does not, None adds one to a model without a surface below that
        receives its shadow (`passgraph.scene.ground.has_floor`)
    up : the axis of the file that points up; None takes the usual one of the format: z in STL, y in the others
    max_bytes : largest file size

    Returns
    -------
    Parts of a scene with the file's camera and lights (glTF), or else a camera that sees the whole model and one key
    light with an extent. Transforms, instances (EXT_mesh_gpu_instancing), base colors, textures, vertex colors,
    normal maps and alpha modes are kept. Positions far from the origin are recentered in float64. Missing and
    unsupported parts are in ``warnings``.

    Raises
    ------
    InputError
        For a missing file, an unknown format, corrupt or truncated data, NaN or infinite positions, indices out of
        range, no triangles, or a picture beyond the limit.

    Notes
    -----
    Vertex colors are linear in glTF, as in its specification, and sRGB-encoded elsewhere. Surfaces are diffuse: metal,
    roughness and gloss are ignored. Animations are ignored; the rest pose is shown. glTF declares double-sided
    surfaces. In other formats, surfaces that are not closed are double-sided, the file's normals decide the outer side
    of triangles, and closed surfaces that are inside out are reversed.
    """
    if up is not None and not among(up, ("y", "z")):
        raise InputError(f"{shown(path)}: up: expected 'y' or 'z', got {shown(up)}")
    if ground is not None:
        flag(ground, f"{shown(path)}: ground", InputError)
    file = checked_path(path, max_bytes)
    try:
        with np.errstate(all="ignore"):  # overflow becomes infinity, which is checked later
            return _load(file, ground, up or usual_up(file))
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        # untrusted JSON may have any type anywhere; errors without a check of their own are converted here
        raise InputError(f"{file}: a value in it has the wrong type or range ({error})") from error


def _load(file: Path, ground: bool | None, up: Literal["y", "z"]) -> SceneParts:
    folder, notes = FolderReader(file), Notes()
    turn = _Z_UP if up == "z" else np.eye(4)
    data: GltfData | None = None
    if file.suffix.lower() in (".glb", ".gltf"):
        header, binary = gltf.read_header(file, read_model(file))
        gltf.check_header(header, file)
        data = GltfData(file, header, binary, folder, notes)
        nodes, lines = nodes_of(data, turn)
    else:
        placed = PlacedMeshes(file, turn, flat=file.suffix.lower() == ".stl")
        reader = MtlReader(str(file), folder, notes)
        if file.suffix.lower() in POLYGON_READERS:
            _place_surface(_read(file, folder), placed, reader)
        else:
            _place_meshes(_read(file, folder), placed, reader)
        nodes, lines = placed.done()
    lines += [f"{name}: not found beside {file.name}; left out" for name in folder.missing]
    lines += [f"{sentence}; left out" for sentence in folder.refused]
    scene = _framed(tuple(nodes), file, notes.lines() + lines)
    scene = scene if data is None else _with_own_view(scene, data, turn)
    if lacks_ground(scene.nodes, ground):
        grounded, camera = with_ground(scene.nodes, scene.camera)
        scene = scene._replace(nodes=grounded, camera=camera)
    return scene


def usual_up(file: Path) -> Literal["y", "z"]:
    """Return the axis that usually points up in files of this format.

    >>> usual_up(Path("part.STL"))
    'z'
    """
    return "z" if file.suffix.lower() == ".stl" else "y"


def default_light() -> Light:
    """Return a key light from the upper left of the default camera, with a visible penumbra.

    It is directional with radius 0.04 (2.3 degrees, nine times the sun's), which fits scenes of any size and offset.
    """
    return Light.directional((0.6, -1.0, -0.5), (1.0, 0.96, 0.9), 0.9, 0.04, "key light")


def _read(file: Path, folder: FolderReader) -> Any:
    """Return the arrays of the only mesh, or the scene of trimesh."""
    import trimesh

    kind = file.suffix.lower()[1:]
    data = read_model(file)
    # FolderReader has the methods that trimesh calls, but not trimesh's base class, which can also write
    resolver: Any = folder
    try:
        with np.errstate(all="ignore"):  # NaN in a file is reported by our own checks
            if file.suffix.lower() in POLYGON_READERS:
                surface = POLYGON_READERS[file.suffix.lower()](data)
                folder.picture = surface.picture
                return arrays_of_polygons(surface, file.name)
            return trimesh.load_scene(
                BytesIO(split_obj_polygons(as_utf8(data)) if kind == "obj" else data),
                file_type=kind,
                resolver=resolver,
                process=False,
            )
    except InputError:
        raise
    except MemoryError:
        raise InputError(f"{file}: too large for the memory of this machine; simplify the model") from None
    except Exception as error:  # trimesh raises errors of any type for damaged data
        detail = (str(error).strip().splitlines() or [type(error).__name__])[0][:120]
        raise InputError(f"{file}: cannot be read as {kind.upper()}, it is corrupt or truncated ({detail})") from None


def _place_meshes(loaded: Any, placed: PlacedMeshes, reader: MtlReader) -> None:
    """Place the geometries of a trimesh scene."""
    import trimesh

    names = list(loaded.graph.nodes_geometry)
    placed.others += len(loaded.geometry) if not names else 0
    placed.check_count(len(names))
    for name in names:
        matrix, key = loaded.graph[name]
        geometry = loaded.geometry[key]
        if not isinstance(geometry, trimesh.Trimesh) or len(geometry.faces) == 0:
            placed.others += 1
            continue
        label = f"{placed.file.name}:{key}"
        if key not in placed.meshes:
            placed.make(key, arrays_of(geometry, label), label, find_outside=True)
        source = getattr(geometry.visual, "material", None)
        material = reader.read(None if source is None else str(source.name or ""))
        placed.put(key, np.asarray(matrix, dtype=np.float64), material, str(name))


def _place_surface(arrays: Arrays, placed: PlacedMeshes, reader: MtlReader) -> None:
    """Place the mesh of a file that holds one."""
    if not len(arrays.triangles):
        placed.others += 1
        return
    placed.make(None, arrays, placed.file.name, find_outside=True)
    placed.put(None, np.eye(4), reader.read(None if arrays.uvs is None else ""), placed.file.stem)


def _framed(nodes: tuple[Node, ...], file: Path, notes: list[str]) -> SceneParts:
    bounds = bounds_of_nodes(nodes)
    if not np.isfinite(bounds).all() or sphere_of(bounds)[1] > MOST_RADIUS:
        raise InputError(f"{file}: its extent {bounds.tolist()} is beyond what float32 can draw; scale it down")
    extent = float(np.ptp(bounds, axis=0).max())
    if extent < LEAST_RADIUS:
        what = f"its extent, {extent:g}, is below what float32 can draw; scale it up"
        raise InputError(f"{file}: {what if extent else 'all its vertices are at one place; nothing could be seen'}")
    floors = floors_of(nodes)
    camera = seeing_floors(Camera.orbit(standing_points(nodes, floors)), floors)
    return SceneParts(nodes, camera, (default_light(),), file.name, tuple(notes))


def _with_own_view(scene: SceneParts, data: GltfData, turn: Float64) -> SceneParts:
    bounds = bounds_of_nodes(scene.nodes)
    try:
        cameras = gltf.cameras_of(data, bounds, turn)
        lights = gltf.lights_of(data, bounds, turn)
    except InputError as error:
        raise InputError(f"{data.file}: {error}") from None
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise InputError(f"{data.file}: its cameras or lights are broken ({error})") from None
    camera = cameras[0].camera if cameras else scene.camera
    return scene._replace(camera=camera, lights=tuple(lights) or scene.lights, cameras=tuple(cameras))
