# mypy: disable-error-code="no-any-return"
"""Contact penumbra: darken a floor near objects that stand on it or hang just above it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph.effects.checked import checked, effect
from passgraph.effects.color.tone_map import tone_map
from passgraph.effects.effect_options import picture_of
from passgraph.effects.quantities import Height, Reach, Share
from passgraph.effects.shadows.shadow_light import multiply
from passgraph.effects.shadows.soft_shadow import SoftShadow, soft_shadow_passes
from passgraph.effects.surfaces.batches import merged
from passgraph.effects.surfaces.geometry import ViewFrame, unpack_normal, view_position
from passgraph.effects.surfaces.views import View
from passgraph.language import (
    Const,
    Image,
    Vertex,
    clamp,
    discard,
    dot,
    front_facing,
    mat4,
    pixel,
    uv,
    vec2,
    vec3,
    vec4,
)
from passgraph.scene.matrices import transform_points, translation

Float64 = NDArray[np.float64]
Darkness = Share | Mapping[str, Share]
#: Darkness for nodes missing in a mapping.
DARKNESS = 0.7
#: Surfaces less than this fraction of the threshold under the floor count as on it.
SLACK = 1e-3
#: Height of the floor where there is none.
NO_FLOOR = -1e30


@pg.struct
class Layer:
    """A vertex seen from straight above."""

    position: vec4
    y: float  # scene units over the map's origin
    color: vec4


@pg.vertex
def from_above(vertex: Vertex, clip_from_local: mat4) -> Layer:
    """The near plane is at the threshold above the floor's highest point: higher geometry is clipped."""
    return Layer(clip_from_local * vec4(vertex.position, 1.0), vertex.position.y, vertex.color)


@pg.fragment
def height_of(layer: Layer) -> float:
    """Write the floor as a height map."""
    return layer.y


@pg.function
def over_floor(heights: Image, y: float, threshold: float, has_heights: bool) -> float:
    """Return 0 on the floor, 1 at the threshold above it."""
    if has_heights:
        return (y - heights.texel(pixel()).r) / threshold
    return y / threshold


@pg.fragment
def buried(layer: Layer, heights: Image, threshold: float, has_heights: Const[bool]) -> float:
    """Count the faces under the floor: more look down than up where the floor is inside a body."""
    if over_floor(heights, layer.y, threshold, has_heights) >= -SLACK:
        discard()
    return -1.0 if front_facing() else 1.0


@pg.fragment
def gradient(
    layer: Layer, heights: Image, inside: Image, threshold: float, darkness: float, solid: float,
    has_heights: Const[bool], has_inside: Const[bool],
) -> vec4:  # fmt: skip
    """Return the remaining fraction of the light: all at the threshold, the least on the floor."""
    h = over_floor(heights, layer.y, threshold, has_heights)
    if h > 1.0 or (front_facing() and abs(h) <= SLACK):
        discard()  # the second test skips the floor itself, if one mesh holds floor and bodies
    if has_inside and h < -SLACK and inside.texel(pixel()).r < 0.5:
        discard()  # under the floor, and the floor here is outside of the body
    through = layer.color.rgb * (1.0 - clamp(max(layer.color.a, solid), 0.0, 1.0))
    return vec4(1.0 - darkness * (1.0 - clamp(h, 0.0, 1.0)) * (1.0 - through), 1.0)


@dataclass(frozen=True, eq=False)
class Window:
    """The square of the world that the map shows; right is +x, down is +z.

    Attributes
    ----------
    origin : world position of its center
    half : half of its side, scene units
    """

    origin: Float64
    half: float

    @property
    def flat(self) -> Float64:
        """Return the matrix from positions relative to the origin to (x, y) in -1 to 1 and z in scene units above the
        origin."""
        k = 1.0 / self.half
        return np.array([[k, 0, 0, 0], [0, 0, -k, 0], [0, 1, 0, 0], [0, 0, 0, 1.0]])

    def clip(self, low: float, high: float) -> Float64:
        """Return the clip matrix with the near plane at world y ``high`` and the far plane at ``low``."""
        matrix, depth = self.flat, high - low
        matrix[2] = 0.0, -2.0 / depth, 0.0, (high + low - 2.0 * float(self.origin[1])) / depth
        return matrix


@dataclass(frozen=True, eq=False)
class ContactMap:
    """Targets of `contact_map`, and their position.

    Attributes
    ----------
    map : rgba16f, remaining fraction of the light
    heights : r32f, of the floor above the window's origin; None on a plane
    window : the square that both cover
    """

    map: pg.Target
    heights: pg.Target | None
    window: Window


def contact_map(
    scene: pg.Scene, floor: Sequence[pg.Node], height: float, threshold: float, darkness: Darkness, map_size: int
) -> ContactMap:
    """Draw everything within ``threshold`` of a floor: a height field, or the plane at ``height`` without one."""
    bodies = [node for node in scene.nodes if node.casts and node not in floor]
    near = near_to_field(bodies, floor, threshold) if floor else near_to_plane(bodies, height, threshold)
    if not near:
        raise pg.GraphError(f"contact: nothing in scene {scene.name!r} is within {threshold:g} of its floor")
    low = np.min([node.bounds[0] for node in near], axis=0)
    high = np.max([node.bounds[1] for node in near], axis=0)
    origin = 0.5 * (low + high)
    top, bottom = height, height
    if floor:
        top = max(float(node.bounds[1, 1]) for node in floor)
        bottom = min(float(node.bounds[0, 1]) for node in floor)
    origin[1] = 0.5 * (top + bottom)
    # the map is square, with a margin of a few texels
    half = 0.5 * float(max(high[0] - low[0], high[2] - low[2], 1e-6)) * (1.0 + 8.0 / map_size)
    window, size = Window(origin, half), (map_size, map_size)
    blank = pg.Input("contact blank", "r32f", (1, 1), static=True, default=np.zeros((1, 1, 1), np.float32))
    heights = None
    if floor:
        slack = 1e-3 * max(top - bottom, threshold)
        heights = pg.draw(
            merged(floor, origin),
            vertex=from_above,
            fragment=height_of,
            into=pg.target("contact heights", "r32f", size, clear=NO_FLOOR),
            depth=pg.target("contact heights test", "depth32f", size),
            clip_from_local=window.clip(bottom - slack, top + slack),
        )
    values: dict[str, object] = {
        "heights": heights or blank,
        "has_heights": heights is not None,
        "threshold": threshold,
        "clip_from_local": window.clip(min(float(low[1]), bottom) - threshold, top + threshold),
    }
    inside = None
    if floor or low[1] < height - SLACK * threshold:
        inside = pg.draw(
            merged(near, origin), vertex=from_above, fragment=buried, blend="add",
            into=pg.target("contact inside", "r16f", size), values=values,
        )  # fmt: skip
    values |= {"inside": inside or blank, "has_inside": inside is not None}
    into: pg.Target | pg.TargetSpec = pg.target("contact map", "rgba16f", size, clear=1.0)
    for (dark, solid), nodes in alike(near, darkness).items():
        into = pg.draw(
            merged(nodes, origin), vertex=from_above, fragment=gradient, into=into, blend="min", name="contact map",
            values={**values, "darkness": dark, "solid": float(solid)},
        )  # fmt: skip
    assert isinstance(into, pg.Target)
    return ContactMap(into, heights, window)


def alike(nodes: Iterable[pg.Node], darkness: Darkness) -> dict[tuple[float, bool], list[pg.Node]]:
    """Group nodes by darkness, and by True for colors whose opacity is meaningless."""
    groups: dict[tuple[float, bool], list[pg.Node]] = {}
    for node in nodes:
        dark = darkness.get(node.name, DARKNESS) if isinstance(darkness, Mapping) else darkness
        groups.setdefault((dark, node.material.alpha_mode != "blend"), []).append(node)
    return groups


def near_to_plane(nodes: Iterable[pg.Node], height: float, threshold: float) -> list[pg.Node]:
    """Return the nodes with geometry above the plane and closer to it than the threshold."""
    return [
        node
        for node in nodes
        if node.bounds[1, 1] > height + SLACK * threshold and node.bounds[0, 1] < height + threshold
    ]


def near_to_field(nodes: Iterable[pg.Node], floor: Iterable[pg.Node], threshold: float) -> list[pg.Node]:
    """Return the same for a height field, by the floor's triangles that may be under a node's box."""
    corners = np.concatenate([transform_points(f.transform, f.mesh.positions)[f.mesh.triangles] for f in floor])
    low, high = corners.min(axis=1), corners.max(axis=1)
    found = []
    for node in nodes:
        box = node.bounds
        under = ((high >= box[0]) & (low <= box[1]))[:, [0, 2]].all(axis=1)
        if under.any() and box[0, 1] < high[under, 1].max() + threshold and box[1, 1] > low[under, 1].min():
            found.append(node)
    return found


def floor_nodes(scene: pg.Scene, name: str | None) -> list[pg.Node]:
    """Return the nodes with this name; none for None."""
    found = [node for node in scene.nodes if node.name == name]
    if name is not None and not found:
        raise pg.GraphError(f"contact: floor: {_unknown(scene, name)}")
    return found


def check_names(scene: pg.Scene, darkness: Darkness) -> None:
    """Check that every name belongs to a node."""
    for name in darkness if isinstance(darkness, Mapping) else ():
        if all(node.name != name for node in scene.nodes):
            raise pg.GraphError(f"contact: darkness: {_unknown(scene, name)}")


def _unknown(scene: pg.Scene, name: str) -> str:
    names = sorted({node.name for node in scene.nodes})
    near = get_close_matches(name, names, n=1)
    hint = f"; did you mean {near[0]!r}?" if near else f"; it has {', '.join(names[:8])}"
    return f"scene {scene.name!r} has no node {name!r}{hint}"


#: A pixel belongs to the plane if it is this near to it, as a fraction of its distance from the eye.
ON_FLOOR = 1e-3
#: The floor is drawn again over itself, pulled toward the eye: a vertex may be snapped to the next 1/256 of a pixel
#: (times 4 for steep corners of a triangle), and a depth is rounded a few times.  More would be visible at feet.
AGAIN_OFFSET = (-4.0 / 256.0, -8.0)


@pg.struct
class Ground:
    """A vertex of the floor in the camera's view."""

    position: vec4
    place: vec2  # on the map, -1 to 1


@pg.function
def share_at(contacts: Image, place: vec2) -> vec3:
    """Read the map: world position times matrix is the texture coordinate; filtered, without a depth test."""
    if abs(place.x) > 1.0 or abs(place.y) > 1.0:
        return vec3(1.0)
    return contacts.sample(vec2(0.5 + 0.5 * place.x, 0.5 - 0.5 * place.y)).rgb


@pg.kernel
def look_up(normals: Image, depth: Image, contacts: Image, frame: ViewFrame, map_from_view: mat4, up: vec3) -> vec4:
    """Return the map's value for pixels of the plane, which are identified by position and normal."""
    z = depth[0, 0].r
    at = map_from_view * vec4(view_position(frame, uv(), z), 1.0)
    level = dot(unpack_normal(normals[0, 0].zw), up) > 0.9
    # z of the map's space is scene units over the floor
    if z > 0.0 and level and abs(at.z) <= ON_FLOOR * z:
        return vec4(share_at(contacts, at.xy), 1.0)
    return vec4(1.0)


@pg.vertex
def place_floor(vertex: Vertex, clip_from_local: mat4, map_from_local: mat4) -> Ground:
    """Draw a height field, so that its pixels are identified however steep it is."""
    local = vec4(vertex.position, 1.0)
    return Ground(clip_from_local * local, (map_from_local * local).xy)


@pg.fragment
def look_up_floor(ground: Ground, contacts: Image) -> vec4:
    """Return the remaining fraction of the light at this place of the floor."""
    return vec4(share_at(contacts, ground.place), 1.0)


@dataclass(frozen=True)
class Contact:
    """Targets of `contact`.

    Attributes
    ----------
    picture : the result of `contact`
    lit : scene-linear, darkened
    share : remaining fraction of the floor's color, on the screen; 1 elsewhere
    map : the same from straight above, right is +x, down is +z
    heights : the floor from straight above, r32f, scene units; None on a plane
    scene : the scene with its soft shadows, not yet darkened
    """

    picture: pg.Target
    lit: pg.Target
    share: pg.Target
    map: pg.Target
    heights: pg.Target | None
    scene: SoftShadow


@checked
def contact_passes(
    scene: pg.Scene,
    *,
    height: Height = 0.0,
    floor: str | None = None,
    threshold: Reach = 0.3,
    darkness: Darkness = 0.7,
    map_size: Annotated[int, pg.Range(16, 4096, "texels")] = 256,
    display: bool = True,
) -> Contact:
    """Return `contact` with all intermediate targets; parameters as there."""
    check_names(scene, darkness)
    ground = floor_nodes(scene, floor)
    field = contact_map(scene, ground, height, threshold, darkness, map_size)
    passes = soft_shadow_passes(scene, display=False)
    view = View(pg.Value("camera", pg.Camera, default=scene.camera))
    share = _share_on_field(ground, view, field, passes) if ground else _share_on_plane(view, field, passes)
    lit = multiply(passes.soft_shadow, share, into=pg.target("contact", "rgba16f"))
    picture = tone_map(lit, 0.0, "linear", into=pg.target("picture", "rgba8"), name="picture") if display else lit
    return Contact(picture, lit, share, field.map, field.heights, passes)


@effect("contact", "scene")
@picture_of(contact_passes)
def contact() -> None:
    """Render a scene with soft shadows, and darken its floor near contacts.

    Parameters
    ----------
    scene : a scene with a floor parallel to XOZ, or a height field
    height : world y of the plane; a height field has its own
    floor : name of the node, or of the nodes, whose surface seen from above is the floor; default: the plane
    threshold : height above the floor from which on objects cast no contact shadow
    darkness : fraction of the light that is removed at contact; falls linearly to 0 at the threshold. A mapping gives
        it by the name of the casting node; names missing in it get 0.7
    map_size : texels along each side of the view from above; fewer are softer
    display : return an 8-bit sRGB picture; off, the scene-linear HDR target

    A run takes ``camera=`` and the lights, as `passgraph.effects.shadows.soft_shadow.soft_shadow` does.

    Raises
    ------
    GraphError
        For values out of range, for names that no node has, and if nothing is near the floor.

    Source: projective penumbrae on a floor: an orthographic view from above, clipped at the threshold by its
    near plane, with the normalized height as color; on a height field clipped for each texel by a height map
    near plane, with the normalized height as color; on a height field clipped for each texel by a height map of the
    floor.  Deviations: where several surfaces cover one texel the lowest counts (a minimum); translucent surfaces let
    their own color through; holes in textures count as solid.  Objects under the floor darken it only where the floor
    is inside the body, which is found by counting the faces below, so that a body with a hole below the floor may leave
    light in it.

    Examples
    --------
    >>> contact(pg.Scene.shipped()).name
    'picture'
    """


def _share_on_plane(view: View, field: ContactMap, passes: SoftShadow) -> pg.Target:
    def from_view(camera: pg.Camera) -> Float64:
        eye = translation(np.asarray(camera.eye) - field.window.origin)
        world: Float64 = field.window.flat @ eye @ camera.view_rotation().T
        return world

    return look_up(
        passes.normals, passes.depth, field.map, view.frame(), view.camera.map(from_view), view.up(),
        into=pg.target("contact share", "rgba16f"),
    )  # fmt: skip


def _share_on_field(floor: Sequence[pg.Node], view: View, field: ContactMap, passes: SoftShadow) -> pg.Target:
    origin = np.mean([node.bounds.mean(axis=0) for node in floor], axis=0)
    share: pg.Target = pg.draw(
        merged(floor, origin), vertex=place_floor, fragment=look_up_floor,
        into=pg.target("contact share", "rgba16f", scale=1.0, clear=1.0), depth=passes.base_color.depth,
        depth_compare="less_equal", depth_write=False, polygon_offset=AGAIN_OFFSET, contacts=field.map,
        cull="none" if any(node.material.double_sided for node in floor) else "back",
        clip_from_local=view.clip_from(origin),
        map_from_local=field.window.flat @ translation(origin - field.window.origin),
    )  # fmt: skip
    return share
