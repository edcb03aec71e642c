# mypy: disable-error-code="no-any-return"
"""Planar shadows: matrices that flatten a scene onto planes, the kernels, and the draws, one flattened copy per
light."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import cos
from operator import itemgetter
from typing import Annotated, Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.effects.checked import checked, effect
from passgraph.effects.color.tone_map import tone_map
from passgraph.effects.effect_options import picture_of
from passgraph.effects.quantities import Color, Height, NotNegative, Share, Width
from passgraph.effects.shadows.shadow_light import KINDS, light_at
from passgraph.effects.surfaces.batches import batches, merged
from passgraph.effects.surfaces.engine_depth import DepthFrame, depth_frame, distance_held
from passgraph.effects.surfaces.material_textures import addressed, texture_input, wrap_number
from passgraph.effects.surfaces.views import LightFrame, View, view_from_world
from passgraph.language import (
    Const,
    Image,
    Vertex,
    clamp,
    discard,
    dot,
    exp,
    mat3,
    mat4,
    normalize,
    smoothstep,
    vec2,
    vec3,
    vec4,
)
from passgraph.scene.matrices import translation

Float64 = NDArray[np.float64]
#: Lights are the columns of one matrix.
LIGHTS_MOST = 4


@dataclass(frozen=True, eq=False)
class Ground:
    """The node of the plane, and all other nodes."""

    height: float
    node: pg.Node
    objects: pg.Scene | None


def ground_of(scene: pg.Scene, height: float) -> Ground:
    """Return the largest flat node at this height, or else a square under the scene, twice as wide."""
    low, high = scene.bounds()
    extent = float(np.linalg.norm(high - low))
    flat = [node for node in scene.nodes if float(np.abs(node.bounds[:, 1] - height).max()) <= 1e-6 * extent]
    if flat:
        node = max(flat, key=lambda each: float(np.prod((each.bounds[1] - each.bounds[0])[[0, 2]])))
        other_nodes = [each for each in scene.nodes if each is not node]
        return Ground(height, node, scene.with_(nodes=other_nodes) if other_nodes else None)
    half = float(max(high[0] - low[0], high[2] - low[2], 1e-6))
    corners = np.array([[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1.0]]) * half
    mesh = pg.Mesh.make(corners, [[0, 1, 2], [0, 2, 3]], np.tile([0.0, 1.0, 0.0], (4, 1)), name="plane")
    place = np.eye(4)
    place[:3, 3] = 0.5 * (low[0] + high[0]), height, 0.5 * (low[2] + high[2])
    return Ground(height, pg.Node(mesh, pg.Material("plane", (1, 1, 1, 1)), place, "plane"), scene)


def mirror(level: float) -> Float64:
    """Return the reflection in y = ``level``."""
    matrix = np.diag([1.0, -1.0, 1.0, 1.0])
    matrix[1, 3] = 2.0 * level
    return matrix


def projection(light: Float64, level: float) -> Float64:
    """Return the projection onto y = ``level``, away from a light: (x, y, z, 1) for a position, (x, y, z, 0) for a
    direction.

    Between the plane and the light w is above 0.  For the plane's row p the matrix is (p·l) I - l pᵀ.

    Source: J. Blinn, "Me and My (Fake) Shadow", 1988; OpenGL Programming Guide, chapter 14.

    >>> shadow = projection(np.array([0.0, 2.0, 0.0, 1.0]), 0.0) @ np.array([1.0, 1.0, 0.0, 1.0])
    >>> (shadow[:3] / shadow[3]).tolist()
    [2.0, 0.0, 0.0]
    """
    plane = np.array([0.0, 1.0, 0.0, -level])
    towards = float(plane @ light)
    matrix: Float64 = towards * np.eye(4) - np.outer(light, plane)
    return -matrix if towards < 0.0 else matrix


def homogeneous(light: pg.Light, origin: Float64) -> Float64:
    """Return a light relative to ``origin``: its position (w = 1), or the direction toward it (w = 0)."""
    if light.kind == "directional":
        return np.append(-np.asarray(light.direction, np.float64), 0.0)
    return np.append(np.subtract(light.position, origin), 1.0)


def side_of(light: pg.Light, origin: Float64, level: float) -> float:
    """Return 1 if a light is on or above y = ``level`` relative to ``origin``, -1 if below."""
    place = homogeneous(light, origin)
    return 1.0 if place[1] - level * place[3] >= 0.0 else -1.0


def sees_top(camera: pg.Camera, height: float) -> bool:
    """Return True if the upper face of y = ``height`` is visible; with parallel rays their direction decides."""
    return float(camera.forward[1]) <= 0.0 if camera.orthographic else camera.eye[1] >= height


def cone(light: pg.Light) -> tuple[float, float]:
    """Return the cosines of the outer and inner half angle; below all cosines without a cone."""
    return (cos(light.cone_outer_rad), cos(light.cone_inner_rad)) if light.kind == "spot" else (-3.0, -2.0)


def lights_from(camera: pg.Camera, *lights: pg.Light) -> tuple[Float64, Float64, Float64]:
    """Return positions, colors and axes as columns, in world axes, relative to the eye.

    The last row has the kind's number, and the cosines of the inner and the outer half angle.
    """
    places, colors, axes = np.zeros((4, 4)), np.zeros((4, 4)), np.zeros((4, 4))
    for column, light in enumerate(lights):
        outer, inner = cone(light)
        places[:3, column] = homogeneous(light, np.asarray(camera.eye))[:3]
        places[3, column] = KINDS.index(light.kind)
        colors[:, column] = *(np.asarray(light.color) * light.intensity), inner
        axes[:, column] = *light.direction, outer
    return places, colors, axes


@pg.struct
class Lit:
    """A vertex in world axes, with the eye at the origin."""

    position: vec4
    normal: vec3
    place: vec3
    height: float  # above the plane, scene units
    uv: vec2
    color: vec4


@pg.struct
class Shade:
    """A caster's vertex, flattened onto the plane."""

    position: vec4
    above: float  # above the plane, on the side of the light
    beyond: float  # positive between the plane and the light
    place: vec4  # on the plane, relative to the light, homogeneous
    color: vec4


@pg.vertex
def place_lit(vertex: Vertex, clip_from_local: mat4, eye_from_local: mat4, height_row: vec4) -> Lit:
    """Place a vertex; its lit position is separate, since a reflection is the lit object seen elsewhere."""
    local = vec4(vertex.position, 1.0)
    place = eye_from_local * local
    return Lit(clip_from_local * local, vertex.normal, place.xyz, dot(height_row, local), vertex.uv, vertex.color)


@pg.function
def one_light(light: vec4, color: vec4, axis: vec4, place: vec3, n: vec3) -> vec3:
    """Diffuse light of one column of `passgraph.effects.planar_shadows.planar.lights_from`."""
    none = vec3(0.0)
    frame = LightFrame(
        mat4(1.0), vec4(0.0), light.xyz, axis.xyz, mat3(1.0), color.rgb, vec2(axis.w, color.w), 0.0, 0.0, 0.0, 0.0
    )
    return light_at(frame, place, n, int(light.w)).rgb if any(color.rgb > none) else none


@pg.function
def light_on(lights: mat4, colors: mat4, axes: mat4, place: vec3, normal: vec3, ambient: vec3) -> vec3:
    """Return the light of all lights: one column each, black for missing ones."""
    n = normalize(normal)
    total = ambient
    for i in range(LIGHTS_MOST):
        total += one_light(lights[i], colors[i], axes[i], place, n)
    return total


@pg.fragment
def lit_object(
    surface: Lit, base_map: Image, lights: mat4, colors: mat4, axes: mat4, ambient: vec3, keep: float,
    has_map: Const[bool], map_wrap: Const[int], cutoff: float,
) -> vec4:  # fmt: skip
    """Shade a lit surface; ``keep`` is the side of the plane that is drawn, 0 for both."""
    if surface.height * keep < 0.0:
        discard()
    color = surface.color
    if has_map:
        color = color * base_map.sample(addressed(base_map, surface.uv, map_wrap))
    if color.a < cutoff:
        discard()
    return vec4(color.rgb * light_on(lights, colors, axes, surface.place, surface.normal, ambient), color.a)


@pg.fragment
def lit_plane(
    surface: Lit, base_map: Image, lights: mat4, colors: mat4, axes: mat4, ambient: vec3, face: vec4, side: float,
    has_map: Const[bool], map_wrap: Const[int],
) -> vec4:  # fmt: skip
    """Shade the visible face of the plane, with that face's color and opacity."""
    color = face.rgb
    if has_map:
        color = color * base_map.sample(addressed(base_map, surface.uv, map_wrap)).rgb
    return vec4(color * light_on(lights, colors, axes, surface.place, vec3(0.0, side, 0.0), ambient), face.a)


@pg.vertex
def flatten(vertex: Vertex, clip_from_local: mat4, above_row: vec4, beyond_row: vec4, spot_from_local: mat4) -> Shade:
    """Flatten a caster onto the plane, away from the light."""
    local = vec4(vertex.position, 1.0)
    above, beyond = dot(above_row, local), dot(beyond_row, local)
    return Shade(clip_from_local * local, above, beyond, spot_from_local * local, vertex.color)


@pg.fragment
def darken(shade: Shade, darkness: float, axis: vec3, cone: vec2, translucent: Const[bool]) -> vec4:
    """Return the fraction of the color that a shadow leaves; casters not between plane and light have no shadow."""
    if shade.above < 0.0 or shade.beyond <= 0.0:
        discard()
    # outside of a spot's cone there is no light to remove
    taken = vec3(darkness * smoothstep(cone.x, cone.y, dot(normalize(shade.place.xyz / shade.place.w), axis)))
    if translucent:
        taken *= 1.0 - shade.color.rgb * (1.0 - clamp(shade.color.a, 0.0, 1.0))
    return vec4(1.0 - taken, 1.0)


@pg.kernel
def fogged(color: Image, depth: Image, holds: DepthFrame, fog_color: vec3, fog: vec3, kind: Const[int]) -> vec4:
    """Apply OpenGL's fog over the distance along the view axis; ``fog`` is start, end, density."""
    z = distance_held(depth[0, 0].r, holds)
    f = (fog.y - z) / (fog.y - fog.x)
    if kind == 2:
        f = exp(-fog.z * z)
    if kind == 3:
        f = exp(-(fog.z * z) * (fog.z * z))
    f = min(max(f, 0.0), 1.0)
    here = color[0, 0]
    return vec4(fog_color + (here.rgb - fog_color) * f, here.a)


#: Shadows are pulled toward the eye by their slope and two steps of the depth format.
SHADOW_OFFSET = (-1.0, -2.0)


class Draws:
    """State shared by all passes: view and lights."""

    def __init__(self, scene: pg.Scene, ground: Ground, ambient: float) -> None:
        self.ground = ground
        self.view = View(pg.Value("camera", pg.Camera, default=scene.camera))
        self.lights = [
            pg.Value("light" if len(scene.lights) == 1 else f"light{i}", pg.Light, default=light)
            for i, light in enumerate(scene.lights)
        ]
        self.batches = batches(ground.objects) if ground.objects is not None else []
        self.white = pg.Input("white", "rgba8", (1, 1), static=True, default=np.ones((1, 1, 4), np.float32))
        self.side = self.view.camera.map(lambda camera: 1.0 if sees_top(camera, ground.height) else -1.0)
        columns = pg.combine(lights_from, self.view.camera, *self.lights)
        self.light_values: dict[str, object] = {
            "lights": columns.map(itemgetter(0)),
            "colors": columns.map(itemgetter(1)),
            "axes": columns.map(itemgetter(2)),
            "ambient": (ambient,) * 3,
        }

    def plane(self, into: Any, depth: Any, name: str, face: object, **state: Any) -> Any:
        """Draw the plane's node, on whichever side the eye is."""
        node = self.ground.node
        origin = node.bounds.mean(axis=0)
        mesh = merged([node], origin)
        values = {
            **self._placed(origin, np.eye(4)),
            **self._map(node.material),
            **self.light_values,
            "face": face,
            "side": self.side,
        }
        return pg.draw(
            mesh, vertex=place_lit, fragment=lit_plane, into=into, depth=depth, name=name, values=values, **state
        )

    def objects(self, into: Any, name: str, mirrored: bool) -> Any:
        """Draw all objects; mirrored ones inside the stencil, with the other winding, from the eye's side only."""
        for batch in self.batches:
            material, blends = batch.material, batch.material.alpha_mode == "blend"
            matrix = mirror(self.ground.height - float(batch.origin[1])) if mirrored else np.eye(4)
            values = {
                **self._placed(batch.origin, matrix),
                **self._map(material),
                **self.light_values,
                **({"colors": np.zeros((4, 4)), "ambient": (1.0,) * 3} if material.unlit else {}),
                "keep": self.side if mirrored else 0.0,
                "cutoff": material.alpha_cutoff if material.alpha_mode == "mask" else -1.0,
            }
            into = pg.draw(
                batch.mesh, vertex=place_lit, fragment=lit_object, into=into, depth=into.depth,
                stencil=pg.Stencil("equal", 1) if mirrored else None, blend="alpha" if blends else None,
                depth_write=not blends, color_mask=(True, True, True, False), name=name, values=values,
                cull="none" if material.double_sided else "front" if mirrored else "back",
            )  # fmt: skip
        return into

    def shadows(self, into: Any, darkness: float, lift: float) -> Any:
        """Draw shadows: each light has its own stencil bit, which the first triangle on a pixel flips."""
        objects = self.ground.objects
        casting = [node for node in objects.nodes if node.casts] if objects is not None else []
        # solid ones first: where their shadow is, a translucent one adds nothing
        for translucent in (False, True):
            nodes = [node for node in casting if (node.material.alpha_mode == "blend") == translucent]
            if nodes:
                into = self._shadows_of(nodes, translucent, into, darkness, lift)
        return into

    def _shadows_of(self, nodes: list[pg.Node], translucent: bool, into: Any, darkness: float, lift: float) -> Any:
        origin = np.mean([node.bounds.mean(axis=0) for node in nodes], axis=0)
        mesh = merged(nodes, origin)
        for number, value in enumerate(self.lights):
            bit = 2 << number
            values = {
                **self._flattened(value, origin, lift),
                "translucent": translucent,
                "darkness": pg.combine(self._darkness_on(origin, darkness), self.view.camera, value),
                "axis": value.map(lambda light: light.direction),
                "cone": value.map(cone),
            }
            into = pg.draw(
                mesh, vertex=flatten, fragment=darken, into=into, depth=into.depth, depth_write=False,
                stencil=pg.Stencil("equal", 1, read_mask=1 | bit, write_mask=bit, passed="invert"),
                depth_compare="less_equal", polygon_offset=SHADOW_OFFSET if lift > 0.0 else (0.0, 0.0),
                blend="multiply", color_mask=(True, True, True, False),
                name=f"6 {'translucent ' if translucent else ''}shadow of {value.name}", values=values,
            )  # fmt: skip
        return into

    def _flattened(self, value: pg.Value, origin: Float64, lift: float) -> dict[str, object]:
        """Return matrices and rows of `flatten` for casters relative to ``origin``."""
        level = self.ground.height - float(origin[1])

        def clip(camera: pg.Camera, light: pg.Light, size: tuple[int, int]) -> Float64:
            toward = 1.0 if sees_top(camera, self.ground.height) else -1.0
            flat = projection(homogeneous(light, origin), level + lift * toward)
            matrix: Float64 = camera.projection_matrix(size[0] / size[1]) @ view_from_world(camera, origin) @ flat
            return matrix

        def from_light(light: pg.Light) -> Float64:
            matrix: Float64 = translation(origin - np.asarray(light.position)) @ projection(
                homogeneous(light, origin), level
            )
            return matrix

        return {
            "clip_from_local": pg.combine(clip, self.view.camera, value, pg.OUTPUT_SIZE),
            "above_row": value.map(lambda light: np.array([0.0, 1.0, 0.0, -level]) * side_of(light, origin, level)),
            "beyond_row": value.map(lambda light: projection(homogeneous(light, origin), level)[3]),
            "spot_from_local": value.map(from_light),
        }

    def _darkness_on(self, origin: Float64, darkness: float) -> Callable[[pg.Camera, pg.Light], float]:
        """Return a function of camera and light: 0 if the eye sees the face that the light does not reach."""
        height = self.ground.height

        def seen(camera: pg.Camera, light: pg.Light) -> float:
            over = sees_top(camera, height) == (side_of(light, origin, height - float(origin[1])) > 0.0)
            return darkness if over else 0.0

        return seen

    def _placed(self, origin: Float64, matrix: Float64) -> dict[str, object]:
        return {
            "clip_from_local": self.view.clip_from(origin).map(lambda seen: seen @ matrix),
            "eye_from_local": self.view.camera.map(lambda camera: camera.relative(translation(origin))),
            "height_row": (0.0, 1.0, 0.0, float(origin[1]) - self.ground.height),
        }

    def _map(self, material: pg.Material) -> dict[str, object]:
        texture = material.base_color_texture
        found = self.white if texture is None else texture_input(texture, "base color")
        return {"base_map": found, "has_map": texture is not None, "map_wrap": wrap_number(texture)}


Fog = Literal["none", "linear", "exp", "exp2"]
FOGS: tuple[Fog, ...] = get_args(Fog)


@dataclass(frozen=True)
class Planar:
    """The color target after every step: the same target after each draw.

    Attributes
    ----------
    picture : the result of `planar`
    reflection : steps 1 and 2, the mirrored objects inside the plane's stencil
    objects : step 3 and 4, plane and objects without shadows
    shadowed : steps 5 and 6
    fogged : step 7; ``shadowed`` without fog
    """

    picture: pg.Target
    reflection: pg.Target
    objects: pg.Target
    shadowed: pg.Target
    fogged: pg.Target


@checked
def planar_passes(
    scene: pg.Scene,
    *,
    height: Height = 0.0,
    top: Color = (1.0, 1.0, 1.0),
    top_opacity: Share = 0.7,
    bottom: Color = (0.25, 0.2, 0.2),
    bottom_opacity: Share = 1.0,
    darkness: Share = 0.6,
    lift: Width = 0.001,
    ambient: NotNegative = 0.25,
    fog: Fog = "linear",
    fog_color: Color = (0.32, 0.42, 0.55),
    fog_start: Height = 10.0,
    fog_end: Height = 40.0,
    fog_density: Annotated[float, pg.Range(0, None, "per scene unit")] = 0.05,
    display: bool = True,
) -> Planar:
    """Return `planar` with every step; parameters as there."""
    if not fog_start < fog_end:
        raise pg.GraphError(f"planar: fog_start must be below fog_end, got {fog_start!r} and {fog_end!r}")
    if len(scene.lights) > LIGHTS_MOST:
        raise pg.GraphError(f"planar: {len(scene.lights)} lights; at most {LIGHTS_MOST} fit")
    ground = ground_of(scene, height)
    draws = Draws(scene, ground, ambient)
    side = draws.side
    into: Any = pg.target("planar", "rgba16f", scale=1.0, clear=(*fog_color, 1.0))
    marked = draws.plane(
        into, pg.target("planar depth", "depth32f_stencil8", scale=1.0), "1 stencil", (0.0,) * 4,
        stencil=pg.Stencil("always", 1, passed="replace"), color_mask=(False,) * 4, depth_write=False,
    )  # fmt: skip
    reflection = draws.objects(marked, "2 reflection", True)
    plane = draws.plane(
        reflection,
        reflection.depth,
        "3 plane",
        side.map(lambda up: (*top, top_opacity) if up > 0.0 else (*bottom, bottom_opacity)),
        blend="alpha",
        color_mask=(True, True, True, False),
    )
    objects = draws.objects(plane, "4 objects", False)
    shadowed = draws.shadows(objects, darkness, lift)
    result = shadowed
    if fog != "none":
        holds = draws.view.camera.map(lambda camera: depth_frame(camera.hardware_depth()))
        result = fogged(
            shadowed, shadowed.depth, holds, fog_color, (fog_start, fog_end, fog_density), FOGS.index(fog),
            into=pg.target("planar fog", "rgba16f"), name="7 fog",
        )  # fmt: skip
    picture = tone_map(result, 0.0, "linear", into=pg.target("picture", "rgba8"), name="picture") if display else result
    return Planar(picture, reflection, objects, shadowed, result)


@effect("planar", "scene")
@picture_of(planar_passes)
def planar() -> None:
    """Render a scene with its mirror image and its shadows on a plane parallel to XOZ, in fog.

    Parameters
    ----------
    scene : a flat node at ``height`` is the plane (with its base color map); without one, a square is added
    height : world y of the plane
    top : linear color of the plane's upper face; a texture multiplies it
    top_opacity : opacity of the upper face; the rest shows the reflection
    bottom : linear color of the plane's lower face; a texture multiplies it
    bottom_opacity : opacity of the lower face; the rest shows the reflection
    darkness : fraction of the color that the shadow of each light removes, once per pixel
    lift : height of the shadows above the plane. They also have a polygon offset; with 0 they have neither, to
        demonstrate z-fighting
    ambient : scene-linear ambient light
    fog : OpenGL's fog modes
    fog_color : scene-linear; also where there is no surface
    fog_start : for linear fog, along the view axis
    fog_end : for linear fog, beyond ``fog_start``
    fog_density : for the exponential modes
    display : return an 8-bit sRGB picture; off, the scene-linear HDR target

    Returns
    -------
    The target "picture", or the scene-linear one with ``display=False``.  A run takes ``camera=``, and ``light=`` (with
    several lights ``light0=``, ``light1=`` …, at most four).

    Source: J. Blinn, "Me and My (Fake) Shadow", 1988; M. Woo et al., "OpenGL Programming Guide" (the red
    book), 3rd edition, chapter 14, shadows and reflections; OpenGL 2.1, section 3.10 (fog).  Deviations: a
    book), 3rd edition, chapter 14, shadows and reflections; OpenGL 2.1, section 3.10 (fog).  Deviations: a stencil bit
    for each light, so that the shadows of two lights add up and those of two objects do not; the reflection has the fog
    of the plane it is seen in; a spot's shadows end with its cone; the shadow of a translucent object lets its color
    through, and where several overlap one of them counts.

    Examples
    --------
    >>> with pg.compile(planar(pg.Scene.shipped()), backend="null", size=(32, 18)) as program:
    ...     program.plan.steps[0].name
    '1 stencil'
    """
