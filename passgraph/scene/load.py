"""Load a model file as a `Scene`, through trimesh."""

from __future__ import annotations

import warnings
from dataclasses import replace
from io import BytesIO
from os import PathLike
from pathlib import Path
from typing import Any, Literal

import numpy as np

from passgraph.arguments import among, flag, shown
from passgraph.errors import InputError
from passgraph.scene import gltf
from passgraph.scene.camera import Camera
from passgraph.scene.files import MAX_FILE_BYTES, FolderReader, as_utf8, checked_path
from passgraph.scene.floor import floor_node
from passgraph.scene.light import Light
from passgraph.scene.load_geometry import mesh_of
from passgraph.scene.load_materials import MaterialReader
from passgraph.scene.matrices import Float64, is_singular, sphere_of
from passgraph.scene.node import Node
from passgraph.scene.scene import Scene

# A file whose y axis is up stays; one with z up is turned so that z becomes y.
_Z_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
# Instances of one mesh are cheap in a file and dear when drawn.
MAX_NODES = 100_000


def load_scene(
    path: str | PathLike[str],
    *,
    ground: bool | None = None,
    up: Literal["y", "z"] = "y",
    max_bytes: int = MAX_FILE_BYTES,
) -> Scene:
    """Read a .glb, .gltf, .obj, .off, .ply or .stl file.

    Parameters
    ----------
    path : the file; textures and material files are looked for in its folder and below, nowhere else
    ground : True adds a tiled floor below the model, False does not, None adds one to a file of a single node
        that has no light of its own, because such a model has nothing that receives its shadow
    up : the axis of the file that points up
    max_bytes : a larger file is refused

    Returns
    -------
    A scene with the file's camera and lights (glTF), or else a camera that sees the whole model and one key
    light with an extent. Transforms, base colours, textures, vertex colours, normal maps and alpha modes are
    kept. Positions far from the origin are recentred in float64. What could not be had is in ``warnings``.

    Raises
    ------
    InputError
        No such file, an unknown kind, corrupt or truncated data, NaN or infinite positions, indices out of
        range, no triangles, or a picture beyond the limit.

    Notes
    -----
    Colours of vertices are taken as linear in glTF, as its specification says, and as sRGB elsewhere.
    """
    if not among(up, ("y", "z")):
        raise InputError(f"{shown(path)}: up: expected 'y' or 'z', got {shown(up)}")
    if ground is not None:
        flag(ground, f"{shown(path)}: ground", InputError)
    file = checked_path(path, max_bytes)
    try:
        with np.errstate(all="ignore"):  # values too large become infinite and are refused as such
            return _load(file, ground, up)
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        # a stranger's JSON may hold any type anywhere; what no check below names ends here
        raise InputError(f"{file}: a value in it has the wrong type or range ({error})") from error


def _load(file: Path, ground: bool | None, up: Literal["y", "z"]) -> Scene:
    is_gltf = file.suffix.lower() in (".glb", ".gltf")
    header = gltf.read_header(file) if is_gltf else {}
    if is_gltf:
        gltf.check_header(header, file)
    folder = FolderReader(file)
    loaded = _read(file, folder)
    reader = MaterialReader(str(file), folder, _exact_factors(header))
    if folder.bombs:
        raise InputError(folder.bombs[0])
    nodes = _nodes(loaded, file, reader, _Z_UP if up == "z" else np.eye(4))
    notes = reader.warnings + [f"{name}: not found beside {file.name}; left out" for name in folder.missing]
    notes += [f"{sentence}; left out" for sentence in folder.refused]
    if "KHR_texture_transform" in header.get("extensionsUsed", []):
        notes.append("KHR_texture_transform is not applied; textures may be shifted or scaled")
    scene = _framed(nodes, file, notes)
    scene = _with_own_view(scene, header, file) if is_gltf and up == "y" else scene
    has_own_light = bool(header.get("extensions", {}).get("KHR_lights_punctual"))
    if ground or (ground is None and len(nodes) == 1 and not has_own_light):
        scene = with_floor(scene)
    return scene


def with_floor(scene: Scene) -> Scene:
    """The scene with a tiled floor that touches the lowest point of its bounds.

    The camera's far plane is moved to hold the floor in front of it.

    >>> from passgraph.scene.mesh import Mesh
    >>> node = Node(Mesh.make([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
    >>> bare = Scene((node,), Camera.framing(node.bounds))
    >>> [node.name for node in with_floor(bare).nodes]
    ['node', 'floor']
    """
    grown = scene.with_(nodes=(*scene.nodes, floor_node(scene.bounds())))
    camera = scene.camera
    reach = float(np.linalg.norm(np.abs(grown.bounds() - np.array(camera.eye)).max(axis=0)))
    if camera.far < reach:
        grown = grown.with_(camera=replace(camera, far=reach))
    return grown


def default_light() -> Light:
    """A key light from the upper left of the default camera, with a penumbra that can be seen.

    A point light would need its distance chosen; a directional one of 0.04 (2.3 degrees, nine suns wide)
    serves every size and offset.
    """
    return Light.directional((0.6, -1.0, -0.5), (1.0, 0.96, 0.9), 0.9, 0.04, "key light")


def _read(file: Path, folder: FolderReader) -> Any:
    import trimesh

    kind = file.suffix.lower()[1:]
    data = file.read_bytes()
    # FolderReader has the methods that trimesh calls, without its base class, which can write too
    resolver: Any = folder
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            # numpy's warnings about NaN in a file come back as errors or warnings of ours
            warnings.simplefilter("ignore")
            return trimesh.load_scene(
                BytesIO(as_utf8(data) if kind == "obj" else data),
                file_type=kind,
                resolver=resolver,
                process=False,
            )
    except InputError:
        raise
    except MemoryError:
        raise InputError(f"{file}: too large for the memory of this machine; simplify the model") from None
    except Exception as error:  # trimesh raises nearly anything on broken data: assertions, lookups, numpy's
        if folder.refused:
            raise InputError(f"{file}: {folder.refused[0]}") from None
        if folder.missing:
            raise InputError(f"{file}: its file {folder.missing[0]} is missing beside it") from None
        detail = (str(error).strip().splitlines() or [type(error).__name__])[0][:120]
        raise InputError(f"{file}: cannot be read as {kind.upper()}, it is corrupt or truncated ({detail})") from None


def _exact_factors(header: dict[str, Any]) -> dict[str, list[float]]:
    """Base colours by material name, for names that occur once."""
    result: dict[str, list[float]] = {}
    names = [m.get("name") for m in header.get("materials", []) if isinstance(m, dict)]
    for material in header.get("materials", []):
        factor = material.get("pbrMetallicRoughness", {}).get("baseColorFactor")
        if factor is not None and names.count(material.get("name")) == 1 and material.get("name"):
            result[material["name"]] = factor
    return result


def _nodes(loaded: Any, file: Path, reader: MaterialReader, turn: Float64) -> list[Node]:
    import trimesh

    made: dict[str, tuple[Any, Float64]] = {}
    nodes: list[Node] = []
    others = 0
    names = list(loaded.graph.nodes_geometry)
    if len(names) > MAX_NODES:
        raise InputError(f"{file}: {len(names)} nodes are more than the limit of {MAX_NODES}; merge them")
    for name in names:
        matrix, key = loaded.graph[name]
        geometry = loaded.geometry[key]
        if not isinstance(geometry, trimesh.Trimesh) or len(geometry.faces) == 0:
            others += 1
            continue
        if key not in made:
            made[key] = mesh_of(geometry, f"{file.name}:{key}", file.suffix.lower(), reader.warnings)
        mesh, offset = made[key]
        transform = turn @ np.asarray(matrix, dtype=np.float64) @ offset
        if not np.isfinite(transform).all() or is_singular(transform):
            reader.warnings.append(f"node {name!r}: its transform has a scale of zero or is not finite; skipped")
            continue
        material = reader.read(getattr(geometry.visual, "material", None))
        nodes.append(Node(mesh, material, transform, str(name)))
    if others and nodes:
        reader.warnings.append(f"{others} parts without triangles (points or lines) were skipped")
    if not nodes:
        what = "only points or lines" if others or len(loaded.geometry) else "no mesh"
        raise InputError(f"{file}: holds {what}; expected at least one triangle in its scene")
    return nodes


def _framed(nodes: list[Node], file: Path, notes: list[str]) -> Scene:
    boxes = np.stack([node.bounds for node in nodes])
    bounds = np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])
    if not np.isfinite(bounds).all() or sphere_of(bounds)[1] > 1e15:
        raise InputError(f"{file}: its extent {bounds.tolist()} is beyond what float32 can draw; scale it down")
    return Scene(tuple(nodes), Camera.framing(bounds), (default_light(),), file.name, tuple(notes))


def _with_own_view(scene: Scene, header: dict[str, Any], file: Path) -> Scene:
    try:
        cameras = gltf.cameras_of(header, file, scene.bounds())
        lights = gltf.lights_of(header, file, scene.bounds())
    except InputError as error:
        raise InputError(f"{file}: {error}") from None
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise InputError(f"{file}: its cameras or lights are broken ({error})") from None
    return scene.with_(camera=cameras[0] if cameras else None, lights=lights or None)
