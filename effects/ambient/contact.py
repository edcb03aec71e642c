"""Contact penumbra: a floor darkened where something stands on it or hangs just over it."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph import Image, mat4, vec2, vec3, vec4
from passgraph.effects.ambient.contact_map import ContactMap, Darkness, check_names, contact_map, floor_nodes
from passgraph.effects.checked import checked, effect
from passgraph.effects.passes import picture_of
from passgraph.effects.pictures.tone_map import tone_map
from passgraph.effects.quantities import Height, Reach
from passgraph.effects.shadows.shadow_light import multiply
from passgraph.effects.shadows.soft_shadow import SoftShadow, soft_shadow_passes
from passgraph.effects.surfaces.batches import merged
from passgraph.effects.surfaces.geometry import ViewFrame, unpack_normal, view_position
from passgraph.effects.surfaces.views import View
from passgraph.scene.matrices import translation

Float64 = NDArray[np.float64]
#: A pixel is the plane's where it lies this near to it, as a share of its distance from the eye.
ON_FLOOR = 1e-3
#: The floor is drawn again over itself, pulled toward the eye: a vertex may be snapped to the next 1/256 of a
#: pixel (times 4 for steep corners of a triangle), and a depth is rounded a few times.  More would show on feet.
AGAIN_OFFSET = (-4.0 / 256.0, -8.0)


@pg.struct
class Ground:
    """A vertex of the floor as the camera sees it."""

    position: vec4
    place: vec2  # on the map, -1 to 1


@pg.function
def share_at(contacts: Image, place: vec2) -> vec3:
    """World position times matrix is the texture coordinate; a filtered read, no depth test."""
    if abs(place.x) > 1.0 or abs(place.y) > 1.0:
        return vec3(1.0)
    return contacts.sample(vec2(0.5 + 0.5 * place.x, 0.5 - 0.5 * place.y)).rgb


@pg.kernel
def look_up(
    normals: Image, depth: Image, contacts: Image, frame: ViewFrame, map_from_view: mat4, up: vec3
) -> vec4:  # fmt: skip
    """On a plane its pixels are known by their place and normal."""
    z = depth[0, 0].r
    at = map_from_view * vec4(view_position(frame, pg.uv(), z), 1.0)
    level = pg.dot(unpack_normal(normals[0, 0].zw), up) > 0.9
    # z of the map's space is scene units over the floor
    if z > 0.0 and level and abs(at.z) <= ON_FLOOR * z:
        return vec4(share_at(contacts, at.xy), 1.0)
    return vec4(1.0)


@pg.vertex
def place_floor(vertex: pg.Vertex, clip_from_local: mat4, map_from_local: mat4) -> Ground:
    """A height field is drawn, so that its pixels are known however steep it is."""
    local = vec4(vertex.position, 1.0)
    return Ground(clip_from_local * local, (map_from_local * local).xy)


@pg.fragment
def look_up_floor(ground: Ground, contacts: Image) -> vec4:
    """The share of the light that this place of the floor keeps."""
    return vec4(share_at(contacts, ground.place), 1.0)


@dataclass(frozen=True)
class Contact:
    """Targets of `contact`.

    Attributes
    ----------
    picture : what `contact` returns
    lit : scene-linear, darkened
    share : what the floor keeps of its colour, on the screen; 1 elsewhere
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
    """`contact` with every target on the way; parameters as there."""
    check_names(scene, darkness)
    ground = floor_nodes(scene, floor)
    made = contact_map(scene, ground, height, threshold, darkness, map_size)
    passes = soft_shadow_passes(scene, display=False)
    view = View(pg.Value("camera", pg.Camera, default=scene.camera))
    share = _share_on_field(ground, view, made, passes) if ground else _share_on_plane(view, made, passes)
    lit = multiply(passes.soft_shadow, share, into=pg.target("contact", "rgba16f"))
    picture = tone_map(lit, 0.0, "linear", into=pg.target("picture", "rgba8"), name="picture") if display else lit
    return Contact(picture, lit, share, made.map, made.heights, passes)


@effect("contact", "scene")
@picture_of(contact_passes)
def contact() -> None:
    """A scene with soft shadows, and its floor darkened near contacts.

    Parameters
    ----------
    scene : its floor is parallel to XOZ, or a height field
    height : of the plane, world y; a height field has its own
    floor : name of the node, or of the nodes, whose surface seen from above is the floor; left out, the plane
    threshold : what is higher over the floor throws no contact shadow
    darkness : share of the light that is taken at contact; linear to 0 at the threshold. A mapping
        gives it by the name of the node that throws it, and 0.7 for names that are not in it
    map_size : texels along each side of the view from above; fewer are softer
    display : return an 8-bit sRGB picture; off, the scene-linear HDR target

    A run takes ``camera=`` and the lights, as `passgraph.effects.shadows.soft_shadow.soft_shadow` does.

    Raises
    ------
    GraphError
        For what is out of range, for names that no node has, and where nothing is near the floor.

    Source: projective penumbrae on a floor: an orthographic view from above, clipped at the threshold by its
    near plane, with the normalised height as colour; on a height field clipped for each texel by a height map
    of the floor.  Deviations: where several surfaces lie over one texel the lowest counts (a minimum);
    translucent surfaces let their own colour through; holes in textures count as solid.  What lies under the
    floor darkens it only where the floor is inside the body, which is found by counting the faces below, so
    that a body with a hole below the floor may leave light in it.

    Examples
    --------
    >>> contact(pg.Scene.shipped()).name
    'picture'
    """


def _share_on_plane(view: View, made: ContactMap, passes: SoftShadow) -> pg.Target:
    def from_view(camera: pg.Camera) -> Float64:
        eye = translation(np.asarray(camera.eye) - made.window.origin)
        world: Float64 = made.window.flat @ eye @ camera.view_rotation().T
        return world

    return look_up(
        passes.normals, passes.depth, made.map, view.frame(), view.camera.map(from_view), view.up(),
        into=pg.target("contact share", "rgba16f"),
    )  # fmt: skip


def _share_on_field(floor: Sequence[pg.Node], view: View, made: ContactMap, passes: SoftShadow) -> pg.Target:
    origin = np.mean([node.bounds.mean(axis=0) for node in floor], axis=0)
    share: pg.Target = pg.draw(
        merged(floor, origin), vertex=place_floor, fragment=look_up_floor,
        into=pg.target("contact share", "rgba16f", scale=1.0, clear=1.0), depth=passes.base_color.depth,
        depth_compare="less_equal", depth_write=False, polygon_offset=AGAIN_OFFSET, contacts=made.map,
        cull="none" if any(node.material.double_sided for node in floor) else "back",
        clip_from_local=view.clip_from(origin),
        map_from_local=made.window.flat @ translation(origin - made.window.origin),
    )  # fmt: skip
    return share
