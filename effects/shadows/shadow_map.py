"""Shadow maps: the casters' linear depth from a light's view."""

from __future__ import annotations

import numpy as np

import passgraph as pg
from passgraph.effects.surfaces.batches import merged
from passgraph.effects.surfaces.material_textures import addressed, texture_input, wrap_number
from passgraph.effects.surfaces.views import Casters, MapView
from passgraph.language import Const, Image, Vertex, discard, dot, mat4, vec2, vec4
from passgraph.records import dataclass

#: Depth where a map shows no caster: farther than any receiver.
NOTHING = 1e30


@pg.struct
class Caster:
    """A caster's vertex in the light's clip space."""

    position: vec4
    depth: float
    uv: vec2
    alpha: float


@pg.vertex
def toward_light(vertex: Vertex, clip_from_local: mat4, depth_row: vec4) -> Caster:
    """Pass linear depth in addition to the clip position: it keeps its precision for any near and far."""
    local = vec4(vertex.position, 1.0)
    return Caster(clip_from_local * local, dot(depth_row, local), vertex.uv, vertex.color.a)


@pg.fragment
def distance_of(caster: Caster) -> float:
    """Return the distance along the light's axis, scene units."""
    return caster.depth


@pg.fragment
def distance_of_cut_out(caster: Caster, base_map: Image, base_wrap: Const[int], cutoff: float) -> float:
    """Return the same for a caster whose texture has holes."""
    if caster.alpha * base_map.sample(addressed(base_map, caster.uv, base_wrap)).a < cutoff:
        discard()
    return caster.depth


@pg.fragment
def distance_of_faded(caster: Caster, cutoff: float) -> float:
    """Return the same for a caster whose vertices' alpha makes holes."""
    if caster.alpha < cutoff:
        discard()
    return caster.depth


@dataclass(frozen=True, eq=False)
class CasterMesh:
    """Casters of one draw, relative to the origin of `Casters`; ``cut_out`` has holes."""

    mesh: pg.Mesh
    cut_out: pg.Material | None = None


def caster_meshes(casters: Casters) -> list[CasterMesh]:
    """Return solid casters as one mesh, and one more for each cut-out material; all lights share them."""
    groups: dict[int | None, list[pg.Node]] = {}
    for node in casters.nodes:
        groups.setdefault(id(node.material) if _has_holes(node) else None, []).append(node)
    return [
        CasterMesh(merged(nodes, casters.origin), None if key is None else nodes[0].material)
        for key, nodes in groups.items()
    ]


def _has_holes(node: pg.Node) -> bool:
    material = node.material
    if material.alpha_mode != "mask":
        return False
    # in float32, as the kernel compares
    least = (node.mesh.colors[:, 3] * np.float32(material.base_color[3])).min()
    return material.base_color_texture is not None or bool(least < np.float32(material.alpha_cutoff))


def shadow_map(view: MapView, meshes: list[CasterMesh], map_size: int, name: str) -> pg.Target:
    """Draw every caster from one light's view.

    Returns
    -------
    r32f, ``map_size`` squared: distance along the light's axis in scene units, 1e30 where there is no caster.
    """
    into: pg.Target | pg.TargetSpec = pg.target(name, "r32f", (map_size, map_size), clear=NOTHING)
    depth: pg.Target | pg.TargetSpec = pg.target(f"{name}_test", "depth32f", (map_size, map_size))
    origin = view.casters.origin
    for part in meshes:
        values: dict[str, object] = {
            "clip_from_local": view.clip_from(origin),
            "depth_row": view.depth_row(origin),
        }
        fragment = distance_of
        if part.cut_out is not None:
            texture = part.cut_out.base_color_texture
            fragment = distance_of_faded if texture is None else distance_of_cut_out
            values |= {"cutoff": part.cut_out.alpha_cutoff}
            if texture is not None:
                values |= {"base_map": texture_input(texture, "base color"), "base_wrap": wrap_number(texture)}
        into = pg.draw(
            part.mesh, vertex=toward_light, fragment=fragment, into=into, depth=depth, name=name, values=values
        )
        assert isinstance(into, pg.Target)
        depth = into.depth
    assert isinstance(into, pg.Target)
    return into
