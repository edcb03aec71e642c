"""The scene from the camera, unlit: color, normals and linear depth in one pass."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from typing import Literal

import numpy as np

import passgraph as pg
from passgraph.effects.checked import checked
from passgraph.effects.surfaces.batches import Batch, batches, is_textured
from passgraph.effects.surfaces.geometry import pack_normal, unpack_normal
from passgraph.effects.surfaces.material_textures import Use, level_at, mipped, texture_input, texture_levels
from passgraph.effects.surfaces.views import View
from passgraph.language import (
    Const,
    Image,
    Vertex,
    clamp,
    cross,
    dfdx,
    dfdy,
    discard,
    dot,
    floor,
    front_facing,
    ivec2,
    mat3,
    mat4,
    normalize,
    vec2,
    vec3,
    vec4,
)
from passgraph.records import dataclass

#: Layers of the parallax search; the intersection between two layers is interpolated.
PARALLAX_STEPS = 8
#: The view is treated as no flatter than this (cosine), or the texture would smear at grazing angles.
FLATTEST_VIEW = 0.25
#: The alpha of the base color of surfaces that no light and no shadow changes.
UNLIT = -1.0


@pg.struct
class Surface:
    """Varyings of a surface, in the camera's frame."""

    position: vec4
    normal: vec3
    tangent: vec4
    view: vec3
    uv: vec2
    color: vec4


@pg.vertex
def place(vertex: Vertex, clip_from_local: mat4, view_from_local: mat4) -> Surface:
    """Transform vertices to clip space; normals and tangents to the camera's frame, by a rotation."""
    turn = mat3(view_from_local)
    local = vec4(vertex.position, 1.0)
    return Surface(
        clip_from_local * local,
        turn * vertex.normal,
        vec4(turn * vertex.tangent.xyz, vertex.tangent.w),
        (view_from_local * local).xyz,
        vertex.uv,
        vertex.color,
    )


@pg.function
def sided(normal: vec3, double_sided: bool) -> vec3:
    """Return the unit normal, turned toward the viewer on back faces."""
    n = normalize(normal)
    return -n if double_sided and not front_facing() else n


@pg.function
def parallax(heights: Image, surface: Surface, n: vec3, scale: float, spreads: bool) -> vec2:
    """Return texture coordinates where the line of sight meets the height map; ``spreads`` in perspective.

    Source: N. Tatarchuk, "Dynamic Parallax Occlusion Mapping", 2006.
    """
    t = normalize(surface.tangent.xyz)
    b = cross(n, t) * surface.tangent.w
    toward = normalize(-surface.view) if spreads else vec3(0.0, 0.0, 1.0)
    size = vec2(heights.size)
    flat = max(dot(n, toward), FLATTEST_VIEW)
    # one unit of depth moves the coordinates by this; v grows against the bitangent
    slide = vec2(-dot(t, toward), dot(b, toward) * size.x / size.y) * (scale / flat)
    start = surface.uv * size
    found = PARALLAX_STEPS
    for i in range(PARALLAX_STEPS):
        # the nearest texel finds the layer; the intersection inside the layer uses filtered heights
        if found == PARALLAX_STEPS:
            layer = float(i) / float(PARALLAX_STEPS)
            if 1.0 - heights.texel(ivec2(floor(start + slide * size * layer))).r <= layer:
                found = i
    low = max(float(found) - 1.0, 0.0) / float(PARALLAX_STEPS)
    high = float(found) / float(PARALLAX_STEPS)
    above = 1.0 - heights.sample(surface.uv + slide * low).r - low
    below = 1.0 - heights.sample(surface.uv + slide * high).r - high
    crossing = clamp(above / max(above - below, 1e-6), 0.0, 1.0)
    return surface.uv + slide * (low + (high - low) * crossing)


@pg.function
def bent(texel: vec3, surface: Surface, n: vec3) -> vec3:
    """Return the normal from a normal map, whose texel x, y, z are -1..1."""
    t = normalize(surface.tangent.xyz)
    return normalize(t * texel.x + cross(n, t) * (surface.tangent.w * texel.y) + n * texel.z)


@pg.function
def rise_of(view: vec3, in_perspective: bool) -> vec2:
    """Return the slopes of the triangle's plane, see `GBuffer.rises`."""
    linear = -1.0 / view.z if in_perspective else -view.z
    return vec2(dfdx(linear), -dfdy(linear))


@pg.fragment
def plain(
    surface: Surface,
    double_sided: Const[bool],
    receives: Const[float],
    masked: Const[bool],
    cutoff: float,
    in_perspective: bool,
) -> tuple[vec4, vec4, float, vec2]:
    """Write a surface without textures: color, normals, distance along the view axis."""
    if masked and surface.color.a < cutoff:
        discard()
    packed = pack_normal(sided(surface.normal, double_sided))
    return (
        vec4(surface.color.rgb, receives),
        vec4(packed, packed),
        -surface.view.z,
        rise_of(surface.view, in_perspective),
    )


@pg.fragment
def textured(
    surface: Surface, base_map: Image, normal_map: Image, height_map: Image, height_scale: float,
    base_levels: Image, base_size: vec2, base_count: Const[int], base_wrap: Const[int],
    base_minify: Const[int], normal_levels: Image, normal_size: vec2, normal_count: Const[int],
    normal_wrap: Const[int], normal_minify: Const[int],
    has_base: Const[bool], has_normals: Const[bool], has_heights: Const[bool], in_perspective: bool,
    double_sided: Const[bool], receives: Const[float], masked: Const[bool], cutoff: float,
) -> tuple[vec4, vec4, float, vec2]:  # fmt: skip
    """Write a surface with any of base color, normal and height map."""
    n = sided(surface.normal, double_sided)
    at = surface.uv
    if has_heights:
        at = parallax(height_map, surface, n, height_scale, in_perspective)
    color = surface.color
    if has_base:
        level = level_at(surface.uv, base_size)
        color = color * mipped(base_map, base_levels, base_size, base_count, base_wrap, base_minify, at, level)
    if masked and color.a < cutoff:
        discard()
    shown = n
    if has_normals:
        level = level_at(surface.uv, normal_size)
        texel = mipped(normal_map, normal_levels, normal_size, normal_count, normal_wrap, normal_minify, at, level).xyz
        shown = bent(texel * 2.0 - 1.0, surface, n)
    return (
        vec4(color.rgb, receives),
        vec4(pack_normal(shown), pack_normal(n)),
        -surface.view.z,
        rise_of(surface.view, in_perspective),
    )


@pg.fragment
def tinted(surface: Surface) -> vec4:
    """Write a translucent surface without textures: color and opacity."""
    return surface.color


@pg.fragment
def tinted_textured(
    surface: Surface, base_map: Image, base_levels: Image, base_size: vec2, base_count: Const[int],
    base_wrap: Const[int], base_minify: Const[int],
) -> vec4:  # fmt: skip
    """Write a translucent surface with a base color map."""
    level = level_at(surface.uv, base_size)
    texel = mipped(base_map, base_levels, base_size, base_count, base_wrap, base_minify, surface.uv, level)
    return surface.color * texel


@dataclass(frozen=True)
class GBuffer:
    """Targets of one size, each for the nearest opaque surface.

    Attributes
    ----------
    color : rgba16f, linear base color, translucent surfaces blended in; alpha is 1 where shadows are received, and
        `UNLIT` on unlit surfaces
    normals : rgba16f, packed: the normal after normal maps (red, green) and that of the surface (blue, alpha)
    depth : r32f, distance along the view axis in scene units; 0 where there is no surface
    rises : rg32f, increase of `passgraph.effects.surfaces.geometry.linear_on_planes` of the depth on the plane of the
        pixel's triangle to the next pixel, to the right and upwards; None if only a depth is known
    """

    color: pg.Target
    normals: pg.Target
    depth: pg.Target
    rises: pg.Target | None = None


def g_buffer(scene: pg.Scene, view: View, background: tuple[float, float, float], prefix: str = "") -> GBuffer:
    """Draw the scene's attributes, one draw for each batch (see `passgraph.effects.surfaces.batches`).

    ``prefix`` begins the targets' names, so that several effects in one graph have distinct ones.
    """
    into: tuple[pg.Target | pg.TargetSpec, ...] = (
        pg.target(f"{prefix}base_color", "rgba16f", scale=1.0, clear=(*background, 0.0)),
        pg.target(f"{prefix}normals", "rgba16f", scale=1.0),
        pg.target(f"{prefix}depth", "r32f", scale=1.0),
        pg.target(f"{prefix}rises", "rg32f", scale=1.0),
    )
    depth: pg.Target | pg.TargetSpec = pg.target(f"{prefix}depth_test", "depth32f", scale=1.0)
    listed = batches(scene)
    opaque = [batch for batch in listed if batch.material.alpha_mode != "blend"]
    if not opaque:
        raise pg.GraphError(f"scene {scene.name!r}: every surface is translucent; shadows need an opaque one")
    for batch in opaque:
        into = _draw(batch, view, into, depth)
        depth = into[0].depth
    color = into[0]
    for batch in listed[len(opaque) :]:
        color = _draw_translucent(batch, view, color, depth)
    _, normals, linear, rises = into
    assert isinstance(color, pg.Target) and isinstance(normals, pg.Target) and isinstance(linear, pg.Target)
    assert isinstance(rises, pg.Target)
    return GBuffer(color, normals, linear, rises)


def _matrices(batch: Batch, view: View) -> dict[str, pg.Derived]:
    return {"clip_from_local": view.clip_from(batch.origin), "view_from_local": view.view_from(batch.origin)}


def _draw(
    batch: Batch,
    view: View,
    into: tuple[pg.Target | pg.TargetSpec, ...],
    depth: pg.Target | pg.TargetSpec,
) -> tuple[pg.Target, ...]:
    material = batch.material
    values: dict[str, object] = {
        "double_sided": material.double_sided,
        "receives": UNLIT if material.unlit else float(batch.receives),
        "masked": material.alpha_mode == "mask",
        "cutoff": material.alpha_cutoff,
        "in_perspective": view.in_perspective(),
        **_matrices(batch, view),
    }
    if is_textured(material):
        maps: dict[str, tuple[pg.Texture | None, Use]] = {
            "base_map": (material.base_color_texture, "base color"),
            "normal_map": (material.normal_texture, "normals"),
            "height_map": (material.height_texture, "height"),
        }
        inputs = {key: texture_input(texture, use) for key, (texture, use) in maps.items() if texture is not None}
        any_input = next(iter(inputs.values()))  # replaces missing maps, whose code is removed
        values |= {key: inputs.get(key, any_input) for key in maps}
        values |= {
            f"has_{word}": f"{key}" in inputs
            for word, key in (("base", "base_map"), ("normals", "normal_map"), ("heights", "height_map"))
        }
        values |= {"height_scale": material.height_scale}
        values |= _levels("base", material.base_color_texture, "base color", any_input)
        values |= _levels("normal", material.normal_texture, "normals", any_input)
    targets: tuple[pg.Target, ...] = pg.draw(
        batch.mesh, vertex=place, fragment=textured if is_textured(material) else plain, into=into,
        depth=depth, cull="none" if material.double_sided else "back",
        name=f"surfaces: {material.name if is_textured(material) else 'untextured'}", values=values,
    )  # fmt: skip
    return targets


def _levels(word: str, texture: pg.Texture | None, use: Use, any_input: object) -> dict[str, object]:
    """Return the kernel arguments for the mipmap levels of a material texture."""
    if texture is None:
        unused = {f"{word}_{name}": 0 for name in ("count", "wrap", "minify")}
        return {f"{word}_levels": any_input, f"{word}_size": (1.0, 1.0), **unused}
    return {f"{word}_{name}": value for name, value in texture_levels(texture, use).items()}


def _draw_translucent(
    batch: Batch,
    view: View,
    color: pg.Target | pg.TargetSpec,
    depth: pg.Target | pg.TargetSpec,
) -> pg.Target:
    """Blend translucent surfaces into the color behind them, so that they get that surface's light and shadow."""
    values: dict[str, object] = dict(_matrices(batch, view))
    texture = batch.material.base_color_texture
    if texture is not None:
        values["base_map"] = texture_input(texture, "base color")
        values |= _levels("base", texture, "base color", values["base_map"])
    mixed: pg.Target = pg.draw(
        batch.mesh, vertex=place, fragment=tinted if texture is None else tinted_textured, into=color,
        depth=depth, depth_write=False, blend="alpha", color_mask=(True, True, True, False),
        cull="none" if batch.material.double_sided else "back", name=f"translucent: {batch.material.name}",
        values=values,
    )  # fmt: skip
    return mixed


# Public functions: the same as plain pictures


@dataclass(frozen=True)
class SceneSurfaces:
    """Results of `scene_surfaces` for the nearest opaque surface; zeros without one.

    Attributes
    ----------
    depth : r32f, distance along the view axis in scene units
    normals : rgba32f, a unit vector and 1
    base_color : rgba16f, linear, without light; translucent surfaces mixed in; alpha is 1 where shadows are received,
        and -1 on unlit surfaces
    """

    depth: pg.Target
    normals: pg.Target
    base_color: pg.Target


@checked
def scene_surfaces(
    scene: pg.Scene, space: Literal["view", "world"] = "view", normal_maps: bool = True
) -> SceneSurfaces:
    """Render depth, normals and base color of a scene in one pass; runs take ``camera=``, by default the scene's.

    Parameters
    ----------
    scene : the scene to draw
    space : space of the normals. "view": x to the right, y up, z toward the eye; "world": the scene's axes
    normal_maps : apply normal maps; off, normals of the surface itself

    Examples
    --------
    >>> seen = scene_surfaces(pg.Scene.shipped(), "world")
    >>> with pg.compile({"depth": seen.depth, "normals": seen.normals}, backend="reference", size=(8, 6)) as program:
    ...     found = program()
    >>> round(float(found["normals"][5, 4, 1]), 2), bool(found["depth"][5, 4, 0] > 1.0)  # of the floor
    (1.0, True)
    """
    camera = pg.Value("camera", pg.Camera, default=scene.camera)
    seen = g_buffer(scene, View(camera), (0.0, 0.0, 0.0), "surfaces ")
    turn = camera.map(lambda one: one.view_rotation()[:3, :3].T if space == "world" else np.eye(3))
    into = pg.target("unit normals", "rgba32f")
    normals = unpacked(seen.normals, seen.depth, turn, normal_maps, into=into, name="unit normals")
    return SceneSurfaces(seen.depth, normals, seen.color)


@pg.kernel
def unpacked(normals: Image, depth: Image, turn: mat3, normal_maps: Const[bool]) -> vec4:
    """Return a packed normal as a unit vector."""
    packed = normals[0, 0]
    n = turn * unpack_normal(packed.xy if normal_maps else packed.zw)
    return vec4(n, 1.0) if depth[0, 0].r > 0.0 else vec4(0.0)
