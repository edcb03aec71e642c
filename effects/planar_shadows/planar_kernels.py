"""Kernels of `passgraph.effects.planar_shadows.planar`: lit surfaces, flattened casters, fog."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

import passgraph as pg
from passgraph import Const, Image, clamp, discard, dot, exp, mat3, mat4, normalize, smoothstep, vec2, vec3, vec4
from passgraph.effects.planar_shadows.planar_matrices import LIGHTS_MOST
from passgraph.effects.shadows.shadow_light import light_at
from passgraph.effects.surfaces.engine_depth import DepthFrame, distance_held
from passgraph.effects.surfaces.views import LightFrame


@pg.struct
class Lit:
    """A vertex with world axes, the eye at the origin."""

    position: vec4
    normal: vec3
    place: vec3
    height: float  # over the plane, scene units
    uv: vec2
    color: vec4


@pg.struct
class Shade:
    """A caster's vertex, flattened onto the plane."""

    position: vec4
    above: float  # the plane, on the side of the light
    beyond: float  # positive between the plane and the light
    place: vec4  # on the plane, relative to the light, homogeneous
    color: vec4


@pg.vertex
def place_lit(vertex: pg.Vertex, clip_from_local: mat4, eye_from_local: mat4, height_row: vec4) -> Lit:
    """Where it is drawn and where it is lit are apart: a reflection is the lit object, seen elsewhere."""
    local = vec4(vertex.position, 1.0)
    place = eye_from_local * local
    return Lit(clip_from_local * local, vertex.normal, place.xyz, dot(height_row, local), vertex.uv, vertex.color)


@pg.function
def one_light(light: vec4, color: vec4, axis: vec4, place: vec3, n: vec3) -> vec3:
    """Diffuse light of one column of `passgraph.effects.planar_shadows.planar_matrices.lights_from`."""
    none = vec3(0.0)
    frame = LightFrame(
        mat4(1.0), vec4(0.0), light.xyz, axis.xyz, mat3(1.0), color.rgb, vec2(axis.w, color.w), 0.0, 0.0, 0.0, 0.0
    )
    return light_at(frame, place, n, int(light.w)).rgb if any(color.rgb > none) else none


@pg.function
def light_on(lights: mat4, colors: mat4, axes: mat4, place: vec3, normal: vec3, ambient: vec3) -> vec3:
    """All lights: one column each, black where there are fewer."""
    n = normalize(normal)
    total = ambient
    for i in range(LIGHTS_MOST):
        total += one_light(lights[i], colors[i], axes[i], place, n)
    return total


@pg.fragment
def lit_object(
    surface: Lit, base_map: Image, lights: mat4, colors: mat4, axes: mat4, ambient: vec3, keep: float,
    has_map: Const[bool], cutoff: float,
) -> vec4:  # fmt: skip
    """A lit surface; ``keep`` is the side of the plane that is drawn, 0 for both."""
    if surface.height * keep < 0.0:
        discard()
    color = surface.color
    if has_map:
        color = color * base_map.sample(surface.uv)
    if color.a < cutoff:
        discard()
    return vec4(color.rgb * light_on(lights, colors, axes, surface.place, surface.normal, ambient), color.a)


@pg.fragment
def lit_plane(
    surface: Lit, base_map: Image, lights: mat4, colors: mat4, axes: mat4, ambient: vec3, face: vec4, side: float,
    has_map: Const[bool],
) -> vec4:  # fmt: skip
    """The face of the plane that the eye sees, with that face's colour and opacity."""
    color = face.rgb
    if has_map:
        color = color * base_map.sample(surface.uv).rgb
    return vec4(color * light_on(lights, colors, axes, surface.place, vec3(0.0, side, 0.0), ambient), face.a)


@pg.vertex
def flatten(
    vertex: pg.Vertex, clip_from_local: mat4, above_row: vec4, beyond_row: vec4, spot_from_local: mat4
) -> Shade:  # fmt: skip
    """A caster onto the plane, away from the light."""
    local = vec4(vertex.position, 1.0)
    above, beyond = dot(above_row, local), dot(beyond_row, local)
    return Shade(clip_from_local * local, above, beyond, spot_from_local * local, vertex.color)


@pg.fragment
def darken(shade: Shade, darkness: float, axis: vec3, cone: vec2, translucent: Const[bool]) -> vec4:
    """The share of the colour that a shadow leaves; what is not between plane and light throws none."""
    if shade.above < 0.0 or shade.beyond <= 0.0:
        discard()
    # where a spot's light does not fall there is none to take away
    taken = vec3(darkness * smoothstep(cone.x, cone.y, dot(normalize(shade.place.xyz / shade.place.w), axis)))
    if translucent:
        taken *= 1.0 - shade.color.rgb * (1.0 - clamp(shade.color.a, 0.0, 1.0))
    return vec4(1.0 - taken, 1.0)


@pg.kernel
def fogged(color: Image, depth: Image, holds: DepthFrame, fog_color: vec3, fog: vec3, kind: Const[int]) -> vec4:
    """OpenGL's fog over the distance along the view axis; ``fog`` is start, end, density."""
    z = distance_held(depth[0, 0].r, holds)
    f = (fog.y - z) / (fog.y - fog.x)
    if kind == 2:
        f = exp(-fog.z * z)
    if kind == 3:
        f = exp(-(fog.z * z) * (fog.z * z))
    f = min(max(f, 0.0), 1.0)
    here = color[0, 0]
    return vec4(fog_color + (here.rgb - fog_color) * f, here.a)
