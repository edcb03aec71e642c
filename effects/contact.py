"""Contact penumbra: a floor darkened where something stands on it or hangs just over it."""

# mypy: disable-error-code="no-any-return"
# Values of the kernel language are Any to Python's type checkers.
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import passgraph as pg
from passgraph import Image, clamp, mat4, vec2, vec3, vec4
from passgraph.effects.batches import merged
from passgraph.effects.geometry import unpack_normal, view_ray
from passgraph.effects.soft_shadow import soft_shadow_passes
from passgraph.effects.tone_map import tone_map
from passgraph.effects.views import View
from passgraph.scene.matrices import translation

Float64 = NDArray[np.float64]
#: A pixel is the floor's where it lies this near to it, as a share of its distance from the eye.
ON_FLOOR = 1e-3


@pg.struct
class Layer:
    """A vertex of the thin layer over the floor, seen from straight above."""

    position: vec4
    height: float  # 0 on the floor, 1 at the threshold
    through: vec3  # what its colour and opacity let through


@pg.vertex
def from_above(vertex: pg.Vertex, clip_from_local: mat4, height_row: vec4) -> Layer:
    """The near plane lies at the threshold: what is higher is clipped."""
    local = vec4(vertex.position, 1.0)
    return Layer(
        clip_from_local * local, pg.dot(height_row, local), vertex.color.rgb * (1.0 - clamp(vertex.color.a, 0.0, 1.0))
    )


@pg.fragment
def gradient(layer: Layer, darkness: float) -> vec4:
    """The share of the light that is left: all at the threshold, the least on the floor."""
    h = clamp(layer.height, 0.0, 1.0)
    return vec4(1.0 - darkness * (1.0 - h) * (1.0 - layer.through), 1.0)


@pg.kernel
def look_up(
    color: Image, normals: Image, depth: Image, contacts: Image, tan_half: vec2, map_from_view: mat4, up: vec3
) -> tuple[vec4, vec4]:
    """World position times matrix is the texture coordinate; a filtered read, no depth test."""
    z = depth[0, 0].r
    clip = map_from_view * vec4(view_ray(tan_half) * z, 1.0)
    share = vec3(1.0, 1.0, 1.0)
    inside = abs(clip.x) <= 1.0 and abs(clip.y) <= 1.0
    level = pg.dot(unpack_normal(normals[0, 0].zw), up) > 0.9
    # z of this clip space is scene units over the floor
    if z > 0.0 and inside and level and abs(clip.z) <= ON_FLOOR * z:
        share = contacts.sample(vec2(0.5 + 0.5 * clip.x, 0.5 - 0.5 * clip.y)).rgb
    here = color[0, 0]
    return vec4(here.rgb * share, here.a), vec4(share, 1.0)


@dataclass(frozen=True)
class Contact:
    """Targets of `contact`.

    Attributes
    ----------
    picture : what `contact` returns
    lit : scene-linear, darkened
    share : what the floor keeps of its colour, on the screen; 1 elsewhere
    map : the same from straight above, right is +x, down is +z
    """

    picture: pg.Target
    lit: pg.Target
    share: pg.Target
    map: pg.Target


def contact(
    scene: pg.Scene,
    *,
    height: float = 0.0,
    threshold: float = 0.3,
    darkness: float = 0.7,
    map_size: int = 256,
    display: bool = True,
) -> pg.Target:
    """A scene with soft shadows, and its floor darkened near contacts.

    Parameters
    ----------
    scene : its floor is parallel to XOZ
    height : of the floor, world y
    threshold : what is higher over the floor throws no contact shadow, scene units, above 0
    darkness : share of the light that is taken at contact, 0 to 1; linear to 0 at the threshold
    map_size : texels along each side of the view from above, 16 to 4096; fewer are softer
    display : return an 8-bit sRGB picture; off, the scene-linear HDR target

    A run takes ``camera=`` and the lights, as `passgraph.effects.soft_shadow.soft_shadow` does.

    Source: projective penumbrae on a floor: an orthographic view from above, clipped at the threshold by its
    near plane, with the normalised height as colour.  Deviations: where several surfaces lie over one texel
    the lowest counts (a minimum); translucent surfaces let their own colour through.

    Examples
    --------
    >>> contact(pg.Scene.shipped()).name
    'picture'
    """
    return contact_passes(
        scene, height=height, threshold=threshold, darkness=darkness, map_size=map_size, display=display
    ).picture


def contact_passes(
    scene: pg.Scene,
    *,
    height: float = 0.0,
    threshold: float = 0.3,
    darkness: float = 0.7,
    map_size: int = 256,
    display: bool = True,
) -> Contact:
    """`contact` with every target on the way; parameters as there."""
    if not threshold > 0.0:
        raise pg.GraphError(f"contact: threshold must be above 0 scene units, got {threshold!r}")
    if not 0.0 <= darkness <= 1.0:
        raise pg.GraphError(f"contact: darkness must be 0 to 1, got {darkness!r}")
    if not 16 <= map_size <= 4096:
        raise pg.GraphError(f"contact: map_size must be 16 to 4096, got {map_size!r}")
    bodies = [node for node in scene.nodes if node.casts and node.bounds[1, 1] > height + 1e-3 * threshold]
    near = [node for node in bodies if node.bounds[0, 1] < height + threshold]
    if not near:
        raise pg.GraphError(f"contact: nothing in scene {scene.name!r} is within {threshold:g} of its floor")
    low = np.min([node.bounds[0] for node in near], axis=0)
    high = np.max([node.bounds[1] for node in near], axis=0)
    origin = 0.5 * (low + high)
    origin[1] = height
    # the map is square, with a margin of a few texels
    half = 0.5 * float(max(high[0] - low[0], high[2] - low[2], 1e-6)) * (1.0 + 8.0 / map_size)
    flat = np.array([[1 / half, 0, 0, 0], [0, 0, -1 / half, 0], [0, 1, 0, 0], [0, 0, 0, 1.0]])
    clip = flat.copy()
    # near at the threshold, far as deep below the floor: heights are z from -1 (near) through 0
    clip[2] = (0.0, -1.0 / threshold, 0.0, 0.0)
    made: pg.Target = pg.draw(
        merged(near, origin), vertex=from_above, fragment=gradient,
        into=pg.target("contact map", "rgba16f", (map_size, map_size), clear=1.0), blend="min", name="contact map",
        clip_from_local=clip, height_row=(0.0, 1.0 / threshold, 0.0, 0.0), darkness=darkness,
    )  # fmt: skip
    passes = soft_shadow_passes(scene, display=False)
    view = View(pg.Value("camera", pg.Camera, default=scene.camera))

    def from_view(camera: pg.Camera) -> Float64:
        world: Float64 = flat @ translation(np.asarray(camera.eye) - origin) @ camera.view_rotation().T
        return world

    lit, share = look_up(
        passes.soft_shadow, passes.normals, passes.depth, made, view.tan_half(), view.camera.map(from_view), view.up(),
        into=(pg.target("contact", "rgba16f"), pg.target("contact share", "rgba16f")), name="contact",
    )  # fmt: skip
    picture = tone_map(lit, 0.0, "linear", into=pg.target("picture", "rgba8"), name="picture") if display else lit
    return Contact(picture, lit, share, made)
